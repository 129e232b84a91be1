#include "sentree/runtime/problems.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace sentree::runtime {
namespace {

using testing::ElementsAre;
using testing::SizeIs;

TEST(Problems, ThatDifferInNumbersAloneAreOne) {
  Problems problems;
  EXPECT_EQ(problems.add("Leaf1 is unreachable; tried again in 601 ms"), 1U);
  EXPECT_EQ(problems.add("Leaf1 is unreachable; tried again in 58 ms"), 2U);
  EXPECT_EQ(problems.add("Leaf2 is unreachable; tried again in 58 ms"), 1U);
  EXPECT_EQ(problems.add("a call of Leaf1 was late (12.5 s)"), 1U);
  EXPECT_EQ(problems.add("a call of Leaf1 was late (7 s)"), 2U);
  EXPECT_EQ(problems.add("a call of Leaf1 was late (7th)"), 1U);
  EXPECT_THAT(
      problems.list(),
      ElementsAre("Leaf1 is unreachable; tried again in 601 ms (2 times)", "Leaf2 is unreachable; tried again in 58 ms",
                  "a call of Leaf1 was late (12.5 s) (2 times)", "a call of Leaf1 was late (7th)"));
}

TEST(Problems, ThatArePeersWhoAreTriedAgainAreOne) {
  Problems problems;
  EXPECT_EQ(problems.add("arm.move: \"arm\" is unreachable: no such port"), 1U);
  EXPECT_EQ(problems.add("arm.move: \"arm\" is unreachable: no such port; tried again in 8 ms"), 2U);
  EXPECT_EQ(problems.add("arm.move: \"arm\" is unreachable: no such port; tried again in 20 ms"), 3U);
  EXPECT_THAT(problems.list(), ElementsAre("arm.move: \"arm\" is unreachable: no such port (3 times)"));
}

TEST(Problems, AreBounded) {
  Problems problems;
  for (int i = 0; i < 1000; ++i) problems.add("problem" + std::to_string(i));
  EXPECT_THAT(problems.list(), SizeIs(Problems::kKindsMax));
  EXPECT_EQ(problems.add("problem7"), 2U);
  EXPECT_EQ(problems.add("problem777"), 901U);  // the others together
}

TEST(Problems, AreToldMoreAndMoreSeldom) {
  std::vector<std::size_t> told;
  for (std::size_t i = 0; i <= 2000; ++i) {
    if (is_power_of_ten(i)) told.push_back(i);
  }
  EXPECT_THAT(told, ElementsAre(1U, 10U, 100U, 1000U));
}

}  // namespace
}  // namespace sentree::runtime
