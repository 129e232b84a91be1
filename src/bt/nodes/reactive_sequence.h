#pragma once

#include "sentree/bt/nodes/reactive.h"

namespace sentree::bt::nodes {

struct ReactiveSequence : Reactive<Status::kSuccess, Status::kFailure> {
  static Manifests manifests() { return {both(control("ReactiveSequence"))}; }
};

}  // namespace sentree::bt::nodes
