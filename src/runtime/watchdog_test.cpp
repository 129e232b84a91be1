// Scripts that never end, in skills and in monitors. Each test leaves a thread behind that runs until the process ends.
#include "sentree/runtime/watchdog.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "sentree/runtime/run.h"

namespace sentree::runtime {
namespace {

using testing::AllOf;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

const std::string kHead = "<scxml xmlns='http://www.w3.org/2005/07/scxml' version='1.0' datamodel='ecmascript'>";

// A mission of two leaves, of which the second works when the first has failed, and two monitors.
class Endless : public testing::Test {
 protected:
  Endless() : folder_(std::filesystem::temp_directory_path() / ("sentree-endless-" + std::to_string(getpid()))) {
    write("sentree.yaml", R"(mission: {file: mission.xml, rate: 50 Hz}
monitors: [{file: monitors/first.scxml}, {file: monitors/last.scxml}]
deadlines: {script: 100 ms, budget: 5 s, call: 1 s, condition: 2 s, unresponsive: 60 s}
)");
    write("mission.xml", R"(<root BTCPP_format="4"><BehaviorTree ID="Main"><Fallback>
  <Action ID="Stuck"/><Action ID="Works"/></Fallback></BehaviorTree></root>)");
    skill("Stuck", "<state id='a'><transition event='tick' target='failure'/></state>");
    skill("Works",
          "<datamodel><data id='n' expr='0'/></datamodel>"
          "<state id='a'><transition event='tick' cond='n &gt; 5' target='success'/>"
          "<transition event='tick'><assign location='n' expr='n + 1'/></transition></state>");
    monitor("first", "<state id='a'><transition event='observer.lost' target='violated'/></state>");
    // Sees the whole mission: it is violated at the end of it.
    monitor("last",
            "<state id='a'><transition event='Works.tick.reply' cond=\"_event.data.status == 'SUCCESS'\" "
            "target='violated'/></state>");
  }
  ~Endless() override { std::filesystem::remove_all(folder_); }

  void write(const std::string& name, const std::string& text) {
    std::filesystem::create_directories((folder_ / name).parent_path());
    std::ofstream(folder_ / name) << text;
  }
  void skill(const std::string& name, const std::string& states) {
    write("skills/" + name + ".scxml", kHead + "\n" + states + "<final id='success'/><final id='failure'/></scxml>");
  }
  void monitor(const std::string& name, const std::string& states) {
    write("monitors/" + name + ".scxml", kHead + "\n" + states + "<final id='violated'/></scxml>");
  }

  RunReport run(bool virtual_time) {
    auto project = project::load_project(folder_);
    EXPECT_TRUE(project.ok()) << (project.ok() ? "" : to_string(project.diagnostics.front()));
    if (!project.ok()) return {};
    project::Scenario scenario = project::plain_scenario(std::move(*project.value));
    scenario.virtual_time = virtual_time;
    auto plan = prepare(std::move(scenario));
    // Warnings of final states that nobody enters are expected.
    if (!plan.ok()) ADD_FAILURE() << to_string(plan.diagnostics.front());
    RunOptions options;
    options.listeners.push_back([this](const Message& message) { seen_.push_back(message.name); });
    return runtime::Run(*plan.value, std::move(options)).execute();
  }

  std::filesystem::path folder_;
  std::vector<std::string> seen_;
  const std::size_t before_ = threads_left_behind();
};

TEST_F(Endless, SkillIsGivenUpAndTheMissionGoesOn) {
  skill("Stuck",
        "<state id='a'><transition event='tick'>\n  <script>while (true) {}</script></transition>"
        "<transition event='halt' target='failure'/></state>");
  const RunReport report = run(false);
  EXPECT_EQ(report.error, "");
  EXPECT_EQ(report.mission, bt::Status::kSuccess);
  EXPECT_THAT(report.given_up,
              ElementsAre(AllOf(HasSubstr("Stuck.scxml:3:11: this script does not end (more than 100 ms of processor"),
                                HasSubstr("skill Stuck is given up"))));
  EXPECT_THAT(report.unmet, Contains(HasSubstr("skill Stuck is given up")));
  EXPECT_THAT(seen_, Contains("Stuck.given_up"));
  EXPECT_EQ(report.monitors[1].verdict, monitor::Verdict::kViolated);
  EXPECT_EQ(threads_left_behind(), before_ + 1);
}

TEST_F(Endless, TopLevelScriptOfASkillCountsToo) {
  skill("Stuck", "<script>for (;;) {}</script><state id='a'><transition event='tick' target='failure'/></state>");
  const RunReport report = run(false);
  EXPECT_EQ(report.mission, bt::Status::kSuccess);
  EXPECT_THAT(report.given_up, ElementsAre(HasSubstr("Stuck.scxml:2:")));
}

TEST_F(Endless, GetterThatIsReadAfterTheStepCountsToo) {
  skill("Stuck",
        "<datamodel><data id='o'/></datamodel><state id='a'><transition event='tick'>\n"
        "<script>o = {get x() { while (true) {} }};</script></transition>"
        "<transition event='halt' target='failure'/></state>");
  const RunReport report = run(false);
  EXPECT_EQ(report.mission, bt::Status::kSuccess);
  EXPECT_THAT(report.given_up, ElementsAre(HasSubstr("Stuck.scxml:3:")));
}

TEST_F(Endless, MonitorIsGivenUpAndTheOthersSeeEveryMessage) {
  monitor("first",
          "<state id='a'><transition event='mission.tick' cond='(function () { while (true) {} })()' "
          "target='violated'/></state>");
  const RunReport report = run(false);
  EXPECT_EQ(report.error, "");
  EXPECT_EQ(report.mission, bt::Status::kSuccess);
  EXPECT_THAT(report.monitors[0].failure, HasSubstr("first.scxml:2:"));
  EXPECT_THAT(report.monitors[0].failure, HasSubstr("monitor first is given up"));
  EXPECT_EQ(report.monitors[0].verdict, monitor::Verdict::kUndecided);
  EXPECT_EQ(report.monitors[1].verdict, monitor::Verdict::kViolated);
  EXPECT_THAT(seen_, Contains("monitor.given_up"));
  EXPECT_EQ(std::count(seen_.begin(), seen_.end(), "mission.tick"), static_cast<std::ptrdiff_t>(report.timing.ticks));
}

TEST_F(Endless, MonitorWhoseTopLevelScriptNeverEndsIsGivenUpBeforeTheRun) {
  monitor(
      "first",
      "<script>while (true) {}</script><state id='a'><transition event='observer.lost' target='violated'/></state>");
  const RunReport report = run(false);
  EXPECT_EQ(report.error, "");
  EXPECT_THAT(report.monitors[0].failure, HasSubstr("first.scxml:2:"));
  EXPECT_EQ(report.monitors[1].verdict, monitor::Verdict::kViolated);
}

TEST_F(Endless, MonitorIsGivenUpWhenItsTimerRunsIntoAScriptToo) {
  monitor("first",
          "<state id='a'><onentry><send event='due' delay='30ms'/></onentry>"
          "<transition event='due'><script>while (true) {}</script></transition>"
          "<transition event='observer.lost' target='violated'/></state>");
  monitor("last",
          "<state id='a'><onentry><send event='due' delay='30ms'/></onentry>"
          "<transition event='due' target='violated'/></state>");
  const RunReport report = run(false);
  EXPECT_THAT(report.monitors[0].failure, HasSubstr("first.scxml:2:"));
  EXPECT_EQ(report.monitors[1].verdict, monitor::Verdict::kViolated);
}

TEST_F(Endless, SkillEndsARunInVirtualTime) {
  skill("Stuck",
        "<state id='a'><transition event='tick'>\n  <script>while (true) {}</script></transition>"
        "<transition event='halt' target='failure'/></state>");
  const RunReport report = run(true);
  EXPECT_THAT(report.error, HasSubstr("Stuck.scxml:3:11: this script does not end"));
  EXPECT_THAT(report.given_up, ElementsAre(report.error));
  EXPECT_THAT(seen_, Contains("Stuck.tick.request"));
}

TEST_F(Endless, MonitorEndsARunInVirtualTime) {
  monitor("first",
          "<state id='a'><transition event='mission.tick' cond='(function () { while (true) {} })()' "
          "target='violated'/></state>");
  const RunReport report = run(true);
  EXPECT_THAT(report.error, HasSubstr("first.scxml:2:"));
  EXPECT_EQ(report.monitors[0].failure, report.error);
}

TEST_F(Endless, TopLevelScriptOfAMonitorEndsARunInVirtualTime) {
  monitor(
      "first",
      "<script>while (true) {}</script><state id='a'><transition event='observer.lost' target='violated'/></state>");
  EXPECT_THAT(run(true).error, HasSubstr("first.scxml:2:"));
}

TEST_F(Endless, GateWhoseScriptNeverEndsRefusesAndIsGivenUp) {
  write("sentree.yaml", R"(mission: {file: mission.xml, rate: 50 Hz}
services: {battery: {interface: robot.thrift/Battery, at: "tcp://127.0.0.1:1"}}
monitors: [{file: monitors/first.scxml, gate: [battery.*]}, {file: monitors/last.scxml}]
deadlines: {script: 100 ms, budget: 60 s, call: 20 s, condition: 30 s, unresponsive: 60 s}
)");
  monitor(
      "first",
      "<state id='a'><transition event='battery.getBatteryState.request' cond='(function () { while (true) {} })()' "
      "target='violated'/></state>");
  skill("Stuck",
        "<state id='a'><onentry><send type='thrift' target='battery' event='getBatteryState'/></onentry>"
        "<transition event='battery.getBatteryState.error' cond=\"_event.data.kind == 'vetoed'\" target='failure'/>"
        "<transition event='error' target='success'/></state>");
  const RunReport report = run(false);
  EXPECT_THAT(report.monitors[0].failure, HasSubstr("first.scxml:2:"));
  EXPECT_THAT(seen_, Contains("battery.getBatteryState.error"));
  EXPECT_THAT(seen_, testing::Not(Contains("battery.getBatteryState.request")));
  EXPECT_EQ(report.monitors[1].verdict, monitor::Verdict::kViolated);
}

TEST_F(Endless, ALeafThatDoesNotAnswerIsToldOfOnceUntilItAnswers) {
  write("mission.xml", R"(<root BTCPP_format="4"><BehaviorTree ID="Main"><Sequence>
  <Script code="n := 0"/>
  <RetryUntilSuccessful num_attempts="6"><Sequence>
    <Script code="n := n + 1"/><Condition ID="Stuck" n="{n}"/>
  </Sequence></RetryUntilSuccessful></Sequence></BehaviorTree></root>)");
  monitor("last",
          "<state id='a'><transition event='Stuck.tick.reply' cond=\"_event.data.status == 'SUCCESS'\" "
          "target='violated'/></state>");
  // At once the third time and the sixth, else never.
  skill("Stuck",
        "<datamodel><data id='n' expr='0'/></datamodel>"
        "<state id='a'><transition event='tick' cond='n == 3' target='failure'/>"
        "<transition event='tick' cond='n == 6' target='success'/></state>");
  const RunReport report = run(true);
  EXPECT_EQ(std::count(seen_.begin(), seen_.end(), "Stuck.tick.error"), 4);
  EXPECT_THAT(report.problems, ElementsAre(AllOf(HasSubstr("Stuck did not answer tick 1"), HasSubstr("(2 times)"))));
  EXPECT_EQ(report.mission, bt::Status::kSuccess);
}

TEST_F(Endless, ASlowScriptThatEndsIsLeftAlone) {
  skill("Stuck",
        "<state id='a'><transition event='tick' target='failure'>"
        "<script>for (var i = 0; i &lt; 1000; ++i) {}</script></transition></state>");
  const RunReport report = run(false);
  EXPECT_THAT(report.given_up, IsEmpty());
  EXPECT_EQ(threads_left_behind(), before_);
}

}  // namespace
}  // namespace sentree::runtime
