#pragma once

#include "sentree/bt/nodes/updated.h"

namespace sentree::bt::nodes {

struct WaitValueUpdate : Updated<Status::kRunning> {
  static Manifests manifests() { return {format4(decorator("WaitValueUpdate", {input<Value>("entry")}))}; }
};

}  // namespace sentree::bt::nodes
