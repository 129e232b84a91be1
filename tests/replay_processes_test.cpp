// Moments of runs whose skills are processes of their own: gone to from the last one at which all parts have said what
// they remember.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "sentree/base/temporary_folder.h"
#include "sentree/processes/elsewhere.h"
#include "sentree/processes/remote_skill.h"
#include "sentree/processes/wire_message.h"
#include "sentree/project/distribute.h"
#include "sentree/replay/recording.h"
#include "sentree/replay/replay.h"
#include "sentree/rpc/server.h"
#include "sentree/sim/state.h"
#include "sentree/text/file.h"

namespace sentree::replay {
namespace {

using std::chrono::seconds;

class OfProcesses : public testing::Test {
 protected:
  /// Twenty times as fast as the wall's clock.
  static project::Scenario in_real_time(const std::filesystem::path& project, seconds duration) {
    auto loaded = project::load_project(project);
    EXPECT_TRUE(loaded.ok());
    project::Scenario scenario = project::plain_scenario(std::move(*loaded.value));
    scenario.factor = 20;
    scenario.duration = duration;
    scenario.virtual_time = false;
    // Of the wall's time: a busy machine is not what is tested.
    scenario.project.deadlines.call = seconds(10);
    scenario.project.deadlines.condition = seconds(20);
    scenario.project.deadlines.budget = seconds(30);
    scenario.project.deadlines.unresponsive = seconds(50);
    return scenario;
  }
  static project::Plan prepared(project::Scenario scenario) {
    auto plan = prepare(std::move(scenario));
    for (const Diagnostic& diagnostic : plan.diagnostics) ADD_FAILURE() << to_string(diagnostic);
    return std::move(*plan.value);
  }

  runtime::RunReport record(const project::Plan& plan, const text::ReadLog& read) {
    runtime::RunOptions options;
    options.elsewhere = processes::elsewhere({.program = SENTREE_PROGRAM});
    options.listeners.push_back([&](const Message& message) { messages_.push_back(message); });
    RunRecorder recorder(plan, read.files(), std::move(*record::FileSink::create(recording_)), {});
    recorder.install(options);
    runtime::RunReport report = runtime::Run(plan, std::move(options)).execute();
    EXPECT_EQ(report.error, "");
    recorder.finish(report);
    return report;
  }

  ReplayReport replay_at(TimePoint moment) {
    auto recorded = RecordedRun::open(recording_);
    EXPECT_TRUE(recorded) << recorded.error().message;
    auto scenario = recorded->scenario();
    EXPECT_TRUE(scenario.ok());
    ReplayOptions options;
    options.at = moment;
    auto report = replay(*recorded, prepared(std::move(*scenario.value)), std::move(options));
    EXPECT_TRUE(report) << report.error().message;
    EXPECT_EQ(report->unrecorded, "");
    for (const Difference& one : report->differences)
      ADD_FAILURE() << one.who << ' ' << one.recorded << "; now " << one.replayed;
    EXPECT_TRUE(report->moment);
    return std::move(*report);
  }

  // As they were observed, by path.
  [[nodiscard]] std::map<std::string, std::string> statuses(const project::Plan& plan, TimePoint moment) const {
    std::map<std::string, std::string> statuses;
    for (const Message& message : messages_) {
      if (message.time > moment || message.name != "node.status") continue;
      const std::string path = plan.tree.path(static_cast<bt::NodeId>(*message.data.find("node")->as_int()));
      const std::string to(message.data.find("to")->text());
      if (to == "IDLE")
        statuses.erase(path);
      else
        statuses[path] = to;
    }
    return statuses;
  }
  static std::map<std::string, std::string> statuses(const ReplayReport& report) {
    std::map<std::string, std::string> nodes;
    for (const auto& [path, status] : *report.moment->find("nodes")->as_map()) nodes[path] = status.text();
    return nodes;
  }

  const TemporaryFolder folder_{"processes"};
  const std::string recording_ = (folder_.path() / "run.mcap").string();
  std::vector<Message> messages_;
};

TEST_F(OfProcesses, AMomentIsGoneToFromTheLastSnapshot) {
  const std::filesystem::path project = std::string(SENTREE_SOURCE_DIR) + "/tests/projects/patrol";
  const text::ReadLog read;
  const project::Plan plan = prepared(project::in_processes(prepared(in_real_time(project, seconds(100)))));
  ASSERT_FALSE(plan.leaves[0].at.empty());
  record(plan, read);

  const auto arrival = std::find_if(messages_.begin(), messages_.end(), [&](const Message& message) {
    return message.name == "node.status" && message.data.find("to")->text() == "SUCCESS" &&
           plan.tree.path(static_cast<bt::NodeId>(*message.data.find("node")->as_int())).ends_with("GoToKitchen");
  });
  ASSERT_NE(arrival, messages_.end());
  for (const TimePoint moment :
       {TimePoint(std::chrono::milliseconds(12'050)), TimePoint(std::chrono::milliseconds(41'050)),
        arrival->time + std::chrono::milliseconds(150)}) {
    SCOPED_TRACE(moment.time_since_epoch().count());
    const ReplayReport report = replay_at(moment);
    ASSERT_TRUE(report.restored);
    EXPECT_GT(*report.restored, TimePoint{});
    EXPECT_EQ(statuses(report), statuses(plan, moment));
    if (moment <= arrival->time) continue;
    // The simulator was a process, too.
    const auto world = sim::restore(*plan.world, *report.moment->find("world"));
    ASSERT_TRUE(world) << world.error().message;
    const auto kitchen = std::find_if(plan.world->locations.begin(), plan.world->locations.end(),
                                      [](const sim::NamedLocation& each) { return each.name == "kitchen"; });
    const sim::Pose2 pose = world->robots[0].truth.pose;
    EXPECT_LT(std::hypot(pose.x - kitchen->pose.x, pose.y - kitchen->pose.y), 0.5);
  }
}

// A leaf that goes on for ever, at an address where a test answers for it.
class AtAnAddress : public OfProcesses {
 protected:
  void put(const char* name, const std::string& text) const {
    const std::filesystem::path file = folder_.path() / "project" / name;
    std::filesystem::create_directories(file.parent_path());
    ASSERT_TRUE(text::write_file(file, text));
  }

  // Every moment is gone to from the beginning, and nothing else is amiss.
  void expect_from_beginning(const idl::ServicePtr& interface, const std::function<rpc::Outcome()>& remember) {
    const auto skill =
        std::make_shared<rpc::FunctionService>(interface, [&](const idl::Method& method, const Value&) -> rpc::Outcome {
          if (method.name == "tick") return Value(Map{{"status", "RUNNING"}, {"outputs", "{}"}});
          if (method.name == "halt") return Value(Map{{"halted", true}});
          return method.name == "remember" ? remember() : rpc::Outcome(Value());
        });
    const std::string at = "unix:" + (folder_.path() / "skill.sock").string();
    const auto server = rpc::Server::start(*rpc::Address::parse(at), {{"skill", skill}});
    ASSERT_TRUE(server) << server.error().message;
    put("skills/Wait.scxml", R"(<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0">
  <state id="s"><transition event="halt" target="failure"/></state><final id="failure"/></scxml>)");
    put("mission.xml", R"(<root BTCPP_format="4"><BehaviorTree ID="Main"><Action ID="Wait"/></BehaviorTree></root>)");
    put("sentree.yaml", "mission: {file: mission.xml, rate: 10 Hz}\nskills:\n  Wait: {at: \"" + at + "\"}\n");
    const text::ReadLog read;
    const project::Plan plan = prepared(in_real_time(folder_.path() / "project", seconds(17)));
    ASSERT_TRUE(plan.leaves[0].chart);
    const runtime::RunReport report = record(plan, read);
    EXPECT_EQ(report.problems, std::vector<std::string>());
    const ReplayReport replayed = replay_at(TimePoint(seconds(16)));
    EXPECT_FALSE(replayed.restored);
    EXPECT_EQ(statuses(replayed), statuses(plan, TimePoint(seconds(16))));
  }
};

TEST_F(AtAnAddress, ASkillThatDoesNotKnowTheQuestionCostsTheSnapshotOnly) {
  expect_from_beginning(*processes::skill_interface(), [] { return Value(); });
}

TEST_F(AtAnAddress, ALiarCostsTheSnapshotOnly) {
  expect_from_beginning(*processes::served_skill_interface(),
                        [] { return processes::octets_of(std::string(5000, 'x')); });
}

}  // namespace
}  // namespace sentree::replay
