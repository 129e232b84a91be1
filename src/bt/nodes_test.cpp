#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "sentree/bt/detail/machine.h"
#include "sentree/bt/detail/test_support.h"
#include "sentree/bt/hooks.h"
#include "sentree/bt/load.h"
#include "sentree/bt/observer.h"
#include "sentree/bt/runner.h"

namespace sentree::bt {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;

Runner runner(const std::string& body, const Registry* registry = nullptr) {
  LoadOptions options;
  options.registry = registry;
  auto loaded = load(in_tree(body), options);
  for (const Diagnostic& d : loaded.diagnostics) {
    if (d.severity == Severity::kError) ADD_FAILURE() << to_string(d);
  }
  return Runner(std::move(*loaded.value));
}

TimePoint at(Duration time) { return TimePoint(time); }

/// How many of the nodes were told to be something else than before, in one tick.
struct Changes final : Observer {
  std::size_t count = 0;
  void status_changed(NodeId, Status, Status, TimePoint) override { ++count; }
};

TEST(Sequence, TakesManyLeavesOfKnownResultsAtOnceAndStopsAtTheRightOne) {
  for (std::size_t leaves = 1; leaves <= 20; ++leaves) {
    for (std::size_t other = 0; other <= leaves; ++other) {
      std::string good;
      std::string bad;
      for (std::size_t i = 0; i < leaves; ++i) {
        good += i == other ? "<AlwaysFailure/>" : "<AlwaysSuccess/>";
        bad += i == other ? "<AlwaysSuccess/>" : "<AlwaysFailure/>";
      }
      const bool all = other == leaves;
      Runner sequence = runner("<Sequence>" + good + "</Sequence>");
      Runner fallback = runner("<Fallback>" + bad + "</Fallback>");
      for (int tick = 0; tick < 2; ++tick) {
        EXPECT_EQ(sequence.tick(), all ? Status::kSuccess : Status::kFailure) << leaves << " leaves, " << other;
        EXPECT_EQ(fallback.tick(), all ? Status::kFailure : Status::kSuccess) << leaves << " leaves, " << other;
        EXPECT_EQ(sequence.state(), State(sequence.tree()));
      }
      // Somebody who listens is told of each leaf, there and back, and of the Sequence.
      Changes changes;
      sequence.effects().observer = &changes;
      sequence.tick();
      EXPECT_EQ(changes.count, 2 * std::min(leaves, other + 1) + 3);
    }
  }
}

TEST(Delay, TicksItsChildAfterTheDelayAndNotBefore) {
  Runner r = runner("<Delay delay_msec=\"100\"><AlwaysFailure/></Delay>");
  EXPECT_EQ(r.tick(at(0ms)), Status::kRunning);
  EXPECT_EQ(r.effects().next_timer, at(100ms));
  EXPECT_EQ(r.tick(at(99ms)), Status::kRunning);
  EXPECT_EQ(r.tick(at(100ms)), Status::kFailure);
  EXPECT_EQ(r.effects().next_timer, kNever);
}

TEST(Sleep, RunsForItsTime) {
  Runner r = runner("<Sleep msec=\"50\"/>");
  EXPECT_EQ(r.tick(at(0ms)), Status::kRunning);
  EXPECT_EQ(r.tick(at(49ms)), Status::kRunning);
  EXPECT_EQ(r.tick(at(50ms)), Status::kSuccess);
}

// So that who adds a node finds out when it is first ticked, not when a saved state is refused.
TEST(Timers, AreStartedOnlyByNodesWhoseStructSaysSo) {
  const auto loaded = load(in_tree("<Sequence><Sleep msec=\"50\"/><AlwaysSuccess/></Sequence>"));
  const Tree& tree = *loaded.value;
  State state(tree);
  Effects effects;
  Machine machine(tree, state, at(0ms), effects);
  machine.start_timer(1, at(50ms));
  const auto saved = save(tree, state);
  ASSERT_TRUE(saved) << to_string(saved.error());
  EXPECT_TRUE(restore(tree, *saved));
  EXPECT_DEATH(machine.start_timer(2, at(50ms)), "starts_timers");
}

TEST(Timeout, HaltsItsChildWhenTheTimerFiresAndFailsAtTheNextTick) {
  auto loaded = load(in_tree("<Timeout msec=\"100\"><Action ID=\"Go\"/></Timeout>"));
  const Tree& tree = *loaded.value;
  State state(tree);
  Effects effects;
  step(tree, state, Input::tick(), at(0ms), effects);
  step(tree, state, Input::answer(1, Status::kRunning), at(0ms), effects);
  EXPECT_EQ(effects.next_timer, at(100ms));
  step(tree, state, Input::timer(), at(99ms), effects);
  EXPECT_TRUE(effects.list.empty());
  step(tree, state, Input::timer(), at(100ms), effects);
  ASSERT_EQ(effects.list.size(), 1U);
  EXPECT_EQ(effects.list[0].kind, Effect::Kind::kHaltLeaf);
  EXPECT_TRUE(effects.wake);
  EXPECT_EQ(step(tree, state, Input::tick(), at(100ms), effects).status, Status::kFailure);
}

TEST(Ports, OfAFailedTickAreNamedWithTheirEntries) {
  for (const auto& [body, what] : std::vector<std::pair<std::string, std::string>>{
           {"<Repeat num_cycles=\"{n}\"><AlwaysSuccess/></Repeat>",
            "port \"num_cycles\": entry {n} holds no value yet"},
           {"<RetryUntilSuccessful num_attempts=\"{n}\"><AlwaysSuccess/></RetryUntilSuccessful>",
            "entry {n} holds no value yet"},
           {"<Delay delay_msec=\"{n}\"><AlwaysSuccess/></Delay>", "port \"delay_msec\": entry {n} holds no value yet"},
           {"<Timeout msec=\"{n}\"><AlwaysSuccess/></Timeout>", "port \"msec\": entry {n} holds no value yet"},
           {"<ParallelAll max_failures=\"{n}\"><AlwaysSuccess/></ParallelAll>", "port \"max_failures\": entry"},
           {"<Parallel failure_count=\"{n}\"><AlwaysSuccess/></Parallel>", "port \"failure_count\": entry"},
           {"<SetBlackboard value=\"1\" output_key=\"{n}\"/>", "port \"output_key\": entry {n} holds no value yet"},
           {"<Sleep msec=\"{n}\"/>", "needs msec as a whole number; port \"msec\": entry {n} holds no value yet"}}) {
    Runner r = runner(body);
    r.tick();
    ASSERT_TRUE(r.error().has_value()) << body;
    EXPECT_THAT(r.error()->message, HasSubstr(what)) << body;
  }
}

TEST(Ports, ThatANodeDoesNotHaveFailItsTick) {
  Registry registry;
  bool is_told = false;
  registry.action("Slip", {output<int>("count")}, [&](Context& self) {
    is_told = !self.output("cuont", 3);
    return Status::kSuccess;
  });
  registry.action("Quiet", {output<int>("count")}, [](Context& self) {
    EXPECT_EQ(self.output("count", 3).error().code, "bt.no-port");
    return Status::kSuccess;
  });
  Runner slip = runner("<Slip count=\"{n}\"/>", &registry);
  slip.tick();
  EXPECT_TRUE(is_told);
  ASSERT_TRUE(slip.error().has_value());
  EXPECT_EQ(slip.error()->code, "bt.no-port");
  EXPECT_THAT(slip.error()->message, HasSubstr("no output port \"cuont\"; did you mean \"count\"?"));
  // One that has it, and nobody asks for what it writes there.
  EXPECT_EQ(runner("<Quiet/>", &registry).tick(), Status::kSuccess);
}

TEST(Scripts, SayWhosePortAnEntryIsOf) {
  Runner r = runner(
      "<Sequence><Script code=\"p := 'abc'\"/><Delay name=\"Wait\" delay_msec=\"{p}\"><AlwaysSuccess/>"
      "</Delay></Sequence>");
  r.tick();
  ASSERT_TRUE(r.error().has_value());
  EXPECT_THAT(r.error()->message, HasSubstr("(port \"delay_msec\" of Wait) and cannot take abc"));
}

TEST(Repeat, IsStoppedWhenItNeverEndsWithinOneTick) {
  // Format 3 does not yield between cycles.
  auto loaded =
      load("<root><BehaviorTree ID=\"A\"><Repeat num_cycles=\"-1\"><AlwaysSuccess/></Repeat></BehaviorTree></root>");
  Runner r(std::move(*loaded.value));
  EXPECT_EQ(r.tick(), Status::kFailure);
  ASSERT_TRUE(r.error().has_value());
  EXPECT_EQ(r.error()->code, "bt.endless-tick");
}

TEST(Runner, TicksOnceUntilNoNodeYields) {
  Runner r = runner("<Repeat num_cycles=\"5\"><AlwaysSuccess/></Repeat>");
  EXPECT_EQ(r.tick_until_waiting(), Status::kSuccess);
}

struct Position {
  double x = 0;
  double y = 0;
};

}  // namespace

template <>
struct Convert<Position> {
  static std::string name() { return "Position"; }
  static Value to_value(const Position& p) { return Map{{"x", p.x}, {"y", p.y}}; }
  static std::optional<Position> from_value(const Value& v) {
    if (v.find("x") == nullptr || v.find("y") == nullptr) return std::nullopt;
    return Position{v.find("x")->number(), v.find("y")->number()};
  }
  static std::optional<Position> from_text(std::string_view text) {
    const auto parts = detail::split_list(text);
    if (parts.size() != 2) return std::nullopt;
    const auto x = detail::parse_real(parts[0]);
    const auto y = detail::parse_real(parts[1]);
    if (!x || !y) return std::nullopt;
    return Position{*x, *y};
  }
};

namespace {

TEST(Ports, CarryTypesOfOnesOwn) {
  Registry registry;
  double seen = 0;
  registry.action("Show", {input<Position>("at")}, [&](Context& self) {
    const auto position = self.input<Position>("at");
    if (position) seen = position->x + position->y;
    return position ? Status::kSuccess : Status::kFailure;
  });
  registry.action("Where", {output<Position>("at")}, [](Context& self) {
    return self.output("at", Position{3, 4}) ? Status::kSuccess : Status::kFailure;
  });
  Runner r = runner("<Sequence><Show at=\"1.5;2\"/><Where at=\"{p}\"/><Show at=\"{p}\"/></Sequence>", &registry);
  EXPECT_EQ(r.tick(), Status::kSuccess);
  EXPECT_EQ(seen, 7);
  EXPECT_EQ(load(in_tree("<Show at=\"1.5\"/>"), {.registry = &registry}).ok(), false);
}

/// Has no value form: a handle of a driver.
struct Driver {
  int number = 0;
};

TEST(Ports, CarryCppObjectsThatTheStateCannotSave) {
  Registry registry;
  registry.action("Open", {output<std::shared_ptr<Driver>>("driver")}, [](Context& self) {
    return self.output("driver", std::make_shared<Driver>(Driver{42})) ? Status::kSuccess : Status::kFailure;
  });
  registry.action("Use", {input<std::shared_ptr<Driver>>("driver")}, [](Context& self) {
    const auto driver = self.input<std::shared_ptr<Driver>>("driver");
    return driver && (*driver)->number == 42 ? Status::kSuccess : Status::kFailure;
  });
  Runner r = runner("<Sequence><Open driver=\"{d}\"/><Use driver=\"{d}\"/></Sequence>", &registry);
  EXPECT_EQ(r.tick(), Status::kSuccess);
  const auto saved = save(r.tree(), r.state());
  ASSERT_FALSE(saved.has_value());
  EXPECT_EQ(saved.error().code, "bt.unsavable");
}

TEST(Ports, AreFoundByNamesOfAnyLengthAndOverwriteOnlyTheirOwnType) {
  Registry registry;
  registry.action("Both",
                  {input<double>("temperature_a"), input<double>("temperature_b"), output<float>("narrow"),
                   output<std::string>("text")},
                  [](Context& self) {
                    const auto a = self.input<double>("temperature_a");
                    const auto b = self.input<double>("temperature_b");
                    if (!a || !b || *a != 1.5 || *b != 2.5 || self.input<double>("temperature_c")) {
                      return Status::kFailure;
                    }
                    return self.output<float>("narrow", 0.5F) && self.output<std::string>("text", "x")
                               ? Status::kSuccess
                               : Status::kFailure;
                  });
  // The second time, entries are overwritten in place; the sequence numbers go on.
  Runner r = runner("<Both temperature_a=\"1.5\" temperature_b=\"2.5\" narrow=\"{n}\" text=\"{t}\"/>", &registry);
  EXPECT_EQ(r.tick(at(1ms)), Status::kSuccess);
  EXPECT_EQ(r.tick(at(2ms)), Status::kSuccess);
  for (const EntryFact& fact : blackboard(r.tree(), r.state())) {
    EXPECT_EQ(fact.sequence, 2U) << fact.name;
    EXPECT_EQ(fact.stamp, at(2ms)) << fact.name;
  }
  EXPECT_EQ(*entry(r.tree(), r.state(), "n"), Value(0.5));
}

struct CountTo {
  std::int64_t count = 0;
  static Ports ports() { return {input<int>("limit")}; }
  Status on_start(Context& self) {
    count = 0;
    return on_running(self);
  }
  Status on_running(Context& self) {
    return ++count < self.input_or<int>("limit", 1) ? Status::kRunning : Status::kSuccess;
  }
  void on_halted(Context&) { count = -100; }
  [[nodiscard]] Value save() const { return count; }
  bool restore(const Value& saved) {
    if (saved.as_int() == nullptr) return false;
    count = *saved.as_int();
    return true;
  }
};

TEST(Stateful, KeepsItsMembersInTheStateOfTheTree) {
  Registry registry;
  registry.add<CountTo>("CountTo");
  Runner r = runner("<CountTo limit=\"3\"/>", &registry);
  EXPECT_EQ(r.tick(), Status::kRunning);
  const State copy = r.state();
  const std::string saved = save(r.tree(), r.state()).value();
  EXPECT_EQ(r.tick(), Status::kRunning);
  EXPECT_EQ(r.tick(), Status::kSuccess);
  r.state() = copy;
  EXPECT_EQ(r.tick(), Status::kRunning);
  EXPECT_EQ(r.tick(), Status::kSuccess);
  r.state() = restore(r.tree(), saved).value();
  EXPECT_EQ(r.tick(), Status::kRunning);
  EXPECT_EQ(r.tick(), Status::kSuccess);
}

struct Unsavable {
  std::vector<void*> handles{nullptr};
  Status tick(Context&) { return Status::kSuccess; }
};

TEST(Stateful, WhatCannotBeSavedSaysSo) {
  Registry registry;
  registry.add<Unsavable>("Opaque");
  Runner r = runner("<Opaque name=\"camera\"/>", &registry);
  EXPECT_THAT(save(r.tree(), r.state()).error().message,
              HasSubstr("node \"camera\" (Opaque) keeps what cannot be saved"));
}

/// Ticks its children in turn, one per tick.
struct RoundRobin {
  std::size_t next = 0;
  Next on_tick(Context& self) { return Next::tick(next % self.child_count()); }
  Next on_child(Context& self, std::size_t child, Status status) {
    self.reset_child(child);
    next = child + 1;
    return Next::done(status);
  }
  [[nodiscard]] Value save() const { return static_cast<std::int64_t>(next); }
  bool restore(const Value& saved) {
    next = static_cast<std::size_t>(saved.number());
    return true;
  }
};

TEST(Control, WrittenInCppDrivesItsChildrenAlsoExternalOnes) {
  Registry registry;
  registry.add<RoundRobin>("RoundRobin", Category::kControl);
  registry.decorator("Swap", {}, [](Context&, Status child) {
    return child == Status::kSuccess ? Status::kFailure : Status::kSuccess;
  });
  Runner r =
      runner("<RoundRobin><AlwaysSuccess/><Swap><AlwaysSuccess/></Swap><Action ID=\"Go\"/></RoundRobin>", &registry);
  r.on_leaf = [](NodeId, const Map&) { return std::pair(Status::kSuccess, Map{}); };
  EXPECT_EQ(r.tick(), Status::kSuccess);
  EXPECT_EQ(r.tick(), Status::kFailure);
  EXPECT_EQ(r.tick(), Status::kSuccess);
}

TEST(Registry, ReportsMistakesWhenATreeIsLoaded) {
  Registry registry;
  registry.action("Sequence", [](Context&) { return Status::kSuccess; });
  registry.action("Twice", [](Context&) { return Status::kSuccess; });
  registry.action("Twice", [](Context&) { return Status::kSuccess; });
  registry.action("BadPort", {input<int>("_x")}, [](Context&) { return Status::kSuccess; });
  const auto loaded = load(in_tree("<AlwaysSuccess/>"), {.registry = &registry});
  EXPECT_FALSE(loaded.ok());
  EXPECT_EQ(loaded.diagnostics.size(), 3U);
}

TEST(Registry, TellsAPluginThatIsNone) {
  Registry registry;
  EXPECT_EQ(registry.plugin("/nonexistent.so").error().code, "bt.plugin-unreadable");
}

TEST(Context, AFailedNodeGivesTheTickUp) {
  Registry registry;
  registry.action("Break", [](Context& self) {
    self.fail("the arm is gone");
    return Status::kSuccess;
  });
  registry.action("Lie", [](Context&) { return Status::kRunning; });
  Runner broken = runner("<Sequence><Break/></Sequence>", &registry);
  EXPECT_EQ(broken.tick(), Status::kFailure);
  EXPECT_THAT(broken.error()->message, HasSubstr("the arm is gone"));
  Runner lying = runner("<Lie/>", &registry);
  EXPECT_EQ(lying.tick(), Status::kFailure);
  EXPECT_EQ(lying.error()->code, "bt.running-returned");
}

struct Undecided {
  Status tick(Context&) { return Status::kRunning; }
};

TEST(Context, AConditionMayBeUndecidedIfItIsAClass) {
  Registry registry;
  registry.condition("Function", [](Context&) { return Status::kRunning; });
  registry.add<Undecided>("Class", Category::kCondition);
  Runner function = runner("<Function/>", &registry);
  EXPECT_EQ(function.tick(), Status::kFailure);
  EXPECT_EQ(function.error()->code, "bt.running-returned");
  EXPECT_THAT(function.error()->message, HasSubstr("make it a class"));
  EXPECT_EQ(runner("<Sequence><Class/></Sequence>", &registry).tick(), Status::kRunning);
}

TEST(Context, AWakerAsksForATickFromOutside) {
  Registry registry;
  std::function<void()> waker;
  registry.add<CountTo>("CountTo");
  registry.action("Keep", [&](Context& self) {
    waker = self.waker();
    return Status::kSuccess;
  });
  Runner r = runner("<Keep/>", &registry);
  int asked = 0;
  r.tick();
  waker();  // of who hears none
  r.effects().waker = [&] { ++asked; };
  r.tick();
  waker();
  EXPECT_EQ(asked, 1);
}

TEST(Statistics, CountsResultsAndKeepsTheLastWithItsTime) {
  Runner r = runner("<Fallback><AlwaysFailure/><AlwaysSuccess _skipIf=\"1\"/><AlwaysSuccess/></Fallback>");
  Statistics statistics(r.tree());
  r.effects().observer = &statistics;
  r.tick(at(5ms));
  r.tick(at(7ms));
  EXPECT_EQ(statistics.node(1).failed, 2U);
  EXPECT_EQ(statistics.node(2).skipped, 2U);
  EXPECT_EQ(statistics.node(3).succeeded, 2U);
  EXPECT_EQ(statistics.node(3).last_result, Status::kSuccess);
  EXPECT_EQ(statistics.node(3).changed, at(7ms));
}

TEST(Format3, RunsWithItsOwnSemantics) {
  auto loaded =
      load("<root><BehaviorTree ID=\"A\"><Repeat num_cycles=\"3\"><AlwaysSuccess/></Repeat></BehaviorTree></root>");
  EXPECT_EQ(loaded.value->format(), 3);
  EXPECT_EQ(Runner(std::move(*loaded.value)).tick(), Status::kSuccess);
  EXPECT_EQ(runner("<Repeat num_cycles=\"3\"><AlwaysSuccess/></Repeat>").tick(), Status::kRunning);
}

/// Leaves that write entries of their own types.
Registry writers() {
  Registry registry;
  registry.action("Real", {output<double>("out")},
                  [](Context& self) { return self.output<double>("out", 0.5) ? Status::kSuccess : Status::kFailure; });
  registry.action("Never", {inout<double>("out")}, [](Context& /*self*/) { return Status::kSuccess; });
  return registry;
}

Runner ticked(const std::string& xml, const Registry& registry, Status wanted) {
  LoadOptions options;
  options.registry = &registry;
  auto loaded = load(xml, options);
  for (const Diagnostic& d : loaded.diagnostics) {
    if (d.severity == Severity::kError) ADD_FAILURE() << to_string(d);
  }
  Runner r(std::move(*loaded.value));
  EXPECT_EQ(r.tick(), wanted) << xml << (r.error() ? "\n" + to_string(*r.error()) : "");
  return r;
}

TEST(SetBlackboard, CopiesIntoADeclaredEntryOnlyWhatIsOfItsType) {
  const Registry registry = writers();
  const auto copied = [&](const std::string& script, Status wanted) {
    Runner r = ticked(in_tree("<Sequence><Never out=\"{d}\"/><Script code=\"" + script +
                              "\"/><SetBlackboard value=\"{v}\" output_key=\"d\"/></Sequence>"),
                      registry, wanted);
    const Value* held = entry(r.tree(), r.state(), "d");
    return held != nullptr ? to_json(*held) : "-";
  };
  EXPECT_EQ(copied("v := 2.5", Status::kSuccess), "2.5");
  EXPECT_EQ(copied("v := '2.5'", Status::kSuccess), "2.5");  // Text is read as what the entry is.
  EXPECT_EQ(copied("v := 2", Status::kFailure), "-");        // A whole number is no double.
  EXPECT_EQ(copied("v := 'red'", Status::kFailure), "-");
}

TEST(SetBlackboard, ReadsTextAlsoWhereTheEntryIsRemapped) {
  const Registry registry = writers();
  const std::string inner = "<BehaviorTree ID=\"In\"><SetBlackboard value=\"{v}\" output_key=\"d\"/></BehaviorTree>";
  Runner r = ticked(in_tree("<Sequence><Never out=\"{d}\"/><Script code=\"v := '2.5'\"/>"
                            "<SubTree ID=\"In\" _autoremap=\"true\"/></Sequence>",
                            inner),
                    registry, Status::kSuccess);
  EXPECT_EQ(to_json(*entry(r.tree(), r.state(), "d")), "2.5");
}

// As in a plug-in, whose types have addresses of their own.
TEST(RestoredState, IsEqualWhicheverLibraryATypeIsOf) {
  static const PortType elsewhere = type_of<double>();
  Registry registry;
  const auto tick = [](Context& self) { return self.output("out", 2.5) ? Status::kSuccess : Status::kFailure; };
  registry.action("Ours", {output<double>("out")}, tick);
  Ports theirs{output<double>("out")};
  theirs.front().type = &elsewhere;
  registry.action("Theirs", theirs, tick);
  Runner r =
      ticked(in_tree("<Sequence><Ours out=\"{a}\"/><Theirs out=\"{b}\"/></Sequence>"), registry, Status::kSuccess);
  const auto saved = save(r.tree(), r.state());
  ASSERT_TRUE(saved);
  EXPECT_EQ(*restore(r.tree(), *saved), r.state());
  Runner again =
      ticked(in_tree("<Sequence><Ours out=\"{a}\"/><Theirs out=\"{b}\"/></Sequence>"), registry, Status::kSuccess);
  EXPECT_EQ(again.state().hash(), r.state().hash());
}

TEST(SetBlackboard, LeavesAnUndeclaredEntryEmptyAndThenRefusesText) {
  const Registry registry = writers();
  Runner r = ticked(in_tree("<Sequence><Script code=\"s := 'red'\"/><SetBlackboard value=\"{s}\" output_key=\"t\"/>"
                            "</Sequence>"),
                    registry, Status::kSuccess);
  EXPECT_EQ(entry(r.tree(), r.state(), "t"), nullptr);
  const auto saved = save(r.tree(), r.state());
  ASSERT_TRUE(saved);
  EXPECT_EQ(*restore(r.tree(), *saved), r.state());
  EXPECT_EQ(r.tick(), Status::kFailure);
  EXPECT_THAT(r.error()->message, HasSubstr("entry \"t\" cannot take the value \"red\""));
}

TEST(SetBlackboard, FailsWhereThereIsNothingToCopyYet) {
  const Registry registry = writers();
  Runner r = ticked(in_tree("<Sequence><Never out=\"{d}\"/><SetBlackboard value=\"{d}\" output_key=\"e\"/></Sequence>"),
                    registry, Status::kFailure);
  EXPECT_FALSE(r.error());
}

TEST(UnsetBlackboard, TakesAnEntryFromTheSubTreesToWhichItIsRemapped) {
  const Registry registry = writers();
  const std::string inner =
      "<BehaviorTree ID=\"In\"><ScriptCondition code=\"a == 1\" _onSuccess=\"seen := 1\"/></BehaviorTree>"
      "<BehaviorTree ID=\"Out\"><UnsetBlackboard key=\"a\"/></BehaviorTree>";
  const std::string use = "<SubTree ID=\"In\" a=\"{x}\"/>";
  Runner kept = ticked(
      in_tree("<Sequence><Script code=\"x := 1\"/>" + use + "<SubTree ID=\"Out\" a=\"{x}\"/>" + use + "</Sequence>",
              inner),
      registry, Status::kSuccess);
  EXPECT_NE(entry(kept.tree(), kept.state(), "x"), nullptr);
  Runner gone =
      ticked(in_tree("<Sequence><Script code=\"x := 1\"/>" + use + "<UnsetBlackboard key=\"x\"/>" + use + "</Sequence>",
                     inner),
             registry, Status::kFailure);
  EXPECT_THAT(gone.error()->message, HasSubstr("no entry \"a\""));
}

std::string in_format3(const std::string& body) {
  return "<root main_tree_to_execute=\"Main\"><BehaviorTree ID=\"Main\">" + body + "</BehaviorTree></root>";
}

TEST(Format3, NoWriteGivesAnEntryItsType) {
  const Registry registry = writers();
  Runner r = ticked(in_format3("<Sequence><SetBlackboard value=\"1\" output_key=\"k\"/><Real out=\"{k}\"/>"
                               "<SetBlackboard value=\"2\" output_key=\"k\"/></Sequence>"),
                    registry, Status::kSuccess);
  // The port declares it: text is read as a number.
  EXPECT_EQ(to_json(*entry(r.tree(), r.state(), "k")), "2.0");
  r = ticked(
      "<root main_tree_to_execute=\"Main\"><BehaviorTree ID=\"Main\"><SubTreePlus ID=\"In\" k=\"1\"/>"
      "</BehaviorTree><BehaviorTree ID=\"In\"><Sequence><Real out=\"{k}\"/>"
      "<SetBlackboard value=\"2\" output_key=\"k\"/></Sequence></BehaviorTree></root>",
      registry, Status::kSuccess);
  // The constant of the SubTree made it, and nothing declares it: it stays text.
  EXPECT_EQ(to_json(*entry(r.tree(), r.state(), "k", 0)), "\"2\"");
}

TEST(Format3, LoadsLeavesWithChildrenThatAreNeverTicked) {
  const Registry registry = writers();
  const std::string xml = in_format3("<Sequence><AlwaysSuccess><AlwaysFailure/></AlwaysSuccess></Sequence>");
  Runner r = ticked(xml, registry, Status::kSuccess);
  EXPECT_EQ(r.tree().size(), 2U);
  EXPECT_THAT(messages(xml), HasSubstr("AlwaysSuccess is a leaf: what stands inside it is never ticked"));
  EXPECT_THAT(messages(in_format3("<Sequence><Action ID=\"AlwaysSuccess\"><AlwaysFailure/></Action></Sequence>")),
              HasSubstr("a leaf has no children"));
}

TEST(EventName, KeepsLettersDigitsAndWhatIsBeyondAscii) {
  EXPECT_EQ(event_name("Sub.Go to (kitchen)/1-a_b"), "Sub.Go_to__kitchen__1-a_b");
  EXPECT_EQ(event_name("Küche"), "Küche");
}

TEST(TryCatch, CleansUpWhenItIsHalted) {
  auto loaded =
      load(in_tree("<TryCatch catch_on_halt=\"true\"><Action ID=\"Work\"/><Script code=\"n := 1\"/></TryCatch>"));
  const Tree& tree = *loaded.value;
  State state(tree);
  Effects effects;
  step(tree, state, Input::tick(), at(0ms), effects);
  step(tree, state, Input::answer(1, Status::kRunning), at(0ms), effects);
  step(tree, state, Input::halt(), at(0ms), effects);
  ASSERT_EQ(effects.list.size(), 1U);
  EXPECT_EQ(effects.list[0].kind, Effect::Kind::kHaltLeaf);
  ASSERT_NE(entry(tree, state, "n"), nullptr);
}

TEST(Halt, GoesOnWhenAnOnHaltedScriptFails) {
  auto loaded = load(in_tree("<Parallel><AlwaysSuccess _onHalted=\"nope = 1\"/><Action ID=\"A\"/></Parallel>"));
  const Tree& tree = *loaded.value;
  State state(tree);
  Effects effects;
  step(tree, state, Input::tick(), at(0ms), effects);
  step(tree, state, Input::answer(2, Status::kRunning), at(0ms), effects);
  EXPECT_EQ(step(tree, state, Input::halt(), at(0ms), effects).kind, StepResult::Kind::kFailed);
  ASSERT_EQ(effects.list.size(), 1U);
  EXPECT_EQ(effects.list[0].leaf, 2U);
  EXPECT_EQ(state.status(2), Status::kIdle);
}

TEST(SubTree, RemapsAutoremapsAndKeepsPrivateEntries) {
  auto loaded = load(
      in_tree("<Sequence><Script code=\"a := 1; b := 2; _p := 3\"/><SubTree ID=\"S\" name=\"s\" x=\"{a}\" c=\"7\" "
              "_autoremap=\"true\"/></Sequence>",
              "<BehaviorTree ID=\"S\"><Script code=\"x := 10; b := 20; _p := 30; c := 70; @r := 5\"/></BehaviorTree>"));
  Runner r(std::move(*loaded.value));
  EXPECT_EQ(r.tick(), Status::kSuccess);
  const auto value = [&](std::string_view name, NodeId subtree = kNoNode) {
    return *entry(r.tree(), r.state(), name, subtree);
  };
  EXPECT_EQ(value("a"), Value(10));
  EXPECT_EQ(value("b"), Value(20));
  EXPECT_EQ(value("_p"), Value(3));
  EXPECT_EQ(value("_p", 2), Value(30));
  EXPECT_EQ(value("c", 2), Value(70));
  EXPECT_EQ(value("r"), Value(5));
  EXPECT_EQ(entry(r.tree(), r.state(), "c"), nullptr);
}

TEST(ManualSelector, WaitsForAChoiceAndTicksTheChildUntilItIsDone) {
  Runner r = runner("<ManualSelector><AlwaysFailure/><Sleep msec=\"10\"/></ManualSelector>");
  EXPECT_EQ(r.tick(at(0ms)), Status::kRunning);
  int asked = 0;
  Choice choice;
  r.effects().choose = [&](NodeId node) {
    EXPECT_EQ(node, 0U);
    ++asked;
    return choice;
  };
  EXPECT_EQ(r.tick(at(0ms)), Status::kRunning);
  choice.child = 1;
  EXPECT_EQ(r.tick(at(0ms)), Status::kRunning);
  EXPECT_EQ(r.state().status(2), Status::kRunning);
  EXPECT_EQ(r.tick(at(10ms)), Status::kSuccess);
  EXPECT_EQ(asked, 2);
  choice.child = 0;
  EXPECT_EQ(r.tick(at(10ms)), Status::kFailure);
  choice = {kNoNode, Status::kSuccess};
  EXPECT_EQ(r.tick(at(10ms)), Status::kSuccess);
  choice.child = 2;
  EXPECT_EQ(r.tick(at(10ms)), Status::kFailure);
  EXPECT_EQ(r.error()->code, "bt.bad-selection");
}

TEST(ManualSelector, IsChosenThroughAnEntryAndRepeatsTheLastSelection) {
  Runner r = runner(
      "<Sequence><RunOnce then_skip=\"false\"><Script code=\"pick := 1\"/></RunOnce>"
      "<ManualSelector repeat_last_selection=\"true\" selection=\"{pick}\"><AlwaysFailure/><AlwaysSuccess/>"
      "</ManualSelector><Script code=\"pick := 0\"/></Sequence>");
  EXPECT_EQ(r.tick(), Status::kSuccess);
  EXPECT_EQ(r.tick(), Status::kSuccess);
  EXPECT_EQ(*entry(r.tree(), r.state(), "pick"), Value(0));
}

TEST(Hooks, ReplaceATickChangeItsResultAndMeasureIt) {
  auto loaded = load(in_tree("<Sequence><AlwaysFailure/><AlwaysFailure/><Action ID=\"Go\"/></Sequence>"));
  const Tree& tree = *loaded.value;
  State state(tree);
  Effects effects;
  TickHooks hooks;
  effects.hooks = &hooks;
  hooks.at(1).before = [](NodeId) { return Status::kSuccess; };
  hooks.at(2).after = [](NodeId, Status status) {
    EXPECT_EQ(status, Status::kFailure);
    return Status::kSuccess;
  };
  Duration took{0};
  hooks.at(3).monitor = [&](NodeId node, Status status, Duration duration) {
    EXPECT_EQ(node, 3U);
    EXPECT_EQ(status, Status::kSuccess);
    took = duration;
  };
  ASSERT_TRUE(step(tree, state, Input::tick(), at(5ms), effects).waiting());
  const StepResult result = step(tree, state, Input::answer(3, Status::kSuccess), at(12ms), effects);
  EXPECT_EQ(result.status, Status::kSuccess);
  EXPECT_EQ(took, Duration(7ms));
  // Without hooks the nodes are what they were.
  effects.hooks = nullptr;
  EXPECT_EQ(step(tree, state, Input::tick(), at(13ms), effects).status, Status::kFailure);
}

TEST(Hooks, MeasureWithTheClockThatTheyAreGiven) {
  ManualClock clock;
  Registry registry;
  registry.action("Work", [&](Context&) {
    clock.set(clock.now() + 3ms);
    return Status::kSuccess;
  });
  Runner r = runner("<Work/>", &registry);
  TickHooks hooks(&clock);
  Duration took{0};
  hooks.at(0).monitor = [&](NodeId, Status, Duration duration) { took = duration; };
  r.effects().hooks = &hooks;
  EXPECT_EQ(r.tick(), Status::kSuccess);
  EXPECT_EQ(took, Duration(3ms));
}

TEST(Context, ANodeThatThrowsGivesTheTickUp) {
  Registry registry;
  registry.action("Throw", [](Context&) -> Status { throw std::runtime_error("no camera"); });
  registry.action("ThrowInt", [](Context&) -> Status { throw 7; });
  Runner thrown = runner("<Sequence><Throw/></Sequence>", &registry);
  EXPECT_EQ(thrown.tick(), Status::kFailure);
  EXPECT_EQ(thrown.error()->code, "bt.node-threw");
  EXPECT_THAT(thrown.error()->message, HasSubstr("no camera"));
  Runner other = runner("<ThrowInt/>", &registry);
  EXPECT_EQ(other.tick(), Status::kFailure);
  EXPECT_EQ(other.error()->code, "bt.node-threw");
}

}  // namespace
}  // namespace sentree::bt
