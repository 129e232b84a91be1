#include "sentree/bt/encode.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "sentree/base/rng.h"
#include "sentree/bt/detail/test_random_tree.h"
#include "sentree/bt/load.h"
#include "sentree/bt/registry.h"
#include "sentree/bt/step.h"

// The canonical form: equal forms, equal futures; states that behave alike have equal forms.

namespace sentree::bt {
namespace {

using namespace std::chrono_literals;
using ::testing::SizeIs;

Tree encoded_tree(const std::string& body, const Registry* registry = nullptr) {
  LoadOptions options;
  options.registry = registry;
  auto loaded = load("<root BTCPP_format=\"4\" main_tree_to_execute=\"Main\"><BehaviorTree ID=\"Main\">" + body +
                         "</BehaviorTree></root>",
                     options);
  for (const Diagnostic& d : loaded.diagnostics) {
    if (d.severity == Severity::kError) ADD_FAILURE() << to_string(d);
  }
  return std::move(*loaded.value);
}

std::string form(const Tree& tree, const State& state, TimePoint now) {
  std::string out;
  const auto encoded = encode(tree, state, now, out);
  EXPECT_TRUE(encoded.has_value());
  return out;
}

/// What a step did, times counted from `now`.
std::string told(const Tree& tree, const StepResult& result, const Effects& effects, TimePoint now) {
  std::string text = std::to_string(static_cast<int>(result.kind)) + std::string(to_string(result.status)) +
                     (result.leaf != kNoNode ? tree.path(result.leaf) : "") + (effects.wake ? " wake " : " ") +
                     (effects.error ? effects.error->message : "");
  for (const Effect& effect : effects.list) {
    text += std::to_string(static_cast<int>(effect.kind)) + ":" + tree.path(effect.leaf) +
            (effect.started ? "+ " : " ") + to_json(Value(effect.inputs));
  }
  return text + (effects.next_timer == kNever ? "" : std::to_string((effects.next_timer - now).count()));
}

/// A run whose inputs are drawn; what a leaf answers is drawn too.
struct Wanderer {
  State state;
  TimePoint now;

  std::string step(const Tree& tree, Rng& rng) {
    Effects effects;
    if (state.waiting_leaf() == kNoNode) now += Duration(50ms) * static_cast<int>(1 + rng.below(4));
    const std::uint64_t choice = rng.below(40);
    Input input = Input::tick();
    if (choice == 0) {
      input = Input::halt();
    } else if (state.waiting_leaf() != kNoNode) {
      const bool condition = tree.category(state.waiting_leaf()) == Category::kCondition;
      static constexpr Status kAnswers[] = {Status::kSuccess, Status::kFailure, Status::kRunning};
      input = Input::answer(state.waiting_leaf(), kAnswers[rng.below(condition ? 2 : 3)],
                            {{"out", static_cast<std::int64_t>(rng.below(2))}});
    } else if (choice < 10 && !state.outstanding_halts().empty()) {
      const auto halts = state.outstanding_halts();
      input = Input::leaf_halted(*std::min_element(halts.begin(), halts.end()));
    } else if (choice < 13) {
      input = Input::timer();
    }
    const StepResult result = bt::step(tree, state, input, now, effects);
    std::string text = told(tree, result, effects, now);
    if (result.kind == StepResult::Kind::kFailed) {
      text += told(tree, bt::step(tree, state, Input::halt(), now, effects), effects, now);
    }
    return text;
  }
};

TEST(Encode, GivesEqualFuturesToStatesWithEqualForms) {
  constexpr std::uint64_t kTrees = 100;
  constexpr int kSteps = 60, kFuture = 15;
  int pairs = 0;
  for (std::uint64_t seed = 1; seed <= kTrees; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const Tree tree = random_tree(seed, {.bounded = true, .branches = true});
    Rng rng(seed);
    std::map<std::string, Wanderer> seen;
    // Two histories that begin at different times.
    for (const TimePoint start : {TimePoint{}, TimePoint(1h)}) {
      Wanderer run{State(tree), start};
      for (int i = 0; i < kSteps; ++i) {
        run.step(tree, rng);
        const auto [place, fresh] = seen.try_emplace(form(tree, run.state, run.now), run);
        if (fresh || (place->second.now == run.now && place->second.state == run.state)) continue;
        if (++pairs % 3 != 0) continue;  // Enough of them.
        Wanderer one = place->second;
        Wanderer two = run;
        Rng first(seed + static_cast<std::uint64_t>(i));
        Rng second = first;
        for (int j = 0; j < kFuture; ++j) {
          ASSERT_EQ(one.step(tree, first), two.step(tree, second)) << "after step " << i << ", " << j << " later";
          ASSERT_EQ(form(tree, one.state, one.now), form(tree, two.state, two.now)) << i << ", " << j << " later";
        }
      }
    }
  }
  // Most of the steps meet a form again.
  EXPECT_GT(pairs, static_cast<int>(kTrees) * kSteps / 4);
}

TEST(Encode, IsTheSameForRunsShiftedInTime) {
  for (std::uint64_t seed = 1; seed <= 300; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const Tree tree = random_tree(seed, {.branches = true});
    Wanderer early{State(tree), TimePoint{}};
    Wanderer late{State(tree), TimePoint(24h)};
    Rng first(seed);
    Rng second(seed);
    for (int i = 0; i < 60; ++i) {
      ASSERT_EQ(early.step(tree, first), late.step(tree, second));
      ASSERT_EQ(form(tree, early.state, early.now), form(tree, late.state, late.now)) << "step " << i;
    }
  }
}

/// The forms that a tree of external leaves has between ticks, conditions answering at random.
std::set<std::string> forms(const Tree& tree, int ticks) {
  std::set<std::string> found;
  State state(tree);
  Effects effects;
  Rng rng(1);
  for (int i = 0; i < ticks; ++i) {
    const TimePoint now(i * 100ms);
    StepResult result = step(tree, state, Input::tick(), now, effects);
    while (result.waiting()) {
      const bool condition = tree.category(result.leaf) == Category::kCondition;
      const Status answer = !condition ? Status::kRunning : rng.below(2) == 0 ? Status::kSuccess : Status::kFailure;
      result = step(tree, state, Input::answer(result.leaf, answer, {{"out", i}}), now, effects);
    }
    for (const NodeId leaf : std::vector<NodeId>(state.outstanding_halts().begin(), state.outstanding_halts().end())) {
      step(tree, state, Input::leaf_halted(leaf), now, effects);
    }
    found.insert(form(tree, state, now));
  }
  return found;
}

TEST(Encode, HasAFormForEachSituationAndNotForEachTick) {
  // Which of the two actions runs.
  const Tree mission = encoded_tree(R"(<ReactiveFallback>
      <ReactiveSequence><Condition ID="Low"/><Action ID="Charge"/></ReactiveSequence><Action ID="Go"/></ReactiveFallback>)");
  EXPECT_THAT(forms(mission, 500), SizeIs(2));
}

TEST(Encode, LeavesOutHowOftenEntriesWereWritten) {
  const Tree writes = encoded_tree(R"(<Sequence><Script code="n := 1"/><SkipUnlessUpdated entry="{n}"><AlwaysSuccess/>
      </SkipUnlessUpdated><Action ID="Wait"/></Sequence>)");
  State state(writes);
  Effects effects;
  std::set<std::string> found;
  for (int i = 0; i < 20; ++i) {
    const TimePoint now(i * 100ms);
    const StepResult waits = step(writes, state, Input::tick(), now, effects);
    step(writes, state, Input::answer(waits.leaf, Status::kSuccess), now, effects);
    found.insert(form(writes, state, now));
  }
  EXPECT_THAT(found, SizeIs(1));
  // A write that the decorator has not seen makes a difference.
  const std::string before = form(writes, state, TimePoint(2s));
  ASSERT_TRUE(set_entry(writes, state, "n", 1, TimePoint(2s)).has_value());
  EXPECT_NE(form(writes, state, TimePoint(2s)), before);
}

TEST(Encode, KeepsNumbersOfWritesWhereEntriesMayBeginToCountAnew) {
  const Tree unsets = encoded_tree(R"(<Sequence><Script code="n := 1"/><UnsetBlackboard key="m"/></Sequence>)");
  State state(unsets);
  Effects effects;
  step(unsets, state, Input::tick(), TimePoint{}, effects);
  const std::string once = form(unsets, state, TimePoint{});
  step(unsets, state, Input::tick(), TimePoint{}, effects);
  EXPECT_NE(form(unsets, state, TimePoint{}), once);
}

TEST(Encode, KeepsWhatNodesInCppMayReadOfTheirEntries) {
  Registry registry;
  registry.action("Count", {input<int>("in")},
                  [](Context& self) { return self.sequence("in") % 2 == 0 ? Status::kSuccess : Status::kFailure; });
  const Tree counting = encoded_tree(R"(<Sequence><Script code="n := 1"/><Count in="{n}"/></Sequence>)", &registry);
  State state(counting);
  Effects effects;
  step(counting, state, Input::tick(), TimePoint{}, effects);
  const std::string once = form(counting, state, TimePoint{});
  step(counting, state, Input::tick(), TimePoint{}, effects);
  EXPECT_NE(form(counting, state, TimePoint{}), once);
}

TEST(Encode, RefusesWhatHasAskedForTheTime) {
  Registry registry;
  registry.condition("Early",
                     [](Context& self) { return self.now() < TimePoint(1s) ? Status::kSuccess : Status::kFailure; });
  const Tree tree = encoded_tree("<Fallback><Action ID=\"Flag\"/><Early/></Fallback>", &registry);
  State state(tree);
  Effects effects;
  std::string out = "before";
  step(tree, state, Input::tick(), TimePoint(1ms), effects);
  EXPECT_TRUE(encode(tree, state, TimePoint(1ms), out));
  step(tree, state, Input::answer(state.waiting_leaf(), Status::kFailure), TimePoint(1ms), effects);
  out = "before";
  const auto refused = encode(tree, state, TimePoint(1ms), out);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, "bt.asks-time");
  EXPECT_THAT(refused.error().message, testing::HasSubstr("node Early in C++ asks for the time"));
  EXPECT_EQ(out, "before");
}

TEST(Encode, CountsTimersFromNow) {
  const Tree sleeps = encoded_tree(R"(<Sleep msec="500"/>)");
  State state(sleeps);
  Effects effects;
  step(sleeps, state, Input::tick(), TimePoint(1s), effects);
  const std::string fresh = form(sleeps, state, TimePoint(1s));
  EXPECT_NE(form(sleeps, state, TimePoint(1100ms)), fresh);
  State later(sleeps);
  step(sleeps, later, Input::tick(), TimePoint(7s), effects);
  EXPECT_EQ(form(sleeps, later, TimePoint(7s)), fresh);
}

TEST(Encode, RefusesWhatHasNoSavedForm) {
  struct Keeps {
    int count = 0;
    Status tick(Context&) { return ++count > 3 ? Status::kSuccess : Status::kFailure; }
  };
  Registry registry;
  registry.add<Keeps>("Keeps");
  const Tree keeps = encoded_tree("<Keeps/>", &registry);
  std::string out = "before";
  EXPECT_EQ(encode(keeps, State(keeps), TimePoint{}, out).error().code, "bt.unsavable");
  EXPECT_EQ(out, "before");
}

}  // namespace
}  // namespace sentree::bt
