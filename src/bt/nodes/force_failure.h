#pragma once

#include "sentree/bt/nodes/mapped.h"

namespace sentree::bt::nodes {

struct ForceFailure : Mapped<Status::kFailure, Status::kFailure> {
  static Manifests manifests() { return {both(decorator("ForceFailure"))}; }
};

}  // namespace sentree::bt::nodes
