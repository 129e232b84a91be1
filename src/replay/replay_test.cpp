#include "sentree/replay/replay.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "sentree/base/json.h"
#include "sentree/base/rng.h"
#include "sentree/base/temporary_folder.h"
#include "sentree/replay/behaviour.h"
#include "sentree/replay/detail/snapshot.h"
#include "sentree/replay/recording.h"

namespace sentree::replay {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

const fs::path kRecharge = fs::path(SENTREE_SOURCE_DIR) / "examples/recharge";

TEST(BehaviourOfNodes, InCppIsTheirStatuses) {
  Behaviour then({"Main.Door"});
  Behaviour now({"Main.Door"});
  const auto status = [](Behaviour& of, const char* node, const char* to, std::uint64_t tick) {
    Message message;
    message.source = node;
    message.name = "node.status";
    message.tick = message.sequence = tick;
    message.data = Map{{"node", 1}, {"from", "IDLE"}, {"to", to}};
    of.observe(message);
  };
  for (Behaviour* each : {&then, &now}) {
    status(*each, "Main.Door", "SUCCESS", 1);
    status(*each, "Main.Door", "IDLE", 1);
  }
  status(then, "Main.Root", "FAILURE", 2);
  status(now, "Main.Door", "SUCCESS", 2);
  EXPECT_TRUE(differences(then, now, Compared::kOrder, kNever).empty());
  status(now, "Main.Door", "FAILURE", 3);
  const std::vector<Difference> found = differences(then, now, Compared::kOrder, kNever);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].who, "Main.Door");
  EXPECT_EQ(found[0].replayed, "is FAILURE");
}

class Replays : public ::testing::Test {
 protected:
  RecordedRun record_run(const fs::path& scenario, bool virtual_time, Duration duration, double factor = 1.0) {
    const std::string file = (folder_.path() / "run.mcap").string();
    const text::ReadLog log;
    auto loaded = load(scenario);
    for (const Diagnostic& each : loaded.diagnostics) EXPECT_NE(each.severity, Severity::kError) << to_string(each);
    loaded.value->duration = duration;
    loaded.value->virtual_time = virtual_time;
    loaded.value->factor = factor;
    if (!virtual_time)
      loaded.value->project.deadlines = {
          .call = std::chrono::seconds(1), .condition = std::chrono::seconds(2), .budget = std::chrono::seconds(3)};
    const auto plan = prepare(std::move(*loaded.value));
    EXPECT_TRUE(plan.ok());
    runtime::RunOptions options = std::move(record_options_);
    RunRecorder recorder(*plan.value, log.files(), std::move(*record::FileSink::create(file)), {});
    recorder.install(options);
    runtime::Run run(*plan.value, std::move(options));
    recorder.finish(run.execute());
    auto opened = RecordedRun::open(file);
    EXPECT_TRUE(opened.has_value());
    return std::move(*opened);
  }

  void put(const std::string& name, const std::string& text) {
    fs::create_directories((folder_.path() / name).parent_path());
    ASSERT_TRUE(text::write_file(folder_.path() / name, text).has_value());
  }

  static Loaded<project::Scenario> load(const fs::path& file) {
    if (file.filename() != "sentree.yaml") return project::load_scenario(file);
    auto project = project::load_project(file);
    Loaded<project::Scenario> loaded{.value = {}, .diagnostics = std::move(project.diagnostics)};
    if (project.value) loaded.value = project::plain_scenario(std::move(*project.value));
    return loaded;
  }

  // The recharge project with one skill replaced by another file of it.
  fs::path project_with(const std::string& skill, const std::string& file) {
    const fs::path folder = folder_.path() / "changed";
    fs::copy(kRecharge, folder, fs::copy_options::recursive);
    fs::copy_file(kRecharge / file, folder / "skills" / (skill + ".scxml"), fs::copy_options::overwrite_existing);
    return folder;
  }

  ReplayReport replay_with(RecordedRun& run, Loaded<project::Scenario> scenario, bool go_on) {
    EXPECT_TRUE(scenario.ok());
    scenario.value->virtual_time = false;  // parts elsewhere are no problem for a replay
    auto plan = prepare(std::move(*scenario.value));
    EXPECT_TRUE(plan.ok()) << to_string(plan.diagnostics[0]);
    ReplayOptions options;
    options.go_on = go_on;
    options.run.listeners.push_back([this](const Message& message) { replayed_.push_back(message); });
    auto report = replay(run, std::move(*plan.value), std::move(options));
    EXPECT_TRUE(report.has_value()) << to_string(report.error());
    return std::move(*report);
  }

  void expect_the_same(RecordedRun& run) {
    const ReplayReport report = replay_with(run, run.scenario(), false);
    for (const Difference& d : report.differences)
      ADD_FAILURE() << sentree::seconds(d.time) << " " << d.who << ": " << d.recorded << " / " << d.replayed;
    EXPECT_EQ(report.unrecorded, "");
  }

  // What was observed after the last snapshot before that moment.
  static std::vector<Message> since_snapshot(RecordedRun& run, TimePoint moment) {
    const auto snapshot = *run.snapshot(moment);
    auto all = *run.observations();
    std::erase_if(all, [&](const Message& message) { return snapshot && message.sequence <= snapshot->sequence; });
    return all;
  }

  void put_tree(const std::string& nodes) {
    put("tree.xml", "<root BTCPP_format=\"4\" main_tree_to_execute=\"T\"><BehaviorTree ID=\"T\">" + nodes +
                        "</BehaviorTree></root>");
  }
  // Its mission succeeds if the topic reaches the leaf between the second and the third tick.
  void put_listener() {
    put("interfaces/t.thrift", "service T { oneway void said() }\n");
    put("skills/Hear.scxml", R"(<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" initial="begun">
  <state id="begun"><transition event="tick" target="ticked"/></state>
  <state id="ticked">
    <transition event="t.said" target="failure"/>
    <transition event="tick" target="ticked_again"/>
    <transition event="halt" target="failure"/>
  </state>
  <state id="ticked_again">
    <transition event="t.said" target="success"/>
    <transition event="halt" target="failure"/>
  </state>
  <final id="success"/>
  <final id="failure"/>
</scxml>)");
    put_tree(R"(<Action ID="Hear"/>)");
    put("sentree.yaml", R"(mission: {file: tree.xml, rate: 10 Hz}
services:
  t: {interface: t.thrift/T, at: topics}
skills:
  Hear: {subscribe: [t.said]}
)");
  }

  const TemporaryFolder folder_{"test"};
  runtime::RunOptions record_options_;  // of the next run that is recorded
  std::vector<Message> replayed_;
};

TEST_F(Replays, AnUnchangedProjectDoesTheSameInEveryObservation) {
  RecordedRun run = record_run(kRecharge / "scenarios/experiment1.yaml", true, std::chrono::seconds(60));
  const ReplayReport report = replay_with(run, run.scenario(), false);
  EXPECT_THAT(report.differences, IsEmpty());
  EXPECT_EQ(report.unrecorded, "");
  EXPECT_EQ(report.answered_requests, report.recorded_requests);
  EXPECT_EQ(report.run.monitors[0].verdict, monitor::Verdict::kViolated);
  EXPECT_EQ(replayed_, *run.observations());
}

TEST_F(Replays, WhatIsWrongWithARecordedProjectIsSaidOfTheRecording) {
  RecordedRun run = record_run(kRecharge / "scenarios/experiment1.yaml", true, std::chrono::seconds(1));
  const auto folder = run.extract();
  ASSERT_TRUE(folder);
  const SourceSpan place{(folder->parent_path() / "A.scxml").string(), 3, 1};
  const Diagnostics told =
      run.errors_in({{Severity::kWarning, "a.b", "told then", place}, {Severity::kError, "a.c", "wrong", place}});
  ASSERT_EQ(told.size(), 1U);
  EXPECT_EQ(to_string(told[0]).find(run.path() + "/"), 0U) << to_string(told[0]);
  EXPECT_TRUE(told[0].span.file.ends_with("A.scxml"));
}

TEST_F(Replays, ProblemsNameFilesOfTheRecording) {
  put("skills/A.scxml", R"(<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" initial="a">
  <state id="a">
    <onentry><send event="goes" delay="450ms"/></onentry>
    <transition event="goes" target="b"/>
    <transition event="halt" target="failure"/>
  </state>
  <state id="b">
    <transition cond="true" target="b"/>
    <transition event="never" target="success"/>
  </state>
  <final id="success"/>
  <final id="failure"/>
</scxml>)");
  put_tree(R"(<Action ID="A"/>)");
  put("sentree.yaml", "mission: {file: tree.xml, rate: 10 Hz}\n");
  RecordedRun run = record_run(folder_.path() / "sentree.yaml", true, std::chrono::seconds(1));
  auto scenario = run.scenario();
  auto plan = prepare(std::move(*scenario.value));
  ASSERT_TRUE(plan.value.has_value());
  std::vector<std::string> told;
  ReplayOptions options;
  options.go_on_at = TimePoint(std::chrono::milliseconds(150));
  options.run.on_problem = [&](const std::string& what) { told.push_back(what); };
  const auto report = replay(run, std::move(*plan.value), std::move(options));
  ASSERT_TRUE(report.has_value()) << to_string(report.error());
  ASSERT_THAT(report->run.problems, SizeIs(1));
  EXPECT_THAT(report->run.problems.front(), HasSubstr("A was given up: " + run.path() + "/skills/A.scxml:8:5: "));
  EXPECT_EQ(told, report->run.problems);
}

// Its deadlines are wall time: a tick may take ten times as long in run time as the project says.
TEST_F(Replays, ARunAtAnotherPaceHasTheDeadlinesOfThatPace) {
  RecordedRun run = record_run(kRecharge / "scenarios/normal.yaml", false, std::chrono::seconds(1), 10);
  EXPECT_EQ(run.scenario().value->factor, 10);
}

TEST_F(Replays, WhatWasDoneToARunIsDoneToItsReplay) {
  const fs::path file = folder_.path() / "faults.yaml";
  ASSERT_TRUE(text::write_file(file, "project: " + kRecharge.string() + R"(
delays:
  - {message: navigation.*, by: 7 ms}
timeline:
  - {at: 1.01 s, delay: {message: battery.getBatteryState.reply, by: 20 ms, count: 3}}
  - {at: 2 s, falsify: {call: battery.getBatteryState, path: percentage, value: 0.2, count: 2}}
  - {at: 3 s, force: {leaf: AtKitchen, status: SUCCESS, count: 1}}
  - {at: 4 s, source: studio, breakpoint: {chart: "skill:GoToKitchen", state: moving}}
  - {at: 5 s, kill: battery}
  - {at: 5.2 s, restart: battery}
  - {at: 6 s, clear: 5}
  - {at: 7 s, kill: AtKitchen}
  - {at: 7.45 s, restart: AtKitchen}
  - {at: 9 s, source: interrupt, stop: mission}
override:
  mission: {repeat: true}
)")
                  .has_value());
  RecordedRun run = record_run(file, true, std::chrono::seconds(30));
  const ReplayReport report = replay_with(run, run.scenario(), false);
  EXPECT_THAT(report.differences, IsEmpty());
  EXPECT_EQ(report.unrecorded, "");
  EXPECT_EQ(replayed_, *run.observations());
  EXPECT_THAT(report.run.problems, IsEmpty());
}

TEST_F(Replays, ARecordingInRealTimeDoesTheSame) {
  RecordedRun run = record_run(kRecharge / "scenarios/experiment1.yaml", false, std::chrono::seconds(8), 4);
  expect_the_same(run);
}

// A gate decides in a thread of its own: the leaf answers its tick before.
TEST_F(Replays, AVetoComesWhenItCame) {
  RecordedRun run = record_run(kRecharge / "scenarios/shield.yaml", false, std::chrono::seconds(20), 50);
  ASSERT_EQ(run.fact("mission"), "FAILURE");
  expect_the_same(run);
}

TEST_F(Replays, ARecordingOfAMachineThatWasLateDoesTheSame) {
  // A period is a millisecond here, so that everything is late now and then, deadlines included.
  RecordedRun run = record_run(kRecharge / "scenarios/experiment1.yaml", false, std::chrono::seconds(60), 100);
  expect_the_same(run);
}

// Answers when the mission has published the second tick, and the leaf has not taken that yet.
class AnsweredInBetween final : public runtime::ServicePort {
 public:
  explicit AnsweredInBetween(Done& done) : done_(done) {}
  void call(const idl::Method&, Value, Done done) override { done_ = std::move(done); }

 private:
  Done& done_;
};

TEST_F(Replays, WhatALeafTookFirstItTakesFirstAgain) {
  put("interfaces/s.thrift", "service S { i32 ask() }\n");
  put("skills/Ask.scxml", R"(<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" initial="asking">
  <state id="asking">
    <onentry><send type="thrift" target="s" event="ask"/></onentry>
    <transition event="s.ask.reply" target="success"/>
    <transition event="halt" target="failure"/>
  </state>
  <final id="success"/>
  <final id="failure"/>
</scxml>)");
  put_tree(R"(<Action ID="Ask"/>)");
  put("sentree.yaml", R"(mission: {file: tree.xml, rate: 10 Hz}
services:
  s: {interface: s.thrift/S, at: "tcp://127.0.0.1:1"}
)");
  runtime::ServicePort::Done done;
  int ticks = 0;
  record_options_.make_port = [&](const project::ServicePlan&, const std::string&) {
    return std::make_unique<AnsweredInBetween>(done);
  };
  record_options_.arrival = [&](std::size_t, runtime::RunOptions::LeafMessage what) {
    if (what == runtime::RunOptions::LeafMessage::kTick && ++ticks == 2) done(mission::CallOutcome::returned(Value(1)));
    return TimePoint{};
  };
  RecordedRun run = record_run(folder_.path() / "sentree.yaml", false, std::chrono::seconds(20));
  ASSERT_EQ(ticks, 2);
  ASSERT_EQ(run.fact("mission"), "SUCCESS");
  expect_the_same(run);
}

TEST_F(Replays, ATopicIsTakenBehindWhatWasTakenBeforeIt) {
  put_listener();
  put("scenarios/said.yaml", "timeline:\n  - {at: 50 ms, call: t.said}\n");
  // It is published between the first and the second tick, and taken between the second and the third.
  record_options_.topic_arrival = [](std::size_t, const mission::Publication&) {
    return TimePoint(std::chrono::milliseconds(150));
  };
  RecordedRun run = record_run(folder_.path() / "scenarios/said.yaml", false, std::chrono::seconds(20));
  ASSERT_EQ(run.fact("mission"), "SUCCESS");
  expect_the_same(run);
}

TEST_F(Replays, ATopicIsHeldBackAsLongAsThen) {
  put_listener();
  put("scenarios/said.yaml",
      "timeline:\n  - {at: 10 ms, delay: {message: t.said, by: 100 ms, count: 1}}\n  - {at: 50 ms, call: t.said}\n");
  RecordedRun run = record_run(folder_.path() / "scenarios/said.yaml", false, std::chrono::seconds(20));
  ASSERT_EQ(run.fact("mission"), "SUCCESS");
  expect_the_same(run);
}

class AnsweredAtOnce final : public runtime::ServicePort {
 public:
  void call(const idl::Method&, Value, Done done) override { done(mission::CallOutcome::returned(Value(1))); }
};

TEST_F(Replays, ACountedDelayIsUsedUpByWhatUsedItUpThen) {
  put("interfaces/s.thrift", "service S { i32 ask()  oneway void said() }\n");
  // The second tick makes it ask, which is what the fault delays, and not what is published before the third tick.
  put("skills/Hear.scxml", R"(<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" initial="begun">
  <state id="begun"><transition event="tick" target="ticked"/><transition event="halt" target="failure"/></state>
  <state id="ticked"><transition event="tick" target="asking"/><transition event="halt" target="failure"/></state>
  <state id="asking">
    <onentry><send type="thrift" target="s" event="ask"/></onentry>
    <transition event="s.said" target="success"/>
    <transition event="tick" target="late"/>
    <transition event="halt" target="failure"/>
  </state>
  <state id="late">
    <transition event="s.said" target="failure"/>
    <transition event="halt" target="failure"/>
  </state>
  <final id="success"/>
  <final id="failure"/>
</scxml>)");
  put_tree(R"(<Action ID="Hear"/>)");
  put("sentree.yaml", R"(mission: {file: tree.xml, rate: 10 Hz}
services:
  s: {interface: s.thrift/S, at: "tcp://127.0.0.1:1"}
skills:
  Hear: {subscribe: [s.said]}
)");
  put("scenarios/said.yaml",
      "timeline:\n  - {at: 10 ms, delay: {message: \"s.*\", by: 120 ms, count: 1}}\n  - {at: 150 ms, call: s.said}\n");
  record_options_.make_port = [](const project::ServicePlan&, const std::string&) {
    return std::make_unique<AnsweredAtOnce>();
  };
  RecordedRun run = record_run(folder_.path() / "scenarios/said.yaml", false, std::chrono::seconds(2));
  expect_the_same(run);
}

class ReplayedTimers : public Replays {
 protected:
  // It rings 150 ms after the first tick, and is in time behind the third one only.
  void put_mission() {
    put("skills/Wait.scxml", R"(<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" initial="begun">
  <state id="begun">
    <onentry><send event="rings" delay="150ms"/></onentry>
    <transition event="rings" target="failure"/>
    <transition event="tick" cond="_event.data.go == 'yes'" target="ready"/>
    <transition event="halt" target="failure"/>
  </state>
  <state id="ready">
    <transition event="rings" target="success"/>
    <transition event="halt" target="failure"/>
  </state>
  <final id="success"/>
  <final id="failure"/>
</scxml>)");
    put_tree(R"(
    <Sequence>
      <Script code="n := 0"/>
      <ReactiveSequence>
        <Script code="n += 1; go := n > 2 ? 'yes' : 'no'"/>
        <Action ID="Wait" go="{go}"/>
      </ReactiveSequence>
    </Sequence>
  )");
    put("sentree.yaml", "mission: {file: tree.xml, rate: 10 Hz}\n");
  }
};

TEST_F(ReplayedTimers, RingWhenTheyRangLate) {
  put_mission();
  // It is due between the second and the third tick, and rings between the third and the fourth.
  record_options_.timer_arrival = [](std::size_t, std::uint64_t) { return TimePoint(std::chrono::milliseconds(250)); };
  RecordedRun run = record_run(folder_.path() / "sentree.yaml", false, std::chrono::seconds(20));
  ASSERT_EQ(run.fact("mission"), "SUCCESS");
  expect_the_same(run);
}

TEST_F(ReplayedTimers, AreNotGoneOnWithWhereNobodyWouldAnswer) {
  put_mission();
  RecordedRun run = record_run(folder_.path() / "sentree.yaml", false, std::chrono::milliseconds(250));
  auto plan = prepare(std::move(*run.scenario().value));
  ReplayOptions options;
  options.go_on_at = TimePoint(std::chrono::milliseconds(100));
  const auto report = replay(run, std::move(*plan.value), std::move(options));
  ASSERT_FALSE(report.has_value());
  EXPECT_EQ(report.error().code, "replay.no-simulator");
}

TEST_F(ReplayedTimers, RingWhenTheyRangThatWereSetLate) {
  put_mission();
  // The first tick is taken late, so that the timer is due, and rings, behind the third one.
  record_options_.arrival = [first = true](std::size_t, runtime::RunOptions::LeafMessage what) mutable {
    const bool is_first = what == runtime::RunOptions::LeafMessage::kTick && std::exchange(first, false);
    return is_first ? TimePoint(std::chrono::milliseconds(90)) : TimePoint{};
  };
  RecordedRun run = record_run(folder_.path() / "sentree.yaml", false, std::chrono::seconds(20));
  ASSERT_EQ(run.fact("mission"), "SUCCESS");
  expect_the_same(run);
}

TEST_F(Replays, AHaltIsTakenBehindWhatWasTakenBeforeIt) {
  put("interfaces/t.thrift", "service T { oneway void said() }\n");
  put("skills/Wait.scxml", R"(<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" initial="begun">
  <state id="begun">
    <onentry><send event="rings" delay="200ms"/></onentry>
    <transition event="rings"><send type="thrift" target="t" event="said"/></transition>
    <transition event="halt" target="failure"/>
  </state>
  <final id="failure"/>
</scxml>)");
  put_tree(R"(<Timeout msec="150"><Action ID="Wait"/></Timeout>)");
  put("sentree.yaml", R"(mission: {file: tree.xml, rate: 10 Hz}
services:
  t: {interface: t.thrift/T, at: topics}
)");
  // It is asked for after 150 ms.
  record_options_.arrival = [](std::size_t, runtime::RunOptions::LeafMessage what) {
    return what == runtime::RunOptions::LeafMessage::kHalt ? TimePoint(std::chrono::milliseconds(250)) : TimePoint{};
  };
  RecordedRun run = record_run(folder_.path() / "sentree.yaml", false, std::chrono::seconds(20));
  ASSERT_EQ(run.fact("mission"), "FAILURE");
  ASSERT_EQ(run.fact("ended_by"), "mission");
  expect_the_same(run);
}

// Everything that a run is when all up to `at` has happened, but for what has no value form.
Map stopped_at(const fs::path& scenario, Duration duration, TimePoint at) {
  auto loaded = project::load_scenario(scenario);
  loaded.value->duration = duration;
  loaded.value->virtual_time = true;
  const auto plan = prepare(std::move(*loaded.value));
  EXPECT_TRUE(plan.ok());
  Map state;
  runtime::RunOptions options;
  options.on_begin = [&](runtime::RunInside& inside) {
    inside.scheduler().at(inside.director(), at + Duration(1), mission::Rank::kInjection, [&] {
      take_snapshot(inside, *plan.value, [&](TimePoint, const Map& snapshot) {
        state = snapshot;
        inside.end();
      });
    });
  };
  (void)runtime::Run(*plan.value, std::move(options)).execute();
  return state;
}

class Moments : public Replays, public ::testing::WithParamInterface<const char*> {};

TEST_P(Moments, AreRestoredAsARunThatStoppedThereIs) {
  constexpr std::uint64_t kSeed = 7;
  SCOPED_TRACE("seed " + std::to_string(kSeed));
  const fs::path scenario = kRecharge / "scenarios" / (std::string(GetParam()) + ".yaml");
  constexpr std::chrono::seconds kDuration(30);
  RecordedRun run = record_run(scenario, true, kDuration);
  Rng rng(kSeed);
  // At ticks, at snapshots, and anywhere between.
  std::vector<TimePoint> moments{TimePoint(std::chrono::seconds(10))};
  for (int i = 0; i < 2; ++i) {
    moments.emplace_back(Duration(static_cast<std::int64_t>(rng.below(29'000'000'000))));
    moments.emplace_back(std::chrono::milliseconds(100 * rng.below(290)));
  }
  for (const TimePoint at : moments) {
    SCOPED_TRACE(std::to_string(at.time_since_epoch().count()) + " ns");
    ASSERT_LT(at, run.ended());
    auto recorded = run.scenario();
    auto plan = prepare(std::move(*recorded.value));
    ASSERT_TRUE(plan.ok());
    ReplayOptions options;
    options.at = at;
    const auto report = replay(run, std::move(*plan.value), std::move(options));
    ASSERT_TRUE(report.has_value()) << to_string(report.error());
    ASSERT_TRUE(report->moment.has_value());
    EXPECT_THAT(report->differences, IsEmpty());
    for (const auto& [part, value] : stopped_at(scenario, kDuration, at)) {
      const Value* restored = report->moment->find(part);
      ASSERT_NE(restored, nullptr) << part;
      if (part != "monitors" && part != "skills") {
        EXPECT_EQ(*restored, value) << part << "\n" << to_json(*restored) << "\n" << to_json(value);
        continue;
      }
      for (const auto& [name, saved] : *value.as_map()) {
        for (const auto& [fact, then] : *saved.as_map()) {
          if (fact.starts_with("history")) continue;  // what explains is shortened in a snapshot
          EXPECT_EQ(*restored->at({name, fact}), then) << name << ": " << fact;
        }
      }
    }
  }
}
INSTANTIATE_TEST_SUITE_P(OfScenarios, Moments, ::testing::Values("normal", "experiment1", "experiment2", "recharge"),
                         [](const auto& scenario) { return std::string(scenario.param); });

TEST_F(Replays, SayThatAMomentIsAfterTheEnd) {
  RecordedRun run = record_run(kRecharge / "scenarios/experiment1.yaml", true, std::chrono::seconds(2));
  for (const bool take_over : {false, true}) {
    auto scenario = run.scenario();
    auto plan = prepare(std::move(*scenario.value));
    ReplayOptions options;
    (take_over ? options.go_on_at : options.at) = TimePoint(std::chrono::seconds(3));
    const auto report = replay(run, std::move(*plan.value), std::move(options));
    ASSERT_FALSE(report.has_value());
    EXPECT_EQ(report.error().code, "replay.after-end");
  }
}

TEST_F(Replays, ShowTheEndOfARunToo) {
  RecordedRun run = record_run(kRecharge / "scenarios/experiment1.yaml", true, std::chrono::seconds(2));
  for (const bool take_over : {false, true}) {
    auto scenario = run.scenario();
    auto plan = prepare(std::move(*scenario.value));
    ReplayOptions options;
    (take_over ? options.go_on_at : options.at) = run.ended();
    const auto report = replay(run, std::move(*plan.value), std::move(options));
    ASSERT_TRUE(report.has_value()) << to_string(report.error());
    ASSERT_TRUE(report->moment.has_value());
    EXPECT_FALSE(report->continued);
    EXPECT_THAT(report->differences, IsEmpty());
    EXPECT_EQ(report->moment->find("time")->number(), 2.0);
    EXPECT_EQ(*report->moment->find("tick")->as_int(), 20);
    EXPECT_FALSE(report->moment->find("skills")->as_map()->empty());
    EXPECT_NE(report->moment->find("world"), nullptr);
  }
}

TEST_F(Replays, GoOnInTheSimulatorFromAnyMomentAsTheRunItself) {
  RecordedRun run = record_run(kRecharge / "scenarios/experiment1.yaml", true, std::chrono::seconds(60));
  for (const int ms : {0, 9'999, 10'000, 23'456}) {
    SCOPED_TRACE(ms);
    replayed_.clear();
    auto scenario = run.scenario();
    auto plan = prepare(std::move(*scenario.value));
    ReplayOptions options;
    options.go_on_at = TimePoint(std::chrono::milliseconds(ms));
    options.run.listeners.push_back([this](const Message& message) { replayed_.push_back(message); });
    const auto report = replay(run, std::move(*plan.value), options);
    ASSERT_TRUE(report.has_value()) << to_string(report.error());
    EXPECT_TRUE(report->continued);
    EXPECT_THAT(report->differences, IsEmpty());
    // Not from the beginning: from the last snapshot.
    ASSERT_TRUE(report->restored.has_value());
    EXPECT_EQ(*report->restored, TimePoint(std::chrono::milliseconds(ms) / kSnapshotPeriod * kSnapshotPeriod));
    EXPECT_EQ(replayed_, since_snapshot(run, *options.go_on_at));
  }
}

TEST_F(Replays, AMomentOfARunThatSomebodySteeredComesFromASnapshotToo) {
  const fs::path file = folder_.path() / "steered.yaml";
  ASSERT_TRUE(text::write_file(file, "project: " + kRecharge.string() + R"(
timeline:
  - {at: 4 s, call: simulation.setBatteryCharge, args: {percent: 90}}
  - {at: 6 s, source: studio, falsify: {call: battery.getBatteryState, path: percentage, value: 0.4, count: 20}}
  - {at: 8 s, source: studio, kill: battery}
  - {at: 8.3 s, source: studio, restart: battery}
  - {at: 12 s, source: studio, call: simulation.setBatteryCharge, args: {percent: 12}}
)")
                  .has_value());
  RecordedRun run = record_run(file, true, std::chrono::seconds(20));
  for (const int ms : {4'500, 7'000, 8'100, 9'900}) {
    SCOPED_TRACE(ms);
    replayed_.clear();
    auto scenario = run.scenario();
    auto plan = prepare(std::move(*scenario.value));
    ReplayOptions options;
    options.go_on_at = TimePoint(std::chrono::milliseconds(ms));
    options.run.listeners.push_back([this](const Message& message) { replayed_.push_back(message); });
    const auto report = replay(run, std::move(*plan.value), options);
    ASSERT_TRUE(report.has_value()) << to_string(report.error());
    EXPECT_THAT(report->differences, IsEmpty());
    ASSERT_TRUE(report->restored.has_value());
    EXPECT_EQ(replayed_, since_snapshot(run, *options.go_on_at));
  }
}

TEST_F(Replays, AProjectsScenarioIsWhereTheRecordedOneLay) {
  const fs::path folder = project_with("AtLocation", "skills/AtLocation.scxml");
  const fs::path found = folder / "verify/found.yaml";
  put("changed/verify/found.yaml", "clock: virtual\nduration: 3 s\nstop_when_violated: true\n");
  RecordedRun run = record_run(found, true, std::chrono::seconds(3));
  const auto there = run.scenario_in(folder.string());
  ASSERT_TRUE(there.ok());
  EXPECT_EQ(there.value->file, found.string());
  EXPECT_THAT(there.diagnostics, IsEmpty());
  fs::remove_all(folder / "verify");
  auto recorded = run.scenario_in(folder.string());
  ASSERT_TRUE(recorded.ok());
  ASSERT_THAT(recorded.diagnostics, SizeIs(1));
  EXPECT_EQ(recorded.diagnostics[0].severity, Severity::kNote);
  EXPECT_THAT(to_string(recorded.diagnostics[0]),
              HasSubstr("run.mcap/verify/found.yaml: note: " + folder.string() +
                        " has no verify/found.yaml; the scenario is the recorded one"));
  EXPECT_EQ(recorded.value->project.folder, folder) << "and the project is the given one";
  EXPECT_TRUE(recorded.value->stop_when_violated);
  const ReplayReport report = replay_with(run, std::move(recorded), false);
  EXPECT_THAT(report.differences, IsEmpty());
}

TEST_F(Replays, AChangedSkillStopsAtTheFirstRequestThatWasNotRecorded) {
  // Recorded with the buggy skill, which never sends the robot to the station; tried with the sound one.
  RecordedRun run = record_run(kRecharge / "scenarios/experiment2.yaml", true, std::chrono::seconds(120));
  EXPECT_THAT(run.fact("verdicts"), HasSubstr("\"recharge\":\"violated\""));
  const fs::path changed = project_with("BatteryLevelAbove-buggy", "skills/BatteryLevelAbove.scxml");
  const ReplayReport report = replay_with(run, run.scenario_in(changed.string()), false);
  ASSERT_FALSE(report.differences.empty());
  EXPECT_THAT(report.differences[0].who, HasSubstr("BatteryLevelAbove"));
  EXPECT_THAT(report.differences[0].replayed, HasSubstr("FAILURE"));
  EXPECT_THAT(report.unrecorded, HasSubstr("station"));
  EXPECT_FALSE(report.continued);
  EXPECT_EQ(report.run.ended, report.unrecorded_at);
}

TEST_F(Replays, AChangedSkillGoesOnInTheRestoredSimulator) {
  RecordedRun run = record_run(kRecharge / "scenarios/experiment2.yaml", true, std::chrono::seconds(120));
  const fs::path changed = project_with("BatteryLevelAbove-buggy", "skills/BatteryLevelAbove.scxml");
  const ReplayReport report = replay_with(run, run.scenario_in(changed.string()), true);
  EXPECT_TRUE(report.continued);
  EXPECT_GT(report.run.ended, report.unrecorded_at);
  for (const runtime::MonitorReport& monitor : report.run.monitors) {
    if (monitor.name == "recharge") {
      EXPECT_NE(monitor.verdict, monitor::Verdict::kViolated);
    }
  }

  // The restored simulator is where the sound skill alone would have brought it: the same as a run of it from the
  // start.
  const std::vector<Message> replayed = replayed_;
  std::vector<Message> direct;
  auto scenario = run.scenario_in(changed.string());
  const auto plan = prepare(std::move(*scenario.value));
  runtime::RunOptions options;
  options.listeners.push_back([&](const Message& message) { direct.push_back(message); });
  (void)runtime::Run(*plan.value, std::move(options)).execute();
  EXPECT_EQ(replayed, direct);
}

}  // namespace
}  // namespace sentree::replay
