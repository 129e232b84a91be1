#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

#include "sentree/mission/effect.h"

namespace sentree::mission::detail {

/// The places in a queue, ordered by time and rank, one of which comes next: the first delivery to each part that finds
/// what it was meant for, since what is on its way to one part keeps its order. Cost: deliveries due × parts; nothing
/// is allocated where one alone is due.
/// @param queue    Not empty; its entries have `when` and `rank`.
/// @param same     Whether the entries at two places are for one part.
/// @param effects  Whether the entry at a place has an effect.
/// @param at       Is filled, in the order of the queue. Empty: the first entry comes next, as ticks and what is done
///                 from outside always do.
template <class Queue, class Same, class Effects>
void due(const Queue& queue, const Same& same, const Effects& effects, std::vector<std::size_t>& at) {
  at.clear();
  const auto& first = queue.front();
  if (!may_change_places(first.rank) || queue.size() < 2 || queue[1].when != first.when) return;
  for (std::size_t i = 0; i < queue.size() && queue[i].when == first.when && may_change_places(queue[i].rank); ++i) {
    if (std::none_of(at.begin(), at.end(), [&](std::size_t earlier) { return same(earlier, i); }) && effects(i))
      at.push_back(i);
  }
  if (at.size() == 1) at.clear();
}

}  // namespace sentree::mission::detail
