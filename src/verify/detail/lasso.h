#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "sentree/verify/detail/branching.h"
#include "sentree/verify/judge.h"

namespace sentree::verify {

/// A behaviour on which something is owed for ever.
struct Lasso {
  std::uint32_t begin = 0;           ///< The pair at which the loop begins.
  std::vector<std::uint32_t> edges;  ///< Of the graph, once round.
};

/// What is known of loops on which something is owed. Choices are "MODEL.NAME", or without a name "MODEL at FILE:LINE";
/// alternatives "MODEL.NAME = value", "MODEL = value at FILE:LINE".
struct Owing {
  std::optional<Lasso> loop;
  std::vector<std::string> fair;     ///< Without a loop: choices whose fairness that rests on.
  std::vector<std::string> avoided;  ///< There is none if these too were taken again and again.
};

/// Looks for a loop among places that owe, by arcs that go on owing. What is fair is taken on it where it is offered
/// (Streett), and nothing that may be drawn leads away from it, since whatever has a probability comes some day. Where
/// nothing has to be taken on it, its way there and once round are of the fewest ticks (among the first 1,000 pairs).
/// @param owing    Places: pairs that owe, and the decisions behind them.
/// @param goes_on  Arcs.
[[nodiscard]] Owing owing_for_ever(const Graph& graph, const Branching& branching, const std::vector<Step>& steps,
                                   const Places& owing, const Allowed& goes_on, const JudgeOptions& options);

}  // namespace sentree::verify
