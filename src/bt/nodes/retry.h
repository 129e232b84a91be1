#pragma once

#include "sentree/bt/nodes/repeated.h"

namespace sentree::bt::nodes {

struct Retry : Repeated<Status::kFailure> {
  static Manifests manifests() {
    const Ports ports{input<std::int32_t>("num_attempts")};
    // The misspelt name of early releases is still in many files.
    return {both(decorator("RetryUntilSuccessful", ports)), format3(decorator("RetryUntilSuccesful", ports))};
  }
};

}  // namespace sentree::bt::nodes
