#pragma once

#include "sentree/bt/nodes/code.h"

namespace sentree::bt::nodes {

struct Script : AnyNode {
  static may::Mask may_return(const may::Asked& /*asked*/) { return may::kSuccess; }
  static Manifests manifests() { return {format4(leaf("Script", Category::kAction, {input<std::string>("code")}))}; }

  static Next enter(Machine& m, const Node& n, NodeId id) {
    return Next::done((n.data != kNone ? m.run(id, n.data) : run_read(m, n, id)) ? Status::kSuccess : Status::kIdle);
  }
  [[gnu::noinline]] static bool run_read(Machine& m, const Node& n, NodeId id) {
    ScriptValue ignored;
    return run_read_code(m, n, id, ignored);
  }
};

}  // namespace sentree::bt::nodes
