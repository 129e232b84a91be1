#include "sentree/verify/statistics.h"

#include <algorithm>
#include <memory>
#include <optional>
#include <utility>

#include "sentree/base/rng.h"
#include "sentree/mission/encode.h"
#include "sentree/mission/virtual_host.h"
#include "sentree/verify/detail/period.h"
#include "sentree/verify/walk.h"

namespace sentree::verify {

namespace {

// Runs that one worker makes before all are told of.
constexpr std::uint64_t kBlockMax = 256;

// Where the mission ends, what has no bound never comes.
void note_end(Came& came, bool of_the_mission, bool owes, bool is_open) {
  if (came != Came::kKept) return;
  if (of_the_mission)
    came = owes ? Came::kViolated : Came::kKept;
  else if (is_open)
    came = Came::kStillOwed;
}

// One run that is executed: its die, its gates and its monitors.
class Thrower final : public mission::Surroundings {
 public:
  Thrower(const project::Plan& plan, Order order, Rng rng)
      : of_run(plan.monitors.size()),
        plan_(plan),
        order_(order),
        rng_(rng),
        gates_(plan),
        monitors_(plan.monitors, TimePoint{}) {}

  void observed(const Message& message) override {
    gates_.observed(message, message.time);
    if (message.time >= end_) return;
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

  // What comes from then on is not judged.
  void end_at(TimePoint end) { end_ = end; }

  // Nothing follows.
  void end(bool of_the_mission, Duration length) {
    for (std::size_t i = 0; i < of_run.size(); ++i) {
      const monitor::Model& model = plan_.monitors[i];
      note_end(of_run[i], of_the_mission, owes_without_bound(model, monitors_.state(i)),
               is_to_come(model, monitors_.state(i)) && leaves_open(model, length, plan_.scenario.project.period));
    }
  }

  std::vector<Came> of_run;
  std::optional<Diagnostic> error;

 private:
  void note() {
    for (const auto& [monitor, decision, leaf] : decided_) {
      if (decision.verdict == monitor::Verdict::kViolated) of_run[monitor] = Came::kViolated;
    }
  }

  const project::Plan& plan_;
  Order order_;
  Rng rng_;
  TimePoint end_ = kNever;
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

  Result<std::vector<Came>> operator()(std::uint64_t number) {
    const TimePoint end = TimePoint{} + sampling_.length;
    Thrower thrower(plan_, sampling_.order, rng_of(sampling_.seed, number));
    mission::State state = host_.begin();
    bool is_last = false;
    while (!is_last && !mission::VirtualHost::ended(state)) {
      // Of the period in which the run ends all comes that is before its end.
      is_last = !state.tree.over && state.tree.planned >= end;
      if (is_last) thrower.end_at(end);
      const auto done = period(host_, state, thrower, [] { return Result<void>(); });
      if (!done) return tl::unexpected(done.error());
      if (thrower.error) return tl::unexpected(*thrower.error);
      // What has no effect any more needs no throw of the die.
      mission::prune(state);
    }
    // What would come at its very end is not known any more.
    const bool ended = mission::VirtualHost::ended(state) && (!is_last || state.now < end);
    thrower.advance(ended ? mission::judged_until(state.now, bt::is_completed(state.tree.root)) : end - Duration(1));
    thrower.end(ended, sampling_.length);
    return std::move(thrower.of_run);
  }

 private:
  const project::Plan& plan_;
  const Sampling& sampling_;
  mission::VirtualHost host_;
};

// Walks through what is known, and executes a period where that ends.
class Walked {
 public:
  Walked(const project::Plan& plan, const Sampling& sampling) : sampling_(sampling), walk_(plan, sampling.order) {
    for (const monitor::Model& model : plan.monitors)
      leaves_open_.push_back(leaves_open(model, sampling.length, plan.scenario.project.period));
  }

  Result<std::vector<Came>> operator()(std::uint64_t number) {
    if (!begun_ || walk_.bytes() > sampling_.memory) {
      if (auto begun = walk_.begin(); !begun) return tl::unexpected(begun.error());
      begun_ = true;
    }
    Rng rng = rng_of(sampling_.seed, number);
    const TimePoint end = TimePoint{} + sampling_.length;
    std::vector<Came> of_run(walk_.monitors());
    std::size_t left = walk_.monitors();
    cores_.clear();
    for (std::size_t i = 0; i < walk_.monitors(); ++i) cores_.push_back(walk_.first(i));
    TimePoint now{};
    std::uint32_t at = 0;
    bool is_last = false;
    bool ended = false;
    for (std::uint64_t tick = 0; left > 0 && !is_last && !walk_.ended(at); ++tick) {
      // Of the period in which the run ends all comes that is before its end.
      is_last = walk_.is_at_end(at, now, end);
      if (tick % 1024 == 1023 && walk_.bytes() > sampling_.memory)
        return fail("verify.memory", "one run needs too much of it");
      const auto way = walk_.go_on(at, rng);
      if (!way) return tl::unexpected(way.error());
      const bool is_cut = is_last && now + way->took >= end;
      for (std::size_t i = 0; i < walk_.monitors(); ++i) {
        if (of_run[i] == Came::kViolated) continue;
        MonitorMemory& monitor = walk_.monitor(i);
        const auto* outcome = is_cut ? monitor.before(cores_[i], monitor.heard(way->seen), end - now)
                                     : monitor.after(cores_[i], monitor.heard(way->seen), way->judged);
        if (outcome == nullptr) return tl::unexpected(*monitor.error());
        cores_[i] = outcome->core;
        if (!outcome->violated) continue;
        of_run[i] = Came::kViolated;
        --left;
      }
      at = way->to;
      now += way->took;
      ended = !is_cut && walk_.ended(at);
    }
    for (std::size_t i = 0; i < walk_.monitors(); ++i) {
      if (of_run[i] == Came::kViolated) continue;
      const MonitorMemory::Kept& kept = walk_.monitor(i).kept(cores_[i]);
      note_end(of_run[i], ended, kept.owes, kept.to_come && leaves_open_[i]);
    }
    return of_run;
  }

 private:
  const Sampling& sampling_;
  Walk walk_;
  std::vector<bool> leaves_open_;  // by monitor
  bool begun_ = false;
  std::vector<std::uint32_t> cores_;
};

// Makes runs by their numbers, each the same whoever makes it.
class Sampler {
 public:
  Sampler(const project::Plan& plan, const Sampling& sampling) : plan_(plan), sampling_(sampling) {
    if (sampling.memory_of_periods) walked_.emplace(plan, sampling);
  }

  Result<std::vector<Came>> operator()(std::uint64_t number) {
    if (walked_) {
      auto of_run = (*walked_)(number);
      if (of_run) return of_run;
      // What has no canonical form, looks at the clock or has too many states can be executed all the same.
      walked_.reset();
    }
    if (!executed_) executed_.emplace(plan_, sampling_);
    return (*executed_)(number);
  }

 private:
  const project::Plan& plan_;
  const Sampling& sampling_;
  std::optional<Walked> walked_;
  std::optional<Executed> executed_;
};

}  // namespace

Result<std::uint64_t> sample(const project::Plan& plan, const Sampling& sampling) {
  const std::size_t workers = std::max<std::size_t>(1, sampling.each ? sampling.workers : 1);
  std::vector<std::unique_ptr<Sampler>> samplers;
  for (std::size_t i = 0; i < workers; ++i) samplers.push_back(std::make_unique<Sampler>(plan, sampling));
  std::uint64_t made = 0;
  // Blocks of runs, told of in the order of their numbers: what comes out does not depend on who made which. The first
  // ones are short, since few may be enough.
  std::uint64_t size = workers;
  std::vector<std::optional<Result<std::vector<Came>>>> block;
  while (made < sampling.runs) {
    block.assign(std::min(size, sampling.runs - made), std::nullopt);
    for_each(sampling.each, workers, [&](std::size_t worker) {
      for (std::size_t i = worker; i < block.size(); i += workers) {
        if (sampling.interrupted && sampling.interrupted()) return;
        block[i] = (*samplers[worker])(made + i);
      }
    });
    for (const auto& of_run : block) {
      if (!of_run) return made;
      if (!*of_run) return tl::unexpected(of_run->error());
      ++made;
      if (sampling.told && !sampling.told(**of_run)) return made;
    }
    size = std::min(2 * size, workers * kBlockMax);
  }
  return made;
}

}  // namespace sentree::verify
