#pragma once

#include "sentree/bt/nodes/reactive.h"

namespace sentree::bt::nodes {

struct ReactiveFallback : Reactive<Status::kFailure, Status::kSuccess> {
  static Manifests manifests() { return {both(control("ReactiveFallback"))}; }
};

}  // namespace sentree::bt::nodes
