// Several robots in one world: each has services of its own, and they meet as obstacles.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <string>

#include "sentree/idl/conform.h"
#include "sentree/processes/component.h"
#include "sentree/runtime/run.h"
#include "sentree/runtime/tap.h"

namespace sentree::processes {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::IsSupersetOf;

// A hall of 8 m x 4 m with a wall around it.
std::string hall() {
  std::string image = "P2 80 40 1\n";
  for (int i = 0; i < 80 * 40; ++i) image += i < 80 || i >= 80 * 39 || i % 80 == 0 || i % 80 == 79 ? "0 " : "1 ";
  return image;
}

// Drives one robot to a place: SERVICE and PLACE are filled in.
constexpr const char* kSkill =
    R"(<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" datamodel="ecmascript" initial="start">
  <state id="start"><transition event="tick" target="going"/></state>
  <state id="going">
    <onentry><send type="thrift" target="SERVICE" event="gotoTargetByLocationName"><param name="name" expr="'PLACE'"/></send></onentry>
    <transition event="halt" target="halted"/>
    <transition event="tick"><send type="thrift" target="SERVICE" event="getNavigationStatus"/></transition>
    <transition event="SERVICE.getNavigationStatus.reply" cond="_event.data.result == 'GOAL_REACHED'" target="success"/>
    <transition event="SERVICE.getNavigationStatus.reply" cond="_event.data.result == 'ABORTED'" target="failure"/>
  </state>
  <final id="success"/><final id="failure"/><final id="halted"/>
</scxml>)";

class TwoRobots : public testing::Test {
 protected:
  TwoRobots()
      : folder_(std::filesystem::path(testing::TempDir()) /
                testing::UnitTest::GetInstance()->current_test_info()->name()) {
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_ / "skills");
    write("hall.pgm", hall());
    write("hall.yaml", "image: hall.pgm\nresolution: 0.1\norigin: [0, 0, 0]\n");
    write("world.yaml",
          "map: hall.yaml\n"
          "robots: {left: {start: west}, right: {start: east, battery: {initial: 50 %}}}\n"
          "locations: {west: [1, 2, 0], east: [7, 2, 180 deg]}\n");
    write("mission.xml",
          R"(<root BTCPP_format="4"><BehaviorTree ID="Main"><Parallel success_count="2" failure_count="1">)"
          R"(<Action ID="LeftGoesEast"/><Action ID="RightGoesWest"/></Parallel></BehaviorTree></root>)");
    skill("LeftGoesEast", "navigation", "east");
    skill("RightGoesWest", "navigation2", "west");
    project("right");
  }
  ~TwoRobots() override { std::filesystem::remove_all(folder_); }

  void write(const std::string& name, const std::string& content) const { std::ofstream(folder_ / name) << content; }
  void skill(const std::string& name, const std::string& service, const std::string& place) const {
    std::string text = kSkill;
    for (const auto& [what, with] : {std::pair<std::string, std::string>{"SERVICE", service}, {"PLACE", place}}) {
      for (auto at = text.find(what); at != std::string::npos; at = text.find(what))
        text.replace(at, what.size(), with);
    }
    write("skills/" + name + ".scxml", text);
  }
  void project(const std::string& second) const {
    write("sentree.yaml",
          "mission: {file: mission.xml}\nworld: world.yaml\nservices:\n"
          "  navigation:  {interface: robot.thrift/Navigation}\n"
          "  navigation2: {interface: robot.thrift/Navigation, robot: " +
              second + "}\n");
  }
  std::string file(const std::string& name) const { return (folder_ / name).string(); }

  std::filesystem::path folder_;
};

TEST_F(TwoRobots, SwapPlacesEachThroughItsOwnService) {
  auto project = project::load_project(folder_);
  ASSERT_TRUE(project.ok()) << to_string(project.diagnostics.front());
  project::Scenario scenario = project::plain_scenario(std::move(*project.value));
  scenario.virtual_time = true;
  auto plan = prepare(std::move(scenario));
  for (const Diagnostic& diagnostic : plan.diagnostics) ADD_FAILURE() << to_string(diagnostic);
  ASSERT_TRUE(plan.ok());
  std::optional<sim::State> last;
  runtime::RunView* view = nullptr;
  runtime::RunOptions options;
  options.on_view = [&](runtime::RunView* now) {
    if (now != nullptr)
      view = now;
    else
      last = view->world();
  };
  const runtime::RunReport report = runtime::Run(*plan.value, std::move(options)).execute();
  EXPECT_EQ(report.mission, bt::Status::kSuccess);
  EXPECT_THAT(report.problems, IsEmpty());
  ASSERT_TRUE(last);
  EXPECT_NEAR(last->robots[0].truth.pose.x, 7.0, 0.1);
  EXPECT_NEAR(last->robots[1].truth.pose.x, 1.0, 0.1);
  EXPECT_EQ(last->robots[0].truth.collisions + last->robots[1].truth.collisions, 0);
}

TEST_F(TwoRobots, AServiceOfARobotThatIsNotThereIsNamed) {
  project("rigt");
  auto project = project::load_project(folder_);
  ASSERT_TRUE(project.ok());
  const auto plan = prepare(project::plain_scenario(std::move(*project.value)));
  EXPECT_FALSE(plan.ok());
  ASSERT_FALSE(plan.diagnostics.empty());
  EXPECT_THAT(
      to_string(plan.diagnostics.front()),
      HasSubstr(
          "service \"navigation2\" is of robot \"rigt\", which the world does not have; did you mean \"right\"?"));
}

TEST_F(TwoRobots, AComponentServesEachRobotByItsName) {
  auto component = prepare_sim_world(file("world.yaml"));
  ASSERT_TRUE(component.ok()) << to_string(component.diagnostics.front());
  std::vector<std::string> names;
  for (const auto& served : component.value->services) names.push_back(served.name);
  EXPECT_THAT(names, IsSupersetOf({"left/navigation", "right/navigation", "left/simulation", "right/battery"}));
  SimServer server(std::move(*component.value), 1, 1.0);
  const runtime::ControlHandler control = server.control("world.yaml");
  EXPECT_EQ(control.services().size(), names.size());
  const auto ask = [&](const std::string& service, const std::string& method, Map arguments = {}) {
    const mission::CallOutcome outcome = control.call(service, method, Value(std::move(arguments)));
    return outcome.ok ? to_json(outcome.result) : std::string(outcome.kind_word()) + ": " + outcome.message;
  };
  EXPECT_EQ(ask("right/battery", "getBatteryCharge"), "50.0");
  EXPECT_EQ(ask("left/simulation", "setBatteryCharge", {{"percent", 20}}), "\"OK\"");
  EXPECT_THAT(ask("left/battery", "getBatteryCharge"), HasSubstr("20.0"));
  EXPECT_EQ(ask("right/battery", "getBatteryCharge"), "50.0");
  EXPECT_EQ(ask("rigt/battery", "getBatteryCharge"),
            "arguments: the simulator has no service \"rigt/battery\"; did you mean \"right/battery\"?");
  EXPECT_THAT(ask("right/battery", "getBateryCharge"), HasSubstr("did you mean \"getBatteryCharge\"?"));
  EXPECT_THAT(ask("left/simulation", "setBatteryCharge"), HasSubstr("percent"));
}

TEST_F(TwoRobots, AComponentTellsWhatIsCalledAndWhereItServes) {
  auto component = prepare_sim_world(file("world.yaml"));
  ASSERT_TRUE(component.ok());
  SimServer server(std::move(*component.value), 1, 1.0);
  const runtime::ControlHandler control = server.control("world.yaml");
  ASSERT_NE(control.tap, nullptr);
  using std::chrono::milliseconds;
  const std::uint64_t before = control.tap->take(-1, "*", milliseconds(0)).next;
  ASSERT_TRUE(control.call("left/battery", "getBatteryCharge", Value(Map{})).ok);
  const auto services = server.services();
  const auto navigation =
      std::find_if(services.begin(), services.end(), [](const auto& each) { return each.name == "right/navigation"; });
  const idl::Method& method = *navigation->service->interface().find("getNavigationStatus");
  ASSERT_TRUE(navigation->service->call(method, Value(Map{})));
  EXPECT_THAT(control.tap->take(static_cast<std::int64_t>(before), "*", milliseconds(0)).messages,
              ElementsAre(HasSubstr("left/battery.getBatteryCharge.request"), HasSubstr("\"result\":100"),
                          HasSubstr("right/navigation.getNavigationStatus.request"),
                          HasSubstr("right/navigation.getNavigationStatus.reply")));
  const auto where = [&](const std::string& name) {
    for (const auto& entry : control.services()) {
      if (entry.name == name) return entry.at;
    }
    return std::string();
  };
  EXPECT_EQ(where("left/battery"), "sim");
  server.tell_address("left/battery", "tcp://127.0.0.1:9090/left/battery");
  server.tell_address("left/battery", "yarp:/left/battery/rpc:i");
  EXPECT_EQ(where("left/battery"), "tcp://127.0.0.1:9090/left/battery, yarp:/left/battery/rpc:i");
  EXPECT_EQ(where("right/battery"), "sim");
}

// With arguments of zeros, which most methods refuse in their reply: whatever it is, it has the shape that the IDL
// says.
TEST_F(TwoRobots, EveryReplyOfEveryMethodHasTheShapeOfTheIdl) {
  auto component = prepare_sim_world(file("world.yaml"));
  ASSERT_TRUE(component.ok());
  const std::vector<SimComponent::Served> services = component.value->services;
  SimServer server(std::move(*component.value), 1, 1.0);
  const runtime::ControlHandler control = server.control("world.yaml");
  int methods = 0;
  for (const SimComponent::Served& served : services) {
    if (served.robot != "left") continue;
    for (const idl::Method* method : served.service->methods) {
      Map arguments;
      for (const idl::Field& field : method->arguments.fields)
        arguments[field.name] = field.when_absent.value_or(Value());
      const mission::CallOutcome outcome = control.call(served.name, method->name, Value(std::move(arguments)));
      EXPECT_TRUE(outcome.ok) << served.name << "." << method->name << ": " << outcome.message;
      ++methods;
      if (!outcome.ok || method->result->kind == idl::Kind::kVoid) continue;
      const auto conforming = idl::conform(*method->result, outcome.result, method->name);
      EXPECT_TRUE(conforming) << served.name << "." << method->name << ": "
                              << (conforming ? "" : conforming.error().message);
    }
  }
  EXPECT_GT(methods, 80);
}

TEST_F(TwoRobots, AProjectsComponentHasTheProjectsNamesAndEveryTestControl) {
  auto project = project::load_project(folder_);
  ASSERT_TRUE(project.ok());
  auto component = prepare_sim(*project.value);
  ASSERT_TRUE(component.ok());
  std::vector<std::string> names;
  for (const auto& served : component.value->services) names.push_back(served.name + " of " + served.robot);
  EXPECT_THAT(names, ElementsAre("navigation of ", "navigation2 of right", "simulation of ", "left/simulation of left",
                                 "right/simulation of right"));
}

}  // namespace
}  // namespace sentree::processes
