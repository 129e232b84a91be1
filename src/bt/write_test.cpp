#include "sentree/bt/write.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "sentree/bt/graph.h"
#include "sentree/bt/load.h"
#include "sentree/bt/step.h"

namespace sentree::bt {
namespace {

using ::testing::HasSubstr;

constexpr std::string_view kFile = R"(<?xml version="1.0"?>
<!-- A mission. -->
<root main_tree_to_execute="Main"   BTCPP_format="4">
<BehaviorTree ID="Main"><Sequence>
   <!-- first -->
   <GoTo   destination="kitchen" carrier='x' name="A"
           _skipIf="n &gt; 1"/>
   <GoTo name="B" destination="hall"/>
  </Sequence></BehaviorTree>
  <TreeNodesModel>
    <Action ID="GoTo"><input_port name="destination" type="std::string">where to</input_port></Action>
  </TreeNodesModel>
</root>
)";

TEST(Format, IndentsKeepsCommentsAndIsIdempotent) {
  const auto formatted = format(kFile);
  ASSERT_TRUE(formatted.has_value());
  EXPECT_THAT(*formatted,
              HasSubstr("<root BTCPP_format=\"4\" main_tree_to_execute=\"Main\">\n  <BehaviorTree ID=\"Main\">\n"));
  EXPECT_THAT(*formatted, HasSubstr("      <!-- first -->\n      <GoTo name=\"A\" destination=\"kitchen\" "
                                    "carrier=\"x\" _skipIf=\"n &gt; 1\"/>\n"));
  EXPECT_THAT(*formatted, HasSubstr("where to</input_port>"));
  EXPECT_EQ(format(*formatted).value(), *formatted);
  EXPECT_TRUE(diff(kFile, *formatted)->empty());
}

TEST(Diff, TellsChangedAddedRemovedAndMovedNodes) {
  std::string other(kFile);
  other.replace(other.find("kitchen"), 7, "cellar");
  auto found = diff(kFile, other).value();
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].path, "Main/Sequence/A");
  EXPECT_EQ(found[0].what, "destination: \"kitchen\" → \"cellar\"");
  EXPECT_EQ(found[0].before.line, 6);

  other = kFile;
  other.insert(other.find("<GoTo name=\"B\""), "<AlwaysSuccess/>");
  found = diff(kFile, other).value();
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].kind, Difference::Kind::kAdded);
  EXPECT_EQ(diff(other, kFile).value()[0].kind, Difference::Kind::kRemoved);
}

TEST(Diff, DoesNotCountHowANodeIsWritten) {
  std::string other(kFile);
  other.replace(other.find("<GoTo name=\"B\""), 5, "<Action ID=\"GoTo\"");
  EXPECT_TRUE(diff(kFile, other)->empty());
}

TEST(WithAttribute, ChangesOnePlaceOfTheFile) {
  auto loaded = load(std::string(kFile));
  ASSERT_TRUE(loaded.ok());
  const auto changed = with_attribute(kFile, *loaded.value, loaded.value->find("B"), "destination", "a < b");
  ASSERT_TRUE(changed.has_value());
  std::string expected(kFile);
  expected.replace(expected.find("hall"), 4, "a &lt; b");
  EXPECT_EQ(*changed, expected);
}

TEST(WithModels, AddsAndReplacesModelsAndKeepsTheRest) {
  const auto changed =
      with_models(kFile, {{"Wait", Category::kAction, {input<double>("seconds", "how long")}, {}}}).value();
  EXPECT_THAT(changed, HasSubstr("<input_port name=\"seconds\" type=\"double\">how long</input_port>"));
  EXPECT_THAT(changed, HasSubstr("<!-- first -->"));
  EXPECT_THAT(changed, HasSubstr("<Action ID=\"GoTo\">"));
  EXPECT_TRUE(load(changed).ok());
}

TEST(Graph, HasANodePerNodeColouredByItsState) {
  auto loaded = load(std::string(kFile));
  ASSERT_TRUE(loaded.ok());
  const Tree& tree = *loaded.value;
  State state(tree);
  Effects effects;
  ASSERT_TRUE(set_entry(tree, state, "n", 0, TimePoint{}).has_value());
  step(tree, state, Input::tick(), TimePoint{}, effects);
  const draw::Tree graph = to_graph(tree, &state);
  ASSERT_EQ(graph.nodes.size(), tree.size());
  EXPECT_EQ(graph.nodes[0].symbol, draw::kSequenceSymbol);
  EXPECT_EQ(graph.nodes[0].status, draw::TreeStatus::kRunning);
  EXPECT_EQ(graph.nodes[1].parent, 0);
  EXPECT_EQ(graph.nodes[1].title, "A");
}

}  // namespace
}  // namespace sentree::bt
