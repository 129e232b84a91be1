#include "sentree/design/parts.h"

#include <gmock/gmock.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "sentree/project/plan.h"
#include "sentree/scxml/format.h"

namespace sentree::design {
namespace {

TEST(NewParts, HaveChartsAsTheyAreFormatted) {
  auto project = project::load_project(std::string(SENTREE_SOURCE_DIR) + "/examples/minimal");
  ASSERT_TRUE(project.ok());
  const auto plan = project::prepare(project::plain_scenario(std::move(*project.value)));
  ASSERT_TRUE(plan.ok());
  int charts = 0;
  for (const char* const kind : kPartKinds) {
    // A short name, and one with which the lines are too long.
    for (const std::string& name : {std::string("x"), std::string(90, 'x')}) {
      for (const project::Plan* const known : {&*plan.value, static_cast<const project::Plan*>(nullptr)}) {
        const auto part = new_part(kind, name, known);
        ASSERT_TRUE(part) << part.error().message;
        for (const auto& [file, content] : part->files) {
          if (!file.ends_with(".scxml")) continue;
          ++charts;
          EXPECT_EQ(*scxml::format(content, file), content) << kind;
        }
      }
    }
  }
  EXPECT_EQ(charts, 12) << "of skills, monitors and components";
}

TEST(NewParts, AreNoSkillsCalledLikeBuiltInNodes) {
  for (const char* const name : {"Sequence", "Timeout", "SubTree", "Action"}) {
    const auto skill = new_part("skill", name, nullptr);
    ASSERT_FALSE(skill) << name;
    EXPECT_THAT(skill.error().message, testing::HasSubstr("is a built-in node"));
    EXPECT_TRUE(new_part("monitor", name, nullptr)) << name;
  }
}

// At the other end may be a robot.
TEST(NewParts, CallNothing) {
  auto project = project::load_project(std::string(SENTREE_SOURCE_DIR) + "/examples/minimal");
  ASSERT_TRUE(project.ok());
  const auto plan = project::prepare(project::plain_scenario(std::move(*project.value)));
  ASSERT_TRUE(plan.ok());
  const auto part = new_part("skill", "Wave", &*plan.value);
  ASSERT_TRUE(part);
  const std::string& source = part->files[0].second;
  EXPECT_THAT(source, testing::HasSubstr("<!-- <send type=\"thrift\" target=\"battery\""));
  const auto chart = scxml::load(source, "Wave.scxml");
  ASSERT_TRUE(chart.ok());
  for (const scxml::SendInfo& send : chart.value->sends()) EXPECT_NE(send.type, "thrift") << source;
}

// A project without services, and what it is when a part is added.
class PlainProject {
 public:
  PlainProject()
      : folder_(std::filesystem::path(testing::TempDir()) /
                testing::UnitTest::GetInstance()->current_test_info()->name()) {
    std::filesystem::remove_all(folder_);
    write("mission.xml",
          "<root BTCPP_format=\"4\"><BehaviorTree ID=\"Main\"><Repeat num_cycles=\"100\">"
          "<AlwaysSuccess/></Repeat></BehaviorTree></root>\n");
  }
  ~PlainProject() { std::filesystem::remove_all(folder_); }

  void write(const std::string& file, const std::string& content) const {
    std::filesystem::create_directories((folder_ / file).parent_path());
    std::ofstream(folder_ / file) << content;
  }
  Diagnostics with(const std::string& more) const {
    write("sentree.yaml", "mission: {file: mission.xml}\n" + more);
    return project::check_project(folder_);
  }
  Loaded<project::Plan> plan() const {
    auto loaded = project::load_project(folder_);
    return loaded.ok() ? project::prepare(project::plain_scenario(std::move(*loaded.value))) : Loaded<project::Plan>();
  }

 private:
  std::filesystem::path folder_;
};

TEST(NewParts, AreSoundInAProjectWithoutServices) {
  const PlainProject project;
  ASSERT_THAT(project.with(""), testing::IsEmpty());
  const auto plan = project.plan();
  ASSERT_TRUE(plan.ok());
  for (const char* const kind : {"monitor", "requirement"}) {
    const auto part = new_part(kind, "first", &*plan.value);
    ASSERT_TRUE(part) << kind;
    for (const auto& [file, content] : part->files) project.write(file, content);
    std::string entries;
    for (const auto& [section, entry] : part->entries) entries += section + ":\n  " + entry + "\n";
    std::string told;
    for (const Diagnostic& diagnostic : project.with(entries)) told += to_string(diagnostic) + "\n";
    EXPECT_EQ(told.find("requirements/"), std::string::npos) << told;
    EXPECT_EQ(told.find("monitors/"), std::string::npos) << told;
  }
}

TEST(NewParts, SpeakOfACallThatASkillMakes) {
  auto project = project::load_project(std::string(SENTREE_SOURCE_DIR) + "/examples/recharge");
  ASSERT_TRUE(project.ok());
  auto plan = project::prepare(project::plain_scenario(std::move(*project.value)));
  ASSERT_TRUE(plan.ok());
  // One that nobody calls, and comes first.
  plan.value->services.emplace("aaa", plan.value->services.at("battery")).first->second.name = "aaa";
  for (const char* const kind : {"monitor", "requirement"}) {
    const auto part = new_part(kind, "first", &*plan.value);
    ASSERT_TRUE(part) << kind;
    EXPECT_THAT(part->files[0].second, testing::Not(testing::HasSubstr("aaa."))) << kind;
  }
}

TEST(NewParts, AreNoComponentsCalledLikeWhatIsThere) {
  auto project = project::load_project(std::string(SENTREE_SOURCE_DIR) + "/examples/recharge");
  ASSERT_TRUE(project.ok());
  auto plan = project::prepare(project::plain_scenario(std::move(*project.value)));
  ASSERT_TRUE(plan.ok());
  project::ModelEntry& model = plan.value->scenario.project.models.emplace_back();
  for (const char* const name : {"arm", "arm_model"}) {
    model.name = name;
    const auto part = new_part("component", "arm", &*plan.value);
    ASSERT_FALSE(part) << name;
    EXPECT_THAT(part.error().message, testing::StartsWith(std::string("there is a model ") + name + " already"));
  }
  EXPECT_TRUE(new_part("component", "leg", &*plan.value));
  EXPECT_FALSE(new_part("component", "mission", &*plan.value));
}

}  // namespace
}  // namespace sentree::design
