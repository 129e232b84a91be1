#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "sentree/base/result.h"
#include "sentree/base/time.h"
#include "sentree/mission/instant.h"
#include "sentree/project/intervention.h"
#include "sentree/project/plan.h"

namespace sentree::verify {

/// Deliveries in one period, at all its instants together.
inline constexpr std::size_t kDeliveriesMax = 1'000'000;

/// Who gets a delivery: "robot (models/robot.scxml)".
[[nodiscard]] std::string recipient(const project::Plan& plan, const mission::Delivery& what);

/// Deliveries after which it is looked whether to go on.
inline constexpr std::size_t kLooksOften = 256;

/// The number that an entry of the timeline has, if it stands from then on, in a run of the scenario alone.
[[nodiscard]] inline std::uint64_t number_of(const project::Scenario& scenario,
                                             std::vector<project::Injection>::const_iterator entry) {
  const auto before = std::count_if(scenario.timeline.begin(), entry,
                                    [](const project::Injection& one) { return project::stands(one.what); });
  return scenario.delays.size() + static_cast<std::uint64_t>(before) + 1;
}

/// Executes one period of a run: everything up to and including the next planned tick, the timeline of the scenario
/// among it.
/// @param host         `mission::VirtualHost` or `mission::PartMemory`, with a run of it.
///                     What a run would only note of its timeline is told to `outside` as a problem.
/// @param before_tick  Called when that tick is the next thing, but for injections: `Result<void>()`.
/// @param on_the_way   Called every now and then, likewise.
/// @return  Deliveries executed. Errors: verify.endless, verify.fault, those of `before_tick` and
///          `on_the_way`.
template <class Host, class Run, class Outside, class BeforeTick, class OnTheWay>
[[nodiscard]] Result<std::size_t> period(Host& host, Run& run, Outside& outside, const BeforeTick& before_tick,
                                         const OnTheWay& on_the_way) {
  const bool ticks = !host.over(run);
  const TimePoint until = ticks ? host.planned(run) : run.now + host.plan().scenario.project.period;
  const auto& timeline = host.plan().scenario.timeline;
  auto injection = std::find_if(timeline.begin(), timeline.end(), [&](const project::Injection& i) {
    return i.at > run.now || (!run.begun && i.at == run.now);
  });
  run.begun = true;
  bool asked = !ticks;
  std::size_t delivered = 0;
  mission::Instant instant(host.plan().leaves.size() + host.plan().models.size() + 1);
  while (!host.ended(run)) {
    const TimePoint next = host.next(run);
    if (injection != timeline.end() && injection->at <= until && injection->at <= next) {
      run.now = std::max(run.now, injection->at);
      const std::uint64_t number = number_of(host.plan().scenario, injection);
      if (auto done = host.inject(run, injection->what, outside, number); !done) {
        if (done.error().code == "verify.fault") {
          Diagnostic error = done.error();
          error.span = injection->span;
          return tl::unexpected(std::move(error));
        }
        outside.problem(to_string(injection->span) + ": " + done.error().message);
      }
      ++injection;
      continue;
    }
    if (!asked && next >= until) {
      asked = true;
      run.now = std::max(run.now, until);
      if (auto done = before_tick(); !done) return tl::unexpected(done.error());
      continue;
    }
    if (next == kNever || next > until) break;
    if (++delivered > kDeliveriesMax) {
      return fail("verify.endless",
                  "more than " + std::to_string(kDeliveriesMax) + " messages between two ticks, the last for " +
                      recipient(host.plan(), host.front(run)) + "; let timers be longer, or the mission's rate higher");
    }
    if (delivered % kLooksOften == 0) {
      if (auto goes_on = on_the_way(); !goes_on) return tl::unexpected(goes_on.error());
    }
    if (next != run.now) instant.begin();
    if (!instant.admits(run.queue.size())) return fail("verify.endless", instant.why());
    if (instant.listens()) instant.tell(recipient(host.plan(), host.front(run)), host.front(run));
    host.step(run, outside);
  }
  if (!ticks && !host.ended(run)) run.now = until;
  return delivered;
}

template <class Host, class Run, class Outside, class BeforeTick>
[[nodiscard]] Result<std::size_t> period(Host& host, Run& run, Outside& outside, const BeforeTick& before_tick) {
  return period(host, run, outside, before_tick, [] { return Result<void>(); });
}

}  // namespace sentree::verify
