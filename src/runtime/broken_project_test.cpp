// Projects broken in one way each, and the exact message that a user gets.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include "sentree/runtime/plan.h"

namespace sentree::runtime {
namespace {

namespace fs = std::filesystem;

struct Broken {
  const char* name;
  const char* file;     // in examples/recharge
  const char* before;   // replaced …
  const char* after;    // … by this; both null: the file is removed
  const char* message;  // without the project's folder
};

const Broken kBroken[] = {
    {"MalformedXml", "mission.xml", "</BehaviorTree>", "</BehaviourTree>",
     "mission.xml:33:3: </BehaviourTree> closes <BehaviorTree>"},
    {"UnknownLeaf", "mission.xml", "<WaitForUser name=\"WaitForUser\"/>", "<WaitForUsr name=\"WaitForUser\"/>", ""},
    {"MissingSkillFile", "skills/WaitForUser.scxml", nullptr, nullptr, ""},
    {"MisspeltPort", "mission.xml", "threshold=\"30\"", "treshold=\"30\"", ""},
    {"TwoRootTrees", "mission.xml", "  <TreeNodesModel>",
     "  <BehaviorTree ID=\"Main\"><AlwaysSuccess/></BehaviorTree>\n  <TreeNodesModel>", ""},
    {"BadChartTarget", "skills/BatteryLevelAbove.scxml", "target=\"success\"/>", "target=\"succes\"/>", ""},
    {"ScriptSyntax", "skills/BatteryLevelAbove.scxml", "&gt; threshold", "&gt; (threshold", ""},
    {"UnknownService", "skills/BatteryLevelAbove.scxml", "target=\"battery\"", "target=\"batery\"",
     "skills/BatteryLevelAbove.scxml:12:34: service \"batery\" is not in sentree.yaml; did you mean \"battery\"?"},
    {"UnknownMethod", "skills/BatteryLevelAbove.scxml", "event=\"getBatteryState\"", "event=\"getBateryState\"", ""},
    {"WrongArgumentType", "skills/AtLocation.scxml", "expr=\"linear_tolerance\"", "expr=\"'near'\"", ""},
    {"TruncatedMap", "world/house.pgm", nullptr, "P5\n10 10\n255\nabc", ""},
    {"UnknownDestination", "mission.xml", "destination=\"kitchen\"", "destination=\"kichen\"",
     "mission.xml:30:9: \"kichen\", the destination of GoToKitchen, is no location or area of world/world.yaml; did "
     "you mean \"kitchen\"?"},
    {"OutcomeThatIsNone", "skills/GoToLocation.scxml", "<final id=\"halted\"/>", "<final id=\"stopped\"/>", ""},
    {"ToleranceTooNarrow", "skills/AtLocation.scxml", "expr=\"0.3\"", "expr=\"0.01\"", ""},
    {"ToleranceTooWide", "skills/AtLocation.scxml", "expr=\"0.3\"", "expr=\"3\"", ""},
    {"UnknownMonitorState", "sentree.yaml", "violated: [failure]}\n  - ", "violated: [failed]}\n  - ", ""},
    {"NoInterface", "sentree.yaml", "robot.thrift/Battery", "robots.thrift/Battery", ""},
    {"TestControlAsService", "skills/BatteryLevelAbove.scxml", "target=\"battery\"", "target=\"simulation\"", ""},
    {"BadAddress", "sentree.yaml", "Battery,    at: sim", "Battery,    at: 'http://here'", ""},
    {"AttributeNobodyDeclared", "mission.xml", "threshold=\"30\"", "threshold=\"30\" carrier=\"tcp\"", ""},
};

class BrokenProject : public testing::TestWithParam<Broken> {};

void edit(const fs::path& file, const Broken& broken) {
  if (broken.after == nullptr) {
    ASSERT_TRUE(fs::remove(file));
    return;
  }
  if (broken.before == nullptr) {
    std::ofstream(file) << broken.after;
    return;
  }
  std::stringstream text;
  text << std::ifstream(file).rdbuf();
  std::string content = text.str();
  const auto at = content.find(broken.before);
  ASSERT_NE(at, std::string::npos) << "the example no longer has " << broken.before;
  content.replace(at, std::string(broken.before).size(), broken.after);
  std::ofstream(file) << content;
}

TEST_P(BrokenProject, IsReportedExactly) {
  const Broken& broken = GetParam();
  const fs::path folder = fs::path(testing::TempDir()) / (std::string("broken-") + broken.name);
  fs::remove_all(folder);
  fs::copy(fs::path(SENTREE_SOURCE_DIR) / "examples/recharge", folder, fs::copy_options::recursive);
  edit(folder / broken.file, broken);
  auto project = load_project(folder);
  ASSERT_TRUE(project.ok());
  const auto plan = prepare(plain_scenario(std::move(*project.value)));
  std::string messages;
  for (const Diagnostic& diagnostic : plan.diagnostics) {
    std::string text = to_string(diagnostic);
    for (auto at = text.find(folder.string() + "/"); at != std::string::npos; at = text.find(folder.string() + "/")) {
      text.erase(at, folder.string().size() + 1);
    }
    messages += (messages.empty() ? "" : "\n") + text;
  }
  EXPECT_EQ(messages, broken.message);
  fs::remove_all(folder);
}

INSTANTIATE_TEST_SUITE_P(Table, BrokenProject, testing::ValuesIn(kBroken),
                         [](const auto& param) { return param.param.name; });

}  // namespace
}  // namespace sentree::runtime
