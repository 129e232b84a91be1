#pragma once

#include "sentree/bt/nodes/code.h"

namespace sentree::bt::nodes {

struct Script : AnyNode {
  static may::Mask may_return(const may::Asked& /*asked*/) { return may::kSuccess; }
  static Manifests manifests() { return {format4(leaf("Script", Category::kAction, {input<std::string>("code")}))}; }

  static Next enter(Machine& m, const Node& n, NodeId id) {
    ScriptValue result;
    if (!run_code(m, n, id, result)) return Next::done(Status::kIdle);
    return Next::done(Status::kSuccess);
  }
};

}  // namespace sentree::bt::nodes
