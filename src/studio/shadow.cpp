#include "sentree/studio/detail/shadow.h"

#include <fmt/format.h>

#include <algorithm>

#include "sentree/record/sink.h"
#include "sentree/replay/recording.h"
#include "sentree/studio/detail/record_queue.h"

namespace sentree::studio {

Result<void> runs_here(const project::Plan& plan) {
  const auto is_elsewhere = [](const auto& part) { return !part.at.empty(); };
  if (!plan.scenario.processes.empty() || std::any_of(plan.leaves.begin(), plan.leaves.end(), is_elsewhere) ||
      std::any_of(plan.observers.begin(), plan.observers.end(), is_elsewhere))
    return fail("shadow.elsewhere", "the scenario has parts in processes of their own; choose another one");
  for (const auto& [name, service] : plan.services) {
    if (!project::is_inside(service.at))
      return fail("shadow.elsewhere", fmt::format("service \"{}\" is at {}, which is not run again", name, service.at));
  }
  return {};
}

Result<std::shared_ptr<const Shadow>> Shadow::run(project::Plan plan, const std::atomic<bool>& stop) {
  if (auto here = runs_here(plan); !here) return tl::unexpected(here.error());
  plan.scenario.virtual_time = true;
  auto shadow = std::make_shared<Shadow>(std::move(plan));
  {
    RecordQueue queue(shadow->history);
    runtime::RunOptions options;
    runtime::Run* running = nullptr;
    std::size_t observations = 0;
    options.listeners.push_back([&](const Message& message) {
      shadow->behaviour.observe(message);
      if (++observations < kShadowObservationsMax && !stop) return;
      shadow->whole = false;
      running->interrupt();
    });
    replay::RecordingOptions recording;
    recording.compression = record::Compression::kNone;
    recording.tap = [&](TimePoint time, record::RunRecord record) { queue.put(time, std::move(record)); };
    replay::RunRecorder recorder(shadow->plan, {}, std::make_unique<record::NullSink>(), std::move(recording));
    recorder.install(options);
    campaign::CoverageWatch watch(shadow->plan, shadow->coverage, options);
    runtime::Run run(shadow->plan, std::move(options));
    running = &run;
    shadow->report = run.execute();
    recorder.finish(shadow->report);
    watch.finish(shadow->report);
    queue.drain();
  }
  if (!shadow->report.error.empty()) return fail("shadow.run", shadow->report.error);
  return shadow;
}

}  // namespace sentree::studio
