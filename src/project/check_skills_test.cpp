#include "sentree/project/detail/check_skills.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include "sentree/base/temporary_folder.h"

namespace sentree::project {
namespace {

namespace fs = std::filesystem;
using testing::Contains;
using testing::HasSubstr;
using testing::Not;

struct ExampleEdit {
  const char* file;
  const char* before;  // null: the file is new
  const char* after;
};

// What is said of an example with these changes.
std::vector<std::string> told_of(const char* example, const std::vector<ExampleEdit>& edits) {
  const TemporaryFolder temporary("check-skills");
  const fs::path folder = temporary.path() / "project";
  fs::copy(fs::path(SENTREE_SOURCE_DIR) / "examples" / example, folder, fs::copy_options::recursive);
  for (const ExampleEdit& edit : edits) {
    std::string content = edit.after;
    if (edit.before != nullptr) {
      std::stringstream text;
      text << std::ifstream(folder / edit.file).rdbuf();
      content = text.str();
      const auto at = content.find(edit.before);
      EXPECT_NE(at, std::string::npos) << "the example no longer has " << edit.before;
      content.replace(at, std::string(edit.before).size(), edit.after);
    }
    std::ofstream(folder / edit.file) << content;
  }
  std::vector<std::string> messages;
  for (const Diagnostic& diagnostic : check_project(folder)) messages.push_back(to_string(diagnostic));
  return messages;
}

TEST(CheckSkills, TellsWhatTheyGiveBackToNobody) {
  const char* const said = "Find has no output port \"prat\"; did you mean \"part\"?";
  EXPECT_THAT(told_of("pick-and-place", {{"skills/Find.scxml", "name=\"part\"", "name=\"prat\""}}),
              Contains(HasSubstr(said)));
  // What is nearly called so, where the port is given too, is another.
  EXPECT_THAT(told_of("pick-and-place", {{"skills/Find.scxml", "<param name=\"part\"",
                                          "<param name=\"prat\" expr=\"found\"/><param name=\"part\""}}),
              Not(Contains(HasSubstr("prat"))));
}

TEST(CheckSkills, KnowsWhatListsAndExceptionsHave) {
  EXPECT_THAT(told_of("pick-and-place",
                      {{"interfaces/cell.thrift", "string findPart", "list<string> findPart"},
                       {"skills/Find.scxml", "_event.data.result !== ''", "_event.data.result.lenght === 1"}}),
              Contains(HasSubstr("a list has no member \"lenght\"; did you mean \"length\"?")));
  EXPECT_THAT(told_of("pick-and-place",
                      {{"skills/Find.scxml", "event=\"camera.findPart error\"",
                        "event=\"camera.findPart.error\" cond=\"_event.data.exception.Jammed.why === 'x'\""}}),
              Contains(HasSubstr("an exception of findPart has no member \"Jammed\"")));
  EXPECT_THAT(
      told_of("pick-and-place", {{"skills/Find.scxml", "event=\"camera.findPart error\"",
                                  "event=\"camera.findPart.error\" cond=\"_event.data.kind === 'interrupted'\""}}),
      Not(Contains(HasSubstr("interrupted"))));
}

TEST(CheckSkills, LooksIntoInvokedCharts) {
  const auto told_of_child = [](const std::string& child) {
    return told_of("pick-and-place",
                   {{"skills/Find.scxml", "  <final id=\"success\"",
                     "  <state id=\"unused\"><invoke src=\"../Child.scxml\"/></state>\n  <final id=\"success\""},
                    {"Child.scxml", nullptr, child.c_str()}});
  };
  EXPECT_THAT(told_of_child("<scxml version=\"1.0\"><state id=\"a\"><onentry><send type=\"thrift\" target=\"camra\" "
                            "event=\"findPart\"/></onentry></state></scxml>"),
              Contains(HasSubstr("service \"camra\" is not in sentree.yaml; did you mean \"camera\"?")));
  EXPECT_THAT(told_of_child("<scxml version=\"1.0\"><state id=\"a\"><transition target=\"b\"/></state></scxml>"),
              Contains(HasSubstr("the invoked chart cannot be loaded")));
  EXPECT_THAT(
      told_of("pick-and-place", {{"skills/Find.scxml", "  <final id=\"success\"",
                                  "  <state id=\"s\"><invoke src=\"Gone.scxml\"/></state>\n  <final id=\"success\""}}),
      Contains(HasSubstr("\"Gone.scxml\" cannot be invoked")));
}

TEST(CheckSkills, TellsOfAnOutcomeThatEndsNothing) {
  EXPECT_THAT(told_of("pick-and-place", {{"skills/Find.scxml", "<final id=\"failure\"/>", "<state id=\"failure\"/>"}}),
              Contains(HasSubstr("state \"failure\" has no way out and ends nothing: write <final id=\"failure\"/>")));
}

TEST(CheckMonitors, TellsOfSendsThatNobodyReceives) {
  EXPECT_THAT(told_of("recharge", {{"monitors/battery.scxml", "<state id=\"failure\"/>",
                                    "<state id=\"s\"><onentry><send type=\"thrift\" target=\"navigation\" "
                                    "event=\"stopNavigation\"/></onentry></state>\n  <state id=\"failure\"/>"}}),
              Contains(HasSubstr("a monitor only watches: nobody receives its <send type=\"thrift\">")));
}

TEST(CheckSkills, TellsOfAListWithAHole) {
  EXPECT_THAT(told_of("porter", {{"models/porter.scxml", "expr=\"[0, 1, 2]\"", "expr=\"[, 1, 2]\""}}),
              Contains(HasSubstr("nothing between two commas")));
}

TEST(CheckScenarios, TellOfAWorldThatThereIsNotToChange) {
  EXPECT_THAT(told_of("modelled", {{"scenarios/b.yaml", nullptr, "override: {world: {robots: []}}\n"}}),
              Contains(HasSubstr("changes a world, and the project has none (world: FILE)")));
}

}  // namespace
}  // namespace sentree::project
