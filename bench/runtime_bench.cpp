// What observing costs: a message from where it is published, through the run's order, to the monitors of the recharge
// mission.

#include <benchmark/benchmark.h>

#include <atomic>
#include <cstdlib>
#include <iostream>
#include <thread>
#include <vector>

#include "sentree/monitor/monitor.h"
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

}  // namespace

BENCHMARK_MAIN();
