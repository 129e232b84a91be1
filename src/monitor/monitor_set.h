#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

#include "sentree/monitor/monitor.h"
#include "sentree/monitor/projection.h"
#include "sentree/monitor/reader.h"

namespace sentree::monitor {

/// Names of observations that are remembered with who listens to them; beyond it each is looked up anew.
inline constexpr std::size_t kRoutesMax = 65'536;
/// Of these, those whose plain steps are planned.
inline constexpr std::size_t kPlannedRoutesMax = 4'096;

/// Which leaf is at work, told from the ticks that are observed.
class LeafTracker {
 public:
  /// What an observation's name says of leaves.
  enum class Sign : std::uint8_t { kNone, kTicked, kAnswered, kEnded };
  [[nodiscard]] static Sign sign(std::string_view observation);

  void see(const Message& message, Sign sign);
  /// The leaf that is being ticked, else the one whose last answer was RUNNING most recently; empty: none.
  [[nodiscard]] const std::string& active() const;
  friend bool operator==(const LeafTracker& a, const LeafTracker& b) {
    return a.ticked_ == b.ticked_ && a.running() == b.running();
  }

 private:
  friend struct MemoryMembers;
  void note_running(std::string leaf);
  void forget_running(const std::string& leaf);
  [[nodiscard]] std::vector<std::string> running() const;  // the latest last

  std::string ticked_;
  std::map<std::uint64_t, std::string> latest_;             // those whose last answer was RUNNING, by when it came
  std::unordered_map<std::string, std::uint64_t> running_;  // when it came
  std::uint64_t answers_ = 0;
};

/// Who listens to observations of which name and source, and to what of them.
class Dispatch {
 public:
  struct Targets {
    std::vector<std::uint32_t> monitors;  ///< Indices.
    Projection projection;                ///< What any of them looks at.
    /// Of each, how it steps plainly. What these plans read is read once for all.
    std::vector<std::optional<scxml::PlainPlan>> plans;
    Reader reader;
  };
  struct Route {
    Targets any;  ///< Those that listen to whoever it is about.
    /// By source, with those of `any`.
    std::unordered_map<std::string, Targets> by_source;
    LeafTracker::Sign sign = LeafTracker::Sign::kNone;

    [[nodiscard]] Targets& of(const std::string& source) {
      if (by_source.empty()) return any;
      const auto found = by_source.find(source);
      return found != by_source.end() ? found->second : any;
    }
  };

  explicit Dispatch(std::span<const Model> models) : models_(models.begin(), models.end()) {}
  /// Valid until the next call. Cost: one look-up, after the first time.
  [[nodiscard]] Route& route(const std::string& observation);
  /// How many names it knows by heart, at most kRoutesMax.
  [[nodiscard]] std::size_t remembered() const { return routes_.size(); }

 private:
  using Known = std::unordered_map<std::string, Route>::value_type;
  [[nodiscard]] Route& look_up(const std::string& observation, Known*& found);
  [[nodiscard]] Route make(const std::string& observation) const;
  void add(Targets& targets, std::size_t monitor) const;
  void plan(Targets& targets, const std::string& observation) const;

  std::vector<Model> models_;
  std::unordered_map<std::string, Route> routes_;
  Route passing_;
  std::array<Known*, 64> lately_{};  // of routes_, by a few characters of the name
};

/// Several monitors fed with one stream of observations: a recording, or a run.
///
/// Cost: an observation costs a look-up and a step of each monitor that listens to it; the others cost nothing.
class MonitorSet {
 public:
  static constexpr std::size_t kRungMax = 1'000'000;

  struct Decided {
    std::size_t monitor;  ///< Index.
    Decision decision;
    std::string leaf;  ///< That was at work then; empty: none.
  };

  /// Is told of every step, in the thread that calls the set.
  ///
  /// Scripts of a monitor may never end. A thread that hangs in one is left behind: `is_given_up` says so of that
  /// monitor from then on, and another thread repeats the call that hung; it goes on with the next monitor.
  class Listener {
   public:
    virtual ~Listener() = default;
    /// The monitor is about to be stepped.
    virtual scxml::ExecutionWatch* watch(std::size_t /*monitor*/) { return nullptr; }
    virtual bool is_given_up(std::size_t /*monitor*/) { return false; }
    /// The monitor has been stepped, or left out since it has been given up.
    virtual void stepped(std::size_t monitor, Decisions decisions) = 0;
  };

  explicit MonitorSet(std::vector<Model> models);
  /// Started.
  /// @param begin  When the stream begins; deadlines from the start of a run count from there.
  MonitorSet(std::vector<Model> models, TimePoint begin);

  void start(TimePoint begin, Listener& listener);
  /// Observations in the order of the stream. Time passes first, up to just before them.
  void observe(const Observation& observation, Listener& listener);
  /// Time passes in silence up to and including `now`. A monitor whose timers ring more than kRungMax times within a
  /// second of it fails: it could not keep up with a run.
  void advance(TimePoint now, Listener& listener);

  /// As above; decisions are appended to `out`, in order of time. `message` must outlive the set.
  void observe(const Message& message, std::vector<Decided>& out);
  /// As above; the message is kept alive as long as it may be part of a witness.
  void observe(const Observation& observation, std::vector<Decided>& out);
  void advance(TimePoint now, std::vector<Decided>& out);

  /// When silence next matters to one of them; kNever: never.
  [[nodiscard]] TimePoint next_timer() const { return wakes_.empty() ? kNever : wakes_.begin()->first; }
  /// Those to which an observation of that name and source goes. Valid until the next observation.
  [[nodiscard]] std::span<const std::uint32_t> listeners(const std::string& observation, const std::string& source);
  /// Whether an observation of that name goes to any of them.
  [[nodiscard]] bool hears(const std::string& observation);
  /// The leaf that is at work after the last observation; empty: none.
  [[nodiscard]] const std::string& leaf() const { return leaves_.active(); }

  /// All that it remembers between two observations: a plain value.
  struct Memory {
    std::vector<State> states;
    LeafTracker leaves;
    friend bool operator==(const Memory&, const Memory&) = default;
  };
  [[nodiscard]] Memory memory() const { return {states_, leaves_}; }
  /// Goes on from there; instead of `start`. The memory must be that of a set of the same models.
  void recall(Memory memory, Listener& listener);

  [[nodiscard]] const std::vector<Model>& models() const { return models_; }
  [[nodiscard]] const State& state(std::size_t monitor) const { return states_[monitor]; }

 private:
  /// Its timers may have changed.
  void note_timer(std::size_t monitor);
  void set_timer(std::size_t monitor, TimePoint due);

  std::vector<Model> models_;
  std::vector<State> states_;
  Dispatch dispatch_;
  LeafTracker leaves_;
  // Times that timers of a monitor rang, since when: no part of its memory, since it only bounds them.
  struct Rung {
    TimePoint since{};
    std::size_t times = 0;
  };
  std::vector<Rung> rung_;
  std::vector<TimePoint> timers_;                      // when silence next matters to each
  std::set<std::pair<TimePoint, std::size_t>> wakes_;  // the same of those to which it does
  // How far the call that hung has come.
  std::size_t started_ = 0;
  std::size_t observed_ = 0;
};

/// What a set of these models remembers, as data: also what explains, each observation once.
/// Error: scxml.no-value-form.
[[nodiscard]] Result<Value> save(std::span<const Model> models, const MonitorSet::Memory& memory);
/// Errors: monitor.bad-state naming the member, scxml.other-chart, scxml.bad-snapshot.
[[nodiscard]] Result<MonitorSet::Memory> restore(std::span<const Model> models, const Value& saved);

/// Everything that the monitors decide of a recording, in order of time.
/// @param end  When it ends, inclusive; what is open then is not decided.
[[nodiscard]] std::vector<MonitorSet::Decided> evaluate(std::vector<Model> models, std::span<const Message> recording,
                                                        TimePoint begin, TimePoint end);

}  // namespace sentree::monitor
