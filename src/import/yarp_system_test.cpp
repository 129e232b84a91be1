#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "sentree/base/temporary_folder.h"
#include "sentree/import/detail/made_file.h"
#include "sentree/import/import.h"
#include "sentree/project/plan.h"
#include "sentree/text/file.h"

namespace sentree::import {
namespace {

using std::filesystem::path;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::Field;
using ::testing::HasSubstr;
using ::testing::Not;

const path kRobot = path(SENTREE_SOURCE_DIR) / "src/import/testdata/robot";

Imported robot() {
  auto imported = import_system(kRobot);
  EXPECT_TRUE(imported.ok()) << (imported.diagnostics.empty() ? "" : to_string(imported.diagnostics[0]));
  return imported.ok() ? std::move(*imported.value) : Imported();
}

auto finding(Fate fate, const std::string& original, const std::string& reason) {
  return AllOf(Field(&Finding::fate, fate), Field(&Finding::original, HasSubstr(original)),
               Field(&Finding::reason, HasSubstr(reason)));
}

TEST(YarpSystem, BecomesAProjectThatCheckAccepts) {
  const TemporaryFolder folder("import");
  const path target = folder.path() / "robot";
  ASSERT_TRUE(write_project(robot(), target, false));
  auto project = project::load_project(target);
  ASSERT_TRUE(project.ok()) << to_string(project.diagnostics.at(0));
  const auto plan = project::prepare(project::plain_scenario(std::move(*project.value)));
  for (const Diagnostic& problem : plan.diagnostics) {
    // Ports of YARP are no addresses in this process; yarp.peers checks such a project.
    if (problem.code == "rpc.address" && problem.message.find("\"yarp:/") != std::string::npos) continue;
    EXPECT_NE(problem.severity, Severity::kError) << to_string(problem);
  }
}

TEST(YarpSystem, ACallWhoseResultIsUsedIsAStateThatWaits) {
  const std::string chart = made_file(robot(), "skills/ChargeOk.scxml");
  EXPECT_THAT(chart, HasSubstr("datamodel=\"ecmascript\""));
  EXPECT_THAT(chart, HasSubstr("<transition event=\"tick\" target=\"ask\"/>"));
  EXPECT_THAT(chart, HasSubstr("<state id=\"ask.charge\">"));
  EXPECT_THAT(chart, HasSubstr("<send type=\"thrift\" target=\"CellsComponent\" event=\"charge\" id=\"ask.charge\"/>"));
  EXPECT_THAT(chart, HasSubstr("<assign location=\"charge\" expr=\"_event.data.result\"/>"));
  EXPECT_THAT(chart, HasSubstr("<if cond=\"(charge &gt; 25.0)\">"));
  EXPECT_THAT(chart, HasSubstr("<!-- // in percent -->"));
  EXPECT_THAT(chart, HasSubstr("<!-- One call, and what its result means. -->"));
  EXPECT_THAT(chart, HasSubstr("<final id=\"success\"/>"));
}

TEST(YarpSystem, RaisesTimersAndEnumeratorsAreTranslated) {
  const std::string chart = made_file(robot(), "skills/Drive.scxml");
  EXPECT_THAT(chart, HasSubstr("<param name=\"mode\" expr=\"'CAREFUL'\"/>"));
  EXPECT_THAT(chart, HasSubstr("<assign location=\"tries\" expr=\"tries + 1\"/>"));
  EXPECT_THAT(chart, HasSubstr("cond=\"answer.allowed &amp;&amp; answer.reason == 'NO_REASON'\""));
  EXPECT_THAT(chart, HasSubstr("<send event=\"SENT\" delay=\"500ms\"/>"));
  EXPECT_THAT(chart, HasSubstr("<if cond=\"progress == 'MOVING' || progress == 'WAITING'\">"));
  EXPECT_THAT(chart, HasSubstr("<send event=\"AGAIN\" delay=\"200ms\"/>"));
  EXPECT_THAT(chart, HasSubstr("<raise event=\"DONE\"/>"));
  EXPECT_THAT(chart, HasSubstr("<log expr=\"'driving to' + ' ' + place\"/>"));
  EXPECT_THAT(chart, HasSubstr("expr=\"{allowed: false, reason: 'NO_REASON'}\""));
}

TEST(YarpSystem, StatesThatAnswerTheTreeBecomeTheEndsOfTheRun) {
  const Imported imported = robot();
  const std::string drive = made_file(imported, "skills/Drive.scxml");
  EXPECT_THAT(drive, HasSubstr("<transition event=\"halt\" target=\"halting\"/>"));
  EXPECT_THAT(drive, HasSubstr("<transition event=\"RESET\" target=\"halted\"/>"));
  EXPECT_THAT(drive, HasSubstr("<final id=\"halted\"/>"));
  // Nested ones, too.
  const std::string grasp = made_file(imported, "skills/Grasp.scxml");
  EXPECT_THAT(grasp, HasSubstr("<final id=\"success\"/>"));
  EXPECT_THAT(grasp, Not(HasSubstr("<state id=\"success\"")));
  EXPECT_THAT(imported.findings, Contains(finding(Fate::kNotNeeded, "REQUEST_ACK", "begins anew")));
}

TEST(YarpSystem, OneChartServesLeavesWithOptionsOfTheirOwn) {
  const std::string yaml = made_file(robot(), "sentree.yaml");
  EXPECT_THAT(yaml, HasSubstr("DriveToDock: {file: skills/Drive.scxml, data: {place: dock}}"));
  // "key value", and found by the program that an application starts with the file.
  EXPECT_THAT(yaml, HasSubstr("CellsComponent: {interface: cells.thrift/Cells, at: \"yarp:/CellsComponent\"}"));
  EXPECT_THAT(yaml, HasSubstr("DriveToShelf: {file: skills/Drive.scxml, data: {place: \"shelf 3\"}}"));
}

TEST(YarpSystem, WhatHasNoCounterpartStaysAtItsPlaceAndIsListed) {
  const Imported imported = robot();
  EXPECT_THAT(made_file(imported, "skills/Drive.scxml"),
              HasSubstr("<!-- not translated, see IMPORT.md: telemetry->count(\"stuck\", tries); -->"));
  EXPECT_THAT(imported.findings, Contains(finding(Fate::kByHand, "telemetry->count", "C++ without a counterpart")));
  EXPECT_THAT(imported.findings, Contains(finding(Fate::kByHand, "for (int i = 0", "a loop")));
  EXPECT_THAT(imported.findings, Contains(finding(Fate::kByHand, "unknownFlag", "not known")));
  EXPECT_THAT(imported.findings, Contains(finding(Fate::kByHand, "Shout", "no chart runs this leaf")));
  EXPECT_THAT(imported.findings, Contains(finding(Fate::kReview, "Rest", "until it is halted")));
  EXPECT_THAT(imported.findings, Contains(finding(Fate::kNotNeeded, "/CellsComponent", "observed by itself")));
  for (const Finding& finding : imported.findings) EXPECT_THAT(finding.span.file, HasSubstr("testdata/robot"));
}

TEST(YarpSystem, FindingsNameTheLineOfTheStatement) {
  for (const Finding& finding : robot().findings) {
    if (finding.original.find("telemetry") == std::string::npos) continue;
    const auto source = text::read_file(finding.span.file);
    ASSERT_TRUE(source);
    int line = 1;
    for (std::size_t at = 0; at < source->find("telemetry"); ++at) line += (*source)[at] == '\n' ? 1 : 0;
    EXPECT_EQ(finding.span.line, line);
    return;
  }
  FAIL() << "no finding";
}

TEST(YarpSystem, MonitorsComeAlongWithAnEntryToBeCompleted) {
  const Imported imported = robot();
  EXPECT_THAT(made_file(imported, "monitors/ChargeMonitor.scxml"), HasSubstr("chargeChanged"));
  EXPECT_THAT(made_file(imported, "sentree.yaml"), HasSubstr("#      tick: {on: mission.tick}"));
}

TEST(YarpSystem, TheSameInputGivesTheSameFiles) {
  const Imported first = robot();
  const Imported second = robot();
  ASSERT_EQ(first.files.size(), second.files.size());
  for (std::size_t i = 0; i < first.files.size(); ++i) EXPECT_EQ(first.files[i].content, second.files[i].content);
  EXPECT_EQ(report_of(first, "robot"), report_of(second, "robot"));
}

TEST(WriteProject, LeavesAFolderThatIsNotEmptyAloneUnlessForced) {
  const TemporaryFolder folder("import");
  const path mine = folder.path() / "mine.txt";
  ASSERT_TRUE(text::write_file(mine, "kept"));
  const Imported imported = robot();
  const auto refused = write_project(imported, folder.path(), false);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, "import.exists");
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "sentree.yaml"));
  ASSERT_TRUE(write_project(imported, folder.path(), true));
  EXPECT_TRUE(std::filesystem::exists(folder.path() / "IMPORT.md"));
  EXPECT_EQ(*text::read_file(mine), "kept");
}

TEST(ImportSystem, RefusesWhatItDoesNotKnow) {
  const TemporaryFolder folder("import");
  ASSERT_TRUE(text::write_file(folder.path() / "readme.txt", "nothing"));
  const auto imported = import_system(folder.path());
  ASSERT_FALSE(imported.ok());
  EXPECT_EQ(imported.diagnostics.at(0).code, "import.unknown-form");
  EXPECT_EQ(import_system(folder.path() / "nowhere").diagnostics.at(0).code, "file.not-found");
  EXPECT_EQ(import_system(folder.path() / "nowhere.xml").diagnostics.at(0).message, "there is no such file or folder");
}

TEST(ImportSystem, DoesNotFollowLinksOutOfTheFolder) {
  const TemporaryFolder folder("import");
  std::filesystem::create_directory(folder.path() / "system");
  std::filesystem::create_directory_symlink(kRobot, folder.path() / "system" / "elsewhere");
  EXPECT_FALSE(import_system(folder.path() / "system").ok());
}

TEST(ImportSystem, RefusesFoldersNestedWithoutEnd) {
  const TemporaryFolder folder("import");
  path deep = folder.path();
  for (int i = 0; i <= kFolderDepthMax; ++i) deep /= "a";
  std::filesystem::create_directories(deep / "b");
  EXPECT_EQ(import_system(folder.path()).diagnostics.at(0).code, "import.too-large");
}

}  // namespace
}  // namespace sentree::import
