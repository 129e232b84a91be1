#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "sentree/monitor/monitor.h"
#include "sentree/monitor/projection.h"

namespace sentree::monitor {

/// Names of observations that are remembered with who listens to them; beyond it each is looked up anew.
inline constexpr std::size_t kRoutesMax = 65'536;

/// Which leaf is at work, told from the ticks that are observed.
class LeafTracker {
 public:
  /// What an observation's name says of leaves.
  enum class Sign : std::uint8_t { kNone, kTicked, kAnswered, kEnded };
  [[nodiscard]] static Sign sign(std::string_view observation);

  void see(const Message& message, Sign sign);
  /// The leaf that is being ticked, else the one whose last answer was RUNNING most recently; empty: none.
  [[nodiscard]] const std::string& active() const;

 private:
  std::string ticked_;
  std::vector<std::string> running_;
};

/// Who listens to observations of which name, and to what of them.
class Dispatch {
 public:
  struct Route {
    std::vector<std::uint32_t> monitors;  ///< Indices.
    Projection projection;                ///< What any of them looks at.
    LeafTracker::Sign sign = LeafTracker::Sign::kNone;
  };

  explicit Dispatch(std::span<const Model> models) : models_(models.begin(), models.end()) {}
  /// Valid until the next call. Cost: one look-up, after the first time.
  [[nodiscard]] const Route& route(const std::string& observation);
  /// How many names it knows by heart, at most kRoutesMax.
  [[nodiscard]] std::size_t remembered() const { return routes_.size(); }

 private:
  [[nodiscard]] Route make(const std::string& observation) const;

  std::vector<Model> models_;
  std::unordered_map<std::string, Route> routes_;
  Route passing_;
};

/// Several monitors fed with one stream of observations: a recording, or a run.
///
/// Cost: an observation costs a look-up and a step of each monitor that listens to it; the others cost nothing.
class MonitorSet {
 public:
  struct Decided {
    std::size_t monitor;  ///< Index.
    Decision decision;
    std::string leaf;  ///< That was at work then; empty: none.
  };

  /// @param begin  When the stream begins; deadlines from the start of a run count from there.
  explicit MonitorSet(std::vector<Model> models, TimePoint begin = {});

  /// Observations in the order of the stream; `message` must outlive the set. Decisions are appended to `out`, in order
  /// of time; by the passing of time before those by the observation.
  void observe(const Message& message, std::vector<Decided>& out);
  /// As above; the message is kept alive as long as it may be part of a witness.
  void observe(const Observation& observation, std::vector<Decided>& out);
  /// Time passes in silence up to and including `now`.
  void advance(TimePoint now, std::vector<Decided>& out);
  /// When silence next matters to one of them; kNever: never.
  [[nodiscard]] TimePoint next_timer() const { return wake_; }

  [[nodiscard]] const std::vector<Model>& models() const { return models_; }
  [[nodiscard]] const State& state(std::size_t monitor) const { return states_[monitor]; }

 private:
  void step(std::size_t monitor, Decisions decisions, std::vector<Decided>& out);
  void find_wake();

  std::vector<Model> models_;
  std::vector<State> states_;
  Dispatch dispatch_;
  LeafTracker leaves_;
  scxml::Event event_;
  TimePoint wake_ = kNever;
};

/// Everything that the monitors decide of a recording, in order of time.
/// @param end  When it ends, inclusive; what is open then is not decided.
[[nodiscard]] std::vector<MonitorSet::Decided> evaluate(std::vector<Model> models, std::span<const Message> recording,
                                                        TimePoint begin, TimePoint end);

}  // namespace sentree::monitor
