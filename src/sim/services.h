#pragma once

#include <span>
#include <string_view>
#include <vector>

#include "sentree/base/result.h"
#include "sentree/base/time.h"
#include "sentree/base/value.h"
#include "sentree/sim/state.h"
#include "sentree/sim/world.h"

namespace sentree::sim {

/// One interface of interfaces/robot.thrift as this library serves it.
struct ServiceInfo {
  std::string_view name;         ///< "Battery", "Navigation", …
  bool is_test_control = false;  ///< Skills must not reach it.
  std::vector<std::string_view> methods;
};

[[nodiscard]] std::span<const ServiceInfo> services();
/// Null if there is none of that name.
[[nodiscard]] const ServiceInfo* find_service(std::string_view name);

struct Call {
  std::string_view service;  ///< The interface's name, e.g. "Navigation".
  std::string_view method;
  const Map& args;              ///< By name, in the shapes below.
  std::string_view robot = {};  ///< Empty: the first.
  Value former = {};            ///< An answer to the same call that nobody needs any more: the next is made of it.
};

/// Advances the world to `now` of the run and serves the call.
///
/// Values have the shapes of the IDL: a struct is a map in the order of its fields, an enumerator its name,
/// i32 and i64 ints, a double a double (an int is taken), binary bytes; a method without result gives null.
/// What the interface can say (an unknown location, say) is in the result, not an error.
/// Errors: sim.unknown-robot, sim.unknown-service, sim.unknown-method, sim.bad-argument.
[[nodiscard]] Result<Value> call(const World& world, State& state, Call call, TimePoint now);

/// The same, but where nobody has looked at the latest scan it may not have been cast (`advance_uncast`).
[[nodiscard]] Result<Value> call_uncast(const World& world, State& state, Call call, TimePoint now);

}  // namespace sentree::sim
