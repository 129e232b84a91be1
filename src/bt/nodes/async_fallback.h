#pragma once

#include "sentree/bt/nodes/ordered.h"

namespace sentree::bt::nodes {

struct AsyncFallback : Ordered<Status::kFailure, Status::kSuccess, true> {
  static Manifests manifests() { return {format4(control("AsyncFallback"))}; }
};

}  // namespace sentree::bt::nodes
