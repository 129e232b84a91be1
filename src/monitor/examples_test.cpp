// The twelve requirements of examples/requirements, each with a trace that violates it and one that does not.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>

#include "sentree/monitor/monitor_set.h"
#include "sentree/text/file.h"

namespace sentree::monitor {
namespace {

class Trace {
 public:
  Trace& at(double s) {
    now_ = TimePoint(from_seconds(s));
    return *this;
  }
  Trace& reply(const std::string& method, Value result, Map args = {}) {
    return add(method + ".reply", Map{{"args", std::move(args)}, {"result", std::move(result)}});
  }
  Trace& request(const std::string& method, Map args = {}) {
    return add(method + ".request", Map{{"args", std::move(args)}});
  }
  Trace& level(double percent) { return reply("battery.getBatteryState", Map{{"percentage", percent / 100}}); }
  Trace& go(const char* place) { return request("navigation.gotoTargetByLocationName", Map{{"name", place}}); }
  Trace& near(const char* place, bool is) { return reply("navigation.checkNearToLocation", is, Map{{"name", place}}); }
  Trace& speed(double mps) { return reply("base.getLastVelocityCommand", Map{{"vx", mps}}); }
  Trace& arm(bool moving, const char* gripper) {
    return reply("arm.getArmState", Map{{"moving", moving}, {"gripper", gripper}});
  }
  Trace& ticks(int count) {
    for (int i = 0; i < count; ++i) add("mission.tick", Map());
    return *this;
  }
  Trace& fails() {
    status("FAILURE");
    return status("IDLE");
  }
  Trace& status(const char* to) {
    add("node.status", Map{{"to", to}});
    messages.back().source = "GotoGoal";
    return *this;
  }
  std::vector<Message> messages;

 private:
  Trace& add(const std::string& name, Map data) {
    Message m;
    m.name = name;
    m.time = now_;
    m.sequence = messages.size() + 1;
    m.data = std::move(data);
    messages.push_back(std::move(m));
    return *this;
  }
  TimePoint now_{};
};

struct Example {
  const char* name;
  std::function<void(Trace&)> bad;
  std::function<void(Trace&)> good;
  double end_s = 60;
};

const std::vector<Example>& examples() {
  static const std::vector<Example> kExamples{
      {"R1", [](Trace& t) { t.level(21).at(5).level(19.9); }, [](Trace& t) { t.level(21).at(5).level(20); }},
      {"R2", [](Trace& t) { t.go("goal").level(29).ticks(11); },
       [](Trace& t) { t.go("goal").level(29).ticks(10).near("station", true).ticks(5); }},
      {"R3", [](Trace& t) { t.speed(0.3).request("safety.halt").at(0.6).speed(0); },
       [](Trace& t) { t.speed(0.3).request("safety.halt").at(0.5).speed(0); }},
      {"R4", [](Trace& t) { t.arm(true, "OPEN").speed(0.1); }, [](Trace& t) { t.arm(true, "OPEN").speed(0); }},
      {"R5", [](Trace& t) { t.reply("localization.getLocalizationStatus", "NOT_YET_LOCALIZED").go("goal"); },
       [](Trace& t) { t.reply("localization.getLocalizationStatus", "LOCALIZED_OK").go("goal"); }},
      {"R6", [](Trace& t) { t.at(1.5).level(50); }, [](Trace& t) { t.at(1.5).level(50).at(3.5).level(50); }, 5.0},
      {"R7", [](Trace& t) { t.request("safety.stop").at(1).go("goal"); },
       [](Trace& t) { t.request("safety.stop").at(1).request("safety.reset").go("goal"); }},
      {"R8", [](Trace& t) { t.level(50).reply("battery.isCharging", true).speed(0).speed(0.2); },
       [](Trace& t) {
         t.level(50)
             .reply("battery.isCharging", true)
             .speed(0)
             .level(100)
             .reply("battery.isCharging", false)
             .speed(0.2);
       }},
      {"R9", [](Trace& t) { t.fails().at(10).fails().at(20).fails().at(60).fails(); },
       [](Trace& t) { t.fails().at(10).fails().at(20).fails().at(60.1).fails(); }, 70.0},
      {"R10", [](Trace& t) { t.near("goal", false); },
       [](Trace& t) {
         t.near("goal", false).reply("navigation.getNavigationState", Map{{"status", "WAITING_OBSTACLE"}});
       },
       400.0},
      {"R11", [](Trace& t) { t.level(31).level(29).at(10).level(31).level(29); },
       [](Trace& t) { t.level(31).level(29).at(30.1).level(31).level(29); }},
      {"R12", [](Trace& t) { t.arm(false, "CLOSED").reply("arm.pick", true).arm(false, "OPEN").request("arm.place"); },
       [](Trace& t) { t.arm(false, "CLOSED").reply("arm.pick", true).arm(false, "OPEN"); }},
  };
  return kExamples;
}

TEST(Examples, TheTwelveDecideAsTheySay) {
  const auto source =
      text::read_file(std::string(SENTREE_SOURCE_DIR) + "/examples/requirements/requirements/twelve.req");
  ASSERT_TRUE(source);
  const auto file = parse_requirements(*source, "twelve.req");
  ASSERT_TRUE(file.ok()) << to_string(file.diagnostics.front());
  ASSERT_EQ(file.value->requirements.size(), examples().size());
  for (std::size_t i = 0; i < examples().size(); ++i) {
    const Example& example = examples()[i];
    const Requirement& requirement = file.value->requirements[i];
    EXPECT_EQ(requirement.name, example.name);
    const auto violated = [&](const std::function<void(Trace&)>& play) {
      Trace trace;
      play(trace);
      const auto decided = evaluate({*Model::make(requirement).value}, trace.messages, TimePoint{},
                                    TimePoint(from_seconds(example.end_s)));
      return !decided.empty() && decided[0].decision.verdict == Verdict::kViolated;
    };
    EXPECT_TRUE(violated(example.bad)) << example.name;
    EXPECT_FALSE(violated(example.good)) << example.name;
  }
}

}  // namespace
}  // namespace sentree::monitor
