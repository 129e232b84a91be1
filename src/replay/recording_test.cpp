#include "sentree/replay/recording.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "sentree/base/temporary_folder.h"
#include "sentree/monitor/monitor.h"
#include "sentree/record/observation.h"
#include "sentree/replay/recorded_run.h"
#include "sentree/scxml/session.h"
#include "sentree/sim/state.h"

namespace sentree::replay {
namespace {

namespace fs = std::filesystem;
using ::testing::Contains;
using ::testing::IsEmpty;
using ::testing::SizeIs;

struct Recorded {
  std::string file;
  runtime::RunReport report;
  std::vector<Message> observations;
};

const fs::path kRecordedProject = fs::path(SENTREE_SOURCE_DIR) / "examples/recharge";

// Runs a scenario in virtual time and records it.
Recorded record_file(const fs::path& scenario, Duration duration, runtime::RunOptions options = {}) {
  Recorded recorded;
  const text::ReadLog log;
  auto loaded = project::load_scenario(scenario);
  EXPECT_TRUE(loaded.ok());
  loaded.value->duration = duration;
  loaded.value->virtual_time = true;
  auto plan = prepare(std::move(*loaded.value));
  EXPECT_TRUE(plan.ok());
  options.listeners.push_back([&](const Message& message) { recorded.observations.push_back(message); });
  RunRecorder recorder(*plan.value, log.files(), std::make_unique<record::StringSink>(recorded.file), {});
  recorder.install(options);
  runtime::Run run(*plan.value, std::move(options));
  recorded.report = run.execute();
  recorder.finish(recorded.report);
  return recorded;
}

// One of the recharge example.
Recorded record_run(const std::string& scenario, Duration duration, runtime::RunOptions options = {}) {
  return record_file(kRecordedProject / "scenarios" / (scenario + ".yaml"), duration, std::move(options));
}

class Recording : public ::testing::Test {
 protected:
  RecordedRun open(const std::string& file) {
    const fs::path path = folder_.path() / "run.mcap";
    EXPECT_TRUE(text::write_file(path, file));
    auto run = RecordedRun::open(path.string());
    EXPECT_TRUE(run.has_value()) << to_string(run.error());
    return std::move(*run);
  }

  const TemporaryFolder folder_{"test"};
};

TEST_F(Recording, HoldsEveryObservationOfTheRun) {
  const Recorded recorded = record_run("experiment1", std::chrono::seconds(40));
  RecordedRun run = open(recorded.file);
  const auto messages = run.observations();
  ASSERT_TRUE(messages.has_value());
  ASSERT_EQ(messages->size(), recorded.observations.size());
  for (std::size_t i = 0; i < messages->size(); ++i) ASSERT_EQ((*messages)[i], recorded.observations[i]);
  EXPECT_THAT(run.reader().problems(), IsEmpty());
  EXPECT_EQ(run.ended(), recorded.report.ended);
  EXPECT_EQ(run.fact("mission"), "RUNNING");
  EXPECT_EQ(run.fact("scenario"), "experiment1");
}

TEST_F(Recording, IsTheSameBytesForTheSameSeedAndChangesNothing) {
  const Recorded first = record_run("experiment2", std::chrono::seconds(30));
  EXPECT_EQ(first.file, record_run("experiment2", std::chrono::seconds(30)).file);
  auto loaded = project::load_scenario(fs::path(SENTREE_SOURCE_DIR) / "examples/recharge/scenarios/experiment2.yaml");
  loaded.value->duration = std::chrono::seconds(30);
  const auto plan = prepare(std::move(*loaded.value));
  std::vector<Message> unrecorded;
  runtime::RunOptions options;
  options.listeners.push_back([&](const Message& message) { unrecorded.push_back(message); });
  (void)runtime::Run(*plan.value, std::move(options)).execute();
  EXPECT_EQ(unrecorded, first.observations);
}

// A violation of a requirement with its place, and a problem with one.
TEST_F(Recording, IsTheSameBytesHoweverItsProjectIsNamed) {
  for (const char* part : {"interfaces", "mission.xml", "monitors", "requirements", "scenarios", "sentree.yaml",
                           "skills", "world", "models"}) {
    if (fs::exists(kRecordedProject / part))
      fs::copy(kRecordedProject / part, folder_.path() / part, fs::copy_options::recursive);
  }
  const fs::path scenario = fs::path("scenarios") / "killed.yaml";
  ASSERT_TRUE(text::write_file(folder_.path() / scenario,
                               "override: {world: {battery: {initial: 10 %}}}\n"
                               "timeline:\n  - {at: 1 s, restart: GoToKitchen}\n"));
  const fs::path before = fs::current_path();
  const auto record = [&](const fs::path& in, const fs::path& project) {
    fs::current_path(in);
    Recorded recorded = record_file(project / scenario, std::chrono::seconds(5));
    fs::current_path(before);
    return recorded;
  };
  const Recorded absolute = record("/", folder_.path());
  EXPECT_THAT(absolute.report.problems, Contains(::testing::HasSubstr("has not been killed")));
  ASSERT_TRUE(absolute.report.monitors.back().explanation || absolute.report.any_violated());
  const fs::path above = folder_.path().parent_path();
  const fs::path name = folder_.path().filename();
  const fs::path below = folder_.path() / "skills";
  for (const auto& [in, project] :
       {std::pair(above, name), std::pair(above, "." / name / ""), std::pair(below, fs::path("..")),
        std::pair(folder_.path(), fs::path()), std::pair(folder_.path(), fs::path("."))})
    EXPECT_TRUE(record(in, project).file == absolute.file) << project << " in " << in;
}

TEST_F(Recording, HoldsAProjectThatRunsAgain) {
  const Recorded recorded = record_run("experiment1", std::chrono::seconds(25));
  RecordedRun run = open(recorded.file);
  auto scenario = run.scenario();
  ASSERT_TRUE(scenario.ok()) << to_string(scenario.diagnostics[0]);
  const auto plan = prepare(std::move(*scenario.value));
  ASSERT_TRUE(plan.ok()) << to_string(plan.diagnostics[0]);
  std::vector<Message> again;
  runtime::RunOptions options;
  options.listeners.push_back([&](const Message& message) { again.push_back(message); });
  (void)runtime::Run(*plan.value, std::move(options)).execute();
  EXPECT_EQ(again, recorded.observations);
}

TEST_F(Recording, HoldsSnapshotsOfTheWholeRun) {
  // What the run really was at ten seconds, before anything happens at that instant but what is injected.
  std::optional<mission::State> then;
  runtime::RunOptions options;
  options.on_begin = [&](runtime::RunInside& inside) {
    inside.scheduler().at(inside.director(), TimePoint(std::chrono::seconds(10)), mission::Rank::kInjection,
                          [&] { then = inside.capture(); });
  };
  const Recorded recorded = record_run("experiment1", std::chrono::seconds(12), std::move(options));
  RecordedRun run = open(recorded.file);
  const auto none = run.snapshot(TimePoint(std::chrono::seconds(4)));
  ASSERT_TRUE(none.has_value());
  EXPECT_FALSE(none->has_value());
  const auto snapshot = run.snapshot(TimePoint(std::chrono::milliseconds(14'900)));
  ASSERT_TRUE(snapshot.has_value() && snapshot->has_value());
  EXPECT_EQ((*snapshot)->time, TimePoint(std::chrono::seconds(10)));

  auto scenario = run.scenario();
  const auto plan = prepare(std::move(*scenario.value));
  auto state = mission::restore(*plan.value, (*snapshot)->state);
  ASSERT_TRUE(state.has_value()) << to_string(state.error());
  EXPECT_EQ(state->published, (*snapshot)->sequence);
  state->order = then->order;  // the recorder has tasks of its own
  EXPECT_EQ(state->queue.size(), then->queue.size());
  for (std::size_t i = 0; i < state->queue.size(); ++i) state->queue[i].order = then->queue[i].order;
  for (mission::State* each : {&*state, &*then}) {
    for (monitor::State& monitor : each->monitors.states) {
      if (monitor.trail.history->size() < kSnapshotTrailMax) continue;
      monitor.trail.history.reset();  // shortened in the snapshot
      monitor.trail.history_complete = false;
    }
  }
  EXPECT_TRUE(*state == *then);
  const auto world = mission::saved_world((*snapshot)->state);
  ASSERT_TRUE(world.has_value()) << to_string(world.error());
  const auto restored = sim::restore(*plan.value->world, *world);
  ASSERT_TRUE(restored.has_value()) << to_string(restored.error());
  EXPECT_EQ(*restored, *then->world);

  for (std::size_t i = 0; i < plan.value->monitors.size(); ++i) {
    // A monitor that sees every observation up to the snapshot comes to the saved session.
    const monitor::Model& model = plan.value->monitors[i];
    monitor::State seen = monitor::start(model, TimePoint{});
    for (const Message& message : recorded.observations) {
      if (message.sequence <= (*snapshot)->sequence) monitor::observe(model, seen, message);
    }
    EXPECT_EQ(state->monitors.states[i].verdict, seen.verdict);
    EXPECT_EQ(state->monitors.states[i].session.configuration(), seen.session.configuration());
  }
}

TEST_F(Recording, ShowsTreeChartsMonitorsAndRobot) {
  const Recorded recorded = record_run("experiment1", std::chrono::seconds(30));
  RecordedRun run = open(recorded.file);
  const auto last = [&](std::string_view topic) {
    std::string text;
    EXPECT_TRUE(
        run.reader().read({.channels = run.reader().channels_of(topic)}, [&](const record::RawMessage& message) {
          text = message.data;
          return true;
        }));
    return text;
  };
  EXPECT_THAT(last("/tree"), ::testing::HasSubstr("{\"tick\":300,\"status\":{"));
  EXPECT_THAT(last("/charts"), ::testing::HasSubstr("\"states\":["));
  EXPECT_THAT(last("/monitors"), ::testing::HasSubstr("\"verdict\":"));
  EXPECT_THAT(last("/log"), ::testing::HasSubstr("violated: state "));
  EXPECT_THAT(last("/robot/pose"), ::testing::HasSubstr("\"orientation\""));
  EXPECT_THAT(last("/robot/scan"), ::testing::HasSubstr("\"ranges\":["));
  EXPECT_THAT(last("/map"), ::testing::HasSubstr("\"occupancy\""));
}

TEST_F(Recording, RefusesNamesThatLeadOutOfItsFolder) {
  for (const std::string name : {"project/../../evil.sh", "project//etc/evil"}) {
    std::string file;
    record::Recorder recorder(std::make_unique<record::StringSink>(file), {});
    recorder.add_channel(std::string(record::kObservationsTopic), "sentree.Observation", "{}");
    recorder.add({std::string(kRunMetadata), {{"source", "sentree.yaml"}, {"project", "sentree.yaml"}}});
    recorder.attach({.name = name, .media_type = "", .data = "x"});
    recorder.close();
    RecordedRun run = open(file);
    const auto extracted = run.extract();
    ASSERT_FALSE(extracted.has_value());
    EXPECT_EQ(extracted.error().code, "record.bad-name");
  }
}

}  // namespace
}  // namespace sentree::replay
