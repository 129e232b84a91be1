#include "sentree/studio/detail/sides.h"

#include <gtest/gtest.h>

#include "sentree/base/json.h"
#include "sentree/project/plan.h"
#include "sentree/text/file.h"

namespace sentree::studio {
namespace {

TEST(Sides, OnlyWhatARunReadIsComparedWithItsRecording) {
  const auto shipped = [](const char* file) {
    return text::read_file(project::shipped_folder("interfaces") / file).value_or("");
  };
  Sides sides{{{"sentree.yaml", "a"},
               {"mission.xml", "b"},
               {"gone.scxml", "c"},
               {"interfaces/robot.thrift", shipped("robot.thrift")}},
              {{"sentree.yaml", "a"}, {"mission.xml", "b"}, {"scenarios/other.yaml", "d"}}};
  ASSERT_FALSE(sides.before["interfaces/robot.thrift"].empty());
  keep_what_was_read(sides.before, sides.after);
  EXPECT_EQ(to_json(changed_files(sides)), R"([{"file":"gone.scxml","change":"removed"}])");
  // What comes with Sentree by now is another, or the project has its own.
  sides.before["interfaces/robot.thrift"] += "// earlier\n";
  EXPECT_EQ(sides.after["interfaces/robot.thrift"], shipped("robot.thrift"));
  EXPECT_EQ(to_json(changed_files(sides)),
            R"([{"file":"gone.scxml","change":"removed"},{"file":"interfaces/robot.thrift","change":"changed"}])");
}

}  // namespace
}  // namespace sentree::studio
