// In virtual time the replay of an unchanged project is the run itself, observation for observation: every example, and
// random missions.
//
// SENTREE_SEEDS=N replays N random missions instead of the usual ones, SENTREE_SEED=S only that of seed S.

#include <gtest/gtest.h>

#include <algorithm>
#include <iostream>

#include "sentree/base/detail/test_seeds.h"
#include "sentree/base/temporary_folder.h"
#include "sentree/mission/detail/test_random_mission.h"
#include "sentree/replay/recording.h"
#include "sentree/replay/replay.h"

namespace sentree::replay {
namespace {

namespace fs = std::filesystem;
using std::chrono::seconds;

constexpr std::uint64_t kSeeds = 40;

Loaded<project::Scenario> load(const fs::path& file) {
  if (file.filename() != "sentree.yaml") return project::load_scenario(file);
  auto project = project::load_project(file);
  Loaded<project::Scenario> loaded{.value = {}, .diagnostics = std::move(project.diagnostics)};
  if (project.value) loaded.value = project::plain_scenario(std::move(*project.value));
  return loaded;
}

// Records what a scenario, or a project as it is, does in virtual time, and replays it.
class Unchanged {
 public:
  // What is different; empty: nothing.
  std::string judge(const fs::path& file, Duration limit) {
    const std::string recording = (folder_.path() / "run.mcap").string();
    then_.clear();
    now_.clear();
    if (!record(file, recording, limit)) return "";
    auto recorded = RecordedRun::open(recording);
    if (!recorded) return to_string(recorded.error());
    auto scenario = recorded->scenario();
    if (!scenario.ok()) return to_string(scenario.diagnostics.front());
    scenario.value->virtual_time = false;  // as `sentree replay` has it
    auto plan = project::prepare(std::move(*scenario.value));
    if (!plan.ok()) return to_string(plan.diagnostics.front());
    ReplayOptions options;
    options.run.listeners.push_back([this](const Message& message) { now_.push_back(message); });
    const auto report = replay(*recorded, std::move(*plan.value), std::move(options));
    if (!report) return to_string(report.error());
    return compare(*recorded, *report);
  }

  // Of all that were judged.
  std::uint64_t observations() const { return observations_; }
  std::uint64_t runs() const { return runs_; }

 private:
  // False: it does not run in virtual time.
  bool record(const fs::path& file, const std::string& recording, Duration limit) {
    const text::ReadLog log;
    auto scenario = load(file);
    if (!scenario.ok()) return false;
    scenario.value->virtual_time = true;
    scenario.value->duration = std::min(scenario.value->duration, limit);
    const auto plan = project::prepare(std::move(*scenario.value));
    if (!plan.ok()) return false;
    runtime::RunOptions options;
    options.listeners.push_back([this](const Message& message) { then_.push_back(message); });
    RunRecorder recorder(*plan.value, log.files(), std::move(*record::FileSink::create(recording)), {});
    recorder.install(options);
    runtime::Run run(*plan.value, std::move(options));
    const runtime::RunReport report = run.execute();
    recorder.finish(report);
    if (!report.error.empty()) return false;
    ++runs_;
    observations_ += then_.size();
    return true;
  }

  std::string compare(RecordedRun& recorded, const ReplayReport& report) const {
    if (!report.differences.empty()) {
      const Difference& d = report.differences.front();
      return std::to_string(sentree::seconds(d.time)) + " s " + d.who + ": " + d.recorded + "; now: " + d.replayed;
    }
    if (!report.unrecorded.empty()) return report.unrecorded + ", which was not recorded";
    const auto [then, now] = std::mismatch(then_.begin(), then_.end(), now_.begin(), now_.end());
    if (then != then_.end() || now != now_.end()) {
      return "recorded: " + (then != then_.end() ? to_json(*then) : "nothing more") +
             "; now: " + (now != now_.end() ? to_json(*now) : "nothing more");
    }
    if (report.answered_requests != report.recorded_requests) return "not every request was made again";
    for (const runtime::MonitorReport& monitor : report.run.monitors) {
      const std::string verdict = "\"" + monitor.name + "\":\"" + std::string(to_string(monitor.verdict)) + "\"";
      if (recorded.fact("verdicts").find(verdict) == std::string::npos) return "another verdict: " + verdict;
    }
    return "";
  }

  const TemporaryFolder folder_{"unchanged"};
  std::vector<Message> then_;
  std::vector<Message> now_;
  std::uint64_t observations_ = 0;
  std::uint64_t runs_ = 0;
};

// Its scenarios, or else the project as it is.
std::vector<fs::path> scenarios_of(const fs::path& project) {
  std::vector<fs::path> files;
  std::error_code none;
  for (const auto& entry : fs::directory_iterator(project / "scenarios", none)) files.push_back(entry.path());
  if (files.empty()) files.push_back(project / "sentree.yaml");
  std::sort(files.begin(), files.end());
  return files;
}

class Examples : public ::testing::TestWithParam<const char*> {};

TEST_P(Examples, AreReplayedToTheLastObservation) {
  Unchanged unchanged;
  const fs::path project = fs::path(SENTREE_SOURCE_DIR) / "examples" / GetParam();
  for (const fs::path& file : scenarios_of(project)) EXPECT_EQ(unchanged.judge(file, seconds(20)), "") << file;
  EXPECT_GT(unchanged.runs(), 0);
}
INSTANTIATE_TEST_SUITE_P(, Examples,
                         ::testing::Values("grasp", "guard", "handover", "minimal", "modelled", "pick-and-place",
                                           "porter", "recharge", "telemetry", "topics", "two-robots", "warehouse"),
                         [](const auto& example) {
                           std::string name = example.param;
                           std::replace(name.begin(), name.end(), '-', '_');
                           return name;
                         });

TEST(Unchanged, FaultsOnCallsOfModelsAndOfTheSimulatorAreWhereTheyWere) {
  const TemporaryFolder folder("faults");
  Unchanged unchanged;
  for (const auto& [project, timeline] : {std::pair("warehouse", R"(
  - {at: 200 ms, delay: {message: "station.*", by: 200 ms, count: 4}}
  - {at: 400 ms, delay: {message: "fleet.*.reply", by: 400 ms, count: 3}}
  - {at: 1200 ms, late: "station.*"}
  - {at: 2400 ms, clear: 3}
  - {at: 3 s, unreachable: "fleet.*"}
  - {at: 4 s, clear: 4}
  - {at: 5 s, kill: station}
  - {at: 6 s, restart: station}
)"),
                                          std::pair("recharge", R"(
  - {at: 1 s, delay: {message: "*.tick", by: 100 ms, count: 20}}
  - {at: 1 s, delay: {message: "battery.*", by: 100 ms, count: 9}}
  - {at: 2 s, delay: {message: "battery.getBatteryState.reply", by: 300 ms, count: 7}}
  - {at: 4 s, late: "battery.*"}
  - {at: 7 s, clear: 4}
  - {at: 8 s, unreachable: "navigation.*"}
  - {at: 9 s, clear: 5}
  - {at: 10 s, falsify: {call: battery.getBatteryState, path: percentage, value: 0.1, count: 5}}
)"),
                                          std::pair("telemetry", R"(
  - {at: 1 s, delay: {message: "robot.*", by: 700 ms, count: 5}}
)"),
                                          std::pair("topics", R"(
  - {at: 1 s, delay: {message: "battery.*", by: 700 ms}}
  - {at: 2 s, call: battery.state, args: {percentage: 40, charging: true}}
)")}) {
    const fs::path copy = folder.path() / project;
    fs::copy(fs::path(SENTREE_SOURCE_DIR) / "examples" / project, copy, fs::copy_options::recursive);
    const fs::path file = copy / "scenarios" / "faults.yaml";
    const std::string text = std::string("override: {mission: {repeat: true}}\ntimeline:") + timeline;
    ASSERT_TRUE(text::write_file(file, text).has_value());
    const auto loaded = project::load_scenario(file);
    ASSERT_TRUE(loaded.ok()) << project << ": " << to_string(loaded.diagnostics.front());
    EXPECT_EQ(unchanged.judge(file, seconds(20)), "") << project;
  }
  EXPECT_EQ(unchanged.runs(), 4);
}

TEST(Unchanged, RandomMissionsAreReplayedToTheLastObservation) {
  const TemporaryFolder folder("random");
  const mission::RandomProject project(folder.path() / "p");
  Unchanged unchanged;
  for (const std::uint64_t seed : seeds(kSeeds)) {
    const auto file = project.write(mission::MissionGenerator(seed).make());
    ASSERT_TRUE(file.has_value());
    EXPECT_EQ(unchanged.judge(*file, seconds(40)), "") << "seed " << seed;
  }
  std::cout << unchanged.runs() << " missions, " << unchanged.observations() << " observations\n";
  EXPECT_GT(unchanged.runs(), seeds(kSeeds).size() / 2);  // the others are refused
}

}  // namespace
}  // namespace sentree::replay
