#pragma once

#include "sentree/bt/nodes/mapped.h"

namespace sentree::bt::nodes {

struct ForceSuccess : Mapped<Status::kSuccess, Status::kSuccess> {
  static Manifests manifests() { return {both(decorator("ForceSuccess"))}; }
};

}  // namespace sentree::bt::nodes
