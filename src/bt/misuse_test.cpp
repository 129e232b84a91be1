#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <ctime>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>

#include "sentree/bt/detail/test_support.h"
#include "sentree/bt/hooks.h"
#include "sentree/bt/load.h"
#include "sentree/bt/runner.h"

// What C++ of others may do wrong: throw where nobody expects it, call what is at work, leave out what is needed.

namespace sentree::bt {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;

/// Its text form throws.
struct Stern {
  int x = 0;
};

}  // namespace

template <>
struct Convert<Stern> {
  static std::string name() { return "Stern"; }
  static Value to_value(const Stern& s) { return Map{{"x", static_cast<std::int64_t>(s.x)}}; }
  static std::optional<Stern> from_value(const Value& v) {
    if (const Value* x = v.find("x")) return Stern{static_cast<int>(x->number())};
    throw std::invalid_argument("a Stern has an x");
  }
  static std::optional<Stern> from_text(std::string_view text) {
    if (text == "1") return Stern{1};
    throw std::invalid_argument("only 1 is Stern");
  }
};

namespace {

Runner misused(const std::string& body, const Registry& registry, const Clock* clock = nullptr,
               const std::string& more = {}) {
  auto loaded = load(in_tree(body, more), {.registry = &registry});
  for (const Diagnostic& d : loaded.diagnostics) {
    if (d.severity == Severity::kError) ADD_FAILURE() << to_string(d);
  }
  return Runner(std::move(*loaded.value), clock);
}

Registry stern() {
  Registry registry;
  registry.action("Read", {input<Stern>("in")}, [](Context& self) {
    const auto in = self.input<Stern>("in");
    if (!in) self.fail(in.error().message);
    return Status::kSuccess;
  });
  registry.action("Make", {output<Stern>("out")}, [](Context& self) {
    self.output("out", Stern{3});
    return Status::kSuccess;
  });
  return registry;
}

TEST(Conversions, ThatThrowAreFindingsAtTheirPlace) {
  const Registry registry = stern();
  const auto loaded = load(in_tree("<Sequence>\n<Read in=\"2\"/></Sequence>"), {.registry = &registry}, "m.xml");
  ASSERT_EQ(loaded.diagnostics.size(), 1U);
  EXPECT_FALSE(loaded.ok());
  EXPECT_THAT(to_string(loaded.diagnostics[0]), HasSubstr("m.xml:3:"));
  EXPECT_THAT(loaded.diagnostics[0].message, HasSubstr("\"2\" is no Stern: only 1 is Stern"));
}

TEST(Conversions, ThatThrowFailTheTickAndNotTheProgram) {
  const Registry registry = stern();
  for (const auto& [body, what] : std::initializer_list<std::pair<const char*, const char*>>{
           {"<Sequence><Make out=\"{e}\"/><Script code=\"e := '2'\"/></Sequence>", "only 1 is Stern"},
           {"<Sequence><Make out=\"{e}\"/><SetBlackboard output_key=\"e\" value=\"2\"/></Sequence>", "entry \"e\""},
           {"<Sequence><Script code=\"e := 5\"/><Read in=\"{e}\"/></Sequence>", "a Stern has an x"},
       }) {
    Runner r = misused(body, registry);
    EXPECT_EQ(r.tick(), Status::kFailure) << body;
    ASSERT_TRUE(r.error().has_value()) << body;
    EXPECT_THAT(r.error()->message, HasSubstr(what)) << body;
  }
  // Format 3 reads literals when the port is read.
  auto old = load("<root BTCPP_format=\"3\"><BehaviorTree ID=\"M\"><Read in=\"2\"/></BehaviorTree></root>",
                  {.registry = &registry});
  ASSERT_TRUE(old.ok());
  Runner r(std::move(*old.value));
  EXPECT_EQ(r.tick(), Status::kFailure);
  EXPECT_THAT(r.error()->message, HasSubstr("port \"in\": \"2\" is no Stern: only 1 is Stern"));
}

struct Unsaved {
  int taken = 0;  // one without members has nothing to save
  Status tick(Context& /*self*/) { return Status::kSuccess; }
  [[nodiscard]] Value save() const { throw std::runtime_error("no disk"); }
  bool restore(const Value& /*saved*/) { return true; }
};

TEST(NodesOfOthers, WhoseSaveThrowsAreErrorsOfSave) {
  Registry registry;
  registry.add<Unsaved>("Unsaved");
  const Runner r = misused("<Unsaved name=\"camera\"/>", registry);
  const auto saved = save(r.tree(), r.state());
  ASSERT_FALSE(saved);
  EXPECT_EQ(saved.error().code, "bt.unsavable");
  EXPECT_THAT(saved.error().message, HasSubstr("\"camera\" (Unsaved) cannot be saved: its save() threw no disk"));
}

struct Uncopied {
  std::shared_ptr<bool> throws = std::make_shared<bool>(false);
  Uncopied() = default;
  Uncopied(const Uncopied& other) : throws(other.throws) {
    if (*throws) throw std::runtime_error("no copy");
  }
  Uncopied(Uncopied&&) = default;
  Uncopied& operator=(const Uncopied&) = default;
  Uncopied& operator=(Uncopied&&) = default;
  ~Uncopied() = default;
  Status tick(Context& /*self*/) { return Status::kSuccess; }
};

TEST(NodesOfOthers, WhoseCopyThrowsFailTheirTickInTheCopy) {
  Registry registry;
  Uncopied prototype;
  const std::shared_ptr<bool> throws = prototype.throws;
  registry.add<Uncopied>("Uncopied", std::move(prototype));
  Runner r = misused("<Uncopied/>", registry);
  EXPECT_EQ(r.tick(), Status::kSuccess);
  *throws = true;
  State copy = r.state();
  EXPECT_EQ(r.tick(), Status::kSuccess);
  Effects effects;
  EXPECT_EQ(step(r.tree(), copy, Input::tick(), TimePoint{}, effects).kind, StepResult::Kind::kFailed);
  EXPECT_THAT(effects.error->message, HasSubstr("threw when it was copied"));
  EXPECT_FALSE(save(r.tree(), copy));
  Runner later = misused("<Uncopied/>", registry);
  EXPECT_EQ(later.tick(), Status::kFailure);
  EXPECT_THAT(later.error()->message, HasSubstr("threw when it was copied"));
}

TEST(NodesOfOthers, ThatNobodyRegisteredAreNamed) {
  const std::string models = "<TreeNodesModel><Action ID=\"Grasp\"/></TreeNodesModel>";
  Runner r = misused("<Fallback>\n<Grasp name=\"cup\"/><AlwaysSuccess/></Fallback>", Registry(), nullptr, models);
  EXPECT_EQ(r.tick(), Status::kFailure);
  ASSERT_TRUE(r.error().has_value());
  EXPECT_EQ(r.error()->code, "bt.unregistered");
  EXPECT_THAT(r.error()->message, HasSubstr("Grasp \"cup\": is declared"));
  EXPECT_THAT(r.error()->message, HasSubstr("register \"Grasp\""));
  EXPECT_EQ(r.error()->span.line, 3U);
  r.on_leaf = [](NodeId, const Map&) { return std::pair(Status::kFailure, Map{}); };
  EXPECT_EQ(r.tick(), Status::kSuccess);
  EXPECT_FALSE(r.error().has_value());
}

TEST(NodesOfOthers, WithoutAFunctionAreRefused) {
  Registry registry;
  registry.action("N", nullptr);
  registry.condition("C", {}, nullptr);
  registry.decorator("D", {}, nullptr);
  const auto loaded = load(in_tree("<AlwaysSuccess/>"), {.registry = &registry});
  ASSERT_EQ(loaded.diagnostics.size(), 3U);
  EXPECT_EQ(loaded.diagnostics[0].code, "bt.no-function");
  EXPECT_THAT(loaded.diagnostics[0].message, HasSubstr("\"N\""));
}

struct Reach {
  bool resets = false;
  Next on_tick(Context& self) {
    if (resets) self.reset_child(5);
    return Next::done(resets || self.child_status(5) == Status::kIdle ? Status::kSuccess : Status::kFailure);
  }
  Next on_child(Context& /*self*/, std::size_t /*child*/, Status status) { return Next::done(status); }
};

TEST(NodesOfOthers, ThatAskForAChildTheyDoNotHaveFail) {
  for (const bool resets : {false, true}) {
    Registry registry;
    registry.add<Reach>("Reach", Category::kControl, Reach{resets});
    Runner r = misused("<Reach><AlwaysSuccess/></Reach>", registry);
    EXPECT_EQ(r.tick(), Status::kFailure);
    ASSERT_TRUE(r.error().has_value());
    EXPECT_EQ(r.error()->code, "bt.child-count");
    EXPECT_THAT(r.error()->message, HasSubstr("asks for child 5 and has 1"));
  }
}

TEST(Runner, HaltedFromWithinHaltsWhenTheTickEnds) {
  Registry registry;
  Runner* at_work = nullptr;
  int ticked = 0;
  registry.action("Halt", [&](Context&) {
    at_work->halt();
    return Status::kSuccess;
  });
  registry.action("Count", [&](Context&) {
    ++ticked;
    return Status::kSuccess;
  });
  ManualClock clock;
  Runner r = misused("<Sequence><Halt/><Count/><Sleep msec=\"10\"/></Sequence>", registry, &clock);
  at_work = &r;
  EXPECT_EQ(r.tick(), Status::kIdle);
  EXPECT_EQ(ticked, 1);
  EXPECT_FALSE(r.error().has_value());
  EXPECT_EQ(r.state().next_timer(), kNever);
  for (const Status status : r.state().statuses()) EXPECT_EQ(status, Status::kIdle);
  EXPECT_EQ(r.tick(), Status::kIdle);
  EXPECT_EQ(ticked, 2);
}

TEST(Runner, TickedFromWithinFailsTheTick) {
  Registry registry;
  Runner* at_work = nullptr;
  registry.action("Tick",
                  [&](Context&) { return at_work->tick() == Status::kFailure ? Status::kSuccess : Status::kFailure; });
  Runner r = misused("<Tick/>", registry);
  at_work = &r;
  EXPECT_EQ(r.tick(), Status::kFailure);
  ASSERT_TRUE(r.error().has_value());
  EXPECT_EQ(r.error()->code, "bt.nested-tick");
}

class Throwing final : public Observer {
 public:
  void status_changed(NodeId /*node*/, Status /*from*/, Status /*to*/, TimePoint /*time*/) override {
    throw std::runtime_error("the log is full");
  }
};

TEST(Runner, OutlivesWhatObserversHooksAndAnswersThrow) {
  ManualClock clock;
  Runner r = misused("<Sequence><Grasp/><Sleep msec=\"10\"/></Sequence>", Registry(), &clock,
                     "<TreeNodesModel><Action ID=\"Grasp\"/></TreeNodesModel>");
  const auto fails_with = [&](const char* what) {
    EXPECT_EQ(r.tick(), Status::kFailure);
    ASSERT_TRUE(r.error().has_value()) << what;
    EXPECT_EQ(r.error()->code, "bt.callback-threw");
    EXPECT_THAT(r.error()->message, HasSubstr(what));
  };
  r.on_leaf = [](NodeId, const Map&) -> std::pair<Status, Map> { throw std::runtime_error("no arm"); };
  fails_with("Grasp \"Grasp\": on_leaf threw no arm");
  r.on_leaf = [](NodeId, const Map&) { return std::pair(Status::kSuccess, Map{}); };
  Throwing throwing;
  r.effects().observer = &throwing;
  fails_with("the log is full");
  r.effects().observer = nullptr;
  TickHooks hooks;
  hooks.at(1).before = [](NodeId) -> Status { throw std::runtime_error("no breakpoint"); };
  r.effects().hooks = &hooks;
  fails_with("no breakpoint");
  r.effects().hooks = nullptr;
  EXPECT_EQ(r.tick(), Status::kRunning);
  EXPECT_FALSE(r.error().has_value());
  clock.advance(10ms);
  EXPECT_EQ(r.tick(), Status::kSuccess);
}

TEST(Runner, WithoutAClockSaysWhoWaitsForOne) {
  Runner r = misused("<Sequence><AlwaysSuccess/>\n<Sleep name=\"nap\" msec=\"10\"/></Sequence>", Registry());
  Status status = Status::kRunning;
  for (int i = 0; i < 10 && status == Status::kRunning; ++i) status = r.tick();
  EXPECT_EQ(status, Status::kFailure);
  ASSERT_TRUE(r.error().has_value());
  EXPECT_EQ(r.error()->code, "bt.no-clock");
  EXPECT_THAT(r.error()->message, HasSubstr("Sleep \"nap\": waits for time"));
  // One that is told the time may be ticked without saying it each time.
  EXPECT_EQ(r.tick(TimePoint{}), Status::kRunning);
  EXPECT_EQ(r.tick(), Status::kRunning);
  EXPECT_EQ(r.tick(TimePoint(10ms)), Status::kSuccess);
}

struct Halted {
  void on_halted(Context& self);
};
struct HaltedWrongly {
  void on_halted(int why);
};
struct Misspelt {
  void onHalted();
};
static_assert(detail::kHaltFits<Halted> && !detail::kHaltIsMisspelt<Halted>);
static_assert(detail::kHaltFits<Unsaved> && !detail::kHaltIsMisspelt<Unsaved>);
static_assert(!detail::kHaltFits<HaltedWrongly>);
static_assert(detail::kHaltIsMisspelt<Misspelt>);

TEST(Load, TakesThousandsOfNestedSubTreesInLittleTime) {
  constexpr int kNested = 3'900;
  std::string trees;
  for (int i = 0; i < kNested; ++i) {
    const std::string next = std::to_string(i + 1);
    trees += "<BehaviorTree ID=\"T" + std::to_string(i) + "\"><SubTree ID=\"T" + next + "\"/></BehaviorTree>";
  }
  trees += "<BehaviorTree ID=\"T" + std::to_string(kNested) + "\"><AlwaysSuccess/></BehaviorTree>";
  const std::clock_t begun = std::clock();
  const auto loaded = load("<root BTCPP_format=\"4\" main_tree_to_execute=\"T0\">" + trees + "</root>");
  ASSERT_TRUE(loaded.ok());
  // Cubic, as it was, it takes half a minute.
  EXPECT_LT(std::clock() - begun, 6 * CLOCKS_PER_SEC);
  RecordProperty("ms", static_cast<int>((std::clock() - begun) * 1000 / CLOCKS_PER_SEC));
  const std::string path = scope_path(*loaded.value, static_cast<NodeId>(2));
  EXPECT_EQ(path, "SubTree.SubTree.SubTree");
}

}  // namespace
}  // namespace sentree::bt
