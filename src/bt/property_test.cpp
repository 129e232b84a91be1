#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "sentree/base/rng.h"
#include "sentree/bt/detail/test_random_tree.h"
#include "sentree/bt/detail/test_support.h"
#include "sentree/bt/encode.h"
#include "sentree/bt/hooks.h"
#include "sentree/bt/load.h"
#include "sentree/bt/registry.h"
#include "sentree/bt/state.h"
#include "sentree/bt/step.h"

// Properties of steps and states on random trees: what a leaf answers depends on its own history only.

namespace sentree::bt {
namespace {

using namespace std::chrono_literals;

/// Everything that a tree did, as text.
struct Play {
  Play(const Tree& tree_, std::uint64_t seed_) : tree(tree_), seed(seed_), state(tree_) {}

  /// What the leaf answers the n-th time it is asked; the same whoever asks.
  Status answer_of(NodeId leaf) {
    const std::uint64_t n = ++asked[leaf];
    Rng rng = Rng::of(seed, std::to_string(leaf) + "/" + std::to_string(n));
    if (tree.category(leaf) == Category::kCondition) return rng.below(2) == 0 ? Status::kSuccess : Status::kFailure;
    const std::uint64_t choice = rng.below(4);
    return choice < 2 ? Status::kRunning : choice == 2 ? Status::kSuccess : Status::kFailure;
  }

  void note() {
    for (const Effect& effect : effects.list) {
      log += std::to_string(static_cast<int>(effect.kind)) + ":" + tree.path(effect.leaf) +
             (effect.started ? "+ " : " ") + to_json(Value(effect.inputs));
    }
  }

  /// One root tick. `between` runs while the tick is suspended.
  template <class Between>
  void tick(TimePoint now, Between&& between) {
    StepResult result = step(tree, state, Input::tick(), now, effects);
    note();
    while (result.waiting()) {
      const NodeId leaf = result.leaf;
      between();
      const Status status = answer_of(leaf);
      result = step(tree, state, Input::answer(leaf, status, {{"out", static_cast<std::int64_t>(asked[leaf])}}), now,
                    effects);
      note();
    }
    finish(result, now);
  }

  void finish(const StepResult& result, TimePoint now) {
    log += " = " + std::string(to_string(result.status)) + (effects.error ? effects.error->message : "") + "\n";
    // Leaves halt late: the first one outstanding says so after each tick.
    if (!state.outstanding_halts().empty()) {
      step(tree, state, Input::leaf_halted(state.outstanding_halts().front()), now, effects);
    }
    if (result.kind == StepResult::Kind::kFailed) {
      step(tree, state, Input::halt(), now, effects);
      note();
    }
  }

  const Tree& tree;
  std::uint64_t seed;
  State state;
  Effects effects;
  std::map<NodeId, std::uint64_t> asked;
  std::string log;
};

constexpr std::uint64_t kTrees = 300;
constexpr int kTicks = 25;
TimePoint at_tick(int tick) { return TimePoint(tick * 100ms); }

TEST(Property, ARestoredStateGoesOnExactlyAsTheOriginal) {
  for (std::uint64_t seed = 1; seed <= kTrees; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const Tree tree = random_tree(seed);
    Play play(tree, seed);
    Rng rng(seed);
    const int cut = static_cast<int>(rng.below(kTicks));
    for (int tick = 0; tick < cut; ++tick) play.tick(at_tick(tick), [] {});
    const auto bytes = save(tree, play.state);
    ASSERT_TRUE(bytes.has_value());
    const auto restored = restore(tree, *bytes);
    ASSERT_TRUE(restored.has_value()) << restored.error().message;
    ASSERT_TRUE(*restored == play.state);
    ASSERT_EQ(restored->hash(), play.state.hash());
    ASSERT_EQ(save(tree, *restored).value(), *bytes);
    Play other = play;
    other.state = *restored;
    for (int tick = cut; tick < kTicks; ++tick) {
      play.tick(at_tick(tick), [] {});
      other.tick(at_tick(tick), [] {});
    }
    ASSERT_EQ(play.log, other.log);
    ASSERT_TRUE(play.state == other.state);
  }
}

TEST(Property, TheOutcomeDoesNotDependOnWhatHappensWhileATickIsSuspended) {
  for (std::uint64_t seed = 1; seed <= kTrees; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const Tree tree = random_tree(seed);
    Play at_once(tree, seed);
    Play later(tree, seed);
    Effects quiet;
    for (int tick = 0; tick < kTicks; ++tick) {
      at_once.tick(at_tick(tick), [] {});
      later.tick(at_tick(tick), [&] {
        // Ticks, timers and stray answers do not fit in; being saved and restored is not noticed.
        EXPECT_EQ(step(tree, later.state, Input::tick(), at_tick(tick), quiet).kind, StepResult::Kind::kIgnored);
        EXPECT_EQ(step(tree, later.state, Input::timer(), at_tick(tick), quiet).kind, StepResult::Kind::kIgnored);
        EXPECT_EQ(step(tree, later.state, Input::answer(0, Status::kSuccess), at_tick(tick), quiet).kind,
                  StepResult::Kind::kIgnored);
        later.state = restore(tree, save(tree, later.state).value()).value();
      });
    }
    ASSERT_EQ(at_once.log, later.log);
    ASSERT_TRUE(at_once.state == later.state);
  }
}

TEST(Property, TheOutcomeDoesNotDependOnWhenALeafAnswers) {
  // Without timers, so that later is only later.
  for (std::uint64_t seed = 1; seed <= kTrees; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const Tree tree = random_tree(seed, {.timers = false});
    Play at_once(tree, seed);
    Play later(tree, seed);
    Rng rng(seed);
    TimePoint now{};
    for (int tick = 0; tick < kTicks; ++tick) {
      at_once.tick(at_tick(tick), [] {});
      StepResult result = step(tree, later.state, Input::tick(), now, later.effects);
      later.note();
      while (result.waiting()) {
        now += Duration(static_cast<Duration::rep>(rng.below(1'000'000'000)));
        const NodeId leaf = result.leaf;
        const Status status = later.answer_of(leaf);
        result = step(tree, later.state,
                      Input::answer(leaf, status, {{"out", static_cast<std::int64_t>(later.asked[leaf])}}), now,
                      later.effects);
        later.note();
      }
      later.finish(result, now);
    }
    ASSERT_EQ(at_once.log, later.log);
    ASSERT_TRUE(
        std::equal(at_once.state.statuses().begin(), at_once.state.statuses().end(), later.state.statuses().begin()));
    ASSERT_EQ(to_json(export_blackboard(tree, at_once.state)), to_json(export_blackboard(tree, later.state)));
  }
}

/// Leaves in C++ that answer as `Play` does, within the step.
struct Answering {
  Status consult(Context& self) {
    const Status status = play->answer_of(self.id());
    asked->push_back(self.id());
    static_cast<void>(self.output("out", static_cast<std::int64_t>(play->asked[self.id()])));
    return status;
  }
  // What it remembers is not the tree's.
  [[nodiscard]] Value save() const { return {}; }
  [[nodiscard]] bool restore(const Value& /*saved*/) { return true; }
  Play* play = nullptr;
  std::vector<NodeId>* asked = nullptr;
};
struct AnsweringAction : Answering {
  static Ports ports() { return {input("in"), output("out")}; }
  Status on_start(Context& self) { return consult(self); }
  Status on_running(Context& self) { return consult(self); }
};
struct AnsweringCondition : Answering {
  static Ports ports() { return {output("out")}; }
  Status tick(Context& self) { return consult(self); }
};

TEST(Property, LeavesInCppAndLeavesThatAreWaitedForGiveTheSame) {
  // Without loops: a leaf that is halted and ticked again within one tick is RUNNING while it halts, if it is external.
  for (std::uint64_t seed = 1; seed <= kTrees; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const RandomTree::Parts parts{.timers = true, .loops = false};
    const Tree waiting = random_tree(seed, parts);
    Play play(waiting, seed);
    std::vector<NodeId> asked;
    Registry registry;
    Play answers(waiting, seed);
    AnsweringAction action;
    AnsweringCondition condition;
    action.play = condition.play = &answers;
    action.asked = condition.asked = &asked;
    registry.add<AnsweringAction>("Do", action);
    registry.add<AnsweringCondition>("Ask", Category::kCondition, condition);
    const Tree direct = random_tree(seed, parts, &registry);
    State state(direct);
    Effects effects;
    for (int tick = 0; tick < kTicks; ++tick) {
      std::vector<NodeId> waited;
      const auto halted = [&] {
        // They halt at once here, as C++ leaves do.
        Effects quiet;
        while (!play.state.outstanding_halts().empty()) {
          step(waiting, play.state, Input::leaf_halted(play.state.outstanding_halts().front()), at_tick(tick), quiet);
        }
      };
      StepResult result = step(waiting, play.state, Input::tick(), at_tick(tick), play.effects);
      halted();
      while (result.waiting()) {
        const NodeId leaf = result.leaf;
        waited.push_back(leaf);
        const Status status = play.answer_of(leaf);
        result = step(waiting, play.state,
                      Input::answer(leaf, status, {{"out", static_cast<std::int64_t>(play.asked[leaf])}}),
                      at_tick(tick), play.effects);
        halted();
      }
      asked.clear();
      const StepResult same = step(direct, state, Input::tick(), at_tick(tick), effects);
      ASSERT_EQ(asked, waited) << "tick " << tick;
      ASSERT_EQ(same.kind, result.kind);
      ASSERT_EQ(same.status, result.status);
      if (result.kind == StepResult::Kind::kFailed) {
        step(waiting, play.state, Input::halt(), at_tick(tick), play.effects);
        halted();
        step(direct, state, Input::halt(), at_tick(tick), effects);
      }
      ASSERT_TRUE(std::equal(state.statuses().begin(), state.statuses().end(), play.state.statuses().begin()));
      ASSERT_EQ(to_json(export_blackboard(direct, state)), to_json(export_blackboard(waiting, play.state)));
    }
  }
}

/// Everything that it is told, as text.
class Log final : public Observer {
 public:
  void status_changed(NodeId node, Status from, Status to, TimePoint /*time*/) override {
    text += std::to_string(node) + ": " + std::string(to_string(from)) + " > " + std::string(to_string(to)) + "\n";
  }
  void skipped(NodeId node, TimePoint /*time*/) override { text += std::to_string(node) + " skipped\n"; }
  std::string text;
};

TEST(Property, NodesThatAreCalledDoWhatTheyDoWhenTheyAreWalkedTo) {
  for (std::uint64_t seed = 1; seed <= kTrees; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const RandomTree::Parts parts{.branches = true};
    const Tree external = random_tree(seed, parts);
    struct Side {
      explicit Side(const Tree& of) : answers(of, 0) {}
      Play answers;
      std::vector<NodeId> asked;
      std::optional<Tree> tree;
      State state;
      Effects effects;
      Log log;
    };
    Side called(external);
    Side walked(external);
    for (Side* side : {&called, &walked}) {
      side->answers.seed = seed;
      Registry registry;
      AnsweringAction action;
      AnsweringCondition condition;
      action.play = condition.play = &side->answers;
      action.asked = condition.asked = &side->asked;
      registry.add<AnsweringAction>("Do", action);
      registry.add<AnsweringCondition>("Ask", Category::kCondition, condition);
      side->tree.emplace(random_tree(seed, parts, &registry));
      side->state = State(*side->tree);
    }
    // Every other tree is observed, too: what changes is told in the same order.
    if (seed % 2 == 0) {
      called.effects.observer = &called.log;
      walked.effects.observer = &walked.log;
    }
    // Whoever hooks into ticks is told of each, and nothing is called past him.
    TickHooks hooks;
    walked.effects.hooks = &hooks;
    for (int tick = 0; tick < kTicks; ++tick) {
      const StepResult result = step(*called.tree, called.state, Input::tick(), at_tick(tick), called.effects);
      const StepResult same = step(*walked.tree, walked.state, Input::tick(), at_tick(tick), walked.effects);
      ASSERT_EQ(result.kind, same.kind);
      ASSERT_EQ(result.status, same.status);
      ASSERT_EQ(called.effects.wake, walked.effects.wake);
      ASSERT_EQ(called.effects.next_timer, walked.effects.next_timer);
      ASSERT_EQ(called.asked, walked.asked);
      ASSERT_EQ(called.log.text, walked.log.text);
      if (result.kind == StepResult::Kind::kFailed) {
        ASSERT_EQ(called.effects.error->message, walked.effects.error->message);
        for (Side* side : {&called, &walked}) {
          step(*side->tree, side->state, Input::halt(), at_tick(tick), side->effects);
        }
      }
      std::string one;
      std::string other;
      ASSERT_TRUE(encode(*called.tree, called.state, at_tick(tick), one).has_value());
      ASSERT_TRUE(encode(*walked.tree, walked.state, at_tick(tick), other).has_value());
      ASSERT_EQ(one, other);
    }
  }
}

TEST(Property, ADeepTreeIsTickedAsAFlatOne) {
  const auto ticked = [](int levels, const std::string& leaf) {
    std::string xml = leaf;
    for (int i = 0; i < levels; ++i) {
      const std::string tag = i % 3 == 0 ? "Inverter" : i % 3 == 1 ? "Sequence" : "Fallback";
      xml = "<" + tag + ">" + xml + "</" + tag + ">";
    }
    auto loaded = load(in_tree(xml));
    EXPECT_TRUE(loaded.ok());
    State state(*loaded.value);
    Effects effects;
    const StepResult result = step(*loaded.value, state, Input::tick(), at_tick(0), effects);
    EXPECT_TRUE(result.done());
    for (const Status status : state.statuses())
      EXPECT_TRUE(status == Status::kIdle || result.status == Status::kRunning);
    return result.status;
  };
  for (const int levels : {0, 1, 99, 100, 101, 102, 150, 300, 900}) {
    SCOPED_TRACE(levels);
    const bool inverted = (levels + 2) / 3 % 2 == 1;
    EXPECT_EQ(ticked(levels, "<AlwaysSuccess/>"), inverted ? Status::kFailure : Status::kSuccess);
    EXPECT_EQ(ticked(levels, "<AlwaysFailure/>"), inverted ? Status::kSuccess : Status::kFailure);
    EXPECT_EQ(ticked(levels, "<Sleep msec=\"5\"/>"), Status::kRunning);
  }
}

TEST(Property, ACopyIsEqualUntilItIsSteppedAndThenTheOriginalIsAsItWas) {
  for (std::uint64_t seed = 1; seed <= kTrees; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const Tree tree = random_tree(seed);
    Play play(tree, seed);
    std::size_t different = 0;
    for (int tick = 0; tick < kTicks; ++tick) {
      const State before = play.state;
      const std::string bytes = save(tree, before).value();
      const std::uint64_t hash = before.hash();
      ASSERT_TRUE(before == play.state);
      play.tick(at_tick(tick), [] {});
      // Stepping one copy is not seen in the other; what differs in bytes differs in comparison, and the reverse.
      ASSERT_EQ(save(tree, before).value(), bytes);
      ASSERT_EQ(before.hash(), hash);
      const bool same = before == play.state;
      ASSERT_EQ(same, save(tree, play.state).value() == bytes);
      if (same) {
        ASSERT_EQ(play.state.hash(), hash);
      } else {
        different += play.state.hash() != hash ? 1 : 0;
      }
    }
    ASSERT_GT(different, 0U);
  }
}

/// Rebuilds every status from what it is told.
class Mirror final : public Observer {
 public:
  explicit Mirror(const Tree& tree) : statuses(tree.size(), Status::kIdle) {}
  void status_changed(NodeId node, Status from, Status to, TimePoint /*time*/) override {
    consistent = consistent && statuses[node] == from && from != to;
    statuses[node] = to;
  }
  std::vector<Status> statuses;
  bool consistent = true;
};

TEST(Property, AnObserverSeesEveryChangeAndChangesNothing) {
  for (std::uint64_t seed = 1; seed <= kTrees; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const Tree tree = random_tree(seed);
    Play watched(tree, seed);
    Play alone(tree, seed);
    Mirror mirror(tree);
    watched.effects.observer = &mirror;
    for (int tick = 0; tick < kTicks; ++tick) {
      watched.tick(at_tick(tick), [] {});
      alone.tick(at_tick(tick), [] {});
      ASSERT_TRUE(mirror.consistent);
      ASSERT_TRUE(std::equal(mirror.statuses.begin(), mirror.statuses.end(), watched.state.statuses().begin()));
    }
    ASSERT_EQ(watched.log, alone.log);
    ASSERT_TRUE(watched.state == alone.state);
  }
}

TEST(Property, HaltingAtAnyMomentLeavesAllNodesIdle) {
  for (std::uint64_t seed = 1; seed <= kTrees; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const Tree tree = random_tree(seed);
    Play play(tree, seed);
    Rng rng(seed + 1000);
    for (int tick = 0; tick < static_cast<int>(rng.below(10)); ++tick) play.tick(at_tick(tick), [] {});
    // In the middle of a tick, or between two.
    if (rng.below(2) == 0) step(tree, play.state, Input::tick(), at_tick(20), play.effects);
    step(tree, play.state, Input::halt(), at_tick(20), play.effects);
    EXPECT_EQ(play.state.waiting_leaf(), kNoNode);
    EXPECT_EQ(play.state.next_timer(), kNever);
    for (const Status status : play.state.statuses()) ASSERT_EQ(status, Status::kIdle);
  }
}

TEST(Snapshot, RefusesDamagedBytesAndOtherTrees) {
  const Tree tree = random_tree(3);
  Play play(tree, 3);
  for (int tick = 0; tick < 8; ++tick) play.tick(at_tick(tick), [] {});
  const std::string bytes = save(tree, play.state).value();
  EXPECT_EQ(restore(random_tree(4), bytes).error().code, "bt.bad-snapshot");
  EXPECT_EQ(restore(tree, "").error().code, "bt.bad-snapshot");
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    ASSERT_FALSE(restore(tree, bytes.substr(0, size)).has_value()) << size;
  }
  // A changed byte is refused, or gives a state that can be stepped.
  Rng rng(5);
  for (int i = 0; i < 3000; ++i) {
    std::string damaged = bytes;
    damaged[rng.below(damaged.size())] = static_cast<char>(rng.next());
    const auto restored = restore(tree, damaged);
    if (!restored) continue;
    Play other(tree, 3);
    other.state = *restored;
    step(tree, other.state, Input::halt(), at_tick(9), other.effects);
    other.tick(at_tick(9), [] {});
  }
}

}  // namespace
}  // namespace sentree::bt
