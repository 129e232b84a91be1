#include "sentree/sim/state.h"

#include <cstddef>
#include <string>

#include <fmt/format.h>

#include "sentree/base/archive.h"
#include "sentree/base/assert.h"
#include "sentree/sim/detail/archive.h"

namespace sentree::sim {

namespace {

// What indices of a state may be: everything else that is well formed is harmless.
std::string broken_reference(const World& world, const State& state) {
  if (state.robots.size() != world.robots.size()) {
    return fmt::format("it has {} robots and the world {}", state.robots.size(), world.robots.size());
  }
  if (state.time < TimePoint{} || state.time.time_since_epoch() % world.step != Duration(0)) {
    return "time is no multiple of the world's step";
  }
  for (std::size_t i = 0; i < state.robots.size(); ++i) {
    const RobotState& robot = state.robots[i];
    const Navigator& navigator = robot.navigator;
    const std::string name = fmt::format("robots[{}]", i);
    if (robot.station < -1 || robot.station >= static_cast<int>(world.stations.size()))
      return name + ".station is none";
    if (is_active(navigator.status) && !navigator.goal.waypoints.empty() &&
        navigator.waypoint >= navigator.goal.waypoints.size()) {
      return name + ".navigator.waypoint is beyond the goal's last";
    }
    if (robot.scan.ranges.size() != static_cast<std::size_t>(world.robots[i].laser.beams)) {
      return name + ".scan has another number of beams";
    }
    const auto slots = world.robots[i].costs.weights().size();
    for (const std::uint32_t slot : navigator.seen) {
      if (slot >= slots) return name + ".navigator.seen names a cell outside the map";
    }
  }
  return {};
}

}  // namespace

std::uint64_t State::hash() const { return archive::hash(*this); }

Value save(const State& state) {
  for (const RobotState& robot : state.robots) SENTREE_ASSERT(!robot.uncast);
  return archive::Saver::saved(state);
}

Result<State> restore(const World& world, const Value& saved) {
  State state;
  std::string problem;
  archive::Restorer{&saved, {}, &problem}.restored(saved, {}, state);
  if (problem.empty()) problem = broken_reference(world, state);
  if (!problem.empty()) return fail("sim.bad-state", "the saved state does not fit this world: " + problem);
  return state;
}

}  // namespace sentree::sim
