#pragma once

#include "sentree/bt/nodes/node.h"

namespace sentree::bt::nodes {

struct AlwaysFailure : AnyNode {
  static Next enter(Machine& /*m*/, const Node& /*n*/, NodeId /*id*/) { return Next::done(Status::kFailure); }
  static may::Mask may_return(const may::Asked& /*asked*/) { return may::kFailure; }
  static Manifests manifests() { return {both(leaf("AlwaysFailure", Category::kAction))}; }
};

}  // namespace sentree::bt::nodes
