#include "sentree/design/comparison.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "sentree/bt/write.h"
#include "sentree/scxml/diff.h"

namespace sentree::design {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

const Kinds& kinds() {
  static const Kinds kKinds{{}};
  return kKinds;
}

Comparison compared(const std::string& before, const std::string& after) {
  auto comparison = compare(before, after, kinds(), "before", "after");
  if (!comparison) {
    ADD_FAILURE() << to_string(comparison.error());
    return {};
  }
  return std::move(*comparison);
}

std::string tree(const std::string& nodes) {
  return "<root BTCPP_format=\"4\">\n<BehaviorTree ID=\"Main\">\n" + nodes + "\n</BehaviorTree>\n</root>\n";
}

// "added Name", … of the parts that have a mark, in the order drawn.
std::vector<std::string> marked(const ComparedTree& compared) {
  std::vector<std::string> found;
  for (std::size_t i = 0; i < compared.marks.size(); ++i) {
    if (compared.marks[i] != Mark::kNone)
      found.push_back(std::string(to_string(compared.marks[i])) + " " + compared.drawing.nodes[i].title);
  }
  return found;
}

std::vector<std::string> marked(const ComparedChart& compared) {
  std::vector<std::string> found;
  for (std::size_t i = 0; i < compared.states.size(); ++i) {
    if (compared.states[i] != Mark::kNone)
      found.push_back(std::string(to_string(compared.states[i])) + " " + compared.drawing.states[i].name);
  }
  for (std::size_t i = 0; i < compared.transitions.size(); ++i) {
    if (compared.transitions[i] != Mark::kNone)
      found.push_back(std::string(to_string(compared.transitions[i])) + " " + compared.drawing.transitions[i].event);
  }
  return found;
}

const char* const kBefore = R"(<Sequence name="Root">
  <Fallback name="First"><AlwaysSuccess name="A"/><AlwaysFailure name="Gone"/></Fallback>
  <Sequence name="Second"><Sleep name="Wait" msec="10"/></Sequence>
</Sequence>)";
const char* const kAfter = R"(<Sequence name="Root">
  <Fallback name="First"><SetBlackboard name="New" output_key="k" value="1"/></Fallback>
  <Sequence name="Second"><Sleep name="Wait" msec="20"/><AlwaysSuccess name="A"/></Sequence>
</Sequence>)";

TEST(Comparison, ShowsWhatWasAddedRemovedMovedAndChangedInOneTree) {
  const Comparison comparison = compared(tree(kBefore), tree(kAfter));
  ASSERT_EQ(comparison.trees.size(), 1U);
  const ComparedTree& one = comparison.trees.front();
  EXPECT_THAT(marked(one), ElementsAre("left A", "removed Gone", "added New", "changed Wait", "moved A"));
  EXPECT_EQ(comparison.differences.size(), bt::diff(tree(kBefore), tree(kAfter))->size());
  ASSERT_EQ(comparison.differences.size(), 4U);
  for (std::size_t i = 0; i < 4; ++i) {
    const ComparedPlace& place = comparison.places[i];
    ASSERT_EQ(place.tree, 0);
    const auto part = static_cast<std::size_t>(place.part);
    // A difference is shown at the part that it is about, with the mark of its kind.
    EXPECT_THAT(comparison.differences[i].path, testing::EndsWith("/" + one.drawing.nodes[part].title));
  }
  ASSERT_EQ(one.moves.size(), 1U);
  EXPECT_EQ(one.marks[static_cast<std::size_t>(one.moves[0].first)], Mark::kLeft);
  EXPECT_EQ(one.marks[static_cast<std::size_t>(one.moves[0].second)], Mark::kMoved);
}

TEST(Comparison, SaysWhatAPortWasAndIs) {
  const Comparison comparison = compared(tree(kBefore), tree(kAfter));
  const auto& nodes = comparison.trees.front().drawing.nodes;
  const auto wait = std::find_if(nodes.begin(), nodes.end(), [](const auto& node) { return node.title == "Wait"; });
  ASSERT_NE(wait, nodes.end());
  EXPECT_THAT(wait->lines, ElementsAre("Sleep", "msec: 10 → 20"));
}

TEST(Comparison, DrawsParentsBeforeTheirChildren) {
  const Comparison comparison = compared(tree(kBefore), tree(kAfter));
  const auto& nodes = comparison.trees.front().drawing.nodes;
  for (std::size_t i = 0; i < nodes.size(); ++i) EXPECT_LT(nodes[i].parent, static_cast<int>(i));
}

TEST(Comparison, KeepsWhatWasWrappedAndShowsItAsMoved) {
  const std::string before = tree("<Sequence name=\"Root\"><AlwaysSuccess name=\"A\"/></Sequence>");
  const std::string after =
      tree("<Sequence name=\"Root\"><Inverter name=\"Not\"><AlwaysSuccess name=\"A\"/></Inverter></Sequence>");
  EXPECT_THAT(marked(compared(before, after).trees.front()), ElementsAre("left A", "added Not", "moved A"));
  EXPECT_THAT(marked(compared(after, before).trees.front()), ElementsAre("removed Not", "left A", "moved A"));
}

TEST(Comparison, MarksNothingWhereOnlyTheWritingDiffers) {
  const Comparison comparison = compared(tree(kBefore), tree("<!-- said -->" + std::string(kBefore)));
  EXPECT_THAT(comparison.differences, IsEmpty());
  EXPECT_THAT(marked(comparison.trees.front()), IsEmpty());
}

TEST(Comparison, ShowsATreeThatCameAndOneThatWent) {
  const auto with = [](const std::string& id) {
    return "<root BTCPP_format=\"4\"><BehaviorTree ID=\"Main\"><AlwaysSuccess/></BehaviorTree><BehaviorTree ID=\"" +
           id + "\"><AlwaysFailure name=\"" + id + "Leaf\"/></BehaviorTree></root>";
  };
  const Comparison comparison = compared(with("Old"), with("New"));
  ASSERT_EQ(comparison.trees.size(), 3U);
  EXPECT_THAT(marked(comparison.trees[1]), ElementsAre("added NewLeaf"));
  EXPECT_THAT(marked(comparison.trees[2]), ElementsAre("removed OldLeaf"));
  ASSERT_EQ(comparison.places.size(), 2U);
  EXPECT_EQ(comparison.places[0].tree, 2);
  EXPECT_EQ(comparison.places[1].tree, 1);
}

std::string chart(const std::string& states) {
  return "<scxml xmlns=\"http://www.w3.org/2005/07/scxml\" version=\"1.0\" name=\"Door\" initial=\"closed\">\n" +
         states + "\n</scxml>\n";
}

TEST(Comparison, ShowsWhatBecameOfStatesAndTransitions) {
  const std::string before = chart(R"(<state id="closed"><transition event="open" target="moving"/>
      <transition event="lock" target="locked"/></state>
    <state id="moving"/><state id="locked"/><state id="outer"/>)");
  const std::string after = chart(R"(<state id="closed"><transition event="open" cond="true" target="moving"/></state>
    <state id="outer" initial="moving"><state id="moving"/></state><state id="ajar"/>)");
  const Comparison comparison = compared(before, after);
  ASSERT_TRUE(comparison.chart);
  EXPECT_EQ(comparison.differences.size(), scxml::diff(before, after)->size());
  EXPECT_THAT(marked(*comparison.chart), testing::IsSupersetOf({"added ajar", "removed locked", "moved moving",
                                                                "left moving", "changed open", "removed lock"}));
  for (std::size_t i = 0; i < comparison.chart->drawing.states.size(); ++i)
    EXPECT_LT(comparison.chart->drawing.states[i].parent, static_cast<int>(i));
}

TEST(Comparison, ShowsWhereATransitionLedAndLeads) {
  const std::string before =
      chart("<state id=\"closed\"><transition event=\"go\" target=\"a\"/></state><state id=\"a\"/><state id=\"b\"/>");
  const std::string after =
      chart("<state id=\"closed\"><transition event=\"go\" target=\"b\"/></state><state id=\"a\"/><state id=\"b\"/>");
  const Comparison comparison = compared(before, after);
  EXPECT_THAT(marked(*comparison.chart), ElementsAre("changed go", "left "));
}

TEST(Comparison, RefusesWhatIsNoPicture) {
  EXPECT_EQ(compare(tree("<AlwaysSuccess/>"), chart("<state id=\"closed\"/>"), kinds(), "a", "b").error().code,
            "diff.unlike");
  EXPECT_EQ(compare("rate: 1", "rate: 2", kinds(), "a", "b").error().code, "diff.unlike");
}

TEST(Comparison, SaysWhereAndWhyATextCannotBeRead) {
  const std::string good = tree("<AlwaysSuccess/>");
  const std::string bad = tree("<AlwaysSuccess/><Broken");
  const auto told = [&](const std::string& before, const std::string& after, const char* was, const char* is) {
    return to_string(compare(before, after, kinds(), was, is).error());
  };
  EXPECT_THAT(told(good, bad, "a.xml", "b.xml"),
              testing::MatchesRegex("b.xml:[34]:[0-9]+: cannot be read, so that texts are compared: .+"));
  EXPECT_THAT(told(bad, good, "m.xml", "m.xml"),
              testing::MatchesRegex("m.xml:[34]:[0-9]+: what was there cannot be read, so .+"));
  EXPECT_THAT(told(good, "", "a.xml", "a.xml"), testing::HasSubstr("what is there now cannot be read"));
}

}  // namespace
}  // namespace sentree::design
