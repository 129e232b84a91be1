#pragma once

#include <cstddef>
#include <variant>

#include "sentree/mission/state.h"

namespace sentree::mission {

/// Whether deliveries of that rank to different parts may change places at one instant: a tick comes when nothing else
/// is due, and what is done from outside comes first.
[[nodiscard]] constexpr bool may_change_places(Rank rank) { return rank != Rank::kTick && rank != Rank::kInjection; }

/// The end of a leaf's time to answer. It comes in place of the one before: a leaf is waited for only until the next is
/// ticked, so that no other has an effect any more.
[[nodiscard]] inline bool is_answer_due(const Delivery& what) {
  const auto* to_tree = std::get_if<TreeDelivery>(&what.what);
  return to_tree != nullptr && std::holds_alternative<AnswerDue>(*to_tree);
}

/// Whether a delivery finds what it was meant for: not a timer that has been set anew, nor the end of a leaf's time
/// when the leaf has answered.
/// @param wake  Of a model or a skill (bool), by its number: when its timer rings.
template <class Wake>
[[nodiscard]] bool has_effect(const Delivery& what, const TreeState& tree, const Wake& wake) {
  if (const auto* to_tree = std::get_if<TreeDelivery>(&what.what)) {
    const auto* due = std::get_if<AnswerDue>(to_tree);
    return due == nullptr || tree.outstanding(due->leaf) == due->tick;
  }
  if (const auto* to_skill = std::get_if<SkillDelivery>(&what.what)) {
    const auto* timer = std::get_if<SkillTimer>(to_skill);
    return timer == nullptr || wake(false, what.leaf) == timer->when;
  }
  const auto* timer = std::get_if<ModelTimer>(&std::get<ModelDelivery>(what.what));
  return timer == nullptr || wake(true, what.leaf) == timer->when;
}

}  // namespace sentree::mission
