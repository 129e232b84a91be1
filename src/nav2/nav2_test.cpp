#include "sentree/nav2/nav2.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <string>
#include <vector>

#include "sentree/bt/load.h"
#include "sentree/bt/runner.h"
#include "sentree/bt/state.h"

namespace sentree::nav2 {
namespace {

using bt::Status;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

/// A tree of these nodes whose leaves, <Leaf name="a"/>, return what the test says; a leaf that nobody asked says so.
class Player {
 public:
  explicit Player(const std::string& body) {
    add_nodes(registry_);
    registry_.add<Leaf>("Leaf", bt::Category::kCondition, Leaf{this});
    auto loaded = bt::load("<root BTCPP_format=\"4\"><BehaviorTree ID=\"Main\">" + body + "</BehaviorTree></root>",
                           {.registry = &registry_}, "nav2.xml");
    std::string problems;
    for (const Diagnostic& d : loaded.diagnostics) problems += to_string(d) + "\n";
    EXPECT_TRUE(loaded.ok()) << problems;
    if (loaded.ok()) runner_.emplace(std::move(*loaded.value));
  }

  /// The status of the tree; `asked` then says which leaves were ticked, in their order.
  Status tick() {
    asked.clear();
    return runner_->tick(now);
  }
  Status tick(std::map<std::string, Status> answers) {
    says = std::move(answers);
    return tick();
  }
  void halt() { runner_->halt(); }
  [[nodiscard]] std::string error() const { return runner_->error() ? runner_->error()->message : ""; }
  bt::Runner& runner() { return *runner_; }

  std::map<std::string, Status> says;
  std::vector<std::string> asked;
  TimePoint now{};

 private:
  struct Leaf {
    Player* player;
    Status tick(bt::Context& self) {
      player->asked.emplace_back(self.name());
      return player->says.at(player->asked.back());
    }
    [[nodiscard]] Value save() const { return true; }
    [[nodiscard]] bool restore(const Value& /*saved*/) { return true; }
    friend bool operator==(const Leaf&, const Leaf&) = default;
  };
  bt::Registry registry_;
  std::optional<bt::Runner> runner_;
};

constexpr Status kS = Status::kSuccess, kF = Status::kFailure, kR = Status::kRunning, kSkip = Status::kSkipped;

std::string abc(const std::string& tag, const std::string& attributes = {}) {
  return "<" + tag + attributes + "><Leaf name=\"a\"/><Leaf name=\"b\"/><Leaf name=\"c\"/></" + tag + ">";
}

TEST(PipelineSequence, TicksAgainWhatStandsBeforeTheChildItHasReached) {
  // The example of Nav2's documentation, step by step.
  Player p(abc("PipelineSequence"));
  EXPECT_EQ(p.tick({{"a", kR}}), kR);
  EXPECT_THAT(p.asked, ElementsAre("a"));
  EXPECT_EQ(p.tick({{"a", kS}, {"b", kR}}), kR);
  EXPECT_THAT(p.asked, ElementsAre("a", "b"));
  EXPECT_EQ(p.tick({{"a", kR}, {"b", kS}, {"c", kR}}), kR);
  EXPECT_THAT(p.asked, ElementsAre("a", "b", "c"));
  EXPECT_EQ(p.tick({{"a", kR}, {"b", kS}, {"c", kS}}), kS);
  // Then it begins anew.
  EXPECT_EQ(p.tick({{"a", kR}}), kR);
  EXPECT_THAT(p.asked, ElementsAre("a"));
}

TEST(PipelineSequence, FailsWithAnyChild) {
  Player p(abc("PipelineSequence"));
  EXPECT_EQ(p.tick({{"a", kS}, {"b", kR}}), kR);
  EXPECT_EQ(p.tick({{"a", kF}}), kF);
  EXPECT_THAT(p.asked, ElementsAre("a"));
  EXPECT_EQ(p.tick({{"a", kR}, {"b", kR}}), kR);
  EXPECT_THAT(p.asked, ElementsAre("a")) << "it has not reached b any more";
}

TEST(PipelineSequence, IsSkippedWithAllOfItsChildren) {
  Player p("<ForceSuccess>" + abc("PipelineSequence") + "</ForceSuccess>");
  EXPECT_EQ(p.tick({{"a", kSkip}, {"b", kSkip}, {"c", kSkip}}), kSkip);
  EXPECT_EQ(p.tick({{"a", kSkip}, {"b", kS}, {"c", kSkip}}), kS);
}

TEST(NonblockingSequence, TicksEveryChildUntilAllSucceedAtOnce) {
  Player p(abc("NonblockingSequence"));
  EXPECT_EQ(p.tick({{"a", kR}, {"b", kS}, {"c", kR}}), kR);
  EXPECT_THAT(p.asked, ElementsAre("a", "b", "c"));
  EXPECT_EQ(p.tick({{"a", kS}, {"b", kS}, {"c", kR}}), kR);
  EXPECT_EQ(p.tick({{"a", kS}, {"b", kS}, {"c", kS}}), kS);
  EXPECT_EQ(p.tick({{"a", kR}, {"b", kF}}), kF);
  EXPECT_THAT(p.asked, ElementsAre("a", "b"));
}

std::string recovery(const std::string& attributes) {
  return "<RecoveryNode" + attributes + "><Leaf name=\"go\"/><Leaf name=\"mend\"/></RecoveryNode>";
}

TEST(RecoveryNode, TriesAgainAsOftenAsItIsTold) {
  Player p(recovery(" number_of_retries=\"2\""));
  EXPECT_EQ(p.tick({{"go", kF}, {"mend", kS}}), kF);
  EXPECT_THAT(p.asked, ElementsAre("go", "mend", "go", "mend", "go"));
  EXPECT_EQ(p.tick({{"go", kF}, {"mend", kS}}), kF);
  EXPECT_EQ(p.asked.size(), 5U) << "it counts anew after it has ended";
}

TEST(RecoveryNode, SucceedsWithItsFirstChildAndFailsWithItsSecond) {
  Player p(recovery(""));
  EXPECT_EQ(p.tick({{"go", kS}}), kS);
  EXPECT_EQ(p.tick({{"go", kF}, {"mend", kF}}), kF);
  EXPECT_THAT(p.asked, ElementsAre("go", "mend"));
  EXPECT_EQ(p.tick({{"go", kF}, {"mend", kSkip}}), kF);
}

TEST(RecoveryNode, GoesOnWithTheChildThatRunsAndForgetsItWhenHalted) {
  Player p(recovery(""));
  EXPECT_EQ(p.tick({{"go", kF}, {"mend", kR}}), kR);
  EXPECT_EQ(p.tick({{"go", kR}, {"mend", kS}}), kR);
  EXPECT_THAT(p.asked, ElementsAre("mend", "go"));
  EXPECT_EQ(p.tick({{"go", kF}}), kF) << "its only retry is spent";
  EXPECT_EQ(p.tick({{"go", kF}, {"mend", kR}}), kR);
  p.halt();
  EXPECT_EQ(p.tick({{"go", kR}}), kR);
  EXPECT_THAT(p.asked, ElementsAre("go"));
}

TEST(RecoveryNode, SaysThatItNeedsTwoChildren) {
  Player p("<RecoveryNode><Leaf name=\"a\"/></RecoveryNode>");
  EXPECT_EQ(p.tick({{"a", kS}}), kF);
  EXPECT_THAT(p.error(), HasSubstr("must have 2 children"));
}

TEST(RoundRobin, GoesOnBehindTheChildThatSucceeded) {
  Player p("<KeepRunningUntilFailure>" + abc("RoundRobin") + "</KeepRunningUntilFailure>");
  p.tick({{"a", kF}, {"b", kR}});
  EXPECT_THAT(p.asked, ElementsAre("a", "b"));
  p.tick({{"b", kS}});
  EXPECT_THAT(p.asked, ElementsAre("b"));
  p.tick({{"c", kR}});
  EXPECT_THAT(p.asked, ElementsAre("c"));
  p.tick({{"c", kF}, {"a", kR}});
  EXPECT_THAT(p.asked, ElementsAre("c", "a"));
  EXPECT_EQ(p.tick({{"a", kF}, {"b", kF}, {"c", kF}}), kF) << "all have failed";
  EXPECT_THAT(p.asked, ElementsAre("a", "b"));
}

TEST(RoundRobin, FailsAfterOneRoundAndBeginsWithTheFirstWhenHalted) {
  Player p(abc("RoundRobin"));
  EXPECT_EQ(p.tick({{"a", kF}, {"b", kF}, {"c", kF}}), kF);
  EXPECT_THAT(p.asked, ElementsAre("a", "b", "c"));
  EXPECT_EQ(p.tick({{"a", kF}, {"b", kR}}), kR);
  p.halt();
  EXPECT_EQ(p.tick({{"a", kS}}), kS);
  EXPECT_EQ(p.tick({{"b", kSkip}, {"c", kSkip}, {"a", kSkip}}), kSkip);
}

TEST(PersistentSequence, KeepsItsPlaceOnTheBlackboardWhenItFailsOrIsHalted) {
  Player q("<Sequence><Leaf name=\"first\" _onSuccess=\"i := 0\"/><KeepRunningUntilFailure>" +
           abc("PersistentSequence", " current_child_idx=\"{i}\"") + "</KeepRunningUntilFailure></Sequence>");
  EXPECT_EQ(q.tick({{"first", kS}, {"a", kS}, {"b", kR}}), kR);
  EXPECT_EQ(q.tick({{"b", kS}, {"c", kS}}), kR);
  EXPECT_THAT(q.asked, ElementsAre("b", "c"));
  EXPECT_EQ(q.tick({{"a", kS}, {"b", kF}}), kF);
  EXPECT_EQ(q.tick({{"first", kSkip}, {"b", kR}}), kR);
  EXPECT_THAT(q.asked, ElementsAre("first", "b"));
}

TEST(PersistentSequence, NeedsAPlaceThatIsThere) {
  Player p("<Sequence><Script code=\"i := 3\"/>" + abc("PersistentSequence", " current_child_idx=\"{i}\"") +
           "</Sequence>");
  EXPECT_EQ(p.tick(), kF);
  EXPECT_THAT(p.error(), HasSubstr("current_child_idx is 3; it has 3 children"));
}

TEST(RateController, TicksItsChildAtMostSoOften) {
  Player p(
      "<KeepRunningUntilFailure><NonblockingSequence><RateController hz=\"2\"><Leaf name=\"a\"/></RateController>"
      "<Leaf name=\"b\"/></NonblockingSequence></KeepRunningUntilFailure>");
  p.says = {{"a", kS}, {"b", kR}};
  std::string ticks;
  for (int i = 0; i <= 12; ++i) {
    p.tick();
    ticks += p.asked.front() == "a" ? 'a' : '.';
    p.now += std::chrono::milliseconds(100);
  }
  EXPECT_EQ(ticks, "a....a....a..");
}

TEST(RateController, TicksAChildThatRunsOn) {
  Player p("<RateController hz=\"0.1\"><Leaf name=\"a\"/></RateController>");
  EXPECT_EQ(p.tick({{"a", kR}}), kR);
  EXPECT_EQ(p.tick({{"a", kS}}), kS);
  EXPECT_THAT(p.asked, ElementsAre("a"));
}

TEST(RateController, RefusesARateOfNothing) {
  Player p("<RateController hz=\"0\"><Leaf name=\"a\"/></RateController>");
  EXPECT_EQ(p.tick({{"a", kS}}), kF);
  EXPECT_THAT(p.error(), HasSubstr("hz must be greater than 0"));
}

TEST(SingleTrigger, TicksItsChildOnceAndFailsUntilItIsReset) {
  // NonblockingSequence ticks it again without a reset, and resets it when it fails.
  Player p(
      "<NonblockingSequence><SingleTrigger><Leaf name=\"a\"/></SingleTrigger><Leaf name=\"b\"/></NonblockingSequence>");
  EXPECT_EQ(p.tick({{"a", kR}, {"b", kR}}), kR);
  EXPECT_EQ(p.tick({{"a", kS}, {"b", kR}}), kR);
  EXPECT_EQ(p.tick({{"a", kS}, {"b", kR}}), kF);
  EXPECT_THAT(p.asked, IsEmpty());
  EXPECT_EQ(p.tick({{"a", kS}, {"b", kS}}), kS);
  EXPECT_THAT(p.asked, ElementsAre("a", "b"));
}

TEST(GoalUpdatedController, TicksItsChildWhenTheGoalChanges) {
  Player p(
      "<NonblockingSequence><Leaf name=\"set\" _onSuccess=\"goal := 1\"/>"
      "<Leaf name=\"change\" _onSuccess=\"goal := 2\"/>"
      "<GoalUpdatedController goal=\"{goal}\"><Leaf name=\"a\"/></GoalUpdatedController><Leaf name=\"b\"/>"
      "</NonblockingSequence>");
  p.says = {{"set", kS}, {"change", kSkip}, {"a", kS}, {"b", kR}};
  p.tick();
  EXPECT_THAT(p.asked, ElementsAre("set", "change", "a", "b"));
  p.tick();
  EXPECT_THAT(p.asked, ElementsAre("set", "change", "b")) << "the same goal";
  p.says["change"] = kS;
  p.tick();
  EXPECT_THAT(p.asked, ElementsAre("set", "change", "a", "b"));
}

TEST(GoalUpdated, ComparesWithTheTickBefore) {
  Player p(
      "<Sequence><Leaf name=\"set\" _onSuccess=\"goal := 1\"/><ReactiveFallback><GoalUpdated/><Leaf name=\"a\"/>"
      "</ReactiveFallback></Sequence>");
  p.tick({{"set", kS}, {"a", kR}});
  EXPECT_THAT(p.asked, ElementsAre("set", "a")) << "the first goal is no other one";
  p.tick();
  EXPECT_THAT(p.asked, ElementsAre("a"));
  Player q(
      "<ReactiveSequence><Leaf name=\"set\" _onSuccess=\"goal := 1\"/>"
      "<Leaf name=\"change\" _onSuccess=\"goal := 2\"/><ReactiveFallback><GoalUpdated/><Leaf name=\"a\"/>"
      "</ReactiveFallback></ReactiveSequence>");
  q.tick({{"set", kS}, {"change", kSkip}, {"a", kR}});
  EXPECT_EQ(q.tick({{"set", kSkip}, {"change", kS}, {"a", kR}}), kS);
}

TEST(GlobalUpdatedGoal, TakesTheFirstGoalForANewOneAndRemembersItWhenItIsReset) {
  Player p("<Repeat num_cycles=\"-1\"><Sequence><GlobalUpdatedGoal/><Leaf name=\"a\"/></Sequence></Repeat>");
  p.tick({{"a", kR}});
  EXPECT_THAT(p.asked, ElementsAre("a"));
  p.halt();
  EXPECT_EQ(p.tick({{"a", kR}}), kF) << "the same goal as before";
}

TEST(TimeExpired, SucceedsOnceForEachSpan) {
  Player p("<ReactiveSequence><Inverter><TimeExpired seconds=\"2\"/></Inverter><Leaf name=\"a\"/></ReactiveSequence>");
  const auto at = [&](int s) {
    p.now = TimePoint(std::chrono::seconds(s));
    p.tick({{"a", kR}});
    return p.asked.size();
  };
  EXPECT_EQ(at(0), 1U);
  EXPECT_EQ(at(1), 1U);
  EXPECT_EQ(at(2), 0U) << "it has expired";
}

TEST(ErrorConditions, KnowWhatARecoveryMayMend) {
  const auto status = [](const std::string& node, int code) {
    Player p("<Sequence><Leaf name=\"set\" _onSuccess=\"code := " + std::to_string(code) + "\"/><" + node +
             " error_code=\"{code}\"/></Sequence>");
    return p.tick({{"set", kS}});
  };
  EXPECT_EQ(status("WouldAControllerRecoveryHelp", 106), kS);
  EXPECT_EQ(status("WouldAControllerRecoveryHelp", 208), kF);
  EXPECT_EQ(status("WouldAPlannerRecoveryHelp", 208), kS);
  EXPECT_EQ(status("WouldAPlannerRecoveryHelp", 204), kF) << "a goal off the map stays there";
  EXPECT_EQ(status("WouldAPlannerRecoveryHelp", 308), kS) << "no path through several poses";
  EXPECT_EQ(status("WouldASmootherRecoveryHelp", 502), kS) << "it took too long";
  EXPECT_EQ(status("WouldASmootherRecoveryHelp", 501), kF) << "no such smoother";
  EXPECT_EQ(status("WouldARouteRecoveryHelp", 405), kS);
  EXPECT_EQ(status("WouldARouteRecoveryHelp", 402), kF) << "no valid graph";
  EXPECT_EQ(status("AreErrorCodesPresent error_codes_to_check=\"3;5\"", 5), kS);
  EXPECT_EQ(Player("<WouldAControllerRecoveryHelp error_code=\"{never}\"/>").tick(), kF);
}

TEST(Selectors, ChooseTheDefault) {
  Player p(
      "<Sequence><PlannerSelector default_planner=\"GridBased\" selected_planner=\"{it}\"/>"
      "<ScriptCondition code=\"it == 'GridBased'\"/></Sequence>");
  EXPECT_EQ(p.tick(), kS);
  EXPECT_EQ(Player("<PlannerSelector selected_planner=\"{it}\"/>").tick(), kF);
}

// A path along the x axis to `to`, by way of a point `off` beside it.
Value path_to(double to, double off) {
  const auto pose = [](double x, double y) {
    return Value(Map{{"pose", Map{{"position", Map{{"x", x}, {"y", y}, {"z", 0.0}}}}}});
  };
  return Map{{"poses", List{pose(0, 0), pose(to / 2, off), pose(to, 0)}}};
}

TEST(PathLongerOnApproach, TicksItsChildWhenADetourOpensNearTheGoal) {
  Player p(
      "<PathLongerOnApproach path=\"{path}\" prox_len=\"3.0\" length_factor=\"2.0\"><Leaf name=\"a\"/>"
      "</PathLongerOnApproach>");
  const auto with = [&](const Value& path) {
    EXPECT_TRUE(bt::set_entry(p.runner().tree(), p.runner().state(), "path", path, p.now));
    return p.tick({{"a", kR}});
  };
  EXPECT_EQ(with(path_to(2, 0)), kS);
  EXPECT_EQ(with(path_to(2, 0.5)), kS) << "a little longer";
  EXPECT_EQ(with(path_to(2, 9)), kR);
  EXPECT_THAT(p.asked, ElementsAre("a"));
}

TEST(PathExpiringTimer, BeginsAnewWithEachPath) {
  Player p(
      "<ReactiveSequence><Inverter><PathExpiringTimer path=\"{path}\" seconds=\"2\"/></Inverter>"
      "<Leaf name=\"a\"/></ReactiveSequence>");
  const auto expired = [&](int s, double length) {
    p.now = TimePoint(std::chrono::seconds(s));
    EXPECT_TRUE(bt::set_entry(p.runner().tree(), p.runner().state(), "path", path_to(length, 0), p.now));
    p.tick({{"a", kR}});
    return p.asked.empty();
  };
  EXPECT_FALSE(expired(0, 4));
  EXPECT_FALSE(expired(1, 4));
  EXPECT_TRUE(expired(2, 4));
  EXPECT_FALSE(expired(3, 4)) << "it said so a second ago";
  EXPECT_FALSE(expired(4, 5)) << "a new path";
  EXPECT_FALSE(expired(5, 5));
  EXPECT_TRUE(expired(6, 5));
}

TEST(GoalUpdater, HandsItsGoalOn) {
  Player p(
      "<Sequence><Leaf name=\"set\" _onSuccess=\"goal := 7\"/><GoalUpdater input_goal=\"{goal}\" "
      "output_goal=\"{now}\"><ScriptCondition code=\"now == 7\"/></GoalUpdater></Sequence>");
  EXPECT_EQ(p.tick({{"set", kS}}), kS);
}

// What a node makes of a path of three poses at x = 0, 2 and 4; as JSON.
std::string made_of_path(const std::string& node, const std::string& entry) {
  Player p(node);
  EXPECT_TRUE(bt::set_entry(p.runner().tree(), p.runner().state(), "path", path_to(4, 0), p.now));
  if (p.tick() != kS) return "FAILURE";
  const Value all = bt::export_blackboard(p.runner().tree(), p.runner().state());
  const Value* made = all.at({"", entry});
  return made != nullptr ? to_json(*made) : "no entry in " + to_json(all);
}

TEST(TruncatePath, EndsThePathBeforeItsEndAndLooksThere) {
  EXPECT_THAT(made_of_path("<TruncatePath input_path=\"{path}\" output_path=\"{out}\" distance=\"1.5\"/>", "out"),
              testing::AllOf(HasSubstr("\"x\":2"), testing::Not(HasSubstr("\"x\":4")), HasSubstr("\"w\":1")));
  EXPECT_THAT(made_of_path("<TruncatePath input_path=\"{path}\" output_path=\"{out}\" distance=\"99\"/>", "out"),
              HasSubstr("\"x\":2"))
      << "two poses stay";
  EXPECT_EQ(made_of_path("<TruncatePath input_path=\"{none}\" output_path=\"{out}\"/>", "out"), "FAILURE");
}

TEST(GetPoseFromPath, CountsFromEitherEnd) {
  const auto pose = [](const std::string& index) {
    return made_of_path("<GetPoseFromPath path=\"{path}\" index=\"" + index + "\" pose=\"{out}\"/>", "out");
  };
  EXPECT_THAT(pose("1"), HasSubstr("\"x\":2"));
  EXPECT_THAT(pose("-1"), HasSubstr("\"x\":4"));
  EXPECT_EQ(pose("3"), "FAILURE");
  EXPECT_EQ(pose("-4"), "FAILURE");
}

TEST(ConcatenatePaths, HasThePosesOfBoth) {
  const auto both = [](const std::string& second) {
    return made_of_path(
        "<ConcatenatePaths input_path1=\"{path}\" input_path2=\"{" + second + "}\" output_path=\"{out}\"/>", "out");
  };
  const auto count = [](const std::string& text) {
    std::size_t out = 0;
    for (auto at = text.find("\"position\""); at != std::string::npos; at = text.find("\"position\"", at + 1)) ++out;
    return out;
  };
  EXPECT_EQ(count(both("path")), 6U) << both("path");
  EXPECT_EQ(count(both("none")), 3U) << "one alone is the whole";
  EXPECT_EQ(made_of_path("<ConcatenatePaths input_path1=\"{none}\" output_path=\"{out}\"/>", "out"), "FAILURE");
}

TEST(AppendGoalPoseToGoals, PutsItBehindTheOthers) {
  const std::string pose = "<GetPoseFromPath path=\"{path}\" index=\"-1\" pose=\"{goal}\"/>";
  const auto goals = [&](const std::string& before) {
    return made_of_path("<Sequence>" + pose + "<AppendGoalPoseToGoals goal_pose=\"{goal}\" input_goals=\"{" + before +
                            "}\" output_goals=\"{out}\"/></Sequence>",
                        "out");
  };
  EXPECT_THAT(goals("none"), testing::AllOf(testing::StartsWith("[{"), HasSubstr("\"x\":4")));
  EXPECT_THAT(goals("path"), testing::AllOf(HasSubstr("\"x\":0"), HasSubstr("\"x\":2"), HasSubstr("\"poses\":[")))
      << "a message that has a list stays one";
  EXPECT_EQ(made_of_path("<AppendGoalPoseToGoals goal_pose=\"{none}\" output_goals=\"{out}\"/>", "out"), "FAILURE");
}

TEST(Nav2, NodesCanBeSavedInTheMiddle) {
  const std::string body = recovery("");
  Player p(body);
  p.tick({{"go", kF}, {"mend", kR}});
  const auto saved = bt::save(p.runner().tree(), p.runner().state());
  ASSERT_TRUE(saved.has_value()) << saved.error().message;
  Player q(body);
  auto restored = bt::restore(q.runner().tree(), *saved);
  ASSERT_TRUE(restored.has_value()) << restored.error().message;
  q.runner().state() = std::move(*restored);
  q.tick({{"go", kR}, {"mend", kS}});
  EXPECT_THAT(q.asked, ElementsAre("mend", "go"));
}

TEST(Nav2, ModelsWhatNeedsRos) {
  bt::Registry registry;
  add_nodes(registry);
  EXPECT_THAT(registry.problems(), IsEmpty());
  for (const bt::NodeModel& model : models()) {
    EXPECT_EQ(registry.find(model.id), nullptr) << model.id;
  }
  bt::Palette palette;
  palette.add(models());
  const auto tree = bt::load(
      "<root BTCPP_format=\"4\"><BehaviorTree ID=\"M\"><DistanceController distance=\"1.0\"><GoalUpdater "
      "input_goal=\"{g}\" "
      "output_goal=\"{h}\"><AlwaysSuccess/></GoalUpdater></DistanceController></BehaviorTree></root>",
      {.registry = &registry, .palette = &palette, .partial = true});
  ASSERT_TRUE(tree.ok());
  EXPECT_TRUE(tree.value->is_unknown(0));
  EXPECT_EQ(tree.value->category(0), bt::Category::kDecorator);
}

}  // namespace
}  // namespace sentree::nav2
