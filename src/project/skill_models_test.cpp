#include "sentree/project/skill_models.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

namespace sentree::project {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
namespace fs = std::filesystem;

/// A project in a folder of its own: file names and contents.
Project project(std::initializer_list<std::pair<const char*, std::string>> files) {
  const fs::path folder =
      fs::path(testing::TempDir()) /
      ("skill_models_" + std::string(testing::UnitTest::GetInstance()->current_test_info()->name()));
  fs::remove_all(folder);
  fs::create_directories(folder / "skills");
  for (const auto& [name, content] : files) std::ofstream(folder / name) << content;
  Project made;
  made.folder = folder;
  made.file = "sentree.yaml";
  made.mission.path = "mission.xml";
  return made;
}

std::string chart(const std::string& name, const std::string& data, const std::string& body) {
  return "<scxml xmlns=\"http://www.w3.org/2005/07/scxml\" version=\"1.0\" datamodel=\"ecmascript\" name=\"" + name +
         "\" initial=\"s\"><datamodel>" + data + "</datamodel>" + body + "<final id=\"success\"/></scxml>";
}

std::vector<std::string> described(const Project& from) {
  const auto models = skill_models(from);
  std::vector<std::string> all;
  if (!models.ok()) return {to_string(models.diagnostics.front())};
  for (const bt::NodeModel& model : *models.value) {
    std::string text = std::string(bt::to_string(model.category)) + " " + model.id + ":";
    for (const bt::PortInfo& port : model.ports) {
      text += " " + std::string(bt::to_string(port.direction)) + " " + port.name;
      if (!port.declared_type.empty())
        text += " " + port.declared_type;
      else if (port.type != nullptr)
        text += " " + port.type->name;
      if (port.default_text) text += "=" + *port.default_text;
    }
    all.push_back(text);
  }
  return all;
}

TEST(SkillModels, AreReadFromChartsThatTheMissionDoesNotMention) {
  EXPECT_THAT(
      described(
          project({{"skills/Ask.scxml", chart("Ask", "<data id=\"who\"/>", "<state id=\"s\"/>")},
                   {"skills/Go.scxml",
                    chart("Go",
                          "<data id=\"goal\"/><data id=\"speed\" expr=\"0.5\"/><data id=\"loud\" expr=\"true\"/>"
                          "<data id=\"word\" expr=\"'hi'\"/><data id=\"tries\" expr=\"0\"/><data id=\"n\" expr=\"1\"/>",
                          "<state id=\"s\"><onentry><assign location=\"tries\" expr=\"tries + 1\"/>"
                          "<script>n++;</script></onentry><transition event=\"halt\" target=\"success\"/></state>"
                          "<final id=\"failure\"><donedata><param name=\"why\" expr=\"1\"/></donedata></final>")}})),
      ElementsAre("Condition Ask: input_port who",
                  "Action Go: input_port goal input_port speed double=0.5 input_port loud bool=true input_port word "
                  "std::string=hi output_port why"));
}

TEST(SkillModels, KeepWhatTheMissionSaysAndFollowTheChart) {
  const Project p = project(
      {{"mission.xml",
        "<root BTCPP_format=\"4\"><BehaviorTree ID=\"M\"><Ask who=\"you\" name=\"n\"/></BehaviorTree><TreeNodesModel>"
        "<Action ID=\"Ask\"><input_port name=\"gone\"/><input_port name=\"who\" "
        "type=\"Person\">whom</input_port></Action>"
        "</TreeNodesModel></root>"},
       {"skills/Ask.scxml", chart("Ask", "<data id=\"how\" expr=\"'x'\"/><data id=\"who\"/>", "<state id=\"s\"/>")},
       {"skills/Ask-loud.scxml", chart("Ask", "<data id=\"who\"/>", "<state id=\"s\"/>")}});
  EXPECT_THAT(described(p), ElementsAre("Action Ask: input_port who Person input_port how std::string=x"));
  EXPECT_EQ(skill_models(p).value->front().ports.front().description, "whom");
}

TEST(SkillModels, HaveASkillInAnotherLanguageAsTheMissionDeclaresIt) {
  EXPECT_THAT(described(project(
                  {{"mission.xml",
                    "<root BTCPP_format=\"4\"><BehaviorTree ID=\"M\"><Far x=\"1\"/></BehaviorTree><TreeNodesModel>"
                    "<Action ID=\"Far\"><inout_port name=\"x\" type=\"int\"/></Action></TreeNodesModel></root>"}})),
              ElementsAre("Action Far: inout_port x int"));
}

TEST(SkillModels, HaveThePortsThatTheTreeUsesWhereNobodyDeclaresThem) {
  EXPECT_THAT(
      described(project({{"mission.xml",
                          R"(<root BTCPP_format="4"><BehaviorTree ID="Main"><Own a="1" b="{x}" _skipIf="true"><Sequence>
<Action ID="Count" name="one" topic="/t" n="3"/><Action ID="Count" n="{n}"/><Action ID="Go" to="home"/>
</Sequence></Own></BehaviorTree></root>)"},
                         {"skills/Go.scxml", chart("Go", "<data id=\"to\" expr=\"'x'\"/>", "<state id=\"s\"/>")}})),
      ElementsAre("Action Count: input_port topic inout_port n", "Action Go: input_port to std::string=x",
                  "Decorator Own: input_port a inout_port b"));
}

TEST(SkillModels, SayWhichChartCannotBeRead) {
  EXPECT_THAT(described(project({{"skills/Ask.scxml", "<scxml"}})).front(), HasSubstr("skills/Ask.scxml:1:"));
}

}  // namespace
}  // namespace sentree::project
