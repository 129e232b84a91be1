// What observing costs: a message from where it is published, through the run's order, to the monitors of the recharge
// mission; and what recording adds to a run.

#include <benchmark/benchmark.h>

#include <time.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdlib>
#include <iostream>
#include <optional>
#include <thread>
#include <vector>

#include "sentree/monitor/monitor.h"
#include "sentree/runtime/recording.h"
#include "sentree/runtime/run.h"
#include "sentree/runtime/stream.h"

namespace {

using namespace sentree;
using namespace sentree::runtime;

Plan recharge() {
  auto scenario = load_scenario(std::string(SENTREE_SOURCE_DIR) + "/examples/recharge/scenarios/recharge.yaml");
  if (scenario.ok()) {
    auto plan = prepare(std::move(*scenario.value));
    if (plan.ok()) return std::move(*plan.value);
  }
  std::cerr << "examples/recharge cannot be loaded\n";
  std::exit(1);
}

// Every message of a run, once.
std::vector<Message> recorded(const Plan& plan) {
  std::vector<Message> messages;
  RunOptions options;
  options.listeners.push_back([&](const Message& message) { messages.push_back(message); });
  (void)Run(plan, std::move(options)).execute();
  return messages;
}

// One iteration is one message; CPU is that of all threads: the publisher's and the observer's.
void observation(benchmark::State& state) {
  const Plan plan = recharge();
  const std::vector<Message> messages = recorded(plan);
  const auto scheduler = make_real_scheduler();
  Stream stream(*scheduler);
  std::vector<monitor::State> states;
  for (const monitor::Model& model : plan.monitors) states.push_back(monitor::start(model, TimePoint{}));
  std::atomic<std::uint64_t> seen = 0;
  stream.subscribe([&](const Message& message) {
    for (std::size_t i = 0; i < states.size(); ++i) (void)monitor::observe(plan.monitors[i], states[i], message);
    ++seen;
    seen.notify_one();
  });
  std::thread actors([&] { (void)scheduler->run(); });
  std::size_t next = 0;
  std::uint64_t published = 0;
  for (auto _ : state) {
    Message message = messages[next];
    next = (next + 1) % messages.size();
    stream.publish(std::move(message));
    ++published;
    // In bursts of a tick's messages, as they come; the observer is waited for, so that the queue stays short.
    if (published % 24 == 0) {
      for (std::uint64_t before = seen; before < published; before = seen) seen.wait(before);
    }
  }
  for (std::uint64_t before = seen; before < published; before = seen) seen.wait(before);
  scheduler->stop();
  actors.join();
  state.counters["messages/s"] = benchmark::Counter(static_cast<double>(published), benchmark::Counter::kIsRate);
}
BENCHMARK(observation)->MeasureProcessCPUTime()->UseRealTime();

class Discard final : public record::Sink {
 public:
  Result<void> write(std::string_view) override { return {}; }
};

double thread_cpu_s() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + static_cast<double>(now.tv_nsec) * 1e-9;
}

// The recharge mission in virtual time, with and without a recording in turn, so that both meet the same machine.
// Counters: nanoseconds of CPU that the run's thread spends on an observation, by the quickest run of each kind, and
// what recording adds to it in percent; "wall%" is the same for the time that passes until the recording is closed.
void recording(benchmark::State& state) {
  const Plan plan = recharge();
  struct Best {
    double thread = 1e9;
    double wall = 1e9;
  };
  Best best[2];
  std::uint64_t observations = 1;
  for (auto _ : state) {
    for (const bool recorded : {false, true}) {
      double begin = 0;
      double end = 0;
      RunOptions options;
      options.listeners.push_back([&](const Message& message) {
        if (message.sequence == 1) begin = thread_cpu_s();
      });
      std::optional<RunRecorder> recorder;
      if (recorded) {
        recorder.emplace(plan, std::vector<text::ReadFile>{}, std::make_unique<Discard>(), RecordingOptions{});
        recorder->install(options);
      }
      // The mission's end is the last thing that the run's thread does.
      options.listeners.push_back([&](const Message& message) {
        if (message.name == "mission.status") end = thread_cpu_s();
      });
      const auto start = std::chrono::steady_clock::now();
      const RunReport report = Run(plan, std::move(options)).execute();
      if (recorder) (void)recorder->finish(report);
      const std::chrono::duration<double> wall = std::chrono::steady_clock::now() - start;
      observations = report.observations;
      best[recorded].thread = std::min(best[recorded].thread, end - begin);
      best[recorded].wall = std::min(best[recorded].wall, wall.count());
    }
  }
  const double each = 1e9 / static_cast<double>(observations);
  state.counters["plain_ns"] = best[0].thread * each;
  state.counters["recorded_ns"] = best[1].thread * each;
  state.counters["thread%"] = 100 * (best[1].thread / best[0].thread - 1);
  state.counters["wall%"] = 100 * (best[1].wall / best[0].wall - 1);
}
BENCHMARK(recording)->Unit(benchmark::kMillisecond)->Iterations(30);

}  // namespace

BENCHMARK_MAIN();
