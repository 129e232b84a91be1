#include "sentree/verify/orders.h"

#include <algorithm>
#include <optional>

namespace sentree::verify {

using mission::PartMemory;

// Steps of one instant, between two ticks.
struct Orders::Group {
  const OrderedPeriod& period;
  std::size_t begin = 0;
  std::size_t size = 0;
  std::span<const OrderDecision> decisions;

  [[nodiscard]] const PartMemory::Trace::Step& step(std::size_t i) const { return period.trace.steps[begin + i]; }
  [[nodiscard]] std::span<const PartMemory::Trace::Put> puts(std::size_t i) const {
    const std::size_t first = begin + i == 0 ? 0 : period.trace.steps[begin + i - 1].puts;
    return std::span(period.trace.puts).subspan(first, step(i).puts - first);
  }
  [[nodiscard]] std::span<const std::uint32_t> observed(std::size_t i) const {
    const std::size_t first = begin + i == 0 ? 0 : period.trace.steps[begin + i - 1].observed;
    return std::span(period.trace.observed).subspan(first, step(i).observed - first);
  }
  [[nodiscard]] std::span<const std::uint32_t> due(const OrderDecision& decision,
                                                   const std::vector<OpenDecision>& open) const {
    return period.due.subspan(decision.due, open[decision.decision].count);
  }
};

void Orders::want(const OrderedPeriod& period, std::span<const std::uint64_t> hearers,
                  std::vector<OpenDecision>& open) {
  const auto& steps = period.trace.steps;
  std::size_t at = 0;
  for (std::size_t begin = 0, end = 0; begin < steps.size() && at < period.decisions.size(); begin = end) {
    // A tick comes when nothing else is due.
    for (end = begin + 1;
         end < steps.size() && steps[end].when == steps[begin].when && steps[end].rank != mission::Rank::kTick;) {
      ++end;
    }
    const std::size_t first = at;
    while (at < period.decisions.size() && period.decisions[at].step < end) ++at;
    if (at == first) continue;
    const Group group{.period = period,
                      .begin = begin,
                      .size = end - begin,
                      .decisions = period.decisions.subspan(first, at - first)};
    if (period.ended && end == steps.size()) {
      // What was still due could have come before.
      for (const OrderDecision& decision : group.decisions) {
        auto& wanted = open[decision.decision].wanted;
        std::fill(wanted.begin(), wanted.end(), true);
      }
      continue;
    }
    heard_by_.assign(group.size * words_, 0);
    for (std::size_t i = 0; i < group.size; ++i) {
      for (const std::uint32_t number : group.observed(i)) {
        for (std::size_t w = 0; w < words_; ++w) heard_by_[i * words_ + w] |= hearers[number * words_ + w];
      }
    }
    want_in(group, open);
  }
}

// One step puts something to the part of the other that this takes before what it has taken.
bool Orders::overtakes(const Group& group, std::size_t a, std::size_t b) {
  const auto& taken = group.step(b);
  const auto puts = group.puts(a);
  return std::any_of(puts.begin(), puts.end(), [&](const PartMemory::Trace::Put& put) {
    return put.part == taken.part && put.when == taken.when && put.rank < taken.rank;
  });
}

bool Orders::depends(const Group& group, std::size_t a, std::size_t b) const {
  if (group.step(a).asks_faults && group.step(b).asks_faults) return true;
  if (overtakes(group, a, b) || overtakes(group, b, a)) return true;
  for (std::size_t w = 0; w < words_; ++w) {
    if ((heard_by_[a * words_ + w] & heard_by_[b * words_ + w]) != 0) return true;
  }
  for (const PartMemory::Trace::Put& one : group.puts(a)) {
    for (const PartMemory::Trace::Put& other : group.puts(b)) {
      if (one.part != other.part) continue;
      if ((one.when == other.when && one.rank == other.rank) || one.is_topic || other.is_topic) return true;
    }
  }
  return false;
}

void Orders::want_in(const Group& group, std::vector<OpenDecision>& open) {
  row_ = (group.size + 63) / 64;
  before_.assign(group.size * row_, 0);
  for (std::size_t j = 1; j < group.size; ++j) {
    races_.clear();
    for (std::size_t i = j; i-- > 0;) {
      const auto& first = group.step(i);
      const auto& second = group.step(j);
      if (is_before(i, j)) {
        // By what the first put, which comes between them; but the second could have been taken before that was there.
        if (first.part != second.part && overtakes(group, i, j)) races_.push_back(i);
        continue;
      }
      const bool follows = first.part == second.part || second.put_by == group.begin + i;
      if (!follows && !depends(group, i, j)) continue;
      for (std::size_t w = 0; w < row_; ++w) before_[j * row_ + w] |= before_[i * row_ + w];
      before_[j * row_ + i / 64] |= std::uint64_t{1} << (i % 64);
      if (!follows) races_.push_back(i);
    }
    for (const std::size_t i : races_) want_for(group, i, j, open);
  }
}

// The second of two steps could have come first.
void Orders::want_for(const Group& group, std::size_t first, std::size_t second, std::vector<OpenDecision>& open) {
  const auto step = static_cast<std::uint32_t>(group.begin + first);
  const auto decision = std::lower_bound(group.decisions.begin(), group.decisions.end(), step,
                                         [](const OrderDecision& one, std::uint32_t at) { return one.step < at; });
  if (decision == group.decisions.end() || decision->step != step) return;
  const auto due = group.due(*decision, open);
  std::vector<bool>& wanted = open[decision->decision].wanted;
  // What leads there without the first: a part can begin with it whose step needs none of the others.
  std::optional<std::size_t> can_begin;
  for (std::size_t k = first + 1; k <= second; ++k) {
    if (k != second && is_before(first, k)) continue;
    bool begins = true;
    for (std::size_t other = first + 1; begins && other < k; ++other)
      begins = is_before(first, other) || !is_before(other, k);
    const auto place = std::find(due.begin(), due.end(), group.step(k).part);
    if (!begins || place == due.end()) continue;
    const auto alternative = static_cast<std::size_t>(place - due.begin());
    if (wanted[alternative]) return;
    can_begin = alternative;
  }
  if (can_begin)
    wanted[*can_begin] = true;
  else
    std::fill(wanted.begin(), wanted.end(), true);
}

}  // namespace sentree::verify
