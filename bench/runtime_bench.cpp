// What observing costs: a message from where it is published, through the run's order, to the monitors of the recharge
// mission; what recording adds to a call between processes and to a whole run; and what the machine makes of a pause.

#include <benchmark/benchmark.h>

#include <sys/resource.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <functional>
#include <iostream>
#include <limits>
#include <numeric>
#include <optional>
#include <thread>
#include <vector>

#include "sentree/base/rng.h"
#include "sentree/record/sink.h"
#include "sentree/replay/recording.h"
#include "sentree/rpc/client.h"
#include "sentree/rpc/server.h"
#include "sentree/runtime/monitors.h"
#include "sentree/runtime/run.h"
#include "sentree/runtime/stream.h"
#include "sentree/runtime/watchdog.h"

namespace {

using namespace sentree;
using namespace sentree::runtime;

project::Plan recharge() {
  auto scenario =
      project::load_scenario(std::string(SENTREE_SOURCE_DIR) + "/examples/recharge/scenarios/recharge.yaml");
  if (scenario.ok()) {
    auto plan = prepare(std::move(*scenario.value));
    if (plan.ok()) return std::move(*plan.value);
  }
  std::cerr << "examples/recharge cannot be loaded\n";
  std::exit(1);
}

// A run as a value, copied hot: what a fork costs. 0: the mission with its skills, calls and faults; 1: with the
// monitors; 2: with the simulated robot and its particle filter too.
void copy_run(benchmark::State& state) {
  const project::Plan plan = recharge();
  std::optional<mission::State> captured;
  RunOptions options;
  options.on_begin = [&](RunInside& inside) {
    inside.scheduler().at(inside.director(), TimePoint(std::chrono::milliseconds(60'001)), mission::Rank::kInjection,
                          [&] {
                            captured = inside.capture();
                            inside.end();
                          });
  };
  (void)Run(plan, std::move(options)).execute();
  if (state.range(0) < 2) captured->world.reset();
  if (state.range(0) < 1) captured->monitors = {};
  for (auto _ : state) {
    mission::State copy = *captured;
    benchmark::DoNotOptimize(copy);
  }
}
BENCHMARK(copy_run)->ArgName("parts")->Arg(0)->Arg(1)->Arg(2);

// Every message of a run, once.
std::vector<Message> recorded(const project::Plan& plan) {
  std::vector<Message> messages;
  RunOptions options;
  options.listeners.push_back([&](const Message& message) { messages.push_back(message); });
  (void)Run(plan, std::move(options)).execute();
  return messages;
}

double process_cpu_s() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + static_cast<double>(now.tv_nsec) * 1e-9;
}

// What observes a run in real time: its stream, and its monitors.
struct Observed {
  explicit Observed(const project::Plan& plan)
      : monitors(plan, *scheduler, stream, watchdog,
                 {.decided = [](const MonitorReport&) {}, .given_up = [](const std::string&) {}}) {
    stream.subscribe([this](const Message& message) { monitors.observe(message); });
  }
  std::unique_ptr<Scheduler> scheduler = make_real_scheduler();
  Stream stream{*scheduler};
  Watchdog watchdog{std::chrono::seconds(10)};
  Monitors monitors;
};

// A run of `kBursts` periods in which an actor has `kBurst` messages of a recharge run each, as a tick has them: 10,000
// a second. They are published, and the monitors of that run step; or they are only made. CPU time of all threads [s].
constexpr std::size_t kBurst = 24;
constexpr std::size_t kBursts = 210;
constexpr std::chrono::microseconds kBurstPeriod{2400};

double paced(const project::Plan& plan, const std::vector<Message>& messages, bool publish) {
  Observed observed(plan);
  auto& [scheduler, stream, watchdog, monitors] = observed;
  const ActorId publisher = scheduler->add_actor("publisher");
  monitors.start();
  std::size_t next = 0;
  std::size_t bursts = 0;
  std::function<void()> burst = [&] {
    for (std::size_t i = 0; i < kBurst; ++i) {
      Message message = messages[next];
      next = (next + 1) % messages.size();
      if (publish)
        stream.publish(std::move(message));
      else
        benchmark::DoNotOptimize(message);
    }
    if (++bursts == kBursts)
      scheduler->stop();
    else
      scheduler->at(publisher, TimePoint(kBurstPeriod * bursts), mission::Rank::kTick, burst);
  };
  scheduler->at(publisher, TimePoint{}, mission::Rank::kTick, burst);
  const double begin = process_cpu_s();
  (void)scheduler->run();
  monitors.finish(scheduler->now());
  return process_cpu_s() - begin;
}

// CPU of all threads for one observation, from where it is published to the monitors that have seen it, in a run with
// 10,000 a second: what publishing adds to the same run without, by the quickest of each kind, in turn.
void observation(benchmark::State& state) {
  const project::Plan plan = recharge();
  const std::vector<Message> messages = recorded(plan);
  double best[2] = {1e9, 1e9};
  for (auto _ : state) {
    for (const bool publish : {false, true}) best[publish] = std::min(best[publish], paced(plan, messages, publish));
  }
  state.counters["each_ns"] = 1e9 * (best[1] - best[0]) / static_cast<double>(kBurst * kBursts);
  state.counters["idle_ns"] = 1e9 * best[0] / static_cast<double>(kBurst * kBursts);
}
BENCHMARK(observation)->Unit(benchmark::kMillisecond)->Iterations(10);

double thread_cpu_s() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + static_cast<double>(now.tv_nsec) * 1e-9;
}

long thread_faults() {
  rusage used{};
  getrusage(RUSAGE_THREAD, &used);
  return used.ru_minflt;
}

// The recharge mission in virtual time, with and without a recording in turn, so that both meet the same machine.
// Counters: nanoseconds of CPU that the run's thread spends on an observation, by the quickest run of each kind, and
// what recording adds to it in percent; "wall%" is the same for the time that passes until the recording is closed.
void recording(benchmark::State& state) {
  const project::Plan plan = recharge();
  struct Best {
    double thread = 1e9;
    double wall = 1e9;
    long faults = std::numeric_limits<long>::max();
  };
  Best best[2];
  std::uint64_t observations = 1;
  for (auto _ : state) {
    for (const bool recorded : {false, true}) {
      double begin = 0;
      double end = 0;
      long faults = 0;
      RunOptions options;
      options.listeners.push_back([&](const Message& message) {
        if (message.sequence != 1) return;
        faults = thread_faults();
        begin = thread_cpu_s();
      });
      std::optional<replay::RunRecorder> recorder;
      if (recorded) {
        recorder.emplace(plan, std::vector<text::ReadFile>{}, std::make_unique<record::NullSink>(),
                         replay::RecordingOptions{});
        recorder->install(options);
      }
      // The mission's end is the last thing that the run's thread does.
      options.listeners.push_back([&](const Message& message) {
        if (message.name != "mission.status") return;
        end = thread_cpu_s();
        faults = thread_faults() - faults;
      });
      const auto start = std::chrono::steady_clock::now();
      const RunReport report = Run(plan, std::move(options)).execute();
      if (recorder) (void)recorder->finish(report);
      const std::chrono::duration<double> wall = std::chrono::steady_clock::now() - start;
      observations = report.observations;
      best[recorded].thread = std::min(best[recorded].thread, end - begin);
      best[recorded].wall = std::min(best[recorded].wall, wall.count());
      best[recorded].faults = std::min(best[recorded].faults, faults);
    }
  }
  const double each = 1e9 / static_cast<double>(observations);
  state.counters["plain_ns"] = best[0].thread * each;
  state.counters["recorded_ns"] = best[1].thread * each;
  state.counters["thread%"] = 100 * (best[1].thread / best[0].thread - 1);
  state.counters["faults"] = static_cast<double>(best[1].faults - best[0].faults);
  state.counters["observations"] = static_cast<double>(observations);
  state.counters["wall%"] = 100 * (best[1].wall / best[0].wall - 1);
}
BENCHMARK(recording)->Unit(benchmark::kMillisecond)->Iterations(30);

// Publishes what a run publishes of a call.
void publish(Stream& stream, MessageKind kind, const char* what, std::uint64_t call, Map data) {
  Message message;
  message.kind = kind;
  message.source = "leaf";
  message.target = "battery";
  message.name = std::string("battery.getBatteryState") + what;
  message.call = call;
  message.data = std::move(data);
  stream.publish(std::move(message));
}

constexpr int kCalls = 5000;

// Calls over a Unix socket, observed by the run's monitors, and recorded or not. The median call [s].
double median_call(const project::Plan& plan, const Value& state, bool recorded) {
  Observed observed(plan);
  auto& [scheduler, stream, watchdog, monitors] = observed;
  std::optional<replay::RunRecorder> recorder;
  if (recorded) {
    RunOptions options;
    recorder.emplace(plan, std::vector<text::ReadFile>{}, std::make_unique<record::NullSink>(),
                     replay::RecordingOptions{});
    recorder->install(options);
    for (auto& listener : options.listeners) stream.subscribe(std::move(listener));
  }
  const project::ServicePlan& battery = plan.services.at("battery");
  const idl::Method& method = *battery.service->find("getBatteryState");
  const auto address = *rpc::Address::parse("unix:/tmp/sentree-bench-" + std::to_string(::getpid()));
  const auto server = rpc::Server::start(
      address,
      {{"battery", std::make_shared<rpc::FunctionService>(
                       battery.service, [&](const idl::Method&, const Value&) -> rpc::Outcome { return state; })}});
  const auto client = rpc::Client::remote(address, battery.service, {.target = "battery"});
  monitors.start();
  std::thread running([&] { (void)scheduler->run(); });
  std::vector<double> times;
  for (std::uint64_t call = 1; call <= kCalls; ++call) {
    const auto begin = std::chrono::steady_clock::now();
    publish(stream, MessageKind::kRequest, ".request", call, Map{{"args", Map()}});
    const rpc::Outcome outcome = (*client)->call(method, Map(), begin + std::chrono::seconds(1));
    if (!outcome) std::abort();
    publish(stream, MessageKind::kReply, ".reply", call, Map{{"args", Map()}, {"result", *outcome}});
    times.push_back(std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());
  }
  scheduler->stop();
  running.join();
  monitors.finish(scheduler->now());
  if (recorder) (void)recorder->finish(RunReport{});
  std::nth_element(times.begin(), times.begin() + kCalls / 2, times.end());
  return times[kCalls / 2];
}

// What recording adds to an observed call between two processes, by the quickest of each kind, in turn.
void recorded_call(benchmark::State& state) {
  const project::Plan plan = recharge();
  const std::vector<Message> messages = recorded(plan);
  const auto reply =
      std::ranges::find_if(messages, [](const Message& m) { return m.name == "battery.getBatteryState.reply"; });
  const Value battery = *reply->data.find("result");
  double best[2] = {1e9, 1e9};
  for (auto _ : state) {
    for (const bool is_recorded : {false, true})
      best[is_recorded] = std::min(best[is_recorded], median_call(plan, battery, is_recorded));
  }
  state.counters["observed_us"] = 1e6 * best[0];
  state.counters["recorded_us"] = 1e6 * best[1];
  state.counters["added%"] = 100 * (best[1] / best[0] - 1);
}
BENCHMARK(recorded_call)->Unit(benchmark::kMillisecond)->Iterations(15);

// What the machine itself makes of a pause: reading 128 KiB, about what a tick touches, line by line after milliseconds
// of rest, and at once again. The median nanoseconds for a line.
void rest(benchmark::State& state) {
  constexpr std::size_t kLines = 2048;
  struct alignas(64) Line {
    const Line* next = nullptr;
  };
  std::vector<std::size_t> order(kLines);
  std::iota(order.begin(), order.end(), std::size_t{0});
  Rng rng(1);
  for (std::size_t i = kLines - 1; i > 0; --i) std::swap(order[i], order[rng.next() % (i + 1)]);
  std::vector<Line> lines(kLines);
  for (std::size_t i = 0; i < kLines; ++i) lines[order[i]].next = &lines[order[(i + 1) % kLines]];
  const auto read = [&] {
    const auto begin = std::chrono::steady_clock::now();
    const Line* line = lines.data();
    for (std::size_t i = 0; i < kLines; ++i) line = line->next;
    benchmark::DoNotOptimize(line);
    return std::chrono::duration<double, std::nano>(std::chrono::steady_clock::now() - begin).count() / kLines;
  };
  std::vector<double> rested;
  std::vector<double> again;
  for (auto _ : state) {
    std::this_thread::sleep_for(std::chrono::milliseconds(state.range(0)));
    rested.push_back(read());
    again.push_back(read());
  }
  const auto median = [](std::vector<double>& times) {
    std::ranges::nth_element(times, times.begin() + static_cast<std::ptrdiff_t>(times.size() / 2));
    return times[times.size() / 2];
  };
  state.counters["rested_ns"] = median(rested);
  state.counters["again_ns"] = median(again);
}
BENCHMARK(rest)->ArgName("ms")->Arg(2)->Arg(10)->Arg(100)->Iterations(50);

}  // namespace

BENCHMARK_MAIN();
