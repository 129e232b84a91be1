#pragma once

#include <array>

#include "sentree/bt/nodes/decorator.h"

namespace sentree::bt::nodes {

/// Never armed again, not even by halting the tree.
struct RunOnce : AnyNode {
  static constexpr std::array kWords{Word{Word::Lives::kAlways, Word::Range::kResult}};
  static may::Mask may_return(const may::Asked& asked) {
    const auto then_skip = asked.literal(0);
    return then_skip && detail::parse_bool(*then_skip) == false ? asked.child() : asked.child() | may::kSkipped;
  }
  static Manifests manifests() { return {format4(decorator("RunOnce", {input_default<bool>("then_skip", "true")}))}; }
  static constexpr std::uint32_t kThenSkipPort = 0;
  static std::int32_t& result(Machine& m, const Node& n) { return *m.memory(n); }  ///< A Status; 0: not run yet.

  static Next enter(Machine& m, const Node& n, NodeId id) {
    if (const std::int32_t kept = result(m, n); kept != 0) {
      return Next::done(m.read_bool(n, kThenSkipPort, true) ? Status::kSkipped : static_cast<Status>(kept));
    }
    m.set_status(id, Status::kRunning);
    return Next::tick(0);
  }
  static Next child_done(Machine& m, const Node& n, NodeId /*id*/, Status status) {
    if (is_completed(status)) {
      result(m, n) = static_cast<std::int32_t>(status);
      m.reset(only_child(m, n));
    }
    return Next::done(status);
  }
};

}  // namespace sentree::bt::nodes
