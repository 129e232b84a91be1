#pragma once

#include "sentree/bt/nodes/mapped.h"

namespace sentree::bt::nodes {

struct SubTree : Mapped<Status::kSuccess, Status::kFailure> {
  static may::Mask may_return(const may::Asked& asked) { return asked.subtree(); }
  static Manifests manifests() {
    return {both(leaf("SubTree", Category::kSubTree)), format3(leaf("SubTreePlus", Category::kSubTree))};
  }
};

}  // namespace sentree::bt::nodes
