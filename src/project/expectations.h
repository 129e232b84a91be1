#pragma once

#include "sentree/project/project.h"

namespace sentree::project {

/// Whether anything can come out that `sentree test` would not take.
[[nodiscard]] bool expects_anything(const Scenario& scenario);

}  // namespace sentree::project
