#include "sentree/bt/carry.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "sentree/bt/load.h"
#include "sentree/bt/step.h"

namespace sentree::bt {
namespace {

using testing::HasSubstr;
using testing::SizeIs;

Tree tree(const std::string& body) {
  auto loaded =
      load("<root BTCPP_format=\"4\" main_tree_to_execute=\"Main\"><BehaviorTree ID=\"Main\">" + body +
           "</BehaviorTree><TreeNodesModel><Action ID=\"Go\"/><Condition ID=\"Is\"/></TreeNodesModel></root>");
  for (const Diagnostic& d : loaded.diagnostics) {
    if (d.severity == Severity::kError) ADD_FAILURE() << to_string(d);
  }
  return std::move(*loaded.value);
}

// Ticks, and answers for the leaf that is waited for, until the tick is over or no answer is left.
std::string run(const Tree& tree, State& state, std::initializer_list<Status> answers) {
  std::string told;
  Effects effects;
  StepResult result = step(tree, state, Input::tick(), {}, effects);
  for (const Status answer : answers) {
    if (result.kind != StepResult::Kind::kWaiting) break;
    told += tree.path(result.leaf) + " ";
    result = step(tree, state, Input::answer(result.leaf, answer), {}, effects);
  }
  return told + (result.kind == StepResult::Kind::kWaiting ? "waits for " + tree.path(result.leaf)
                                                           : std::string(to_string(result.status)));
}

TEST(CarryTree, ASequenceGoesOnAtItsChildWhereLeavesWereAddedBeforeAndBehindIt) {
  const Tree before = tree(R"(<Sequence><Go name="a"/><Go name="b"/><Go name="c"/></Sequence>)");
  const Tree after =
      tree(R"(<Sequence><Go name="new"/><Go name="a"/><Go name="b"/><Is name="sure"/><Go name="c"/></Sequence>)");
  State state(before);
  EXPECT_EQ(run(before, state, {Status::kSuccess, Status::kRunning}), "a b RUNNING");
  auto carried = carry(before, state, after);
  ASSERT_TRUE(carried.ok()) << to_string(carried.diagnostics.front());
  EXPECT_EQ(run(after, carried.value->state, {Status::kSuccess, Status::kSuccess, Status::kRunning}),
            "b sure c RUNNING");
}

TEST(CarryTree, ASuspendedTickIsAnsweredInTheNewTree) {
  const Tree before = tree(R"(<ReactiveSequence><Is name="ok"/><Go name="b"/></ReactiveSequence>)");
  const Tree after = tree(R"(<ReactiveSequence><Is name="ok"/><Is name="also"/><Go name="b"/></ReactiveSequence>)");
  State state(before);
  EXPECT_EQ(run(before, state, {}), "waits for ok");
  auto carried = carry(before, state, after);
  ASSERT_TRUE(carried.ok()) << to_string(carried.diagnostics.front());
  Effects effects;
  State& next = carried.value->state;
  const StepResult result = step(after, next, Input::answer(next.waiting_leaf(), Status::kSuccess), {}, effects);
  ASSERT_EQ(result.kind, StepResult::Kind::kWaiting);
  EXPECT_EQ(after.path(result.leaf), "also");
}

TEST(CarryTree, EntriesOfTheBlackboardKeepValueAndNumberOfWrites) {
  const std::string body = R"(<Sequence><Script code="n := 5"/><Go name="a"/></Sequence>)";
  const Tree before = tree(body);
  const Tree after = tree(R"(<Sequence><Script code="n := 5"/><Go name="a"/><Script code="m := n + 1"/></Sequence>)");
  State state(before);
  run(before, state, {Status::kRunning});
  auto carried = carry(before, state, after);
  ASSERT_TRUE(carried.ok());
  ASSERT_NE(entry(after, carried.value->state, "n"), nullptr);
  EXPECT_EQ(entry(after, carried.value->state, "n")->number(), 5.0);
  EXPECT_EQ(blackboard(after, carried.value->state)[0].sequence, blackboard(before, state)[0].sequence);
}

TEST(CarryTree, EntriesOfASubTreeGoWhereItHasGone) {
  const auto of = [](const std::string& children) {
    auto loaded =
        load("<root BTCPP_format=\"4\" main_tree_to_execute=\"Main\"><BehaviorTree ID=\"Main\"><Sequence>" + children +
             "</Sequence></BehaviorTree><BehaviorTree ID=\"S\"><Sequence><Script code=\"n := k\"/>"
             "<Go name=\"{k}\"/></Sequence></BehaviorTree>"
             "<TreeNodesModel><Action ID=\"Go\"/></TreeNodesModel></root>");
    EXPECT_TRUE(loaded.ok());
    return std::move(*loaded.value);
  };
  const Tree before = of(R"(<SubTree ID="S" k="1"/><SubTree ID="S" k="2"/>)");
  const Tree after = of(R"(<AlwaysSuccess/><SubTree ID="S" k="1"/><SubTree ID="S" k="2"/>)");
  State state(before);
  run(before, state, {Status::kRunning});
  const auto carried = carry(before, state, after);
  ASSERT_TRUE(carried.ok()) << to_string(carried.diagnostics.front());
  const Value* n = entry(after, carried.value->state, "n", 2);
  ASSERT_NE(n, nullptr);
  EXPECT_EQ(n->number(), 1.0);
}

TEST(CarryTree, RefusesALeafAtWorkThatIsGoneOrHasMoved) {
  const Tree before = tree(R"(<Sequence><Go name="a"/><Go name="b"/></Sequence>)");
  State state(before);
  run(before, state, {Status::kRunning});
  const auto gone = carry(before, state, tree(R"(<Sequence><Go name="b"/></Sequence>)"));
  ASSERT_FALSE(gone.ok());
  EXPECT_EQ(gone.diagnostics[0].code, "bt.cannot-carry");
  EXPECT_THAT(gone.diagnostics[0].message, HasSubstr("\"a\" (Go) is at work"));
  const auto moved =
      carry(before, state, tree(R"(<Sequence><Inverter><Go name="a"/></Inverter><Go name="b"/></Sequence>)"));
  ASSERT_THAT(moved.diagnostics, SizeIs(1));
  EXPECT_THAT(moved.diagnostics[0].message, HasSubstr("has moved"));
  // Between two runs it may do either.
  const State idle(before);
  EXPECT_TRUE(carry(before, idle, tree(R"(<Sequence><Go name="b"/></Sequence>)")).ok());
}

}  // namespace
}  // namespace sentree::bt
