#include "sentree/design/parts.h"

#include <gmock/gmock.h>

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

}  // namespace
}  // namespace sentree::design
