#include "sentree/graph/tree.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "sentree/bt/load.h"
#include "sentree/bt/step.h"

namespace sentree::graph {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

bt::Tree tree(const std::string& body) {
  auto loaded = bt::load("<root BTCPP_format=\"4\" main_tree_to_execute=\"Main\"><BehaviorTree ID=\"Main\">" + body +
                         "</BehaviorTree></root>");
  EXPECT_TRUE(loaded.ok());
  return std::move(*loaded.value);
}

TEST(Tree, HasANodePerNodeColouredByItsState) {
  const bt::Tree model = tree(R"(<Sequence><Action ID="GoTo" name="A" destination="kitchen" _skipIf="1 &gt; 2"/>
                                 <Action ID="GoTo" name="B"/></Sequence>)");
  bt::State state(model);
  bt::Effects effects;
  step(model, state, bt::Input::tick(), TimePoint{}, effects);
  const draw::Tree drawn = drawing_of(model, &state);
  ASSERT_EQ(drawn.nodes.size(), model.size());
  EXPECT_EQ(drawn.nodes[0].symbol, draw::kSequenceSymbol);
  EXPECT_EQ(drawn.nodes[0].status, draw::TreeStatus::kRunning);
  EXPECT_EQ(drawn.nodes[1].parent, 0);
  EXPECT_EQ(drawn.nodes[1].title, "A");
  EXPECT_THAT(drawn.nodes[1].lines, ElementsAre("GoTo", "destination: kitchen", "_skipIf: 1 > 2"));
  EXPECT_THAT(drawing_of(model, nullptr, {.ports = false, .conditions = false}).nodes[2].lines, ElementsAre("GoTo"));
}

TEST(Tree, ShowsControlsByTheirSignsAndDecoratorsByTheirNames) {
  const bt::Tree model = tree(R"(<ReactiveFallback><SequenceWithMemory><AlwaysSuccess/></SequenceWithMemory>
      <ParallelAll><AlwaysFailure/></ParallelAll><Inverter name="not"><AlwaysSuccess/></Inverter></ReactiveFallback>)");
  const draw::Tree drawn = drawing_of(model);
  EXPECT_EQ(drawn.nodes[0].symbol, "R" + std::string(draw::kFallbackSymbol));
  EXPECT_EQ(drawn.nodes[1].symbol, std::string(draw::kSequenceSymbol) + "*");
  EXPECT_EQ(drawn.nodes[3].symbol, draw::kParallelSymbol);
  EXPECT_EQ(drawn.nodes[5].symbol, "Inverter");
  EXPECT_EQ(drawn.nodes[5].title, "not");
  EXPECT_THAT(drawn.nodes[6].lines, IsEmpty());
}

}  // namespace
}  // namespace sentree::graph
