#pragma once

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <unordered_set>
#include <vector>

#include "sentree/mission/effect.h"

namespace sentree::mission {

/// The places in a queue, ordered by time and rank, one of which comes next: the first delivery to each part that finds
/// what it was meant for, since what is on its way to one part keeps its order. Cost: deliveries due; nothing is
/// allocated where one alone is due.
/// @param queue    Not empty; its entries have `when` and `rank`.
/// @param part     The number of the part that the entry at a place is for.
/// @param effects  Whether the entry at a place has an effect.
/// @param at       Is filled, in the order of the queue. Empty: the first entry comes next, as ticks and what is done
///                 from outside always do.
template <class Queue, class Part, class Effects>
void due(const Queue& queue, const Part& part, const Effects& effects, std::vector<std::size_t>& at) {
  at.clear();
  const auto& first = queue.front();
  if (!may_change_places(first.rank) || queue.size() < 2 || queue[1].when != first.when) return;
  // Few are due, as a rule; at the beginning it is every model.
  constexpr std::size_t kFew = 16;
  std::unordered_set<std::size_t> parts;
  for (std::size_t i = 0; i < queue.size() && queue[i].when == first.when && may_change_places(queue[i].rank); ++i) {
    const std::size_t of = part(i);
    const bool has_one = at.size() < kFew
                             ? std::any_of(at.begin(), at.end(), [&](std::size_t e) { return part(e) == of; })
                             : parts.contains(of);
    if (has_one || !effects(i)) continue;
    at.push_back(i);
    if (at.size() > kFew) parts.insert(of);
    if (at.size() == kFew) std::transform(at.begin(), at.end(), std::inserter(parts, parts.end()), part);
  }
  if (at.size() == 1) at.clear();
}

}  // namespace sentree::mission
