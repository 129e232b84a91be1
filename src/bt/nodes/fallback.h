#pragma once

#include "sentree/bt/nodes/ordered.h"

namespace sentree::bt::nodes {

struct Fallback : Ordered<Status::kFailure, Status::kSuccess, false> {
  static Manifests manifests() { return {both(control("Fallback"))}; }
};

}  // namespace sentree::bt::nodes
