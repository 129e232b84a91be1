#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "sentree/base/message.h"
#include "sentree/base/result.h"
#include "sentree/base/time.h"
#include "sentree/scxml/chart.h"
#include "sentree/scxml/host.h"
#include "sentree/scxml/session.h"

namespace sentree::monitor {

enum class Verdict : std::uint8_t { kUndecided, kViolated, kSatisfied };
/// "undecided", "violated", "satisfied".
[[nodiscard]] std::string_view to_string(Verdict verdict);

/// Observation `on` reaches the chart as event `event`, with data computed from the observation's.
struct Rename {
  std::string event;
  std::string on;
  /// Member of the event's data and ECMAScript expression; names in it are members of the observation's data (source,
  /// target, call, tick, time, args, result, kind, message, status, inputs, outputs).
  std::vector<std::pair<std::string, std::string>> data;
  SourceSpan span;
};

/// What a monitor is made of.
struct Spec {
  std::string name;
  scxml::Chart chart;
  std::vector<std::string> violated;  ///< States whose entry is a violation.
  std::vector<Rename> renames;        ///< If any, the chart sees renamed observations only.
  SourceSpan span;                    ///< Where it is declared, for messages.
};

/// A monitor, checked and ready; immutable, shared by its states.
class Model {
 public:
  /// Codes: monitor.unknown-state, monitor.no-verdict (nothing can ever violate it), monitor.bad-expression.
  [[nodiscard]] static Loaded<Model> make(Spec spec);

  [[nodiscard]] const std::string& name() const;
  [[nodiscard]] const scxml::Chart& chart() const;
  /// False: an observation of that name changes nothing, now or later.
  [[nodiscard]] bool listens_to(std::string_view observation) const;

  struct Parts;  ///< For this library's own files.

 private:
  friend struct Access;
  explicit Model(std::shared_ptr<const Parts> parts) : parts_(std::move(parts)) {}
  std::shared_ptr<const Parts> parts_;
};

/// Why a monitor decided.
struct Decision {
  Verdict verdict = Verdict::kUndecided;
  TimePoint at{};
  std::string state;                ///< The state whose entry decided it.
  std::optional<Message> deciding;  ///< The observation that led there; nothing: time passed in silence.
  /// Observations whose replay alone gives the same verdict at the same time; leaving out any one of them would not.
  std::vector<Message> witness;
  bool witness_complete = true;  ///< False: the history was too long to keep from its beginning.
};

/// Observations kept to find the witness; the oldest are dropped beyond it.
inline constexpr std::size_t kHistoryMax = 100'000;

/// A monitor's memory; a plain value.
struct State {
  scxml::Session session;
  scxml::Session renaming;
  scxml::Session initial;  ///< As after `start`; the past no longer matters when the session is back there.
  Verdict verdict = Verdict::kUndecided;
  std::vector<Message> history;  ///< Observations since the session was last in its initial state.
  bool history_complete = true;
  TimePoint started{};
  std::optional<Diagnostic> failure;  ///< It was given up: its chart exceeded a bound.
};

/// Puts the monitor at its beginning.
///
/// Here and below, `watch` lets a watchdog in another thread look on, since scripts of the chart may never end.
[[nodiscard]] State start(const Model& model, TimePoint now, scxml::ExecutionWatch* watch = nullptr);

/// Feeds one observation. Timers due before it fire first; one due at the same instant fires after it.
/// Returns the decision, once; a decided or failed monitor ignores what follows.
/// Cost: an observation that it does not listen to costs a look-up.
std::optional<Decision> observe(const Model& model, State& state, const Message& message,
                                scxml::ExecutionWatch* watch = nullptr);

/// Lets time pass in silence up to and including `now`.
std::optional<Decision> advance(const Model& model, State& state, TimePoint now,
                                scxml::ExecutionWatch* watch = nullptr);

/// When silence next matters; kNever: never.
[[nodiscard]] TimePoint next_timer(const State& state);

/// Why a monitor that is a gate refuses the request `message`, or nothing: a copy of the state is stepped with it, the
/// state stays. A monitor that is violated, was given up, or exceeds a bound on the way cannot decide, and refuses.
[[nodiscard]] std::optional<std::string> veto(const Model& model, const State& state, const Message& message,
                                              scxml::ExecutionWatch* watch = nullptr);

}  // namespace sentree::monitor
