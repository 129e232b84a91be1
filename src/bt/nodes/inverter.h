#pragma once

#include "sentree/bt/nodes/mapped.h"

namespace sentree::bt::nodes {

struct Inverter : Mapped<Status::kFailure, Status::kSuccess> {
  static Manifests manifests() { return {both(decorator("Inverter"))}; }
};

}  // namespace sentree::bt::nodes
