#include "sentree/runtime/skill.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace sentree::runtime {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

// A skill in the hands of a test: what it does is written down as text.
class Player final : public SkillPort {
 public:
  explicit Player(const std::string& states, bool condition = false, SkillOptions options = {})
      : skill_(load(states), with(std::move(options), condition), *this) {}

  void tick(bool started = false, Map inputs = {}) { skill_.tick(started, inputs, now); }
  void halt() { skill_.halt(now); }
  void cancel() { skill_.cancel(now); }
  bool reply(const std::string& name, Value data = Map()) {
    return skill_.deliver({.run = last_call.run, .name = name, .sendid = last_call.sendid, .data = std::move(data)},
                          now);
  }
  void pass(Duration duration) {
    now += duration;
    skill_.timers(now);
  }
  std::vector<std::string> take() { return std::exchange(done_, {}); }
  Skill& skill() { return skill_; }

  TimePoint now{};
  SkillCall last_call;
  TimePoint wake = kNever;

 private:
  static scxml::Chart load(const std::string& states) {
    auto chart = scxml::load(
        "<scxml xmlns='http://www.w3.org/2005/07/scxml' version='1.0' datamodel='ecmascript'>" + states + "</scxml>",
        "skill.scxml");
    EXPECT_TRUE(chart.ok()) << (chart.ok() ? "" : to_string(chart.diagnostics.front()));
    return *chart.value;
  }
  static SkillOptions with(SkillOptions options, bool condition) {
    options.name = "Leaf";
    options.condition = condition;
    return options;
  }

  void call(SkillCall call) override {
    done_.push_back("call " + call.service + "." + call.method + " " + to_json(call.args));
    last_call = std::move(call);
  }
  void answer(bt::Status status, Map outputs) override {
    done_.push_back(std::string(to_string(status)) + (outputs.empty() ? "" : " " + to_json(Value(outputs))));
  }
  void halted() override { done_.push_back("halted"); }
  void wake_at(TimePoint when) override { wake = when; }
  void log(const scxml::LogLine& line) override { done_.push_back("log " + line.label); }
  void problem(const std::string& what) override { done_.push_back("! " + what); }

  std::vector<std::string> done_;
  Skill skill_;
};

constexpr const char* kAsking = R"(
  <datamodel><data id="n"/></datamodel>
  <state id="asking">
    <onentry><send type="thrift" target="s" event="ask"><param name="n" expr="n"/></send></onentry>
    <onexit><log label="left"/></onexit>
    <transition event="s.ask.reply" cond="_event.data.result" target="success"/>
    <transition event="s.ask.reply" target="failure"/>
  </state>
  <final id="success"><donedata><param name="out" expr="n"/></donedata></final><final id="failure"/>)";

TEST(Skill, AConditionIsAnsweredWhenItsRunEnds) {
  Player p(kAsking, true);
  p.tick(true, {{"n", 3.5}});
  EXPECT_THAT(p.take(), ElementsAre("call s.ask {\"n\":3.5}"));
  EXPECT_TRUE(p.reply("s.ask.reply", Map{{"result", true}}));
  EXPECT_THAT(p.take(), ElementsAre("log left", "SUCCESS {\"out\":3.5}"));
}

TEST(Skill, AnActionAnswersRunningAndTellsItsEndToTheNextTick) {
  Player p(kAsking);
  p.tick(true, {{"n", 1.5}});
  EXPECT_THAT(p.take(), ElementsAre("call s.ask {\"n\":1.5}", "RUNNING"));
  p.reply("s.ask.reply", Map{{"result", true}});
  EXPECT_THAT(p.take(), ElementsAre("log left"));
  p.tick();
  EXPECT_THAT(p.take(), ElementsAre("SUCCESS {\"out\":1.5}"));
}

TEST(Skill, TheFirstTickIsDeliveredToo) {
  Player p(
      "<state id='a'><transition event='tick' cond='_event.data.x === 7' target='success'/></state><final "
      "id='success'/>");
  p.tick(true, {{"x", 7}});
  EXPECT_THAT(p.take(), ElementsAre("SUCCESS"));
}

TEST(Skill, StartsAnewWithItsInitialState) {
  Player p(R"(<datamodel><data id="count" expr="0"/></datamodel>
    <state id="a"><transition event="tick" target="success"><assign location="count" expr="count + 1"/></transition></state>
    <final id="success"><donedata><param name="count" expr="count"/></donedata></final>)");
  p.tick(true);
  p.tick(true);
  EXPECT_THAT(p.take(), ElementsAre("SUCCESS {\"count\":1}", "SUCCESS {\"count\":1}"));
}

TEST(Skill, AHaltThatNothingHandlesCancels) {
  Player p(kAsking);
  p.tick(true);
  p.take();
  p.halt();
  EXPECT_THAT(p.take(), ElementsAre("log left", "halted"));
  EXPECT_FALSE(p.reply("s.ask.reply", Map{{"result", true}}));
  EXPECT_THAT(p.take(), IsEmpty());
}

constexpr const char* kStopping = R"(
  <state id="moving"><transition event="halt" target="stopping"/></state>
  <state id="stopping">
    <onentry><send type="thrift" target="s" event="stop"/></onentry>
    <transition event="s.stop" target="halted"/>
  </state>
  <final id="halted"/><final id="success"/>)";

TEST(Skill, AHaltTakesAsLongAsItNeeds) {
  Player p(kStopping);
  p.tick(true);
  p.halt();
  EXPECT_THAT(p.take(), ElementsAre("RUNNING", "call s.stop {}"));
  p.reply("s.stop.reply");
  EXPECT_THAT(p.take(), ElementsAre("halted"));
}

TEST(Skill, AHaltBeyondItsDeadlineIsCancelled) {
  Player p(kStopping, false, {.halt_deadline = seconds(2)});
  p.tick(true);
  p.halt();
  p.take();
  EXPECT_EQ(p.wake, TimePoint(seconds(2)));
  p.pass(milliseconds(1999));
  EXPECT_THAT(p.take(), IsEmpty());
  p.pass(milliseconds(1));
  EXPECT_THAT(p.take(),
              ElementsAre("! Leaf did not end within its halt deadline of 2000 ms and was cancelled", "halted"));
}

TEST(Skill, HaltingAnEndedRunDiscardsItsStatus) {
  Player p(kAsking);
  p.tick(true);
  p.reply("s.ask.reply", Map{{"result", true}});
  p.take();
  p.halt();
  EXPECT_THAT(p.take(), ElementsAre("halted"));
}

TEST(Skill, AReplyToAnOlderRunReachesNoChart) {
  Player p(kAsking);
  p.tick(true);
  const SkillCall first = p.last_call;
  p.halt();
  p.tick(true);
  p.take();
  EXPECT_FALSE(p.skill().deliver(
      {.run = first.run, .name = "s.ask.reply", .sendid = first.sendid, .data = Map{{"result", true}}}, p.now));
  EXPECT_TRUE(p.reply("s.ask.reply", Map{{"result", true}}));
}

TEST(Skill, ACancelledConditionAnswersNothing) {
  Player p(kAsking, true);
  p.tick(true);
  p.take();
  p.cancel();
  EXPECT_THAT(p.take(), ElementsAre("log left"));
}

TEST(Skill, ItsTimersRunBetweenTicks) {
  Player p(
      R"(<state id="a"><onentry><send event="later" delay="300ms"/></onentry><transition event="later" target="success"/></state><final id="success"/>)");
  p.tick(true);
  EXPECT_THAT(p.take(), ElementsAre("RUNNING"));
  EXPECT_EQ(p.wake, TimePoint(milliseconds(300)));
  p.pass(milliseconds(300));
  p.tick();
  EXPECT_THAT(p.take(), ElementsAre("SUCCESS"));
}

TEST(Skill, ARefusedCallIsErrorExecution) {
  SkillOptions options;
  options.check_call = [](const scxml::OutgoingSend& send) -> Result<void> { return fail("x", "no " + send.event); };
  Player p(R"(<state id="a"><onentry><send type="thrift" target="s" event="ask"/></onentry>
      <transition event="error.execution" cond="_event.data.message === 'no ask'" target="success"/></state><final id="success"/>)",
           false, options);
  p.tick(true);
  EXPECT_THAT(p.take(), ElementsAre("SUCCESS"));
}

TEST(Skill, AChartThatExceedsABoundIsGivenUp) {
  Player p("<state id='a'><transition target='b'/></state><state id='b'><transition target='a'/></state>");
  p.tick(true);
  const auto done = p.take();
  ASSERT_EQ(done.size(), 2U);
  EXPECT_THAT(done[0], HasSubstr("! Leaf was given up: skill.scxml:"));
  EXPECT_THAT(done[1], HasSubstr("FAILURE"));
}

}  // namespace
}  // namespace sentree::runtime
