#pragma once

#include <cstdint>

namespace sentree::mission {

/// Something in a plan that a run came to. It is told at least once, not each time.
struct Met {
  enum class Kind : std::uint8_t {
    kNode,             ///< A node of the tree has a status.
    kSkillState,       ///< The chart of a leaf's skill enters a state.
    kModelState,       ///< The chart of a model enters a state,
    kModelTransition,  ///< or takes a transition.
    kAnswer,           ///< A leaf answers a tick with a status.
  };
  Kind kind = Kind::kNode;
  std::uint32_t of = 0;    ///< Which node, leaf or model of the plan.
  std::uint32_t what = 0;  ///< The status (`bt::Status`), or the index in the chart.
};

}  // namespace sentree::mission
