#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "sentree/base/copy_on_write.h"
#include "sentree/base/message.h"
#include "sentree/base/result.h"
#include "sentree/base/time.h"
#include "sentree/monitor/synthesis.h"
#include "sentree/scxml/chart.h"
#include "sentree/scxml/host.h"
#include "sentree/scxml/session.h"

namespace sentree::monitor {

enum class Verdict : std::uint8_t { kUndecided, kViolated, kSatisfied };
/// "undecided", "violated", "satisfied".
[[nodiscard]] std::string_view to_string(Verdict verdict);

/// A source of the chart's event `event`: observations reach it by that name, with data computed from theirs. Of
/// several sources of one event, the first that an observation fits is the one.
struct Rename {
  std::string event;
  std::vector<std::string> on;         ///< Names of observations; '*' stands for any text.
  std::vector<std::string> from = {};  ///< Whose they must be, likewise; empty: anybody's.
  /// Member of the event's data and ECMAScript expression; names in it are members of the observation's data
  /// (docs/observations.md).
  std::vector<std::pair<std::string, std::string>> data = {};
  /// Whether the event comes: "changed", its data are not those of the observation before; an expression over `value`
  /// and `last`, which are its data then and there (of a single member, its value; `last` is undefined at first), and
  /// the names above; empty: always.
  std::string when = {};
  SourceSpan span = {};
};

/// A chart that was written from a requirement: what its states and data mean.
struct Origin {
  Requirement requirement;
  std::vector<Situation> situations;
  std::vector<Datum> data;
  std::vector<std::string> overwritten;  ///< <data> that every observation sets anew before anything reads them.
  bool forgets = false;                  ///< No datum outlives an observation.
};

/// What a monitor is made of.
struct Spec {
  std::string name;
  scxml::Chart chart;
  std::vector<std::string> violated = {};     ///< States whose entry is a violation.
  std::vector<Rename> renames = {};           ///< If any, the chart sees renamed observations only.
  SourceSpan span = {};                       ///< Where it is declared, for messages.
  bool re_arming = false;                     ///< A violation is not its last: it goes on and counts.
  std::shared_ptr<const Origin> origin = {};  ///< Null: the chart was drawn by hand.
};

/// A monitor, checked and ready; immutable, shared by its states.
class Model {
 public:
  /// Codes: monitor.unknown-state, monitor.no-verdict (nothing can ever violate it), monitor.bad-expression.
  [[nodiscard]] static Loaded<Model> make(Spec spec);
  /// The monitor that is synthesized from a requirement, named like it. Codes: those of `check_requirement`.
  [[nodiscard]] static Loaded<Model> make(const Requirement& requirement, const Vocabulary* vocabulary = nullptr);

  [[nodiscard]] const std::string& name() const;
  [[nodiscard]] const scxml::Chart& chart() const;
  /// Null: the chart was drawn by hand.
  [[nodiscard]] const Origin* origin() const;
  [[nodiscard]] bool re_arming() const;
  /// Is violated as soon as the requirement has been put to the test (`test_of`). Null: from the beginning, or the
  /// chart was drawn by hand.
  [[nodiscard]] const Model* test() const;
  /// False: an observation of that name changes nothing, now or later.
  [[nodiscard]] bool listens_to(std::string_view observation) const;
  /// Of an observation that it listens to: whose it is about; nothing: everybody's. Observations of that name by others
  /// change nothing.
  [[nodiscard]] std::optional<std::span<const std::string>> listens_to_only(std::string_view observation) const;

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
  /// Since when what it decided had been owed; nothing: it owed nothing, or its chart was drawn by hand.
  std::optional<TimePoint> since;
  std::uint64_t number = 1;  ///< Of its violations, from 1: a re-arming monitor goes on.
  TimePoint started{};       ///< When the monitor began to look; a replay begins there.
  /// Observations whose replay alone gives the same verdict at the same time.
  std::vector<Message> witness;
  bool witness_complete = true;  ///< False: the history was too long to keep from its beginning.
  bool witness_minimal = true;   ///< Leaving out any one would not give it. False: it took too long to try.
};
using Decisions = std::vector<Decision>;

/// A message that many monitors look at and remember.
using Observation = std::shared_ptr<const Message>;

/// Observations kept to find the witness; beyond it the oldest are dropped if all of them still matter.
inline constexpr std::size_t kHistoryMax = 100'000;

/// Observations replayed to find out which of them a verdict needs; beyond it, those that are left are the witness.
inline constexpr std::size_t kWitnessReplayedMax = 500'000;

/// Observations remembered before it is looked which of them still matter.
inline constexpr std::size_t kReduceMin = 256;

/// The part of a monitor that decides: what it will decide depends on this and on nothing else. A small plain value; a
/// copy costs what its sessions cost.
struct Core {
  scxml::Session session;
  scxml::Session renaming;
  std::vector<std::optional<Value>> last;  ///< Data of the renamed events that look back, when they were observed last.
  Verdict verdict = Verdict::kUndecided;
  std::optional<TimePoint> since;  ///< When the pending situation it is in began; decides nothing.

  /// It was given up: its chart exceeded a bound.
  [[nodiscard]] const std::optional<Diagnostic>& failure() const { return session.failure(); }
  friend bool operator==(const Core&, const Core&) = default;
};

/// What one step decided.
struct Stepped {
  Verdict verdict = Verdict::kUndecided;
  std::string state;  ///< The state whose entry decided it.
};

// Deciding alone, without a trail: for whoever tries many futures. Here and below, `watch` lets a watchdog in another
// thread look on, since scripts of the chart may never end. A decided or failed monitor ignores what follows; a
// re-arming one goes on.

/// Puts the monitor at its beginning.
[[nodiscard]] Core begin(const Model& model, TimePoint now, scxml::ExecutionWatch* watch = nullptr);
/// One observation. Timers due before it must have fired; one due at the same instant fires after it.
Stepped step(const Model& model, Core& core, const Message& message, scxml::ExecutionWatch* watch = nullptr);
/// Timers up to and including `until`, the earliest first. Stops at what is decided: call it again then.
Stepped step_timers(const Model& model, Core& core, TimePoint until, scxml::ExecutionWatch* watch = nullptr);

/// Appends the canonical form of what decides, as `scxml::encode` does: equal bytes, equal futures. Data that the next
/// observation overwrites before anything reads them are left out. Error: scxml.no-value-form.
Result<void> encode(const Model& model, const Core& core, TimePoint now, std::string& out);

/// The part that explains. It decides nothing, and grows with what is observed; a copy shares what has grown until one
/// of the two observes more.
struct Trail {
  scxml::StateSet beginning;  ///< The configuration after `start`.
  std::uint64_t violations = 0;
  /// Observations whose replay leads where the session is now.
  CopyOnWrite<std::vector<Observation>> history;
  bool history_complete = true;
  std::size_t reduce_at = kReduceMin;  ///< Size of the history at which it is reduced to what still matters.
  /// By state of the chart: during which observation it was entered last.
  CopyOnWrite<std::vector<Observation>> entered_by;
  std::uint64_t seen = 0;    ///< Observations that it listened to.
  std::optional<Core> test;  ///< Of the model's test, while it has not been put to it.
  TimePoint started{};

  /// Keeps only the latest observations: those before are no part of witnesses of what follows.
  void forget_all_but(std::size_t latest);
  /// Of what was observed, wherever it is kept.
  friend bool operator==(const Trail& a, const Trail& b);
};

/// A monitor's memory: what decides, and what explains.
struct State : Core {
  Trail trail;
  friend bool operator==(const State&, const State&) = default;
};

/// Puts the monitor at its beginning.
[[nodiscard]] State start(const Model& model, TimePoint now, scxml::ExecutionWatch* watch = nullptr);

/// Feeds one observation. Timers due before it fire first; one due at the same instant fires after it.
/// Returns what it decided: nothing most of the time, one thing once; several are of re-arming monitors only. A decided
/// or failed monitor ignores what follows.
/// Cost: an observation that it does not listen to costs a look-up.
Decisions observe(const Model& model, State& state, const Message& message, scxml::ExecutionWatch* watch = nullptr);

/// Lets time pass in silence up to and including `now`.
Decisions advance(const Model& model, State& state, TimePoint now, scxml::ExecutionWatch* watch = nullptr);

/// When silence next matters; kNever: never.
[[nodiscard]] TimePoint next_timer(const Model& model, const Core& core);

/// Why a monitor that is a gate refuses the request `message`, or nothing: a copy is stepped with it. A monitor that is
/// violated, was given up, or exceeds a bound on the way cannot decide, and refuses.
[[nodiscard]] std::optional<std::string> veto(const Model& model, const Core& core, const Message& message,
                                              scxml::ExecutionWatch* watch = nullptr);

/// How an undecided monitor stands.
struct Standing {
  bool pending = false;  ///< Something is owed; else it holds so far.
  std::string says;      ///< "owes at(station)"; of a chart drawn by hand: "in state idle".
  std::optional<TimePoint> since;
  std::optional<TimePoint> deadline;  ///< When silence would decide.
  std::string counted;                ///< Of bounds that are no time: "3 of 10 ticks".

  /// "pending: owes at(station) since 12.300 s, until 22.300 s"
  [[nodiscard]] std::string text() const;
};
[[nodiscard]] Standing standing(const Model& model, const Core& core);
/// Why it says nothing that a monitor is not violated: "never got any event it waits for", "was never triggered: …".
/// Empty: it was put to the test.
[[nodiscard]] std::string vacuity(const Model& model, const State& state);

}  // namespace sentree::monitor
