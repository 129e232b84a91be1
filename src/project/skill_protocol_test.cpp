#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include "sentree/project/plan.h"
#include "sentree/project/skill_models.h"

namespace sentree::project {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::IsEmpty;

const fs::path kExample = fs::path(SENTREE_SOURCE_DIR) / "examples/living-skills";

// The example with one change, and what is said of it, without the folder.
class Changed {
 public:
  Changed(const std::string& file, const std::string& before, const std::string& after)
      : folder_(fs::path(testing::TempDir()) / testing::UnitTest::GetInstance()->current_test_info()->name() / "p") {
    fs::remove_all(folder_.parent_path());
    fs::create_directories(folder_.parent_path());
    fs::copy(kExample, folder_, fs::copy_options::recursive);
    fs::copy(kExample / "../minimal", folder_ / "../minimal", fs::copy_options::recursive);
    if (file.empty()) return;
    std::stringstream text;
    text << std::ifstream(folder_ / file).rdbuf();
    std::string content = text.str();
    const auto at = content.find(before);
    EXPECT_NE(at, std::string::npos) << "the example no longer has " << before;
    content.replace(at, before.size(), after);
    std::ofstream(folder_ / file) << content;
  }
  ~Changed() { fs::remove_all(folder_.parent_path()); }

  std::vector<std::string> messages() const {
    auto project = load_project(folder_);
    Diagnostics diagnostics = project.diagnostics;
    if (project.ok()) diagnostics = prepare(plain_scenario(std::move(*project.value))).diagnostics;
    std::vector<std::string> messages;
    for (const Diagnostic& diagnostic : diagnostics) {
      std::string text = to_string(diagnostic);
      const std::string prefix = folder_.string() + "/";
      for (auto at = text.find(prefix); at != std::string::npos; at = text.find(prefix)) text.erase(at, prefix.size());
      messages.push_back(text);
    }
    return messages;
  }
  const fs::path& folder() const { return folder_; }

 private:
  fs::path folder_;
};

TEST(SkillData, IsCheckedAgainstTheChart) {
  EXPECT_THAT(Changed("", "", "").messages(), IsEmpty());
  EXPECT_THAT(Changed("sentree.yaml", "data: {threshold", "data: {treshold").messages(),
              ElementsAre("sentree.yaml:24:83: data \"treshold\" reaches nothing: skills/BatteryLevel.scxml has no "
                          "<data id=\"treshold\"> directly below <scxml>; did you mean \"threshold\"?"));
  EXPECT_THAT(
      Changed("sentree.yaml", "place: desk", "place: desc").messages(),
      ElementsAre(testing::StartsWith("sentree.yaml:26:75: \"desc\", the place of ToDesk, is no location or area")));
}

TEST(SkillData, AndAPortAreNotBothGiven) {
  const Changed changed("mission.xml", "<Action ID=\"VisitDesk\"/>",
                        "<Action ID=\"VisitDesk\"><input_port name=\"place\" default=\"door\"/></Action>");
  EXPECT_THAT(
      changed.messages(),
      ElementsAre(testing::AllOf(
          testing::StartsWith("mission.xml:8:9: input port \"place\" of ToDesk, which may have a default"),
          testing::EndsWith("data of its skill at sentree.yaml:26 set the same <data>; leave one of them out"))));
}

TEST(SkillData, IsNoPortForThePalette) {
  const auto project = load_project(kExample);
  ASSERT_TRUE(project.ok());
  const auto models = skill_models(*project.value);
  ASSERT_TRUE(models.ok());
  for (const bt::NodeModel& model : *models.value) {
    if (!model.id.starts_with("VisitD") && model.id != "BatteryAboveHalf") continue;
    for (const bt::PortInfo& port : model.ports)
      EXPECT_TRUE(port.name != "place" && port.name != "threshold") << model.id;
  }
}

struct Case {
  const char* before;
  const char* after;
  const char* message;
};

TEST(SkillProtocol, EachNameIsCheckedAgainstTheChart) {
  const Case cases[] = {
      {"tick: CMD_TICK", "tick: CMD_TIK",
       "sentree.yaml:12:11: skills/BatteryLevel.scxml has no transition for \"CMD_TIK\"; did you mean \"CMD_TICK\"?"},
      {"event: TICK_RESPONSE", "event: TICK_RESPONS",
       "sentree.yaml:13:21: skills/BatteryLevel.scxml never sends \"TICK_RESPONS\", which is to answer its ticks; did "
       "you "
       "mean \"TICK_RESPONSE\"?"},
      {"param: status", "param: state",
       "skills/BatteryLevel.scxml:14:7: \"TICK_RESPONSE\" answers a tick and has no param \"state\""},
      {"0: SUCCESS, ", "", "skills/BatteryLevel.scxml:14:35: the answer 0 is none of the protocol's values (1, 2)"},
      {"1: FAILURE", "1: FALURE",
       "sentree.yaml:13:75: \"1\" means \"FALURE\", which is no status; write SUCCESS, FAILURE or RUNNING; did you "
       "mean "
       "\"FAILURE\"?"},
      {"{success: SUCCESS", "{succes: SUCCESS",
       "sentree.yaml:19:14: skills/Visit.scxml has no state \"succes\"; did you mean \"success\"?"},
      {"halted: idle", "halted: idel",
       "sentree.yaml:20:13: skills/Visit.scxml neither sends an event \"idel\" nor has such a state; did you mean "
       "\"idle\"?"},
      {"acknowledge: CMD_OK", "acknowlege: CMD_OK",
       "sentree.yaml:18:5: protocol \"standing\" has no key \"acknowlege\"; did you mean \"acknowledge\"?"},
      {"protocol: answering", "protocol: answerin",
       "sentree.yaml:24:65: \"protocols\" has no \"answerin\"; did you mean \"answering\"?; a protocol can also be "
       "written "
       "here, as {tick: …, answer: …}"},
      {"tick: CMD_TICK", "halt: CMD_TICK",
       "sentree.yaml:12:5: protocol \"answering\" needs \"tick\" or \"start\": the event that sets the chart to work"},
  };
  for (const Case& one : cases) {
    const auto messages = Changed("sentree.yaml", one.before, one.after).messages();
    EXPECT_THAT(messages, testing::Contains(std::string(one.message))) << one.after;
  }
}

}  // namespace
}  // namespace sentree::project
