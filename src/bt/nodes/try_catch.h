#pragma once

#include <array>
#include <string>
#include <utility>

#include "sentree/bt/nodes/node.h"

namespace sentree::bt::nodes {

/// All children but the last as a Sequence; when one fails, the last cleans up and the result is FAILURE.
struct TryCatch : AnyNode {
  enum : std::size_t { kCurrent, kSkipped, kInCatch };
  static constexpr std::array kWords{Word{Word::Lives::kAlways, Word::Range::kChild}, Word{Word::Lives::kUnlessIdle},
                                     Word{Word::Lives::kUnlessIdle}};
  static may::Mask may_return(const may::Asked& asked) {
    if (asked.children.empty()) return 0;
    const auto tries = asked.children.first(asked.children.size() - 1);
    return may::ordered(tries, may::kSuccess).first | (asked.children.back() & may::kRunning);
  }
  static Manifests manifests() {
    Manifest manifest = control("TryCatch", {input_default<bool>("catch_on_halt", "false")});
    manifest.children_min = 2;
    return {format4(std::move(manifest))};
  }

  static constexpr std::uint32_t kCatchOnHaltPort = 0;

  static Next enter(Machine& m, const Node& n, NodeId id) {
    if (n.child_count < 2) {
      return m.fail(id, "bt.child-count", "must have at least 2 children and has " + std::to_string(n.child_count));
    }
    std::int32_t* const mem = m.memory(n);
    if (m.status(id) == Status::kIdle) mem[kSkipped] = mem[kInCatch] = 0;
    m.set_status(id, Status::kRunning);
    return Next::tick(mem[kInCatch] != 0 ? n.child_count - 1 : static_cast<std::uint32_t>(mem[kCurrent]));
  }

  static Next child_done(Machine& m, const Node& n, NodeId /*id*/, Status status) {
    std::int32_t* const mem = m.memory(n);
    const std::uint32_t tries = n.child_count - 1;
    if (status == Status::kRunning) return Next::done(status);
    if (mem[kInCatch] != 0) {
      m.reset_children(n);
      clear(mem, kWords);
      return Next::done(Status::kFailure);
    }
    if (status == Status::kFailure) {
      m.reset_children(n, 0, tries);
      mem[kCurrent] = 0;
      mem[kInCatch] = 1;
      return Next::tick(tries);
    }
    if (status == Status::kSkipped) ++mem[kSkipped];
    if (static_cast<std::uint32_t>(++mem[kCurrent]) < tries)
      return Next::tick(static_cast<std::uint32_t>(mem[kCurrent]));
    const bool all_skipped = mem[kSkipped] == static_cast<std::int32_t>(tries);
    m.reset_children(n);
    clear(mem, kWords);
    return Next::done(all_skipped ? Status::kSkipped : Status::kSuccess);
  }

  static void halt(Machine& m, const Node& n, NodeId id) {
    std::int32_t* const mem = m.memory(n);
    if (mem[kInCatch] == 0 && m.status(id) == Status::kRunning && m.read_bool(n, kCatchOnHaltPort, false)) {
      m.reset_children(n, 0, n.child_count - 1);
      if (!m.failed()) m.tick_now(m.child(n, n.child_count - 1));
    }
    clear(mem, kWords);
    m.reset_children(n);
  }
};

}  // namespace sentree::bt::nodes
