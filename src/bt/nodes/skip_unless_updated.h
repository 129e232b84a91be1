#pragma once

#include "sentree/bt/nodes/updated.h"

namespace sentree::bt::nodes {

struct SkipUnlessUpdated : Updated<Status::kSkipped> {
  static Manifests manifests() { return {format4(decorator("SkipUnlessUpdated", {input<Value>("entry")}))}; }
};

}  // namespace sentree::bt::nodes
