#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "sentree/base/diagnostic.h"
#include "sentree/base/result.h"
#include "sentree/base/value.h"

namespace sentree::scxml {

/// Place of a state in document order; 0 is <scxml> itself.
using StateIndex = std::uint32_t;
using TransitionIndex = std::uint32_t;
inline constexpr StateIndex kNoState = 0xFFFFFFFFU;

/// A place in the chart's file; `Chart::span` makes it a `SourceSpan`.
struct Place {
  int line = 0;
  int column = 0;
  int length = 0;
  friend bool operator==(const Place&, const Place&) = default;
};

enum class StateKind : std::uint8_t { kRoot, kAtomic, kCompound, kParallel, kFinal, kHistoryShallow, kHistoryDeep };
[[nodiscard]] std::string_view to_string(StateKind kind);

/// kForeign: one that other engines have (jexl, lua, cplusplus, …); its expressions are text here.
enum class DataModelKind : std::uint8_t { kNull, kEcmaScript, kForeign };

struct State {
  std::string id;  ///< As written; empty if the document gives none.
  StateKind kind = StateKind::kAtomic;
  StateIndex parent = kNoState;  ///< kNoState for the root.
  StateIndex end = 0;            ///< One past the last descendant: the descendants are (index, end).
  std::uint32_t depth = 0;
  std::vector<StateIndex> children;          ///< Document order, history states included.
  std::vector<TransitionIndex> transitions;  ///< Document order; <initial>'s and <history>'s are not among them.
  std::vector<std::string> donedata;         ///< kFinal: the names of <donedata>'s params.
  Place place;                               ///< Of the start tag.

  [[nodiscard]] bool is_atomic() const { return kind == StateKind::kAtomic || kind == StateKind::kFinal; }
  [[nodiscard]] bool is_history() const { return kind >= StateKind::kHistoryShallow; }
};

struct Transition {
  StateIndex source = 0;
  std::vector<std::string> events;  ///< Descriptors without trailing ".*"; empty: eventless.
  std::string condition;            ///< As written; empty: none.
  std::vector<StateIndex> targets;  ///< Empty: targetless.
  bool internal = false;            ///< type="internal".
  Place place;
};

/// A <data> directly below <scxml>: what an invoking program can initialise (SCXML 6.4).
struct DataItem {
  std::string id;
  std::optional<Value> initial;  ///< Its value if that is a constant.
  bool has_value = false;        ///< It has an expr, a src or content.
  Place place;
};

struct SendParam {
  std::string name;
  std::optional<Value> constant;  ///< Its value if that is a constant.
  std::string expression;         ///< As written.
  Place place;
};

/// One <send> of the document, for checks against what its target understands. Nothing where the document gives an
/// expression.
struct SendInfo {
  StateIndex state = 0;             ///< In which it is written.
  std::optional<std::string> type;  ///< Empty string: the SCXML processor.
  std::optional<std::string> target;
  std::optional<std::string> event;
  std::string id;
  std::vector<SendParam> params;  ///< <param>s and namelist.
  bool has_content = false;
  Place place;        ///< Of the element.
  Place event_place;  ///< Of the event's name, if written.
  Place target_place;
};

/// What scripts can ask for that is neither data nor an event. A chart that does behaves differently from one run, or
/// one session, to the next.
enum class Ambient : std::uint8_t {
  kSessionId,  ///< What the session is called: `_sessionid`, `_ioprocessors`.
  kInvokeId,   ///< What the engine calls a chart that is invoked without an id and calls services: they answer by it.
  kClock,      ///< `Date`.
  kRandom,     ///< `Math.random`.
  kIds,        ///< Ids that the engine makes up: idlocation, `_event.sendid`, `.origin`, `.invokeid`, all of `_event`.
  kIdText,     ///< How such an id is spelled: more is done with it than to keep, compare, cancel and send by it.
  kAnything,   ///< It cannot be told: `eval`, the global object as a whole, charts that are known at run time only.
};

/// Where a chart asks for it.
struct AmbientUse {
  Ambient what = Ambient::kAnything;
  std::string name;  ///< As scripts name it: "Math.random", "_event.sendid"; or "idlocation", "<invoke>".
  SourceSpan span;   ///< Of the expression.
};

struct Model;

/// A state chart as loaded: immutable, cheap to copy and to share between threads and sessions.
class Chart {
 public:
  explicit Chart(std::shared_ptr<const Model> model) : model_(std::move(model)) {}

  [[nodiscard]] const std::string& name() const;  ///< The name attribute.
  [[nodiscard]] const std::string& file() const;
  [[nodiscard]] const std::string& source() const;  ///< The document, byte for byte.
  [[nodiscard]] DataModelKind data_model() const;
  [[nodiscard]] std::span<const State> states() const;  ///< Document order; [0] is the root.
  [[nodiscard]] std::span<const Transition> transitions() const;
  [[nodiscard]] std::span<const DataItem> data() const;
  [[nodiscard]] std::span<const SendInfo> sends() const;
  /// Event descriptors of all transitions, sorted, each once.
  [[nodiscard]] std::vector<std::string> events_handled() const;
  /// Names of events that <send> and <raise> name as constants, sorted, each once.
  [[nodiscard]] std::vector<std::string> events_sent() const;
  [[nodiscard]] std::optional<StateIndex> find(std::string_view state_id) const;
  [[nodiscard]] SourceSpan span(const Place& place) const;
  /// Found by what its expressions name, those of charts that it invokes included; decided when it is loaded.
  [[nodiscard]] std::span<const AmbientUse> ambient() const;
  /// Depends on the document's bytes only.
  [[nodiscard]] std::uint64_t fingerprint() const;
  /// Why it can be looked at but not run: the first finding of that kind. Only with `LoadOptions::to_run` false.
  [[nodiscard]] const std::optional<Diagnostic>& obstacle() const;

  [[nodiscard]] const Model& model() const { return *model_; }
  /// The same loaded chart, not merely an equal one.
  friend bool operator==(const Chart& a, const Chart& b) { return a.model_ == b.model_; }

 private:
  std::shared_ptr<const Model> model_;
};

/// The chart itself, those that it invokes, and they in turn, as far as their text is known when it is loaded. Who is
/// invoked in two places is there twice. Cost: O(their number); likewise the next two, with their <send>s and
/// <invoke>s.
[[nodiscard]] std::vector<Chart> with_invoked(const Chart& chart);
/// The <send>s of all of them.
[[nodiscard]] std::vector<SendInfo> sends_with_invoked(const Chart& chart);
/// Whether one of them invokes a chart of which the text is known at run time only.
[[nodiscard]] bool invokes_unknown(const Chart& chart);

/// What `load` accepts at most.
struct LoadLimits {
  std::size_t source_bytes_max = 16U << 20U;
  std::size_t states_max = 100'000;
  std::size_t transitions_max = 200'000;
  int nesting_max = 200;  ///< Elements inside elements, executable content included.
  std::size_t expression_bytes_max = 256U << 10U;
};

struct LoadOptions {
  LoadLimits limits;
  /// Of documents that name none (SCXML 3.2.1 leaves it to the platform). kNull: unless there are expressions that it
  /// does not have; then it is ecmascript, with a warning.
  DataModelKind default_data_model = DataModelKind::kNull;
  /// False: to look at only (check, draw, compare). What other engines understand and this one does not is then a
  /// warning: other data models, elements and attributes of other dialects, undeclared prefixes. `start` refuses such a
  /// chart, see `Chart::obstacle`.
  bool to_run = true;
  /// Reads what `src` attributes of <script>, <data>, <assign> and <invoke> name, as written. Not set: every src is an
  /// error.
  std::function<Result<std::string>(std::string_view uri)> read;
};

/// Reads an SCXML document.
///
/// Refuses what the recommendation forbids (unknown target or initial state, duplicate id, missing attribute, element
/// where it may not be, unreadable <script src>). Expressions that do not parse are not refused: SCXML 5.9 makes them
/// run-time errors; `check` finds them.
/// Taken as other engines take it, with a warning: an empty attribute is an absent one (scxml.empty-attribute);
/// <ascxml> and another or no namespace (scxml.namespace); another version (scxml.version); a delay without unit is in
/// milliseconds (scxml.no-unit); a <history> without default leads to the initial states of its parent
/// (scxml.no-default); `initialstate` of early drafts is `initial`.
/// Codes: xml.*, scxml.no-scxml, scxml.data-model, scxml.unknown-target, scxml.unknown-initial, scxml.bad-initial,
/// scxml.duplicate-id, scxml.unknown-element, scxml.misplaced-element, scxml.missing-attribute, scxml.bad-attribute,
/// scxml.script-unreadable, scxml.too-large, scxml.too-deep.
/// Cost: O(size).
[[nodiscard]] Loaded<Chart> load(std::string_view source, std::string file = {}, const LoadOptions& options = {});

}  // namespace sentree::scxml
