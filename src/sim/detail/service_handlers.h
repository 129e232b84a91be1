#pragma once

#include <cstddef>
#include <span>
#include <string_view>

#include "sentree/base/value.h"
#include "sentree/sim/service_values.h"
#include "sentree/sim/state.h"
#include "sentree/sim/world.h"

namespace sentree::sim {

/// What a method works on. It reads every argument before it changes anything, and changes nothing once
/// `args.problem()` says something.
struct Context {
  const World& world;
  State& state;
  std::size_t robot_index;
  Arguments& args;
  TimePoint now;  ///< Of the run.
  Value& former;  ///< An answer to the same call that nobody needs any more, or null: the next may be made of it.

  [[nodiscard]] RobotState& robot() const { return state.robots[robot_index]; }
  [[nodiscard]] const RobotSpec& spec() const { return world.robots[robot_index]; }
};

struct Method {
  std::string_view name;
  Value (*handler)(const Context& context);
};

/// Per service, its methods in the order of the IDL.
[[nodiscard]] std::span<const Method> navigation_methods();
[[nodiscard]] std::span<const Method> localization_methods();
[[nodiscard]] std::span<const Method> map_server_methods();
[[nodiscard]] std::span<const Method> battery_methods();
[[nodiscard]] std::span<const Method> laser_methods();
[[nodiscard]] std::span<const Method> base_methods();
/// Test control; everything else cannot reach the ground truth.
[[nodiscard]] std::span<const Method> simulation_methods();

}  // namespace sentree::sim
