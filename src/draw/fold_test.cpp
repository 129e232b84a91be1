#include "sentree/draw/fold.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace sentree::draw {
namespace {

using testing::ElementsAre;

ChartState state(const std::string& name, int parent = -1) {
  ChartState made;
  made.parent = parent;
  made.name = name;
  return made;
}

ChartTransition transition(int source, int target, const std::string& event) {
  ChartTransition made;
  made.source = source;
  made.targets = {target};
  made.event = event;
  return made;
}

// outer { inner { deep } other } last
Chart nested() {
  Chart chart;
  chart.states = {state("outer"), state("inner", 0), state("deep", 1), state("other", 0), state("last")};
  chart.transitions = {transition(2, 3, "up"), transition(3, 4, "out"), transition(4, 2, "in"),
                       transition(0, 4, "own")};
  return chart;
}

std::vector<std::string> names(const FoldedChart& folded) {
  std::vector<std::string> found;
  for (const ChartState& one : folded.chart.states) found.push_back(one.name);
  return found;
}

TEST(Fold, HidesWhatIsInAClosedState) {
  const FoldedChart result = folded(nested(), {true, false, false, false, false});
  EXPECT_THAT(names(result), ElementsAre("outer", "last"));
  EXPECT_THAT(result.states, ElementsAre(0, 4));
  EXPECT_THAT(result.hidden, ElementsAre(3, 0));
}

TEST(Fold, LetsArrowsEndAtTheClosedStateAndHidesThoseInside) {
  const FoldedChart result = folded(nested(), {true, false, false, false, false});
  EXPECT_THAT(result.transitions, ElementsAre(1, 2, 3));
  EXPECT_EQ(result.chart.transitions[0].source, 0);
  EXPECT_THAT(result.chart.transitions[0].targets, ElementsAre(1));
  EXPECT_EQ(result.chart.transitions[1].source, 1);
  EXPECT_THAT(result.chart.transitions[1].targets, ElementsAre(0));
}

TEST(Fold, TheOutermostClosedStateIsTheOneThatIsShown) {
  const FoldedChart result = folded(nested(), {true, true, false, false, false});
  EXPECT_THAT(names(result), ElementsAre("outer", "last"));
  const FoldedChart inner = folded(nested(), {false, true, false, false, false});
  EXPECT_THAT(names(inner), ElementsAre("outer", "inner", "other", "last"));
  EXPECT_THAT(inner.hidden, ElementsAre(0, 1, 0, 0));
  EXPECT_EQ(inner.chart.states[1].parent, 0);
}

TEST(Fold, NothingClosedIsTheWhole) {
  const FoldedChart result = folded(nested(), std::vector<bool>(5, false));
  EXPECT_EQ(result.chart.states.size(), 5U);
  EXPECT_EQ(result.chart.transitions.size(), 4U);
}

}  // namespace
}  // namespace sentree::draw
