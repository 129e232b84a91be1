// Runs of missions with nodes of plug-ins that do not come back, or that work in threads. What hangs is left behind
// until the process ends.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <condition_variable>
#include <filesystem>
#include <fstream>
#include <mutex>
#include <string>
#include <thread>

#include "sentree/runtime/run.h"

namespace sentree::runtime {
namespace {

using std::chrono::milliseconds;
using testing::AllOf;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

class PluginRuns : public testing::Test {
 protected:
  PluginRuns() : folder_(std::filesystem::temp_directory_path() / ("sentree-plugin-runs-" + std::to_string(getpid()))) {
    std::filesystem::create_directories(folder_);
  }
  ~PluginRuns() override { std::filesystem::remove_all(folder_); }

  void mission(const std::string& plugin, const std::string& tree, const std::string& rate = "50 Hz") {
    write("sentree.yaml", "mission: {file: mission.xml, rate: " + rate + "}\nplugins: [" SENTREE_PLUGIN_FOLDER "/lib" +
                              plugin + "_plugin.so]\ndeadlines: {halt: 300 ms, unresponsive: 100 ms}\n");
    write("mission.xml", "<root BTCPP_format=\"4\"><BehaviorTree ID=\"Main\">\n" + tree + "\n</BehaviorTree></root>");
  }
  void write(const std::string& name, const std::string& text) { std::ofstream(folder_ / name) << text; }

  RunReport run(bool virtual_time, Duration duration, bool interrupt_when_told = false) {
    auto project = project::load_project(folder_);
    EXPECT_TRUE(project.ok()) << (project.ok() ? "" : to_string(project.diagnostics.front()));
    if (!project.ok()) return {};
    project::Scenario scenario = project::plain_scenario(std::move(*project.value));
    scenario.virtual_time = virtual_time;
    scenario.duration = duration;
    auto plan = prepare(std::move(scenario));
    if (!plan.ok()) ADD_FAILURE() << to_string(plan.diagnostics.front());
    if (!plan.ok()) return {};
    RunOptions options;
    options.on_problem = [this](const std::string& what) {
      const std::lock_guard lock(mutex_);
      told_.push_back(what);
      changed_.notify_all();
    };
    runtime::Run one(*plan.value, std::move(options));
    std::thread person;
    if (interrupt_when_told) {
      person = std::thread([&] {
        std::unique_lock lock(mutex_);
        changed_.wait(lock, [this] { return !told_.empty(); });
        lock.unlock();
        one.interrupt();
      });
    }
    RunReport report = one.execute();
    if (person.joinable()) person.join();
    return report;
  }

  std::filesystem::path folder_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<std::string> told_;
};

constexpr const char* kNamed = "mission.xml:2:27: Hangs \"At the door\", a node in C++, was called at ";

TEST_F(PluginRuns, ANodeThatHangsIsNamedAndTheRunEndsWithoutItWhenAPersonWantsIt) {
  mission("hangs", "<Sequence><AlwaysSuccess/><Hangs name=\"At the door\"/></Sequence>");
  const RunReport report = run(false, std::chrono::hours(1), true);
  EXPECT_THAT(told_, Contains(AllOf(HasSubstr(kNamed), HasSubstr("; the mission stands until it does"))));
  EXPECT_THAT(told_, Contains(AllOf(HasSubstr(kNamed), HasSubstr("; the run is to end and waits for it for 0."))));
  EXPECT_THAT(report.given_up, ElementsAre(AllOf(HasSubstr(kNamed), HasSubstr("; the run ends without it"))));
  EXPECT_TRUE(report.interrupted);
}

TEST_F(PluginRuns, ANodeThatHangsDoesNotOutliveTheLimitOfTime) {
  mission("hangs", "<Sequence><AlwaysSuccess/><Hangs name=\"At the door\"/></Sequence>");
  const RunReport report = run(false, milliseconds(400));
  EXPECT_TRUE(report.timed_out);
  EXPECT_THAT(report.given_up, ElementsAre(HasSubstr(kNamed)));
}

TEST_F(PluginRuns, InVirtualTimeItHasAsLongAsTheRunMayTake) {
  mission("hangs", "<Sequence><AlwaysSuccess/><Hangs name=\"At the door\"/></Sequence>");
  const RunReport report = run(true, milliseconds(500));
  EXPECT_THAT(report.error, AllOf(HasSubstr(kNamed), HasSubstr("was called at 0.000 s")));
  EXPECT_THAT(report.given_up, ElementsAre(report.error));
}

TEST_F(PluginRuns, InVirtualTimeAPersonCanEndItToo) {
  mission("hangs", "<Sequence><AlwaysSuccess/><Hangs name=\"At the door\"/></Sequence>");
  EXPECT_THAT(run(true, std::chrono::hours(1), true).given_up, ElementsAre(HasSubstr(kNamed)));
}

TEST_F(PluginRuns, ANodeThatHangsWhenItIsHaltedIsNamed) {
  mission("hangs", "<HangsWhenHalted/>");
  const RunReport report = run(false, milliseconds(200));
  EXPECT_THAT(report.given_up, ElementsAre(HasSubstr("mission.xml:2:1: HangsWhenHalted \"HangsWhenHalted\"")));
}

TEST_F(PluginRuns, VirtualTimeWaitsForAThreadThatTakesLessThanAPeriod) {
  mission("threads", "<Sequence><Plan steps=\"{steps}\"/><ScriptCondition code=\"steps == 7\"/></Sequence>", "1 Hz");
  const RunReport report = run(true, std::chrono::hours(1));
  EXPECT_EQ(report.mission, bt::Status::kSuccess);
  EXPECT_EQ(report.timing.ticks, 2U);
  EXPECT_THAT(report.problems, IsEmpty());
}

TEST_F(PluginRuns, VirtualTimeWaitsForAThreadNoLongerThanAPeriodAtATime) {
  mission("threads", "<Timeout msec=\"100\"><Follow/></Timeout>");
  const auto begun = std::chrono::steady_clock::now();
  const RunReport report = run(true, std::chrono::hours(1));
  EXPECT_EQ(report.mission, bt::Status::kFailure);
  EXPECT_EQ(report.ended, TimePoint(milliseconds(100)));
  EXPECT_GE(std::chrono::steady_clock::now() - begun, milliseconds(60));
  EXPECT_THAT(report.problems, ElementsAre(AllOf(HasSubstr("mission.xml:2:21: Follow \"Follow\" works in a thread for "
                                                           "longer than a period"),
                                                 HasSubstr("--clock real"))));
}

}  // namespace
}  // namespace sentree::runtime
