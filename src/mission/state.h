#pragma once

#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "sentree/mission/delivery.h"
#include "sentree/mission/faults.h"
#include "sentree/mission/model.h"
#include "sentree/mission/skill.h"
#include "sentree/mission/tree.h"
#include "sentree/monitor/monitor_set.h"
#include "sentree/sim/state.h"

namespace sentree::mission {

/// A delivery that waits for its time.
struct Waiting {
  TimePoint when{};
  Rank rank = Rank::kMessage;
  std::uint64_t order = 0;  ///< Among those of one time and rank.
  Delivery what;
  friend bool operator==(const Waiting&, const Waiting&) = default;
};

/// A whole run between two deliveries (in real time while all of its parts are at rest): everything that what follows
/// depends on. A plain value: a copy goes on alike. It must only be used with the plan of its run.
struct State {
  TimePoint now{};
  /// More than injections has happened at `now`: what is commanded from outside comes a nanosecond later.
  bool begun = false;
  std::uint64_t order = 0;     ///< Of the next delivery that has to wait.
  std::vector<Waiting> queue;  ///< By time, rank and order.
  TreeState tree;
  std::vector<SkillState> skills;  ///< By leaf.
  std::vector<ModelState> models;  ///< As in the plan.
  Faults faults;
  std::set<std::string> down;  ///< Services of the simulator that are killed, and "sim".
  // What the stream has numbered so far.
  std::uint64_t published = 0;
  std::uint64_t stamp = 0;
  std::uint64_t calls = 0;
  std::uint64_t tick = 0;
  std::uint64_t orders = 0;         ///< Instants so far at which deliveries to different parts were due.
  std::optional<sim::State> world;  ///< Nothing: no robot is simulated.
  monitor::MonitorSet::Memory monitors;
  friend bool operator==(const State&, const State&) = default;
};

/// Whether nothing is on its way between the parts but what they have told themselves to do later: no tick, halt or
/// gate is waited for, nothing is held back. Calls that services answer elsewhere are not seen.
[[nodiscard]] bool is_at_rest(const State& state);
/// The state as octets, for `restore`; the same state gives the same octets.
/// Error: mission.unsavable, of a script's or a C++ node's data that have no saved form.
[[nodiscard]] Result<std::string> save(const project::Plan& plan, const State& state);
/// The state that was saved with a plan of the same files, seed and speed, in this process or another one.
/// Errors: mission.other-plan; mission.bad-state (not one of ours, of another version, damaged, or no state of a run).
[[nodiscard]] Result<State> restore(const project::Plan& plan, std::string_view saved);
/// Of what led to the state of each monitor only the latest observations are kept, for witnesses of what follows.
void forget_history(State& state, std::size_t kept);
/// What is on its way, and what was done to a run, as data; `plan` says what may be restored. Error: mission.bad-state.
[[nodiscard]] Value save(const Delivery& delivery);
[[nodiscard]] Result<Delivery> restore_delivery(const project::Plan& plan, const Value& saved);
[[nodiscard]] Value save(const project::Intervention& what);
[[nodiscard]] Result<project::Intervention> restore_intervention(const Value& saved);
/// The simulated world of a saved state as data for `sim::restore`, whatever plan it belongs to; null: it has none.
/// Error: mission.bad-state.
[[nodiscard]] Result<Value> saved_world(std::string_view saved);

}  // namespace sentree::mission
