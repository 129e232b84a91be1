#include "sentree/graph/chart.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace sentree::graph {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

TEST(Chart, HasADotForEachInitialStateAndTellsWhereStatesCameFrom) {
  const auto loaded = scxml::load(
      R"(<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" datamodel="ecmascript">
         <state id="a" initial="c"><state id="b"/><state id="c"/><transition event="e" cond="true" target="f"/></state>
         <final id="f"/></scxml>)",
      "door.scxml");
  ASSERT_TRUE(loaded.ok());
  std::vector<scxml::StateIndex> origin;
  const draw::Chart drawn = drawing_of(*loaded.value, nullptr, 0, &origin);
  EXPECT_THAT(origin, ElementsAre(scxml::kNoState, 1U, scxml::kNoState, 2U, 3U, 4U));
  EXPECT_EQ(drawn.states[1].name, "a");
  EXPECT_EQ(drawn.states[2].parent, 1);
  EXPECT_EQ(drawn.transitions.size(), 3U);
  EXPECT_THAT(draw::to_svg(drawn), HasSubstr("e [true]"));
}

}  // namespace
}  // namespace sentree::graph
