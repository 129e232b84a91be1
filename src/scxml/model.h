#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <variant>
#include <vector>

#include "sentree/base/time.h"
#include "sentree/base/value.h"
#include "sentree/scxml/chart.h"
#include "sentree/scxml/descriptors.h"
#include "sentree/scxml/expression.h"
#include "sentree/scxml/script_functions.h"
#include "sentree/scxml/state_set.h"

namespace sentree::scxml {

using ExpressionId = std::uint32_t;
inline constexpr ExpressionId kNoExpression = 0xFFFFFFFFU;
inline constexpr TransitionIndex kNoTransition = 0xFFFFFFFFU;

enum class ExpressionUse : std::uint8_t {
  kValue,
  kCondition,
  kLocation,
  kItem,  ///< Of <foreach>: a location that is declared if it is not there.
  kScript,
};

struct Expression {
  std::string text;
  ExpressionUse use = ExpressionUse::kValue;
  Place place;                        ///< Of its first byte.
  bool pure = false;                  ///< Evaluating it certainly changes no data.
  NativeCode native;                  ///< Empty: only the interpreter can evaluate it.
  std::optional<std::uint32_t> slot;  ///< kLocation: it is nothing but the name of this variable.
};

// ---- Executable content (SCXML 4) ----

struct Action;
using Block = std::vector<Action>;

struct Raise {
  std::string event;
};
struct Log {
  std::string label;
  ExpressionId expr = kNoExpression;
};
struct Assign {
  ExpressionId location = kNoExpression;
  ExpressionId expr = kNoExpression;
  std::optional<Value> content;  ///< Inline content; used when there is no expr.
};
struct Script {
  ExpressionId code = kNoExpression;
};
struct Cancel {
  std::string sendid;
  ExpressionId sendid_expr = kNoExpression;
};
struct Param {
  std::string name;
  ExpressionId expr = kNoExpression;
  ExpressionId location =
      kNoExpression;  ///< <param location> and namelist of <invoke>: where an empty <finalize> writes.
};
/// <content>, or what <param>s and namelist make.
struct Payload {
  std::vector<Param> namelist;
  std::vector<Param> params;
  bool has_content = false;
  ExpressionId content_expr = kNoExpression;
  std::optional<Value> content;
  std::string content_source;  ///< Inline content, as written.
  Place content_place;         ///< Of its first '<'.
  Place place;
};
/// An attribute that may be given as a constant or as an expression; neither: absent.
struct Text {
  std::string constant;
  ExpressionId expr = kNoExpression;
  [[nodiscard]] bool absent() const { return constant.empty() && expr == kNoExpression; }
};
struct Send {
  Text event;
  Text target;
  Text type;
  Text delay;
  Duration delay_constant{};
  std::string id;
  ExpressionId idlocation = kNoExpression;
  Payload payload;
};
struct If {
  struct Branch;
  std::vector<Branch> branches;
};
struct Foreach {
  ExpressionId array = kNoExpression;
  ExpressionId item = kNoExpression;
  ExpressionId index = kNoExpression;
  std::unique_ptr<Block> body;
};

struct Action {
  std::variant<Raise, Log, Assign, Script, Cancel, Send, If, Foreach> what;
  Place place;
};
struct If::Branch {
  ExpressionId condition = kNoExpression;  ///< kNoExpression: <else>.
  Block body;
};

// ---- States ----

struct Variable {
  std::string id;
  StateIndex state = 0;  ///< In whose <datamodel>.
  ExpressionId expr = kNoExpression;
  std::optional<Value> content;
  std::string failure;  ///< Why its src could not be read; empty: nothing wrong.
  Place place;
};

struct Invoke {
  StateIndex state = 0;
  std::string id;
  ExpressionId idlocation = kNoExpression;
  Text type;
  Text src;
  Payload payload;
  bool autoforward = false;
  Block finalize;
  bool has_finalize = false;
  std::string src_text;        ///< What a constant src names, read when the chart was loaded.
  std::string src_missing;     ///< Why it could not be read.
  std::optional<Chart> child;  ///< The chart, if it is known and could be loaded.
  Place place;
};

/// What the interpreter needs of a state beside `State`.
struct StateCode {
  std::vector<Block> onentry;
  std::vector<Block> onexit;
  std::vector<std::uint32_t> variables;  ///< Slots of its <datamodel>.
  std::vector<std::uint32_t> invokes;
  std::vector<StateIndex> history;          ///< History states among the children.
  TransitionIndex initial = kNoTransition;  ///< Compound: to the initial states. History: the default.
  std::unique_ptr<Payload> donedata;
  std::string done_event;  ///< "done.state.<id>"
};

struct TransitionCode {
  ExpressionId condition = kNoExpression;
  Block content;
  std::vector<DescriptorId> descriptors;
  bool eventless = false;
  bool dynamic = false;          ///< Targets a history state: the domain depends on the session.
  StateIndex domain = kNoState;  ///< SCXML Appendix D, getTransitionDomain; kNoState: targetless.
};

class HeapPool;

/// Lets maps by name be asked with a view.
struct NameHash {
  using is_transparent = void;
  std::size_t operator()(std::string_view name) const { return std::hash<std::string_view>()(name); }
};
template <class T>
using ByName = std::unordered_map<std::string, T, NameHash, std::equal_to<>>;

/// A loaded chart as the engine uses it.
struct Model {
  std::string name;
  std::string file;
  std::string folder;  ///< Of an invoked chart, seen from that of the outermost one: its `src`s are seen from there.
  std::string source;
  DataModelKind data_model = DataModelKind::kNull;
  bool late_binding = false;
  std::uint64_t fingerprint = 0;
  std::optional<Diagnostic> obstacle;  ///< Why it cannot be run.
  bool passed_over = false;            ///< Elements that nobody here knows were left out.
  bool guessed_data_model = false;     ///< None is named, and the chart is only looked at.

  std::vector<State> states;
  std::vector<StateCode> state_code;
  std::vector<Transition> transitions;
  std::vector<TransitionCode> transition_code;
  std::vector<Expression> expressions;
  std::vector<Variable> variables;  ///< By slot, document order.
  std::vector<Invoke> invokes;
  std::vector<ExpressionId> scripts;  ///< <script>s below <scxml>.
  ScriptFunctions functions;          ///< That these leave behind.
  bool plain_objects = true;          ///< No script has means to make objects of another kind than literals make.
  std::vector<DataItem> data;
  std::vector<SendInfo> sends;
  std::vector<std::pair<std::string, Place>> raises;
  std::vector<AmbientUse> ambient;
  unsigned ambient_kinds = 0;  ///< A bit for each `Ambient` that is among them.
  DescriptorTable descriptors;
  ByName<StateIndex> ids;
  ByName<std::uint32_t> slots;
  StateSet atomic;
  bool has_eventless = false;  ///< Any eventless transition at all.
  bool has_history = false;

  std::shared_ptr<HeapPool> heaps;  ///< JavaScript heaps not in use; a cache.

  Model();
  ~Model();
  Model(const Model&) = delete;
  Model& operator=(const Model&) = delete;

  [[nodiscard]] bool is_descendant(StateIndex s, StateIndex ancestor) const {
    return s > ancestor && s < states[ancestor].end;
  }
};

/// Whether this tagged map is XML, and its text (see `tag_xml`).
[[nodiscard]] const std::string* xml_text(const Value& value);
/// XML kept as data: scripts see it as a DOM element or document.
[[nodiscard]] Value tag_xml(std::string_view source);

}  // namespace sentree::scxml
