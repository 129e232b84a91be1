#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "sentree/base/diagnostic.h"
#include "sentree/mission/state.h"
#include "sentree/project/plan.h"

namespace sentree::mission {

/// A run that goes on with another plan.
struct Carried {
  static constexpr std::size_t kGone = static_cast<std::size_t>(-1);

  State state;
  std::vector<std::size_t> leaf_of;  ///< By leaf of the plan before: which one it is in the plan after, or kGone.
  std::vector<std::string> changes;  ///< What came, went or is another one; a sentence each.
};

/// `state`, of the plan `before`, as a state of the plan `after`, whose project takes its place while the mission goes
/// on. Leaves are the same if their paths are, states of their charts, of models and of monitors if their ids are,
/// monitors and models if their names are. What is new begins: leaves idle, monitors at their beginning.
/// Codes: those of `bt::carry` and `scxml::carry`, and mission.cannot-carry, one for each thing that stands in the way.
[[nodiscard]] Loaded<Carried> carry(const project::Plan& before, const State& state, const project::Plan& after);

}  // namespace sentree::mission
