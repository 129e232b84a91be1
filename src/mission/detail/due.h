#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

#include "sentree/mission/state.h"

namespace sentree::mission::detail {

/// The places in a queue, ordered by time and rank, one of which comes next: the first delivery to each part, since
/// what is on its way to one part keeps its order. Cost: deliveries due × parts; nothing is allocated where one alone
/// is due.
/// @param queue  Not empty; its entries have `when` and `rank`.
/// @param same   Whether the entries at two places are for one part.
/// @param at     Is filled, in the order of the queue. Empty: the first entry comes next, as ticks always do.
template <class Queue, class Same>
void due(const Queue& queue, const Same& same, std::vector<std::size_t>& at) {
  at.clear();
  const auto& first = queue.front();
  if (first.rank == Rank::kTick) return;
  for (std::size_t i = 1; i < queue.size() && queue[i].when == first.when && queue[i].rank != Rank::kTick; ++i) {
    if (at.empty()) at.push_back(0);
    if (std::none_of(at.begin(), at.end(), [&](std::size_t earlier) { return same(earlier, i); })) at.push_back(i);
  }
  if (at.size() == 1) at.clear();
}

}  // namespace sentree::mission::detail
