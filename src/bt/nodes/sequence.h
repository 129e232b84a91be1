#pragma once

#include "sentree/bt/nodes/ordered.h"

namespace sentree::bt::nodes {

struct Sequence : Ordered<Status::kSuccess, Status::kFailure, false> {
  static Manifests manifests() { return {both(control("Sequence"))}; }
};

}  // namespace sentree::bt::nodes
