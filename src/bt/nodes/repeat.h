#pragma once

#include "sentree/bt/nodes/repeated.h"

namespace sentree::bt::nodes {

struct Repeat : Repeated<Status::kSuccess> {
  static Manifests manifests() { return {both(decorator("Repeat", {input<std::int32_t>("num_cycles")}))}; }
};

}  // namespace sentree::bt::nodes
