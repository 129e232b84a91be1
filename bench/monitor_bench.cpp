// Speed of monitors: recordings of a million observations in memory, evaluated by the very functions that watch runs.
#include <benchmark/benchmark.h>

#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "sentree/base/rng.h"
#include "sentree/monitor/monitor_set.h"
#include "sentree/monitor/requirement.h"

namespace {

using namespace sentree;

constexpr const char* kDefinitions =
    "let level = reply(battery.getBatteryState).percentage * 100\n"
    "let destination = request(navigation.gotoTargetByLocationName).name\n";
constexpr const char* kAlways = "always level >= 20";
constexpr const char* kResponse =
    "whenever level < 30 and destination = kitchen, destination = station within 10 ticks";
constexpr const char* kTimed = "whenever level < 30, level >= 30 within 10 s";

// As the reply of the simulated battery.
Message reading(double ratio) {
  Message m;
  m.kind = MessageKind::kReply;
  m.source = "BatteryLevelAbove30";
  m.target = "battery";
  m.name = "battery.getBatteryState.reply";
  m.call = 7;
  m.data = Map{{"args", Map()},
               {"result", Map{{"header", Map{{"stamp", 12.5}, {"frame_id", "map"}}},
                              {"voltage", 24.1},
                              {"current", -1.5},
                              {"percentage", ratio},
                              {"temperature", 25.0},
                              {"power_supply_status", "DISCHARGING"},
                              {"warning", "NONE"},
                              {"present", true}}}};
  return m;
}

Message going(const char* place) {
  Message m;
  m.kind = MessageKind::kRequest;
  m.source = "GoTo";
  m.target = "navigation";
  m.name = "navigation.gotoTargetByLocationName.request";
  m.data = Map{{"args", Map{{"name", place}}}};
  return m;
}

Message tick(std::int64_t number) {
  Message m;
  m.source = "mission";
  m.name = "mission.tick";
  m.data = Map{{"tick", number}};
  return m;
}

// Readings, ticks and goals; nothing is violated.
const std::vector<Message>& recording() {
  static const std::vector<Message> kAll = [] {
    std::vector<Message> all;
    Rng rng(1);
    constexpr std::size_t kSize = 1'000'000;
    all.reserve(kSize);
    for (std::size_t i = 0; i < kSize; ++i) {
      const auto kind = i % 10;
      all.push_back(kind == 0   ? tick(static_cast<std::int64_t>(i / 10))
                    : kind == 5 ? going(i % 20 == 5 ? "kitchen" : "station")
                                : reading(0.21 + 0.7 * rng.uniform()));
      all.back().time = TimePoint(std::chrono::milliseconds(i * 10));
      all.back().sequence = i + 1;
    }
    return all;
  }();
  return kAll;
}

monitor::Model model(const std::string& body, const std::string& name = "R") {
  const auto file = monitor::parse_requirements(kDefinitions + name + ": " + body + ".", "bench.req");
  if (!file.ok()) {
    std::fprintf(stderr, "%s\n", to_string(file.diagnostics.front()).c_str());
    std::exit(1);
  }
  return *monitor::Model::make(file.value->requirements.front()).value;
}

void run(benchmark::State& state, const std::vector<monitor::Model>& models, std::size_t expected_decisions) {
  const std::vector<Message>& all = recording();
  for (auto _ : state) {
    const auto decided = monitor::evaluate(models, all, TimePoint{}, all.back().time);
    if (decided.size() != expected_decisions) state.SkipWithError("a verdict is not as expected");
  }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(all.size()));
}

// Monitors of which none listens to what is recorded.
std::vector<monitor::Model> with_idle(std::size_t idle) {
  std::vector<monitor::Model> models{model(kAlways)};
  for (std::size_t i = 0; i < idle; ++i) {
    const std::string n = std::to_string(i);
    models.push_back(model("never event(other" + n + ".method.request)", "Idle" + n));
  }
  return models;
}

}  // namespace

int main(int argc, char** argv) {
  const auto bench = [](const char* name, std::vector<monitor::Model> models) {
    benchmark::RegisterBenchmark(name, [models = std::move(models)](benchmark::State& s) {
      run(s, models, 0);
    })->Unit(benchmark::kMillisecond);
  };
  bench("always_level_at_least_20", {model(kAlways)});
  bench("response_within_10_ticks", {model(kResponse)});
  bench("response_within_10_s", {model(kTimed)});
  bench("always_with_0_idle", with_idle(0));
  bench("always_with_99_idle", with_idle(99));
  benchmark::Initialize(&argc, argv);
  benchmark::RunSpecifiedBenchmarks();
}
