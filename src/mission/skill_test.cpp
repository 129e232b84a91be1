#include "sentree/mission/skill.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <iostream>
#include <set>
#include <string>
#include <vector>

#include "sentree/base/packed.h"
#include "sentree/base/rng.h"
#include "sentree/idl/conform.h"
#include "sentree/scxml/chart.h"

namespace sentree::mission {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

struct PlayerOptions {
  bool condition = false;
  Duration halt_deadline = seconds(2);
  Map constants = {};
  std::optional<project::SkillProtocol> protocol = {};
  std::vector<std::string> latest_topics = {};
};

// A skill in the hands of a test: what it does is written down as text, and its calls are answered by hand.
class SkillPlayer final : public SkillHost {
 public:
  explicit SkillPlayer(const std::string& states, PlayerOptions options = {})
      : machine_({.name = "Leaf",
                  .condition = options.condition,
                  .halt_deadline = options.halt_deadline,
                  .seed = 1,
                  .chart = load(states),
                  .services = &services(),
                  .constants = options.constants,
                  .protocol = options.protocol,
                  .latest_topics = options.latest_topics}) {}

  void execute_elsewhere(ChartElsewhere& elsewhere) { machine_.execute_elsewhere(&elsewhere); }
  [[nodiscard]] const SkillModel& model() const { return machine_.model(); }

  void take(SkillDelivery what) {
    const SkillPhase before = state.phase;
    const std::string_view by = kind_of(what);
    machine_.step(state, std::move(what), *this);
    edges().insert({before, by, state.phase});
  }
  void tick(bool started = false, Map inputs = {}) { take(TickSkill{++ticks_, started, std::move(inputs)}); }
  void hear(std::int64_t n) { take(Published{Shared<Publication>({"s.level", "somebody", Map{{"n", n}}})}); }
  void halt() { take(HaltSkill{}); }
  void cancel() { take(CancelSkill{}); }
  void reply(const Shared<Call>& call, Value result) { take(Outcome{call, CallOutcome::returned(std::move(result))}); }
  void reply(Value result = {}) { reply(last_call, std::move(result)); }
  void wait(Duration duration) {
    time += duration;
    if (wake <= time) take(SkillTimer{wake});
  }
  std::vector<std::string> done() { return std::exchange(done_, {}); }
  [[nodiscard]] std::size_t observed() const { return observed_; }

  // Edges that all tests together have taken.
  struct Order {
    bool operator()(const SkillEdge& a, const SkillEdge& b) const {
      return std::tie(a.from, a.by, a.to) < std::tie(b.from, b.by, b.to);
    }
  };
  static std::set<SkillEdge, Order>& edges() {
    static std::set<SkillEdge, Order> taken;
    return taken;
  }

  SkillState state;
  TimePoint time{};
  Shared<Call> last_call;
  TimePoint wake = kNever;

 private:
  static scxml::Chart load(const std::string& states) {
    auto chart = scxml::load(
        "<scxml xmlns='http://www.w3.org/2005/07/scxml' version='1.0' datamodel='ecmascript'>" + states + "</scxml>",
        "skill.scxml");
    EXPECT_TRUE(chart.ok()) << (chart.ok() ? "" : to_string(chart.diagnostics.front()));
    return *chart.value;
  }
  static const std::map<std::string, project::ServicePlan>& services() {
    static const auto kServices = [] {
      const auto action =
          idl::Schema::load("int32 upto\n---\nint32 reached\n---\nint32 now\n", "demo/action/Count.action");
      const auto schema = idl::Schema::load(
          "service S { bool ask(1: double n = 0)  void stop()  oneway void level(1: i32 n) }", "s.thrift");
      std::map<std::string, project::ServicePlan> services;
      services["s"] = {
          .name = "s", .service = *idl::find_service(*schema.value, "S"), .interface = "S", .at = {}, .robot = {}};
      services["nav"] = {
          .name = "nav", .service = action.value->service("Count"), .interface = "Count", .at = {}, .robot = {}};
      services["seen"] = services["nav"];
      services["seen"].observed = "ros:/seen";
      return services;
    }();
    return kServices;
  }

  TimePoint now() const override { return time; }
  void publish(Message message) override {
    ++observed_;
    if (message.name.ends_with(".late")) done_.push_back(message.name);
  }
  std::uint64_t next_call() override { return ++calls_; }
  std::optional<Admission> request(Message, const Shared<Call>&) override {
    ++observed_;
    return Admission{};
  }
  void send(const Shared<Call>& call, const idl::Method&) override {
    done_.push_back("call " + call->service + "." + call->method + " " + to_json(call->args));
    last_call = call;
  }
  void deliver(SkillDelivery what) override { take(std::move(what)); }
  void deliver_at(TimePoint when, Rank, SkillDelivery) override { wake = when; }
  Duration delay_of(std::string_view) override { return Duration(0); }
  void falsify(std::string_view, const idl::Method&, Value&) override {}
  void answer(std::uint64_t tick, bt::Status status, Map outputs) override {
    EXPECT_EQ(tick, ticks_);
    done_.push_back(std::string(to_string(status)) + (outputs.empty() ? "" : " " + to_json(Value(outputs))));
  }
  void halted() override { done_.push_back("halted"); }
  void log(const scxml::LogLine& line) override { done_.push_back("log " + line.label); }
  void problem(const std::string& what) override { done_.push_back("! " + what); }

  SkillMachine machine_;
  std::uint64_t ticks_ = 0;
  std::uint64_t calls_ = 0;
  std::size_t observed_ = 0;
  std::vector<std::string> done_;
};

constexpr const char* kAsking = R"(
  <datamodel><data id="n" expr="0.5"/></datamodel>
  <state id="asking">
    <onentry><send type="thrift" target="s" event="ask"><param name="n" expr="n"/></send></onentry>
    <onexit><log label="left"/></onexit>
    <transition event="s.ask.reply" cond="_event.data.result" target="success"/>
    <transition event="s.ask.reply" target="failure"/>
  </state>
  <final id="success"><donedata><param name="out" expr="n"/></donedata></final><final id="failure"/>)";

TEST(Skill, AConditionIsAnsweredWhenItsRunEnds) {
  SkillPlayer p(kAsking, {.condition = true});
  p.tick(true, {{"n", 3.5}});
  EXPECT_THAT(p.done(), ElementsAre("call s.ask {\"n\":3.5}"));
  p.reply(true);
  EXPECT_THAT(p.done(), ElementsAre("log left", "SUCCESS {\"out\":3.5}"));
}

TEST(Skill, AnActionAnswersRunningAndTellsItsEndToTheNextTick) {
  SkillPlayer p(kAsking);
  p.tick(true, {{"n", 1.5}});
  EXPECT_THAT(p.done(), ElementsAre("call s.ask {\"n\":1.5}", "RUNNING"));
  p.reply(true);
  EXPECT_THAT(p.done(), ElementsAre("log left"));
  p.tick();
  EXPECT_THAT(p.done(), ElementsAre("SUCCESS {\"out\":1.5}"));
}

TEST(Skill, TheFirstTickIsDeliveredToo) {
  SkillPlayer p(
      "<state id='a'><transition event='tick' cond='_event.data.x === 7' target='success'/></state><final "
      "id='success'/>");
  p.tick(true, {{"x", 7}});
  EXPECT_THAT(p.done(), ElementsAre("SUCCESS"));
}

TEST(Skill, StartsAnewWithItsInitialState) {
  SkillPlayer p(R"(<datamodel><data id="count" expr="0"/></datamodel>
    <state id="a"><transition event="tick" target="success"><assign location="count" expr="count + 1"/></transition></state>
    <final id="success"><donedata><param name="count" expr="count"/></donedata></final>)");
  p.tick(true);
  p.tick(true);
  EXPECT_THAT(p.done(), ElementsAre("SUCCESS {\"count\":1}", "SUCCESS {\"count\":1}"));
}

TEST(Skill, AHaltThatNothingHandlesCancels) {
  SkillPlayer p(kAsking);
  p.tick(true);
  p.done();
  p.halt();
  EXPECT_THAT(p.done(), ElementsAre("log left", "halted"));
  p.reply(true);
  EXPECT_THAT(p.done(), ElementsAre("s.ask.late"));
}

constexpr const char* kStopping = R"(
  <state id="moving"><transition event="halt" target="stopping"/></state>
  <state id="stopping">
    <onentry><send type="thrift" target="s" event="stop"/></onentry>
    <transition event="s.stop" target="halted"/>
  </state>
  <final id="halted"/><final id="success"/>)";

TEST(Skill, AHaltTakesAsLongAsItNeeds) {
  SkillPlayer p(kStopping);
  p.tick(true);
  p.halt();
  EXPECT_THAT(p.done(), ElementsAre("RUNNING", "call s.stop {}"));
  p.reply();
  EXPECT_THAT(p.done(), ElementsAre("halted"));
}

TEST(Skill, AHaltBeyondItsDeadlineIsCancelled) {
  SkillPlayer p(kStopping, {.halt_deadline = seconds(2)});
  p.tick(true);
  p.halt();
  p.done();
  EXPECT_EQ(p.wake, TimePoint(seconds(2)));
  p.wait(milliseconds(1999));
  EXPECT_THAT(p.done(), IsEmpty());
  p.wait(milliseconds(1));
  EXPECT_THAT(p.done(),
              ElementsAre("! Leaf did not end within its halt deadline of 2000 ms and was cancelled", "halted"));
}

TEST(Skill, HaltingAnEndedRunDiscardsItsStatus) {
  SkillPlayer p(kAsking);
  p.tick(true);
  p.reply(true);
  p.done();
  p.halt();
  EXPECT_THAT(p.done(), ElementsAre("halted"));
}

TEST(Skill, AReplyToAnOlderRunReachesNoChart) {
  SkillPlayer p(kAsking);
  p.tick(true);
  const Shared<Call> first = p.last_call;
  p.halt();
  p.tick(true);
  p.done();
  p.reply(first, true);
  EXPECT_THAT(p.done(), ElementsAre("s.ask.late"));
  p.reply(true);
  p.tick();
  EXPECT_THAT(p.done(), ElementsAre("log left", "SUCCESS {\"out\":0.5}"));
}

TEST(Skill, ACancelledConditionAnswersNothing) {
  SkillPlayer p(kAsking, {.condition = true});
  p.tick(true);
  p.done();
  p.cancel();
  EXPECT_THAT(p.done(), ElementsAre("log left"));
}

TEST(Skill, ItsTimersRunBetweenTicks) {
  SkillPlayer p(
      R"(<state id="a"><onentry><send event="later" delay="300ms"/></onentry><transition event="later" target="success"/></state><final id="success"/>)");
  p.tick(true);
  EXPECT_THAT(p.done(), ElementsAre("RUNNING"));
  EXPECT_EQ(p.wake, TimePoint(milliseconds(300)));
  p.wait(milliseconds(300));
  p.tick();
  EXPECT_THAT(p.done(), ElementsAre("SUCCESS"));
}

TEST(Skill, ARefusedCallIsErrorExecution) {
  SkillPlayer p(R"(<state id="a"><onentry><send type="thrift" target="s" event="aks"/></onentry>
      <transition event="error.execution" cond="_event.data.message.indexOf('did you mean') > 0" target="success"/></state><final id="success"/>)");
  p.tick(true);
  EXPECT_THAT(p.done(), ElementsAre("SUCCESS"));
}

TEST(Skill, AKilledSkillFailsUntilItIsRestarted) {
  SkillPlayer p(kAsking, {.condition = true});
  p.tick(true);
  p.done();
  p.take(KillSkill{});
  EXPECT_THAT(p.done(), ElementsAre("FAILURE {\"reason\":\"the skill was killed\"}"));
  p.tick(true);
  p.halt();
  p.reply(true);
  EXPECT_THAT(p.done(), ElementsAre("FAILURE {\"reason\":\"the skill was killed\"}", "halted", "s.ask.late"));
  p.take(RestartSkill{});
  p.tick(true);
  EXPECT_THAT(p.done(), ElementsAre("call s.ask {\"n\":0.5}"));
}

TEST(Skill, AChartThatExceedsABoundIsGivenUp) {
  SkillPlayer p("<state id='a'><transition target='b'/></state><state id='b'><transition target='a'/></state>");
  p.tick(true);
  const auto done = p.done();
  ASSERT_EQ(done.size(), 2U);
  EXPECT_THAT(done[0], HasSubstr("! Leaf was given up: skill.scxml:"));
  EXPECT_THAT(done[1], HasSubstr("FAILURE"));
}

TEST(Skill, ConstantsAreDataAndPortsComeOverThem) {
  SkillPlayer p(R"(<datamodel><data id="a" expr="1"/><data id="b" expr="1"/></datamodel>
    <state id="s"><transition target="success"/></state>
    <final id="success"><donedata><param name="sum" expr="a + b"/></donedata></final>)",
                {.constants = {{"a", 10}, {"b", 20}}});
  p.tick(true, {{"b", 300}});
  EXPECT_THAT(p.done(), ElementsAre("SUCCESS {\"sum\":310}"));
}

project::SkillProtocol answering() {
  project::SkillProtocol protocol;
  protocol.tick = "CMD_TICK";
  protocol.halt = "CMD_HALT";
  protocol.answer = "TICK_RESPONSE";
  protocol.param = "status";
  protocol.values = {{"0", bt::Status::kSuccess}, {"1", bt::Status::kFailure}, {"2", bt::Status::kRunning}};
  protocol.halted = "HALT_RESPONSE";
  return protocol;
}

// Answers as the port `status` says, or what its service says.
constexpr const char* kAnswering = R"(
  <datamodel><data id="count" expr="0"/></datamodel>
  <state id="idle">
    <transition event="CMD_TICK" cond="_event.data.status !== undefined">
      <assign location="count" expr="count + 1"/>
      <send event="TICK_RESPONSE"><param name="status" expr="_event.data.status"/><param name="count" expr="count"/></send>
    </transition>
    <transition event="CMD_TICK" target="asking"/>
    <transition event="CMD_HALT"><send event="HALT_RESPONSE"/></transition>
  </state>
  <state id="asking">
    <onentry><assign location="count" expr="count + 1"/><send type="thrift" target="s" event="ask"/></onentry>
    <transition event="s.ask.reply" target="idle">
      <send event="TICK_RESPONSE"><param name="status" expr="_event.data.result ? 0 : 2"/><param name="count" expr="count"/></send>
    </transition>
  </state>)";

TEST(SkillWithProtocol, AnswersByAnEventAndLivesOn) {
  SkillPlayer p(kAnswering, {.protocol = answering()});
  p.tick(true, {{"status", 2}});
  p.tick(false, {{"status", 0}});
  p.tick(true, {{"status", 1}});
  EXPECT_THAT(p.done(), ElementsAre("RUNNING", "SUCCESS {\"count\":2}", "FAILURE {\"count\":3}"));
  EXPECT_EQ(p.state.phase, SkillPhase::kResting);
  EXPECT_EQ(p.state.run, 1U);
}

TEST(SkillWithProtocol, AConditionWaitsForTheAnswer) {
  SkillPlayer p(kAnswering, {.condition = true, .protocol = answering()});
  p.tick(true);
  EXPECT_THAT(p.done(), ElementsAre("call s.ask {\"n\":0.0}"));
  p.reply(true);
  EXPECT_THAT(p.done(), ElementsAre("SUCCESS {\"count\":1}"));
  p.tick(true);
  p.done();
  p.reply(false);
  EXPECT_THAT(p.done(), ElementsAre("RUNNING"));
}

TEST(SkillWithProtocol, AnActionTellsALateAnswerToTheNextTickAndIsNotTickedTwice) {
  SkillPlayer p(kAnswering, {.protocol = answering()});
  p.tick(true);
  p.tick();
  EXPECT_THAT(p.done(), ElementsAre("call s.ask {\"n\":0.0}", "RUNNING", "RUNNING"));
  p.reply(true);
  EXPECT_EQ(p.state.phase, SkillPhase::kReady);
  p.tick();
  EXPECT_THAT(p.done(), ElementsAre("SUCCESS {\"count\":1}"));
}

TEST(SkillWithProtocol, AnAnswerWithoutMeaningIsFailureAndTold) {
  SkillPlayer p(kAnswering, {.protocol = answering()});
  p.tick(true, {{"status", 7}});
  EXPECT_THAT(p.done(),
              ElementsAre("! Leaf: TICK_RESPONSE answers a tick with 7, which is none of the protocol's values, and "
                          "counts as FAILURE",
                          "FAILURE {\"count\":1}"));
}

TEST(SkillWithProtocol, AHaltIsOverWhenTheChartSaysSo) {
  SkillPlayer p(kAnswering, {.protocol = answering()});
  p.tick(true, {{"status", 2}});
  p.halt();
  EXPECT_THAT(p.done(), ElementsAre("RUNNING", "halted"));
  EXPECT_EQ(p.state.phase, SkillPhase::kResting);
  EXPECT_EQ(p.state.run, 1U);
}

TEST(SkillWithProtocol, AHaltThatItDoesNotTakeEndsTheChartWhichBeginsAnew) {
  SkillPlayer p(kAnswering, {.protocol = answering()});
  p.tick(true);
  p.halt();
  EXPECT_THAT(p.done(), ElementsAre("call s.ask {\"n\":0.0}", "RUNNING", "halted"));
  p.reply(true);
  EXPECT_THAT(p.done(), ElementsAre("s.ask.late"));
  p.tick(true, {{"status", 0}});
  EXPECT_THAT(p.done(), ElementsAre("SUCCESS {\"count\":1}"));
  EXPECT_EQ(p.state.run, 2U);
}

TEST(SkillWithProtocol, WithoutHaltEventOnlyAnOpenTickEndsTheChart) {
  auto protocol = answering();
  protocol.halt = protocol.halted = "";
  SkillPlayer p(kAnswering, {.protocol = protocol});
  p.tick(true, {{"status", 2}});
  p.halt();
  EXPECT_EQ(p.state.phase, SkillPhase::kResting);
  p.tick(true);
  p.halt();
  EXPECT_EQ(p.state.phase, SkillPhase::kIdle);
  EXPECT_THAT(p.done(), ElementsAre("RUNNING", "halted", "call s.ask {\"n\":0.0}", "RUNNING", "halted"));
}

project::SkillProtocol standing() {
  project::SkillProtocol protocol;
  protocol.start = "CMD_START";
  protocol.halt = "CMD_STOP";
  protocol.acknowledge = "CMD_OK";
  protocol.states = {{"success", bt::Status::kSuccess}, {"failure", bt::Status::kFailure}};
  protocol.halted = "idle";
  return protocol;
}

constexpr const char* kStanding = R"(
  <state id="idle"><transition event="CMD_START" target="working"/></state>
  <state id="working">
    <onentry><send id="later" event="later" delay="300ms"/></onentry>
    <onexit><cancel sendid="later"/></onexit>
    <transition event="later" target="success"/>
    <transition event="CMD_STOP" target="stopping"/>
  </state>
  <state id="stopping">
    <onentry><send type="thrift" target="s" event="stop"/></onentry>
    <transition event="s.stop" target="idle"/>
  </state>
  <state id="success"><onexit><log label="read"/></onexit><transition event="CMD_OK" target="idle"/></state>
  <state id="failure"><transition event="CMD_OK" target="idle"/></state>)";

TEST(SkillWithProtocol, TellsTheStatusOfAStateAndIsAcknowledged) {
  SkillPlayer p(kStanding, {.protocol = standing()});
  for (int run = 0; run < 2; ++run) {
    p.tick(true);
    p.tick();
    p.wait(milliseconds(300));
    EXPECT_THAT(p.done(), ElementsAre("RUNNING", "RUNNING"));
    p.tick();
    EXPECT_THAT(p.done(), ElementsAre("SUCCESS", "log read"));
    EXPECT_EQ(p.state.phase, SkillPhase::kResting);
  }
  EXPECT_EQ(p.state.run, 1U);
}

TEST(SkillWithProtocol, HaltsUntilAStateIsReached) {
  SkillPlayer p(kStanding, {.protocol = standing()});
  p.tick(true);
  p.halt();
  EXPECT_THAT(p.done(), ElementsAre("RUNNING", "call s.stop {}"));
  EXPECT_EQ(p.state.phase, SkillPhase::kHalting);
  p.reply();
  EXPECT_THAT(p.done(), ElementsAre("halted"));
  p.tick(true);
  EXPECT_THAT(p.done(), ElementsAre("RUNNING"));
}

TEST(SkillWithProtocol, AnswersByAStateThatItOnlyPassesThrough) {
  project::SkillProtocol protocol;
  protocol.tick = "go";
  protocol.states = {{"good", bt::Status::kSuccess}};
  SkillPlayer p(
      "<state id='idle'><transition event='go' target='good'/></state><state id='good'><transition "
      "target='idle'/></state>",
      {.condition = true, .protocol = protocol});
  p.tick(true);
  p.tick(true);
  EXPECT_THAT(p.done(), ElementsAre("SUCCESS", "SUCCESS"));
}

TEST(SkillWithProtocol, ThatEndsAllTheSameFailsUnlessItSaysSuccess) {
  project::SkillProtocol protocol;
  protocol.tick = "go";
  protocol.states = {{"never", bt::Status::kSuccess}};
  const std::string chart =
      "<state id='idle'><transition event='go' cond='_event.data.well' target='success'/><transition event='go' "
      "target='gone'/></state><state id='never'/><final id='success'/><final id='gone'/>";
  SkillPlayer p(chart, {.protocol = protocol});
  p.tick(true, {{"well", true}});
  p.tick(true, {{"well", false}});
  EXPECT_THAT(p.done(), ElementsAre("SUCCESS", "FAILURE"));
  EXPECT_EQ(p.state.run, 2U);
}

constexpr const char* kListening = R"(
  <state id="listening">
    <transition event="s.level" cond="_event.data.n &gt; 2" target="success"/>
    <transition event="s.level"><send type="thrift" target="s" event="level"><param name="n" expr="_event.data.n"/></send></transition>
  </state>
  <final id="success"/>)";

TEST(Skill, HearsATopicWhileItRunsAndAnswersTheNextTickWithWhatCameOfIt) {
  SkillPlayer p(kListening);
  p.hear(9);
  EXPECT_EQ(p.state.phase, SkillPhase::kIdle);
  p.tick(true);
  p.hear(9);
  EXPECT_EQ(p.state.phase, SkillPhase::kEnded);
  p.tick();
  EXPECT_THAT(p.done(), ElementsAre("RUNNING", "SUCCESS"));
}

TEST(Skill, WhatItPublishesHasNoOutcomeButFailure) {
  SkillPlayer p(kListening);
  p.tick(true);
  p.hear(1);
  p.reply();
  EXPECT_THAT(p.done(), ElementsAre("RUNNING", "call s.level {\"n\":1}"));
  EXPECT_EQ(p.observed(), 1U);  // the request, and nothing of an answer
}

TEST(SkillWithProtocol, ATopicBeginsAChartThatLivesOn) {
  SkillPlayer p(R"(<datamodel><data id="n" expr="0"/></datamodel>
    <state id="living">
      <transition event="s.level"><assign location="n" expr="_event.data.n"/></transition>
      <transition event="CMD_TICK"><send event="TICK_RESPONSE"><param name="status" expr="n"/></send></transition>
    </state>)",
                {.protocol = answering()});
  p.hear(1);
  EXPECT_EQ(p.state.phase, SkillPhase::kResting);
  p.tick(true);
  p.hear(2);
  p.tick(true);
  EXPECT_EQ(p.state.run, 1U);
  EXPECT_EQ(p.done().size(), 2U);
}

// The same for a protocol: each of its answers, from each of its states, by each way there is.
constexpr const char* kAnythingOfAProtocol = R"(
  <datamodel><data id="n" expr="0"/></datamodel>
  <state id="living">
    <onentry><send event="later" delay="300ms"/></onentry>
    <transition event="CMD_TICK" cond="_event.data.end"><send event="TICK_RESPONSE"><param name="status" expr="n % 3"/></send></transition>
    <transition event="CMD_TICK" cond="_event.data.ask"><assign location="n" expr="n + 1"/><send type="thrift" target="s" event="ask"/></transition>
    <transition event="CMD_TICK" cond="n % 7 == 3" target="gone"/>
    <transition event="s.ask.reply" cond="n % 11 == 3" target="gone"/>
    <transition event="s.ask.reply" cond="_event.data.result"><assign location="n" expr="n + 1"/><send event="TICK_RESPONSE"><param name="status" expr="n % 3"/></send></transition>
    <transition event="s.ask.reply"><send type="thrift" target="s" event="ask"/></transition>
    <transition event="later" cond="n % 5 == 1" target="gone"><assign location="n" expr="n + 1"/></transition>
    <transition event="later" cond="n % 2 == 0"><assign location="n" expr="n + 1"/><send event="later" delay="300ms"/></transition>
    <transition event="later"><assign location="n" expr="n + 1"/><send event="later" delay="300ms"/><send event="TICK_RESPONSE"><param name="status" expr="n % 3"/></send></transition>
    <transition event="CMD_HALT" cond="n % 4 == 0"><send event="HALT_RESPONSE"/></transition>
    <transition event="CMD_HALT" cond="n % 4 != 3" target="stopping"/>
    <transition event="CMD_OK" cond="n % 5 == 2" target="gone"/>
    <transition event="s.level" cond="_event.data.n == 1" target="gone"/>
    <transition event="s.level" cond="_event.data.n == 2"><assign location="n" expr="n + 1"/><send event="TICK_RESPONSE"><param name="status" expr="n % 3"/></send></transition>
  </state>
  <state id="stopping">
    <transition event="s.level" cond="_event.data.n == 1" target="gone"/>
    <transition event="s.level" cond="_event.data.n == 2" target="living"><send event="HALT_RESPONSE"/></transition>
    <onentry><send type="thrift" target="s" event="ask"/><send event="still" delay="100ms"/></onentry>
    <transition event="s.ask.reply" cond="_event.data.result" target="living"><send event="HALT_RESPONSE"/></transition>
    <transition event="still" cond="n % 2 == 0" target="living"><send event="HALT_RESPONSE"/></transition>
    <transition event="CMD_HALT" cond="n % 3 != 0" target="living"><send event="HALT_RESPONSE"/></transition>
    <transition event="CMD_HALT" cond="n % 2 == 0"/>
  </state>
  <final id="gone"/>)";

// Ends, asks, waits and stops as chance has it.
constexpr const char* kAnything = R"(
  <datamodel><data id="n" expr="0"/></datamodel>
  <state id="living">
    <onentry><send event="later" delay="300ms"/></onentry>
    <transition event="tick" cond="_event.data.end" target="success"/>
    <transition event="tick" cond="_event.data.ask"><assign location="n" expr="n + 1"/><send type="thrift" target="s" event="ask"/></transition>
    <transition event="s.ask.reply" cond="_event.data.result" target="failure"/>
    <transition event="s.ask.reply" cond="!_event.data.result"/>
    <transition event="later" cond="n % 2 == 0"><assign location="n" expr="n + 1"/><send event="later" delay="300ms"/></transition>
    <transition event="later" target="success"/>
    <transition event="halt" cond="n % 3 != 0" target="stopping"/>
    <transition event="s.level" cond="_event.data.n == 1" target="success"/>
  </state>
  <state id="stopping">
    <onentry><send type="thrift" target="s" event="ask"/><send event="still" delay="100ms"/></onentry>
    <transition event="s.ask.reply" cond="_event.data.result" target="halted"/>
    <transition event="s.level" cond="_event.data.n == 1" target="halted"/>
    <transition event="still"/>
    <transition event="halt" cond="n % 2 == 0"/>
  </state>
  <final id="success"/><final id="failure"/><final id="halted"/>)";

TEST(Skill, AnythingInAnyOrderFollowsTheTableAndACopyGoesOnAlike) {
  const std::uint64_t seed = 20'261'122;
  SCOPED_TRACE("seed " + std::to_string(seed));
  Rng rng(seed);
  project::SkillProtocol protocol = answering();
  protocol.acknowledge = "CMD_OK";
  for (int run = 0; run < 600; ++run) {
    PlayerOptions options{.condition = run % 2 == 0, .halt_deadline = milliseconds(1500)};
    if (run >= 150) options.protocol = protocol;
    SkillPlayer p(run < 150 ? kAnything : kAnythingOfAProtocol, options);
    for (int i = 0; i < 70; ++i) {
      const std::uint64_t what = rng.below(18);
      if (what < 6) {
        p.tick(rng.below(2) == 0 || p.state.run == 0, Map{{"end", rng.below(4) == 0}, {"ask", rng.below(2) == 0}});
      } else if (what < 9) {
        if (!p.last_call.empty()) p.reply(rng.below(3) == 0);
      } else if (what < 11) {
        p.wait(milliseconds(400));
      } else if (what < 13) {
        p.halt();
      } else if (what == 13) {
        p.cancel();
      } else if (what >= 16) {
        p.hear(static_cast<std::int64_t>(rng.below(5)));
      } else {
        p.take(what == 14 && rng.below(3) == 0 ? SkillDelivery(KillSkill{}) : SkillDelivery(RestartSkill{}));
      }
      const SkillState copy = p.state;
      EXPECT_TRUE(copy == p.state);
    }
  }
  std::size_t covered = 0;
  for (const SkillEdge& edge : skill_edges()) {
    if (SkillPlayer::edges().contains(edge))
      ++covered;
    else
      std::cout << "not taken: " << to_string(edge.from) << " --" << edge.by << "--> " << to_string(edge.to) << '\n';
  }
  std::cout << covered << " of " << skill_edges().size() << " edges taken\n";
  EXPECT_EQ(covered, skill_edges().size());
}

const char* const kGoing = R"(
  <state id="going">
    <onentry><send type="thrift" target="nav" event="send_goal"><param name="upto" expr="5"/></send></onentry>
    <transition event="nav.result" target="success"/>
    <transition event="halt" target="halted"/>
  </state>
  <final id="success"/> <final id="failure"/> <final id="halted"/>)";
const char* const kCancelling = R"(
  <datamodel><data id="id" expr="''"/></datamodel>
  <state id="going">
    <onentry><send type="thrift" target="nav" event="send_goal"><param name="upto" expr="5"/></send></onentry>
    <transition event="nav.send_goal.reply"><assign location="id" expr="_event.data.result.goal_id"/></transition>
    <transition event="halt" target="stopping"/>
  </state>
  <state id="stopping">
    <onentry><send type="thrift" target="nav" event="cancel_goal"><param name="goal_id" expr="id"/></send></onentry>
    <transition event="nav.cancel_goal" target="halted"/>
  </state>
  <final id="success"/> <final id="failure"/> <final id="halted"/>)";

Value accepted(bool is = true) { return Map{{"accepted", is}, {"goal_id", "a1"}}; }
Value cancelled() { return Map{{"return_code", 0}, {"goals_canceling", List{"a1"}}}; }

TEST(SkillGoals, AreCancelledWhenTheirRunIsHalted) {
  SkillPlayer p(kGoing);
  p.tick(true);
  p.reply(accepted());
  p.done();
  p.halt();
  EXPECT_THAT(p.done(), ElementsAre(R"(call nav.cancel_goal {"goal_id":"a1"})", "halted"));
  p.reply(cancelled());
  EXPECT_THAT(p.done(), IsEmpty()) << "nobody waits for the answer, and it is not late";
  p.halt();
  EXPECT_THAT(p.done(), ElementsAre("halted"));
}

TEST(SkillGoals, ThatAreAcceptedAfterTheHaltAreCancelledThen) {
  SkillPlayer p(kGoing);
  p.tick(true);
  p.halt();
  p.done();
  p.reply(accepted());
  EXPECT_THAT(p.done(), ElementsAre(R"(call nav.cancel_goal {"goal_id":"a1"})", "nav.send_goal.late"));
  SkillPlayer refused(kGoing);
  refused.tick(true);
  refused.halt();
  refused.done();
  refused.reply(accepted(false));
  EXPECT_THAT(refused.done(), ElementsAre("nav.send_goal.late"));
  EXPECT_THAT(refused.state.goals, IsEmpty());
}

TEST(SkillGoals, ThatTheChartCancelsAreNotCancelledAgain) {
  SkillPlayer p(kCancelling);
  p.tick(true);
  p.reply(accepted());
  p.done();
  p.halt();
  EXPECT_THAT(p.done(), ElementsAre(R"(call nav.cancel_goal {"goal_id":"a1"})"));
  p.reply(cancelled());
  EXPECT_THAT(p.done(), ElementsAre("halted"));
}

constexpr const char* kLow = R"(
  <datamodel><data id="n" expr="-1"/></datamodel>
  <state id="asked">
    <transition event="s.level"><log label="heard" expr="_event.data.n"/><assign location="n" expr="_event.data.n"/></transition>
    <transition event="tick" cond="n &lt; 0"/>
    <transition event="tick" cond="n &lt; 30" target="success"/>
    <transition event="tick" target="failure"/>
  </state>
  <final id="success"/>
  <final id="failure"/>)";

TEST(SkillTopics, ARunBeginsWithWhatWasPublishedLast) {
  SkillPlayer p(kLow, {.latest_topics = {"s.level"}});
  p.tick(true);
  EXPECT_THAT(p.done(), ElementsAre("RUNNING"));
  p.cancel();
  p.hear(50);
  p.hear(20);
  EXPECT_THAT(p.done(), IsEmpty());
  p.tick(true);
  EXPECT_THAT(p.done(), ElementsAre("log heard", "SUCCESS"));
  p.tick(true);
  EXPECT_THAT(p.done(), ElementsAre("log heard", "SUCCESS"));
  p.hear(70);
  p.tick(true);
  EXPECT_THAT(p.done(), ElementsAre("log heard", "FAILURE"));
}

TEST(SkillTopics, AChartThatATopicBeginsHearsItOnce) {
  const project::SkillProtocol protocol{.tick = "tick", .states = {{"success", bt::Status::kSuccess}}};
  SkillPlayer p(kLow, {.protocol = protocol, .latest_topics = {"s.level"}});
  p.hear(20);
  EXPECT_THAT(p.done(), ElementsAre("log heard"));
}

TEST(SkillTopics, WhatARememberedTopicBringsAboutIsNoAnswer) {
  const project::SkillProtocol protocol{.tick = "tick", .states = {{"done", bt::Status::kSuccess}}};
  SkillPlayer p(R"(
  <state id="asked">
    <transition event="s.level" target="done"/>
    <transition event="end" target="gone"/>
  </state>
  <state id="done">
    <transition event="tick" target="gone"><log label="ticked"/></transition>
  </state>
  <final id="gone"/>)",
                {.protocol = protocol, .latest_topics = {"s.level"}});
  p.hear(20);
  p.tick(true);
  EXPECT_THAT(p.done(), testing::Contains("log ticked"));
  p.tick(true);
  EXPECT_THAT(p.done(), testing::Contains("log ticked")) << "what it hears again as it begins is no answer to the tick";
}

TEST(SkillTopics, WithoutThatARunKnowsWhatComesWhileItGoesOn) {
  SkillPlayer p(kLow);
  p.hear(20);
  p.tick(true);
  EXPECT_THAT(p.done(), ElementsAre("RUNNING"));
  p.hear(20);
  p.tick();
  EXPECT_THAT(p.done(), ElementsAre("log heard", "SUCCESS"));
}

TEST(SkillGoals, ThatHaveEndedAreLeftAlone) {
  SkillPlayer p(R"(
  <state id="going">
    <onentry><send type="thrift" target="nav" event="send_goal"><param name="upto" expr="5"/></send></onentry>
    <transition event="halt" target="halted"/>
  </state>
  <final id="halted"/>)");
  p.tick(true);
  p.reply(accepted());
  p.take(Published{Shared<Publication>({"nav.result", "nav", Map{{"goal_id", "a1"}, {"status", "SUCCEEDED"}}})});
  p.done();
  p.halt();
  EXPECT_THAT(p.done(), ElementsAre("halted"));
}

TEST(SkillGoals, OfARunThatEndsByItselfAreItsCharts) {
  SkillPlayer p(kGoing);
  p.tick(true);
  p.reply(accepted());
  p.take(Published{Shared<Publication>({"nav.result", "nav", Map{{"goal_id", "of others"}, {"status", "ABORTED"}}})});
  p.tick();
  p.done();
  p.halt();
  EXPECT_THAT(p.done(), ElementsAre("halted"));
}

TEST(SkillCalls, OfWhatIsObservedAreRefused) {
  const SkillPlayer p(kGoing);
  scxml::OutgoingSend send;
  send.type = "thrift";
  send.target = "seen";
  send.event = "cancel_goal";
  const auto checked = check_call(send, *p.model().services);
  ASSERT_FALSE(checked);
  EXPECT_THAT(checked.error().message, HasSubstr("\"seen\" is observed and cannot be called"));
}

// Executes steps as another process does: from data alone.
class Executor final : public ChartElsewhere {
 public:
  explicit Executor(const SkillPlayer& player) : model_(player.model()) {}
  tl::expected<Value, Away> execute(const scxml::Session& session, const scxml::StepOrder& order) override {
    ++steps;
    if (away) return tl::unexpected(*away);
    if (!instead.is_null()) return instead;
    scxml::Session there;
    if (order.kind != scxml::StepOrder::Kind::kStart)
      there = *scxml::restore(model_.chart, *unpack(pack(*scxml::save(model_.chart, session))));
    scxml::Host host;
    host.processors.push_back({"thrift", ""});
    host.on_send = [this](const scxml::OutgoingSend& send) { return check_call(send, *model_.services); };
    const auto told =
        scxml::execute_and_tell(model_.chart, there, *scxml::restore_order(*unpack(pack(scxml::save(order)))), host);
    EXPECT_TRUE(told);
    return *unpack(pack(*told));
  }
  void took(const scxml::Session&) override {}

  std::optional<Away> away;
  Value instead;
  std::size_t steps = 0;

 private:
  const SkillModel& model_;
};

TEST(SkillElsewhere, DoesWhatItWouldHaveDoneHere) {
  const std::uint64_t seed = 20'261'124;
  SCOPED_TRACE("seed " + std::to_string(seed));
  Rng rng(seed);
  project::SkillProtocol protocol = answering();
  protocol.acknowledge = "CMD_OK";
  std::size_t steps = 0;
  for (int run = 0; run < 60; ++run) {
    PlayerOptions options{.condition = run % 2 == 0, .halt_deadline = milliseconds(1500)};
    if (run >= 30) options.protocol = protocol;
    const char* const states = run < 30 ? kAnything : kAnythingOfAProtocol;
    SkillPlayer here(states, options);
    SkillPlayer there(states, options);
    Executor executor(there);
    there.execute_elsewhere(executor);
    for (int i = 0; i < 70; ++i) {
      const std::uint64_t what = rng.below(15);
      const std::uint64_t which = rng.below(16);
      for (SkillPlayer* p : {&here, &there}) {
        if (what < 6)
          p->tick(which % 2 == 0 || p->state.run == 0, Map{{"end", which < 4}, {"ask", which % 3 == 0}});
        else if (what < 9 && !p->last_call.empty())
          p->reply(which % 3 == 0);
        else if (what < 11)
          p->wait(milliseconds(400));
        else if (what < 13)
          p->halt();
        else if (what == 13)
          p->cancel();
        else
          p->hear(static_cast<std::int64_t>(which % 5));
      }
      ASSERT_EQ(here.done(), there.done()) << "run " << run << ", step " << i;
      ASSERT_TRUE(here.state == there.state) << "run " << run << ", step " << i;
    }
    steps += executor.steps;
  }
  EXPECT_GT(steps, 1000U);
}

TEST(SkillElsewhere, FailsItsLeafWhenNobodyExecutesItAndBeginsAnewWhenSomebodyDoes) {
  SkillPlayer p(kAsking);
  Executor executor(p);
  p.execute_elsewhere(executor);
  p.tick(true);
  p.done();
  executor.away = ChartElsewhere::Away::kLost;
  p.reply(true);
  p.tick();
  EXPECT_THAT(p.done(), ElementsAre(HasSubstr("! Leaf was given up: its process does not execute it"),
                                    HasSubstr("FAILURE {\"reason\":\"its process does not execute it\"}")));
  p.tick(true);
  EXPECT_THAT(p.done().back(), HasSubstr("FAILURE"));
  executor.away.reset();
  p.tick(true);
  EXPECT_THAT(p.done(), ElementsAre("call s.ask {\"n\":0.5}", "RUNNING"));
}

TEST(SkillElsewhere, IsHaltedEvenIfNobodyExecutesIt) {
  SkillPlayer p(kStopping);
  Executor executor(p);
  p.execute_elsewhere(executor);
  p.tick(true);
  p.done();
  executor.away = ChartElsewhere::Away::kLost;
  p.halt();
  EXPECT_THAT(p.done().back(), "halted");
}

TEST(SkillElsewhere, IsExecutedHereWhereItIsToBe) {
  SkillPlayer p(kAsking);
  Executor executor(p);
  executor.away = ChartElsewhere::Away::kHere;
  p.execute_elsewhere(executor);
  p.tick(true);
  EXPECT_THAT(p.done(), ElementsAre("call s.ask {\"n\":0.5}", "RUNNING"));
}

TEST(SkillElsewhere, DoesNothingThatItsChartCouldNot) {
  SkillPlayer other(R"(<state id="a"><onentry><log label="l"/></onentry></state>)");
  scxml::Session session;
  const Value told =
      *scxml::execute_and_tell(other.model().chart, session,
                               {.kind = scxml::StepOrder::Kind::kStart, .now = {}, .event = {}, .options = {}}, {});
  for (const Value& instead : {Value("none"), Value(Map{{"session", 1}, {"told", 2}}), told}) {
    SkillPlayer p(kAsking);
    Executor executor(p);
    executor.instead = instead;
    p.execute_elsewhere(executor);
    p.tick(true);
    EXPECT_THAT(p.done(), ElementsAre(HasSubstr("! Leaf was given up: its process executes something else"),
                                      HasSubstr("FAILURE")));
    EXPECT_TRUE(p.last_call.empty());
  }
}

TEST(Skill, TellsOfErrorsThatItsChartTakesNoTransitionFor) {
  SkillPlayer skill(R"xml(<datamodel><data id="n" expr="0"/></datamodel>
<state id="a"><onentry><assign location="n" expr="nowhere.x"/></onentry>
  <transition event="tick" target="b"/></state>
<state id="b"><onentry><assign location="n" expr="nobody.y"/><send event="more" target="#_scxml_none"/></onentry>
  <transition event="error.execution" target="success"/></state>
<final id="success"/>)xml");
  skill.tick(true);
  const std::vector<std::string> done = skill.done();
  ASSERT_EQ(done.size(), 2U);
  EXPECT_THAT(done[0], HasSubstr("! skill Leaf: skill.scxml:2:"));
  EXPECT_THAT(done[0], HasSubstr("nowhere"));
  EXPECT_EQ(done[1], "SUCCESS");  // what it takes is its own business
}

}  // namespace
}  // namespace sentree::mission
