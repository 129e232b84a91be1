#include "sentree/mission/tree.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <iostream>
#include <queue>
#include <set>
#include <string>
#include <vector>

#include "sentree/base/rng.h"
#include "sentree/bt/load.h"

namespace sentree::mission {
namespace {

using std::chrono::milliseconds;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;

// A mission in the hands of a test: leaves answer when it says so, time passes when it says so.
class TreePlayer final : public TreeHost {
 public:
  // `late`: so much later than planned ticks begin.
  explicit TreePlayer(const std::string& nodes, bool repeat = false, Duration late = Duration(0))
      : late_(late), plan_(plan_of(nodes)), machine_(model(repeat)) {
    state = machine_.initial();
    machine_.start(state, *this);
  }

  void take(TreeDelivery what) {
    const TreePhase before = state.phase;
    const std::string_view by = kind_of(what);
    machine_.step(state, std::move(what), *this);
    edges().insert({before, by, state.phase});
  }
  // What is due until then, in order.
  void wait(Duration duration) {
    const TimePoint until = time + duration;
    for (int bound = 10'000; bound > 0 && !queue_.empty() && queue_.begin()->first.first <= until; --bound) {
      auto first = queue_.extract(queue_.begin());
      time = std::max(time, first.key().first);
      if (std::holds_alternative<Period>(first.mapped())) time += late_;
      take(std::move(first.mapped()));
    }
    time = until;
  }
  void answer(bt::Status status, Map outputs = {}) {
    ASSERT_FALSE(asked.empty());
    const auto [leaf, tick] = asked.back();
    asked.pop_back();
    take(Answered{leaf, tick, status, std::move(outputs)});
  }

  struct Order {
    bool operator()(const TreeEdge& a, const TreeEdge& b) const {
      return std::tie(a.from, a.by, a.to) < std::tie(b.from, b.by, b.to);
    }
  };
  static std::set<TreeEdge, Order>& edges() {
    static std::set<TreeEdge, Order> taken;
    return taken;
  }

  TreeState state;
  TimePoint time{};
  std::vector<std::pair<std::size_t, std::uint64_t>> asked;
  std::vector<std::size_t> halting;
  std::vector<std::string> problems;
  std::vector<std::string> statuses;  // of the mission
  int times_ended = 0;

 private:
  static project::Plan plan_of(const std::string& nodes) {
    auto loaded = bt::load("<root BTCPP_format=\"4\"><BehaviorTree ID=\"Main\">" + nodes + "</BehaviorTree></root>", {},
                           "mission.xml");
    EXPECT_TRUE(loaded.ok()) << (loaded.ok() ? "" : to_string(loaded.diagnostics.front()));
    project::Plan plan{.scenario = {}, .tree = std::move(*loaded.value)};
    for (const bt::NodeId node : plan.tree.external_leaves()) {
      project::LeafPlan leaf;
      leaf.node = node;
      leaf.name = leaf.id = plan.tree.event_name(node);
      plan.leaves.push_back(std::move(leaf));
    }
    return plan;
  }
  TreeModel model(bool repeat) const {
    TreeModel model;
    model.plan = &plan_;
    model.period = milliseconds(100);
    model.repeat = repeat;
    model.deadlines.condition = milliseconds(80);
    model.deadlines.budget = milliseconds(100);
    model.deadlines.halt = milliseconds(300);
    model.deadlines.unresponsive = milliseconds(350);
    return model;
  }

  TimePoint now() const override { return time; }
  void publish(Message message) override {
    if (message.name == "mission.status") statuses.emplace_back(message.data.find("status")->text());
  }
  std::uint64_t next_call() override { return ++calls_; }
  void set_tick(std::uint64_t) override {}
  void tick(std::size_t leaf, std::uint64_t tick, bool, const Map&) override { asked.emplace_back(leaf, tick); }
  void halt(std::size_t leaf, TimePoint /*asked*/) override { halting.push_back(leaf); }
  void cancel(std::size_t, TimePoint) override {}
  void deliver(TreeDelivery what) override { deliver_at(time, Rank::kMessage, std::move(what)); }
  void deliver_at(TimePoint when, Rank rank, TreeDelivery what) override {
    queue_.emplace(std::pair(std::max(when, time), std::pair(rank, ++order_)), std::move(what));
  }
  std::optional<bt::Status> forced(std::string_view) override { return std::nullopt; }
  TimePoint due(std::size_t) override { return {}; }
  void tick_began(Duration) override {}
  void tick_done(std::uint64_t, Duration) override {}
  void problem(std::string what) override { problems.push_back(std::move(what)); }
  void ended() override { ++times_ended; }

  Duration late_;
  project::Plan plan_;
  TreeMachine machine_;
  std::multimap<std::pair<TimePoint, std::pair<Rank, std::uint64_t>>, TreeDelivery> queue_;
  std::uint64_t order_ = 0;
  std::uint64_t calls_ = 0;
};

TEST(Tree, EndsWithItsRoot) {
  TreePlayer p("<Sequence><Action ID=\"A\"/><Sleep msec=\"150\"/></Sequence>");
  p.wait(milliseconds(0));
  p.answer(bt::Status::kSuccess);
  p.wait(milliseconds(300));
  EXPECT_THAT(p.statuses, ElementsAre("RUNNING", "SUCCESS"));
  EXPECT_EQ(p.times_ended, 1);
}

TEST(Tree, StopsALeafThatDoesNotHaltWhenTheMissionHasCompleted) {
  TreePlayer p("<Parallel success_count=\"1\"><Action ID=\"A\"/><Sleep msec=\"150\"/></Parallel>");
  p.wait(milliseconds(0));
  for (int tick = 0; tick < 2; ++tick) {
    p.answer(bt::Status::kRunning);
    p.wait(milliseconds(100));
  }
  p.answer(bt::Status::kRunning);
  EXPECT_EQ(p.state.phase, TreePhase::kHalting);
  EXPECT_THAT(p.halting, ElementsAre(0));
  p.wait(std::chrono::seconds(10));
  EXPECT_EQ(p.times_ended, 0) << "it may take its time to halt";
  p.take(Stop{});
  p.wait(milliseconds(599));
  EXPECT_EQ(p.times_ended, 0);
  p.wait(milliseconds(1));
  EXPECT_EQ(p.times_ended, 1);
  EXPECT_EQ(p.state.root, bt::Status::kSuccess);
  EXPECT_THAT(p.problems, ElementsAre(HasSubstr("still halting")));
}

TEST(Tree, KeepsItsRateWithALeafBeyondItsBudgetAlsoIfTicksBeginALittleLate) {
  TreePlayer p("<Sequence><Action ID=\"A\"/><Action ID=\"B\"/></Sequence>", false, std::chrono::microseconds(300));
  p.wait(milliseconds(0));
  p.time += std::chrono::microseconds(300);
  p.answer(bt::Status::kSuccess);  // B never answers
  p.wait(milliseconds(340));
  EXPECT_EQ(p.state.missed, 0);
  EXPECT_EQ(p.state.ticks, 4);
}

// Scripts of every hook, made to fail at every way in which a mission ends.
TEST(Tree, FailsForTheReasonOfTheLeafThatFailedLast) {
  const Map worn{{"reason", "worn"}};
  TreePlayer caught("<Fallback><Action ID=\"A\"/><Action ID=\"B\"/></Fallback>");
  caught.wait(milliseconds(0));
  caught.answer(bt::Status::kFailure, worn);
  EXPECT_EQ(caught.state.reason, "A: worn");
  caught.answer(bt::Status::kFailure);
  EXPECT_TRUE(caught.state.over);
  EXPECT_EQ(caught.state.reason, "") << "B says none";

  TreePlayer recovered(
      "<Sequence><RetryUntilSuccessful num_attempts=\"2\"><Action ID=\"A\"/></RetryUntilSuccessful>"
      "<Inverter><Action ID=\"B\"/></Inverter></Sequence>");
  recovered.wait(milliseconds(0));
  recovered.answer(bt::Status::kFailure, worn);
  recovered.wait(milliseconds(100));
  recovered.answer(bt::Status::kSuccess);
  recovered.wait(milliseconds(100));
  recovered.answer(bt::Status::kSuccess);
  EXPECT_TRUE(recovered.state.over);
  EXPECT_EQ(recovered.state.root, bt::Status::kFailure);
  EXPECT_EQ(recovered.state.reason, "");

  TreePlayer succeeded("<Fallback><Action ID=\"A\"/><Action ID=\"B\"/></Fallback>");
  succeeded.wait(milliseconds(0));
  succeeded.answer(bt::Status::kFailure, worn);
  succeeded.answer(bt::Status::kSuccess);
  EXPECT_EQ(succeeded.state.root, bt::Status::kSuccess);
  EXPECT_EQ(succeeded.state.reason, "");
}

class FailingHook : public testing::TestWithParam<std::string> {};

TEST_P(FailingHook, IsOneProblemAndTheMissionEndsInOrder) {
  const std::string hook = GetParam() + "=\"tries += 1\"";
  for (const std::string& tree :
       {"<Sleep msec=\"500\" " + hook + "/>",
        "<Parallel failure_count=\"1\"><Sleep msec=\"500\" " + hook +
            "/><Sequence><Sleep msec=\"250\"/><AlwaysFailure/></Sequence></Parallel>",
        "<Sequence><Action ID=\"A\" " + hook + "/><AlwaysFailure/></Sequence>",
        "<Sequence " + hook + "><Action ID=\"A\"/><AlwaysFailure " + hook + "/></Sequence>"}) {
    for (const bool stopped : {false, true}) {
      SCOPED_TRACE(tree + (stopped ? ", stopped" : ", left alone"));
      TreePlayer p(tree);
      for (int i = 0; i < 8 && p.times_ended == 0; ++i) {
        if (stopped && i == 2) p.take(Stop{});
        p.wait(milliseconds(100));
        if (!p.asked.empty() && i != 1) p.answer(i % 2 == 0 ? bt::Status::kRunning : bt::Status::kSuccess);
        for (const std::size_t leaf : std::exchange(p.halting, {})) p.take(Halted{leaf});
      }
      p.wait(milliseconds(2000));
      EXPECT_EQ(p.times_ended, 1);
      // The script that failed, and what halting its tree said.
      std::size_t failures = 0;
      for (const std::string& problem : p.problems) {
        if (problem.find("tries") == std::string::npos) continue;
        ++failures;
        EXPECT_THAT(problem, HasSubstr("mission.xml:1:"));
        EXPECT_EQ(std::count(p.problems.begin(), p.problems.end(), problem), 1) << problem;
      }
      EXPECT_LE(failures, 2U);
    }
  }
}
INSTANTIATE_TEST_SUITE_P(Tree, FailingHook,
                         testing::Values("_onHalted", "_onSuccess", "_onFailure", "_post", "_skipIf", "_successIf",
                                         "_failureIf", "_while"),
                         [](const auto& tested) { return tested.param.substr(1); });

TEST(Tree, AFailingScriptSaysWhichAndWhere) {
  TreePlayer p("<Sleep msec=\"500\" _onHalted=\"tries += 1\"/>");
  p.wait(milliseconds(100));
  p.take(Stop{});
  ASSERT_EQ(p.problems.size(), 1U);
  EXPECT_THAT(p.problems[0], HasSubstr("mission.xml:1:"));
  EXPECT_THAT(p.problems[0], HasSubstr("tries"));
  EXPECT_EQ(p.times_ended, 1);
}

TEST(Tree, AnythingInAnyOrderFollowsTheTable) {
  const std::uint64_t seed = 20'261'122;
  SCOPED_TRACE("seed " + std::to_string(seed));
  Rng rng(seed);
  const std::vector<std::string> trees{
      "<ReactiveSequence><Action ID=\"A\"/><Action ID=\"B\"/></ReactiveSequence>",
      "<ReactiveFallback><Action ID=\"A\"/><Sleep msec=\"250\"/></ReactiveFallback>",
      "<Parallel success_count=\"1\"><Action ID=\"A\"/><Timeout msec=\"230\"><Action ID=\"B\"/></Timeout></Parallel>",
      "<Timeout msec=\"150\"><Sleep msec=\"500\" _onHalted=\"tries += 1\"/></Timeout>",
      "<Parallel success_count=\"1\"><Action ID=\"A\" _onHalted=\"tries += 1\"/><Delay delay_msec=\"120\"><Script "
      "code=\"nothing += 1\"/></Delay></Parallel>",
      "<Timeout msec=\"150\"><Parallel><Action ID=\"A\"/><Sleep msec=\"500\" _onHalted=\"tries += "
      "1\"/></Parallel></Timeout>",
      "<Action ID=\"A\"/>",
      "<ReactiveSequence><Condition ID=\"A\"/><Action ID=\"B\"/></ReactiveSequence>",
      "<AlwaysSuccess/>"};
  for (int run = 0; run < 1500; ++run) {
    TreePlayer p(trees[rng.below(trees.size())], rng.below(4) == 0);
    for (int i = 0; i < 40; ++i) {
      const std::uint64_t what = rng.below(20);
      if (what < 8) {
        p.wait(milliseconds(40));
      } else if (what < 14) {
        constexpr bt::Status kStatuses[] = {bt::Status::kRunning, bt::Status::kSuccess, bt::Status::kFailure};
        if (!p.asked.empty()) p.answer(kStatuses[rng.below(3)]);
      } else if (what < 18) {
        if (p.halting.empty()) continue;
        const std::size_t leaf = p.halting.back();
        p.halting.pop_back();
        p.take(Halted{leaf});
      } else if (rng.below(6) == 0) {
        p.take(Stop{});
      }
      ASSERT_LE(p.times_ended, 1);
      EXPECT_EQ(p.times_ended == 1, p.state.phase == TreePhase::kEnded);
    }
    if (p.state.phase != TreePhase::kEnded) p.take(Stop{});
    p.wait(milliseconds(10'000));
    EXPECT_EQ(p.times_ended, 1);
  }
  std::size_t covered = 0;
  for (const TreeEdge& edge : tree_edges()) {
    if (TreePlayer::edges().contains(edge))
      ++covered;
    else
      std::cout << "not taken: " << to_string(edge.from) << " --" << edge.by << "--> " << to_string(edge.to) << '\n';
  }
  std::cout << covered << " of " << tree_edges().size() << " edges taken\n";
  EXPECT_EQ(covered, tree_edges().size());
}

}  // namespace
}  // namespace sentree::mission
