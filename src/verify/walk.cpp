#include "sentree/verify/walk.h"

#include <utility>

#include "sentree/project/cpp_nodes.h"

namespace sentree::verify {

namespace {

// @param probability  Of each alternative, by index.
template <class Probability>
std::uint64_t drawn(Rng& rng, std::uint64_t count, const Probability& probability) {
  double left = rng.uniform();
  for (std::uint64_t i = 0; i + 1 < count; ++i) {
    left -= probability(i);
    if (left < 0) return i;
  }
  return count - 1;
}

}  // namespace

std::uint64_t thrown(Rng& rng, std::uint64_t count, const mission::Choice* choice) {
  return choice != nullptr && choice->probability ? drawn(rng, count, choice->probability) : rng.below(count);
}

Walk::Walk(const project::Plan& plan, Order order, std::function<Result<double>(const Frontier&)> score)
    : plan_(plan), score_(std::move(score)) {
  options_.order = order;
  options_.reduce_orders = false;
  if (!project::cpp_nodes(plan).empty()) options_.times = bt::Times::kAbsolute;
}

Result<void> Walk::begin() {
  forks_.clear();
  next_.clear();
  probabilities_.clear();
  ways_.clear();
  states_.clear();
  monitors_.clear();
  first_.clear();
  periods_.emplace(plan_, options_);
  if (score_) {
    periods_->on_new([this](const Frontier& run) {
      if (auto score = score_(run))
        score_now_ = *score;
      else
        no_score_ = score.error();
    });
  }
  if (auto begun = periods_->begin(); !begun) return begun;
  for (const monitor::Model& model : plan_.monitors) {
    monitors_.push_back(std::make_unique<MonitorMemory>(periods_->graph(), model));
    const auto first = monitors_.back()->begin();
    if (!first) return tl::unexpected(*monitors_.back()->error());
    first_.push_back(*first);
  }
  if (no_score_) return tl::unexpected(*no_score_);
  states_.push_back({.score = score_now_});
  return {};
}

std::uint64_t Walk::bytes() const {
  std::uint64_t sum = periods_->bytes() + forks_.capacity() * sizeof(Fork) + next_.capacity() * sizeof(next_[0]) +
                      probabilities_.capacity() * sizeof(double) + ways_.capacity() * sizeof(Step) +
                      states_.capacity() * sizeof(State);
  for (const auto& monitor : monitors_) sum += monitor->bytes();
  return sum;
}

Result<Walk::Step> Walk::go_on(std::uint32_t from, Rng& rng) {
  script_.clear();
  std::uint32_t at = states_[from].first;
  while (at != kNo) {
    if ((at & kIsWay) != 0) return Step(ways_[at & ~kIsWay]);
    const Fork& fork = forks_[at];
    const auto of = [&](std::uint64_t i) { return probabilities_[fork.probability + i]; };
    const auto taken =
        static_cast<std::uint32_t>(fork.probability == kNo ? rng.below(fork.count) : drawn(rng, fork.count, of));
    script_.push_back(taken);
    at = next_[fork.next + taken];
  }
  // The forks that are met where nothing is known yet.
  const std::size_t known = script_.size();
  met_.clear();
  const auto way = periods_->go_on(from, script_, [&](std::uint64_t count, const mission::Choice* choice) {
    Fork fork{.count = static_cast<std::uint32_t>(count), .next = static_cast<std::uint32_t>(next_.size())};
    next_.resize(next_.size() + count, kNo);
    if (choice != nullptr && choice->probability) {
      fork.probability = static_cast<std::uint32_t>(probabilities_.size());
      for (std::uint64_t i = 0; i < count; ++i) probabilities_.push_back(choice->probability(i));
    }
    met_.push_back(static_cast<std::uint32_t>(forks_.size()));
    forks_.push_back(fork);
    return static_cast<std::uint32_t>(thrown(rng, count, choice));
  });
  if (!way) return tl::unexpected(way.error());
  if (no_score_) return tl::unexpected(*no_score_);
  if (way->is_new) states_.push_back({.over = way->over, .until_planned = way->until_planned, .score = score_now_});
  const auto& made = periods_->made();
  const auto put = [&](std::size_t depth, std::uint32_t what) {
    if (depth == 0) {
      states_[from].first = what;
      return;
    }
    // The fork before: the last that was known, or one that was met.
    const std::uint32_t before = depth > known ? met_[depth - known - 1] : last_known(from, depth);
    next_[forks_[before].next + made[depth - 1].alternative] = what;
  };
  for (std::size_t i = 0; i < met_.size(); ++i) put(known + i, met_[i]);
  ways_.push_back({.to = way->to, .seen = periods_->keep_seen(), .took = way->took, .judged = way->judged});
  put(made.size(), kIsWay | static_cast<std::uint32_t>(ways_.size() - 1));
  return ways_.back();
}

// The fork whose alternative is the last of the script.
std::uint32_t Walk::last_known(std::uint32_t from, std::size_t depth) const {
  std::uint32_t at = states_[from].first;
  for (std::size_t i = 0; i + 1 < depth; ++i) at = next_[forks_[at].next + script_[i]];
  return at;
}

}  // namespace sentree::verify
