#include "sentree/runtime/detail/decision_record.h"

#include <gtest/gtest.h>

#include "sentree/base/packed.h"

namespace sentree::runtime {
namespace {

Message observed(std::uint64_t sequence) {
  Message message;
  message.sequence = sequence;
  message.time = TimePoint(std::chrono::milliseconds(10 * sequence));
  message.kind = MessageKind::kReply;
  message.source = "battery";
  message.target = "GoToKitchen";
  message.name = "battery.getBatteryState.reply";
  message.call = 7;
  message.tick = 3;
  message.data = Map{{"percentage", 0.125}};
  return message;
}

TEST(DecisionRecord, IsTheDecisionAgain) {
  monitor::Decision decision;
  decision.verdict = monitor::Verdict::kViolated;
  decision.at = TimePoint(std::chrono::milliseconds(20));
  decision.state = "empty";
  decision.deciding = observed(2);
  decision.since = TimePoint(std::chrono::milliseconds(10));
  decision.number = 3;
  decision.started = TimePoint(std::chrono::milliseconds(1));
  decision.witness = {observed(1), observed(2)};
  decision.witness_complete = false;
  decision.witness_minimal = true;
  const auto restored = restore_decision(*unpack(pack(save(decision))));
  ASSERT_TRUE(restored);
  EXPECT_EQ(restored->verdict, decision.verdict);
  EXPECT_EQ(restored->at, decision.at);
  EXPECT_EQ(restored->state, decision.state);
  ASSERT_TRUE(restored->deciding);
  EXPECT_EQ(to_json(*restored->deciding), to_json(*decision.deciding));
  EXPECT_EQ(restored->since, decision.since);
  EXPECT_EQ(restored->number, decision.number);
  EXPECT_EQ(restored->started, decision.started);
  ASSERT_EQ(restored->witness.size(), 2U);
  EXPECT_EQ(to_json(restored->witness[0]), to_json(decision.witness[0]));
  EXPECT_EQ(restored->witness[1].sequence, 2U);
  EXPECT_FALSE(restored->witness_complete);
  EXPECT_TRUE(restored->witness_minimal);
}

TEST(DecisionRecord, IsNoneOfOtherData) {
  EXPECT_FALSE(restore_decision(Value()));
  EXPECT_FALSE(restore_decision(Map{{"verdict", "violated"}}));
  Value torn = save(monitor::Decision{});
  ASSERT_NE(torn.as_map(), nullptr);
  Map less = *torn.as_map();
  less.erase("witness");
  EXPECT_FALSE(restore_decision(less));
}

}  // namespace
}  // namespace sentree::runtime
