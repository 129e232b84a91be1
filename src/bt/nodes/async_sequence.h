#pragma once

#include "sentree/bt/nodes/ordered.h"

namespace sentree::bt::nodes {

struct AsyncSequence : Ordered<Status::kSuccess, Status::kFailure, true> {
  static Manifests manifests() { return {format4(control("AsyncSequence"))}; }
};

}  // namespace sentree::bt::nodes
