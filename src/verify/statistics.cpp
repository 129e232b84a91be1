#include "sentree/verify/statistics.h"

#include <algorithm>
#include <memory>
#include <optional>
#include <utility>

#include "sentree/base/rng.h"
#include "sentree/mission/encode.h"
#include "sentree/mission/virtual_host.h"
#include "sentree/verify/monitor_memory.h"
#include "sentree/verify/period.h"
#include "sentree/verify/periods.h"

namespace sentree::verify {

namespace {

Rng rng_of(const Sampling& sampling, std::uint64_t run) { return Rng(hash_combine(sampling.seed, run)); }

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

std::uint64_t thrown(Rng& rng, std::uint64_t count, const mission::Choice* choice) {
  return choice != nullptr && choice->probability ? drawn(rng, count, choice->probability) : rng.below(count);
}

// One run that is executed: its die, its gates and its monitors.
class Thrower final : public mission::Surroundings {
 public:
  Thrower(const project::Plan& plan, Order order, Rng rng)
      : violated(plan.monitors.size()), order_(order), rng_(rng), gates_(plan), monitors_(plan.monitors, TimePoint{}) {}

  void observed(const Message& message) override {
    gates_.observed(message, message.time);
    decided_.clear();
    // It may be part of a witness, which lives longer than the message.
    monitors_.observe(std::make_shared<const Message>(message), decided_);
    note();
  }
  std::optional<std::uint64_t> choose(const mission::Choice& choice) override {
    return thrown(rng_, choice.count, &choice);
  }
  std::size_t order(std::uint64_t, std::span<const mission::Delivery* const> due) override {
    return order_ == Order::kVirtual ? 0 : rng_.below(due.size());
  }
  std::optional<mission::Veto> judge(const Message& request) override { return gates_.judge(request, request.time); }
  void refused(const Diagnostic& why) override {
    if (!error) error = why;
  }

  void advance(TimePoint now) {
    decided_.clear();
    monitors_.advance(now, decided_);
    note();
  }

  std::vector<bool> violated;
  std::optional<Diagnostic> error;

 private:
  void note() {
    for (const auto& [monitor, decision, leaf] : decided_)
      violated[monitor] = violated[monitor] || decision.verdict == monitor::Verdict::kViolated;
  }

  Order order_;
  Rng rng_;
  Gates gates_;
  monitor::MonitorSet monitors_;
  std::vector<monitor::MonitorSet::Decided> decided_;
};

// Executes each run.
class Executed {
 public:
  Executed(const project::Plan& plan, const Sampling& sampling) : plan_(plan), sampling_(sampling), host_(plan) {
    host_.remember_steps();
  }

  Result<std::vector<bool>> operator()(std::uint64_t number) {
    const TimePoint end = TimePoint{} + sampling_.length;
    Thrower thrower(plan_, sampling_.order, rng_of(sampling_, number));
    mission::State state = host_.begin();
    while (!mission::VirtualHost::ended(state) && state.tree.planned < end && !state.tree.over) {
      const auto done = period(host_, state, thrower, [] { return Result<void>(); });
      if (!done) return tl::unexpected(done.error());
      if (thrower.error) return tl::unexpected(*thrower.error);
      // What has no effect any more needs no throw of the die.
      mission::prune(state);
    }
    // What is owed with a bound is due while the rest of the run is silent.
    if (!mission::VirtualHost::ended(state)) thrower.advance(end);
    return std::move(thrower.violated);
  }

 private:
  const project::Plan& plan_;
  const Sampling& sampling_;
  mission::VirtualHost host_;
};

// Walks through what is known, and executes a period where that ends.
class Walked {
 public:
  Walked(const project::Plan& plan, const Sampling& sampling) : plan_(plan), sampling_(sampling) {
    options_.order = sampling.order;
  }

  Result<std::vector<bool>> operator()(std::uint64_t number) {
    if (!periods_ || bytes() > sampling_.memory) {
      if (auto begun = forget(); !begun) return tl::unexpected(begun.error());
    }
    Rng rng = rng_of(sampling_, number);
    std::vector<bool> violated(monitors_.size());
    std::size_t left = monitors_.size();
    cores_.assign(first_.begin(), first_.end());
    TimePoint now{};
    std::uint32_t at = 0;
    for (std::uint64_t tick = 0; left > 0 && !is_at_end(at, now); ++tick) {
      if (tick % 1024 == 1023 && bytes() > sampling_.memory)
        return fail("verify.memory", "one run needs too much of it");
      const auto way = go_on(at, rng);
      if (!way) return tl::unexpected(way.error());
      for (std::size_t i = 0; i < monitors_.size(); ++i) {
        if (violated[i]) continue;
        MonitorMemory& monitor = *monitors_[i];
        const auto* outcome = monitor.after(cores_[i], monitor.heard(way->seen), way->took);
        if (outcome == nullptr) return tl::unexpected(*monitor.error());
        cores_[i] = outcome->core;
        if (!outcome->violated) continue;
        violated[i] = true;
        --left;
      }
      at = way->to;
      now += way->took;
    }
    if (!periods_->graph().nodes[at].ended && left > 0) {
      const Duration silence = TimePoint{} + sampling_.length - now;
      for (std::size_t i = 0; i < monitors_.size(); ++i)
        violated[i] = violated[i] || monitors_[i]->violated_by_silence(cores_[i], silence);
    }
    return violated;
  }

 private:
  // A decision that is made in a period, or where the period leads: a number of `ways_`.
  struct Fork {
    std::uint32_t count = 0;
    std::uint32_t next = 0;           // index of the first of its alternatives in `next_`
    std::uint32_t probability = kNo;  // likewise in `probabilities_`
  };
  struct Way {
    std::uint32_t to = 0;
    std::uint32_t seen = 0;
    Duration took{};
  };
  struct State {
    std::uint32_t first = kNo;  // as in `next_`
    bool over = false;
    Duration until_planned{};
  };
  static constexpr std::uint32_t kNo = UINT32_MAX;
  static constexpr std::uint32_t kIsWay = 1U << 31U;

  Result<void> forget() {
    forks_.clear();
    next_.clear();
    probabilities_.clear();
    ways_.clear();
    states_.clear();
    monitors_.clear();
    first_.clear();
    periods_.emplace(plan_, options_);
    if (auto begun = periods_->begin(); !begun) return begun;
    for (const monitor::Model& model : plan_.monitors) {
      monitors_.push_back(std::make_unique<MonitorMemory>(periods_->graph(), model));
      const auto first = monitors_.back()->begin();
      if (!first) return tl::unexpected(*monitors_.back()->error());
      first_.push_back(*first);
    }
    states_.emplace_back();
    return {};
  }

  [[nodiscard]] std::uint64_t bytes() const {
    std::uint64_t sum = periods_->bytes() + forks_.capacity() * sizeof(Fork) + next_.capacity() * sizeof(next_[0]) +
                        probabilities_.capacity() * sizeof(double) + ways_.capacity() * sizeof(Way) +
                        states_.capacity() * sizeof(State);
    for (const auto& monitor : monitors_) sum += monitor->bytes();
    return sum;
  }

  [[nodiscard]] bool is_at_end(std::uint32_t at, TimePoint now) const {
    const TimePoint end = TimePoint{} + sampling_.length;
    return periods_->graph().nodes[at].ended || states_[at].over || now + states_[at].until_planned >= end;
  }

  Result<Way> go_on(std::uint32_t from, Rng& rng) {
    script_.clear();
    std::uint32_t at = states_[from].first;
    while (at != kNo) {
      if ((at & kIsWay) != 0) return ways_[at & ~kIsWay];
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
    if (way->is_new) states_.push_back({.over = way->over, .until_planned = way->until_planned});
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
    ways_.push_back({.to = way->to, .seen = periods_->keep_seen(), .took = way->took});
    put(made.size(), kIsWay | static_cast<std::uint32_t>(ways_.size() - 1));
    return ways_.back();
  }

  // The fork whose alternative is the last of the script.
  [[nodiscard]] std::uint32_t last_known(std::uint32_t from, std::size_t depth) const {
    std::uint32_t at = states_[from].first;
    for (std::size_t i = 0; i + 1 < depth; ++i) at = next_[forks_[at].next + script_[i]];
    return at;
  }

  const project::Plan& plan_;
  const Sampling& sampling_;
  Options options_;
  std::optional<Periods> periods_;
  std::vector<std::unique_ptr<MonitorMemory>> monitors_;
  std::vector<std::uint32_t> first_;  // state of each monitor
  std::vector<Fork> forks_;
  std::vector<std::uint32_t> next_;  // by fork and alternative: a fork, a way, or nothing that is known
  std::vector<double> probabilities_;
  std::vector<Way> ways_;
  std::vector<State> states_;
  std::vector<std::uint32_t> cores_;
  std::vector<std::uint32_t> script_;
  std::vector<std::uint32_t> met_;
};

}  // namespace

Result<std::uint64_t> sample(const project::Plan& plan, const Sampling& sampling) {
  std::optional<Walked> walked;
  if (sampling.memory_of_periods) walked.emplace(plan, sampling);
  std::optional<Executed> executed;
  std::uint64_t made = 0;
  while (made < sampling.runs && (!sampling.interrupted || !sampling.interrupted())) {
    if (!walked && !executed) executed.emplace(plan, sampling);
    auto violated = walked ? (*walked)(made) : (*executed)(made);
    if (!violated && walked) {
      // What has no canonical form, looks at the clock or has too many states can be executed all the same.
      walked.reset();
      continue;
    }
    if (!violated) return tl::unexpected(violated.error());
    ++made;
    if (sampling.told && !sampling.told(*violated)) break;
  }
  return made;
}

}  // namespace sentree::verify
