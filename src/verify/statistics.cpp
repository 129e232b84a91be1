#include "sentree/verify/statistics.h"

#include <memory>
#include <optional>
#include <utility>

#include "sentree/base/rng.h"
#include "sentree/mission/virtual_host.h"
#include "sentree/monitor/monitor_set.h"
#include "sentree/verify/period.h"

namespace sentree::verify {

namespace {

// One run's die, and its monitors.
class Thrower final : public mission::Surroundings {
 public:
  Thrower(const project::Plan& plan, Order order, std::uint64_t seed)
      : order_(order), rng_(seed), monitors_(plan.monitors, TimePoint{}) {}

  void observed(const Message& message) override {
    decided_.clear();
    // It may be part of a witness, which lives longer than the message.
    monitors_.observe(std::make_shared<const Message>(message), decided_);
  }
  std::optional<std::uint64_t> choose(const mission::Choice& choice) override {
    if (!choice.probability) return rng_.below(choice.count);
    double left = rng_.uniform();
    for (std::uint64_t i = 0; i + 1 < choice.count; ++i) {
      left -= choice.probability(i);
      if (left < 0) return i;
    }
    return choice.count - 1;
  }
  std::size_t order(std::uint64_t, std::span<const mission::Delivery* const> due) override {
    return order_ == Order::kVirtual ? 0 : rng_.below(due.size());
  }
  void refused(const Diagnostic& why) override {
    if (!error) error = why;
  }

  void advance(TimePoint now) {
    decided_.clear();
    monitors_.advance(now, decided_);
  }
  [[nodiscard]] bool is_violated(std::size_t monitor) const {
    return monitors_.state(monitor).verdict == monitor::Verdict::kViolated;
  }

  std::optional<Diagnostic> error;

 private:
  Order order_;
  Rng rng_;
  monitor::MonitorSet monitors_;
  std::vector<monitor::MonitorSet::Decided> decided_;
};

}  // namespace

Result<std::uint64_t> sample(const project::Plan& plan, const Sampling& sampling) {
  mission::VirtualHost host(plan);
  host.remember_steps();
  const TimePoint end = TimePoint{} + sampling.length;
  std::uint64_t made = 0;
  for (; made < sampling.runs; ++made) {
    if (sampling.interrupted && sampling.interrupted()) break;
    Thrower thrower(plan, sampling.order, hash_combine(sampling.seed, made));
    mission::State state = host.begin();
    while (!mission::VirtualHost::ended(state) && state.tree.planned < end && !state.tree.over) {
      if (auto done = period(host, state, thrower, [] { return Result<void>(); }); !done)
        return tl::unexpected(done.error());
      if (thrower.error) return tl::unexpected(*thrower.error);
    }
    // What is owed with a bound is due while the rest of the run is silent.
    if (!mission::VirtualHost::ended(state)) thrower.advance(end);
    std::vector<bool> violated;
    for (std::size_t i = 0; i < plan.monitors.size(); ++i) violated.push_back(thrower.is_violated(i));
    if (sampling.told && !sampling.told(violated)) {
      ++made;
      break;
    }
  }
  return made;
}

}  // namespace sentree::verify
