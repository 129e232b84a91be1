#pragma once

#include <vector>

#include "sentree/draw/chart.h"

namespace sentree::draw {

/// A chart in which some states hide what is in them.
struct FoldedChart {
  Chart chart;
  std::vector<int> states;       ///< By state of `chart`: its index in the whole.
  std::vector<int> transitions;  ///< By transition of `chart`: its index in the whole.
  std::vector<int> hidden;       ///< By state of `chart`: how many states, dots left out, are hidden in it.
};

/// @param closed  By state: whether what is in it is hidden. An arrow from or to a hidden state begins or ends at the
///                outermost closed state around it; one that lies wholly in a closed state is hidden, too.
/// Cost: O(states + transitions).
[[nodiscard]] FoldedChart folded(const Chart& chart, const std::vector<bool>& closed);

/// Laid out, for pages: {"layout", "states", "transitions", "hidden"}.
[[nodiscard]] Map to_value(const FoldedChart& folded);

}  // namespace sentree::draw
