#include "sentree/project/detail/check_verify.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include "sentree/base/temporary_folder.h"

namespace sentree::project {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::IsEmpty;

// What is said of examples/recharge with these lines in its `verify:`, or with this scenario.
std::vector<std::string> said(const std::string& verify, const std::string& choices = "") {
  const TemporaryFolder temporary("check-verify");
  const fs::path folder = temporary.path() / "recharge";
  fs::copy(fs::path(SENTREE_SOURCE_DIR) / "examples/recharge", folder, fs::copy_options::recursive);
  std::stringstream read;
  read << std::ifstream(folder / "sentree.yaml").rdbuf();
  std::string text = read.str();
  const auto at = text.find("verify:");
  EXPECT_NE(at, std::string::npos);
  text.erase(at);
  std::ofstream(folder / "sentree.yaml") << text << verify << "\n";
  fs::remove_all(folder / "scenarios");
  fs::create_directory(folder / "scenarios");
  std::ofstream(folder / "scenarios/one.yaml")
      << "clock: virtual\noverride: {services: {battery: {at: model}, navigation: {at: model}}}\n"
      << (choices.empty() ? "" : "choices: [" + choices + "]\n") << "expect: {mission: RUNNING}\n";
  std::vector<std::string> all;
  for (const Diagnostic& diagnostic : check_project(folder)) {
    std::string one = to_string(diagnostic);
    const std::string prefix = folder.string() + "/";
    for (auto place = one.find(prefix); place != std::string::npos; place = one.find(prefix))
      one.erase(place, prefix.size());
    all.push_back(one);
  }
  return all;
}

TEST(CheckVerify, WhatIsThereIsRight) {
  EXPECT_THAT(said("verify: {fair: [robot.plugs_in], faults: {any_of: [{kill: GoToKitchen}, {kill: battery}, "
                   "{delay: {message: battery.*, by: 1 s}}, {force: {leaf: AtKitchen, status: FAILURE}}]}}",
                   "{model: robot, number: 1, name: starts_at, value: 2}, {model: robot, number: 3, value: false}, "
                   "{model: robot, number: 4, name: plugs_in, value: true}"),
              IsEmpty());
}

TEST(CheckVerify, FaultsNameWhatIsThere) {
  EXPECT_THAT(
      said("verify: {faults: {any_of: [{kill: GoToKitchn}]}}"),
      ElementsAre("sentree.yaml:17:28: nothing of this run that can be killed is called \"GoToKitchn\"; did you "
                  "mean \"GoToKitchen\"?"));
  EXPECT_THAT(
      said("verify: {faults: {any_of: [{kill: GoToLocation}]}}"),
      ElementsAre("sentree.yaml:17:28: nothing of this run that can be killed is called \"GoToLocation\"; it is "
                  "the skill of GoToStation, GoToKitchen"));
  EXPECT_THAT(said("verify: {faults: {any_of: [{delay: {message: battry.*, by: 1 s}}]}}"),
              ElementsAre(testing::StartsWith("sentree.yaml:17:28: no message is called \"battry.*\"")));
  EXPECT_THAT(said("verify: {faults: {any_of: [{force: {leaf: AtKitchen, status: FAILUR}}]}}"),
              ElementsAre(testing::EndsWith("did you mean \"FAILURE\"?")));
}

TEST(CheckVerify, NoFaultsAtATimeAreNone) {
  EXPECT_THAT(said("verify: {faults: {at_most: 0, any_of: [{kill: GoToKitchen}]}}"),
              ElementsAre(testing::HasSubstr("none of these faults is ever tried")));
}

TEST(CheckVerify, FairNamesAChoice) {
  EXPECT_THAT(
      said("verify: {fair: [robot.plugs_inn]}"),
      ElementsAre("sentree.yaml:17:16: no model makes a choice called \"robot.plugs_inn\"; a choice gets a name "
                  "by pick('NAME', …), and is called MODEL.NAME; there are robot.plugs_in, robot.starts_at, "
                  "robot.starts_with; did you mean \"robot.plugs_in\"?"));
  // Every service has a model, so that none is made for any reply.
  EXPECT_THAT(said("verify: {fair: [any_battery.getBatteryState.percentage]}"),
              ElementsAre(testing::HasSubstr("no model makes a choice called \"any_battery.getBatteryState")));
}

TEST(CheckVerify, ChoicesAreOfTheModelAndItsAlternatives) {
  EXPECT_THAT(said("", "{model: robot, number: 1, name: starts_it, value: 2}"),
              ElementsAre("scenarios/one.yaml:3:11: model \"robot\" makes no choice called \"starts_it\"; did you mean "
                          "\"starts_at\"?"));
  EXPECT_THAT(
      said("", "{model: robot, number: 1, name: starts_at, value: 5}"),
      ElementsAre("scenarios/one.yaml:3:11: choice \"starts_at\" of model \"robot\" has no alternative 5; there "
                  "are 3, 2"));
  EXPECT_THAT(
      said("", "{model: robot, number: 1, value: 36}"),
      ElementsAre("scenarios/one.yaml:3:11: no choice of model \"robot\" has the alternative 36; there are 3, 2, "
                  "35, 32, false, true"));
  EXPECT_THAT(said("", "{model: robt, number: 1, name: starts_at, value: 2}"),
              ElementsAre(testing::HasSubstr("has no model \"robt\"; did you mean \"robot\"?")));
}

TEST(CheckVerify, OrdersNamePartsOfTheRun) {
  const std::string choice = "{model: robot, number: 1, name: starts_at, value: 2}";
  for (const char* part : {"mission", "GoToKitchen", "robot", "any_battery"})
    EXPECT_THAT(said("", choice + "]\norders: [{number: 3, first: " + part + "}"), IsEmpty()) << part;
  EXPECT_THAT(said("", choice + "]\norders: [{number: 3, first: GoToKitchn, tick: 2}"),
              ElementsAre("scenarios/one.yaml:4:10: order 3: the run has no part \"GoToKitchn\"; its parts are the "
                          "mission, its leaves and its models; did you mean \"GoToKitchen\"?"));
}

}  // namespace
}  // namespace sentree::project
