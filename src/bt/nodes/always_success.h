#pragma once

#include "sentree/bt/nodes/node.h"

namespace sentree::bt::nodes {

struct AlwaysSuccess : AnyNode {
  static Next enter(Machine& /*m*/, const Node& /*n*/, NodeId /*id*/) { return Next::done(Status::kSuccess); }
  static may::Mask may_return(const may::Asked& /*asked*/) { return may::kSuccess; }
  static Manifests manifests() { return {both(leaf("AlwaysSuccess", Category::kAction))}; }
};

}  // namespace sentree::bt::nodes
