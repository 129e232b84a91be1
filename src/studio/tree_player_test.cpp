#include "sentree/studio/detail/tree_player.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace sentree::studio {
namespace {

using bt::Status;

const char* const kTree = R"(<root BTCPP_format="4"><BehaviorTree ID="Main">
  <ReactiveSequence name="Root"><Charged name="Charged"/><Drive name="Drive"/></ReactiveSequence>
</BehaviorTree><TreeNodesModel><Condition ID="Charged"/><Action ID="Drive"/></TreeNodesModel></root>)";

TreePlayer playing(const std::string& xml) {
  const bt::Palette palette;
  auto player = TreePlayer::start(xml, "mission.xml", "Main", palette, {});
  if (!player) throw std::runtime_error(to_string(player.error()));
  return std::move(*player);
}

Status said(const TreePlayer& player, const std::string& path) { return player.said(player.tree().find(path)); }

TEST(TreePlayer, BeginsWithConditionsThatDoNotHold) {
  const TreePlayer player = playing(kTree);
  EXPECT_EQ(player.result(), Status::kFailure);
  EXPECT_EQ(said(player, "Charged"), Status::kFailure);
  EXPECT_EQ(said(player, "Drive"), Status::kIdle);
}

TEST(TreePlayer, TicksWithTheAnswersThatWereGiven) {
  TreePlayer player = playing(kTree);
  ASSERT_TRUE(player.answer("Charged", Status::kSuccess));
  EXPECT_EQ(player.result(), Status::kRunning);
  EXPECT_EQ(said(player, "Drive"), Status::kRunning);
  ASSERT_TRUE(player.answer("Drive", Status::kSuccess));
  EXPECT_EQ(player.result(), Status::kSuccess);
}

TEST(TreePlayer, HaltsWhatRanWhenAConditionFails) {
  TreePlayer player = playing(kTree);
  ASSERT_TRUE(player.answer("Charged", Status::kSuccess));
  ASSERT_TRUE(player.answer("Charged", Status::kFailure));
  EXPECT_EQ(player.result(), Status::kFailure);
  EXPECT_EQ(said(player, "Drive"), Status::kIdle);
}

TEST(TreePlayer, GoesBackToWhatWas) {
  TreePlayer player = playing(kTree);
  ASSERT_TRUE(player.answer("Charged", Status::kSuccess));
  ASSERT_TRUE(player.back());
  EXPECT_EQ(player.result(), Status::kFailure);
  EXPECT_EQ(player.answer_of(player.tree().find("Charged")), Status::kFailure);
  EXPECT_EQ(player.back().error().code, "simulate.no-way-back");
}

TEST(TreePlayer, WaitsForATimerOfTheTree) {
  TreePlayer player = playing(
      "<root BTCPP_format=\"4\"><BehaviorTree ID=\"Main\"><Sleep name=\"Rest\" msec=\"1500\"/></BehaviorTree></root>");
  EXPECT_EQ(player.result(), Status::kRunning);
  ASSERT_TRUE(player.wait());
  EXPECT_EQ(player.time(), TimePoint(std::chrono::milliseconds(1500)));
  EXPECT_EQ(player.result(), Status::kSuccess);
}

TEST(TreePlayer, RefusesAConditionThatRunsAndALeafThatIsNotThere) {
  TreePlayer player = playing(kTree);
  EXPECT_EQ(player.answer("Charged", Status::kRunning).error().code, "simulate.bad-answer");
  EXPECT_EQ(player.answer("Nobody", Status::kSuccess).error().code, "simulate.no-such-leaf");
  EXPECT_EQ(player.wait().error().code, "simulate.no-timer");
  EXPECT_EQ(player.steps_back(), 0U);
}

TEST(TreePlayer, NamesANodeThatNobodyKnows) {
  const auto player = TreePlayer::start(
      "<root BTCPP_format=\"4\"><BehaviorTree ID=\"Main\"><SubTree ID=\"Gone\"/></BehaviorTree></root>", "m.xml",
      "Main", bt::Palette(), {});
  ASSERT_FALSE(player);
  EXPECT_EQ(player.error().code, "bt.unknown-node");
}

TEST(TreePlayer, BeginsWithTheEntriesOfTheMission) {
  const std::string xml =
      "<root BTCPP_format=\"4\"><BehaviorTree ID=\"Main\"><ScriptCondition code=\"battery &gt; 0.5\"/></BehaviorTree>"
      "</root>";
  for (const auto& [charge, result] : {std::pair(0.8, Status::kSuccess), std::pair(0.3, Status::kFailure)}) {
    const auto player = TreePlayer::start(xml, "m.xml", "Main", bt::Palette(), {}, {{"battery", Value(charge), {}}});
    ASSERT_TRUE(player) << player.error().message;
    EXPECT_EQ(player->result(), result);
  }
}

TEST(TreePlayer, KeepsTheAnswersOfLeavesThatAreStillThere) {
  TreePlayer player = playing(kTree);
  ASSERT_TRUE(player.answer("Charged", Status::kSuccess));
  const bt::Palette palette;
  const auto again = TreePlayer::start(kTree, "mission.xml", "Main", palette, player.answers());
  ASSERT_TRUE(again);
  EXPECT_EQ(again->result(), Status::kRunning);
}

}  // namespace
}  // namespace sentree::studio
