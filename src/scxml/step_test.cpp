#include "sentree/scxml/step.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

namespace sentree::scxml {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;

constexpr std::string_view kHead =
    R"xml(<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" datamodel="ecmascript">)xml";

Chart chart_of(std::string_view body) {
  auto loaded = load(std::string(kHead) + std::string(body) + "</scxml>", "test.scxml");
  for (const Diagnostic& diagnostic : loaded.diagnostics) ADD_FAILURE() << to_string(diagnostic);
  return *std::move(loaded.value);
}

// A session on fake time.
struct Player : Observer {
  explicit Player(std::string_view body) : chart(chart_of(body)) { host.observer = this; }

  StepInfo begin(Map data = {}) { return start(chart, session, {.data = std::move(data)}, now, effects, host); }
  StepInfo send(std::string_view name, std::optional<Value> data = {}) {
    return step(chart, session, {.name = std::string(name), .data = std::move(data)}, now, effects, host);
  }
  void wait(Duration time) {
    now += time;
    step_timers(chart, session, now, effects, host);
  }
  std::vector<std::string> configuration() const { return session.active_ids(chart); }
  template <class T>
  std::vector<T> all() const {
    std::vector<T> found;
    for (const Effect& effect : effects) {
      if (const T* e = std::get_if<T>(&effect)) found.push_back(*e);
    }
    return found;
  }
  void event(const Chart&, std::string_view, const Event& e) override { events.push_back(e.name); }
  void unhandled(const Chart&, std::string_view, const Diagnostic& why) override { failures.push_back(to_string(why)); }

  Chart chart;
  Session session;
  TimePoint now{};
  Effects effects;
  Host host;
  std::vector<std::string> events;
  std::vector<std::string> failures;  // that nothing took
};

TEST(Step, EntersTheFirstStateAndFollowsEvents) {
  Player p(R"xml(<state id="a"><transition event="go" target="b"/></state><state id="b"/>)xml");
  p.begin();
  EXPECT_THAT(p.configuration(), ElementsAre("a"));
  EXPECT_FALSE(p.send("other").enabled);
  EXPECT_TRUE(p.send("go.now").enabled);
  EXPECT_THAT(p.configuration(), ElementsAre("b"));
}

TEST(Step, TellsWhetherThisVeryEventEnabledATransition) {
  Player p(
      R"xml(<state id="a"><onentry><send event="own"/></onentry><transition event="own"/><transition event="again"><send event="own"/></transition></state>)xml");
  p.begin();
  EXPECT_FALSE(p.send("halt").enabled);
  EXPECT_TRUE(p.send("again").enabled);
}

TEST(Bounds, AForeachOverTooManyItemsIsAnErrorInTheSession) {
  Player p(R"xml(<datamodel><data id="list" expr="new Array(100001)"/></datamodel>
    <state id="a"><onentry><foreach array="list" item="i"/></onentry><transition event="error.execution" target="b"/></state><state id="b"/>)xml");
  p.begin();
  EXPECT_THAT(p.configuration(), ElementsAre("b"));
}

TEST(Step, InitialDataReplaceTopLevelDataOfTheSameId) {
  Player p(R"xml(<datamodel><data id="x" expr="1"/><data id="y" expr="2"/></datamodel><state id="a"/>)xml");
  p.begin({{"x", "given"}, {"z", 3}});
  EXPECT_EQ(p.session.data(p.chart), (Map{{"x", "given"}, {"y", 2}}));
}

TEST(Step, SendToAnOfferedTypeLeavesAsAnEffectWithItsData) {
  Player p(
      R"xml(<state id="a"><onentry><send type="thrift" target="navigation" event="go"><param name="name" expr="'kitchen'"/></send></onentry></state>)xml");
  p.host.processors.push_back({"thrift", ""});
  p.begin();
  const auto sends = p.all<OutgoingSend>();
  ASSERT_EQ(sends.size(), 1U);
  EXPECT_EQ(sends[0].target, "navigation");
  EXPECT_EQ(sends[0].data, Value(Map{{"name", "kitchen"}}));
  EXPECT_FALSE(sends[0].sendid.empty());
  EXPECT_EQ(sends[0].span.line, 1);
}

TEST(Step, GivesAnInvokedChartWhatIsForIt) {
  Player p(R"xml(<state id="a"><invoke id="child"><content><scxml version="1.0" datamodel="ecmascript">
      <state id="asks"><onentry><send type="thrift" target="battery" event="level"/></onentry>
        <transition event="battery.level.reply" cond="_event.data.n === 3" target="knows"/>
        <transition event="error.communication" target="knows"/></state>
      <final id="knows"/></scxml></content></invoke>
    <transition event="battery error" target="wrong"/><transition event="done.invoke.child" target="right"/></state>
    <state id="wrong"/><state id="right"/>)xml");
  p.host.processors.push_back({"thrift", ""});
  EXPECT_TRUE(p.chart.ambient().empty()) << "whom answers find is known by the id";
  for (const auto& [name, type] : {std::pair("battery.level.reply", EventType::kExternal),
                                   std::pair("error.communication", EventType::kPlatform)}) {
    p.effects.clear();
    p.begin();
    const auto sends = p.all<OutgoingSend>();
    ASSERT_EQ(sends.size(), 1U);
    ASSERT_EQ(sends[0].session, p.session.id() + ".child");
    Event answer{.name = name, .type = type, .data = Value(Map{{"n", 3}}), .session = "other"};
    step(p.chart, p.session, answer, p.now, p.effects, p.host);
    EXPECT_THAT(p.configuration(), ElementsAre("a"));
    answer.session = "child";
    step(p.chart, p.session, answer, p.now, p.effects, p.host);
    EXPECT_THAT(p.configuration(), ElementsAre("right"));
    step(p.chart, p.session, answer, p.now, p.effects, p.host);
    EXPECT_THAT(p.configuration(), ElementsAre("right")) << "it has gone";
  }
}

TEST(Step, ARefusedSendRaisesErrorExecutionWithSendidAndMessage) {
  Player p(R"xml(<state id="a"><onentry><send id="s1" type="thrift" target="n" event="go"/></onentry>
    <transition event="error.execution" cond="_event.sendid === 's1' &amp;&amp; _event.data.message === 'no such method'" target="b"/></state><state id="b"/>)xml");
  p.host.processors.push_back({"thrift", ""});
  p.host.on_send = [](const OutgoingSend&) -> Result<void> { return fail("x.y", "no such method"); };
  p.begin();
  EXPECT_THAT(p.configuration(), ElementsAre("b"));
  EXPECT_TRUE(p.all<OutgoingSend>().empty());
}

// The interpreter of what `eval` is given has lines of its own.
TEST(Step, WhereAScriptFailedIsToldOnce) {
  const std::string failing =
      R"xml(<state id="a"><transition event="go"><script>eval('x +');</script></transition>)xml";
  Player untold(failing + "</state>");
  untold.begin();
  untold.send("go");
  EXPECT_THAT(untold.failures, ElementsAre(testing::MatchesRegex("test\\.scxml:1:[0-9]+: SyntaxError: [^(]*")));
  Player told(failing + R"xml(<transition event="error.execution" target="b"
    cond="_event.data.message.split('(line ').length === 2 &amp;&amp; /[(]line 1[)]$/.test(_event.data.message)"/>
    </state><state id="b"/>)xml");
  told.begin();
  told.send("go");
  EXPECT_THAT(told.configuration(), ElementsAre("b"));
}

TEST(Step, SendOfAnUnknownTypeIsErrorExecution) {
  Player p(R"xml(<state id="a"><onentry><send type="carrier" event="go"/></onentry></state>)xml");
  p.begin();
  EXPECT_THAT(p.events, ElementsAre("error.execution"));
}

TEST(Step, DelayedSendsWaitInTheSession) {
  Player p(
      R"xml(<state id="a"><onentry><send event="late" delay="1.5s"/><send id="never" event="x" delay="1s"/><cancel sendid="never"/></onentry>
    <transition event="late" target="b"/></state><state id="b"/>)xml");
  p.begin();
  EXPECT_EQ(p.session.next_timer(), TimePoint(std::chrono::milliseconds(1500)));
  p.wait(std::chrono::milliseconds(1499));
  EXPECT_THAT(p.configuration(), ElementsAre("a"));
  p.wait(std::chrono::milliseconds(1));
  EXPECT_THAT(p.configuration(), ElementsAre("b"));
  EXPECT_EQ(p.session.next_timer(), kNever);
}

TEST(Step, AnEndedSessionTellsItsFinalStateAndData) {
  Player p(R"xml(<final id="failure"><donedata><param name="reason" expr="'none'"/></donedata></final>)xml");
  p.begin();
  const auto done = p.all<Done>();
  ASSERT_EQ(done.size(), 1U);
  EXPECT_EQ(done[0].final_id, "failure");
  EXPECT_EQ(done[0].donedata, Value(Map{{"reason", "none"}}));
  EXPECT_EQ(p.session.status(), SessionStatus::kFinished);
  EXPECT_FALSE(p.send("more").enabled);
}

TEST(Step, CancelRunsTheExitHandlers) {
  Player p(
      R"xml(<state id="a"><onexit><log label="bye"/></onexit><state id="b"><onexit><log label="inner"/></onexit></state></state>)xml");
  p.begin();
  cancel(p.chart, p.session, p.now, p.effects, p.host);
  const auto logs = p.all<LogLine>();
  ASSERT_EQ(logs.size(), 2U);
  EXPECT_EQ(logs[0].label, "inner");
  EXPECT_EQ(logs[1].label, "bye");
  EXPECT_EQ(p.session.status(), SessionStatus::kCancelled);
}

TEST(Parallel, FinishesOnlyWhenEveryRegionIsFinal) {
  Player p(R"xml(<parallel id="p">
    <state id="l"><state id="l1"><transition event="left" target="l2"/></state><final id="l2"/></state>
    <state id="r"><state id="r1"><transition event="right" target="r2"/></state><final id="r2"/></state>
    </parallel>)xml");
  p.begin();
  p.send("left");
  EXPECT_THAT(p.events, testing::Not(Contains("done.state.p")));
  p.send("right");
  EXPECT_THAT(p.events, Contains("done.state.p"));
}

TEST(Bounds, AChartThatNeverComesToRestFailsWithThePlace) {
  Player p("<state id=\"a\">\n<transition target=\"b\"/></state><state id=\"b\"><transition target=\"a\"/></state>");
  p.begin();
  ASSERT_TRUE(p.session.failure());
  EXPECT_EQ(p.session.status(), SessionStatus::kFailed);
  EXPECT_THAT(to_string(*p.session.failure()),
              HasSubstr("test.scxml:2:1: the chart does not come to rest in \"a\", \"b\": more than 10000 microsteps"));
}

TEST(Bounds, AConditionThatFailsAgainAndAgainEndsTheSessionWithTheReason) {
  for (const char* raised : {"", "<onentry><raise event=\"x\"/></onentry>"}) {
    Player p("<state id=\"home\">" + std::string(raised) +
             "<transition cond=\"missing.member\" target=\"home\"/></state>");
    p.begin();
    ASSERT_TRUE(p.session.failure());
    EXPECT_THAT(to_string(*p.session.failure()), testing::AllOf(HasSubstr("does not come to rest in \"home\""),
                                                                HasSubstr("error.execution: "), HasSubstr("missing")));
  }
}

TEST(Bounds, TooManyDelayedSendsAreAnErrorInTheSession) {
  Player p(R"xml(<state id="a"><transition event="again"><send event="x" delay="100s"/></transition></state>)xml");
  p.host.limits.timers_max = 2;
  p.begin();
  for (int i = 0; i < 3; ++i) p.send("again");
  EXPECT_EQ(p.session.timers().size(), 2U);
  EXPECT_THAT(p.events, Contains("error.execution"));
}

TEST(Bounds, AScriptThatEatsMemoryIsAnErrorInTheSession) {
  Player p(
      R"xml(<datamodel><data id="x"/></datamodel><state id="a"><onentry><script>x = []; while (true) x.push('abcdefgh' + x.length);</script></onentry>
    <transition event="error.execution" target="b"/></state><state id="b"/>)xml");
  p.host.limits.script_memory_max = 1U << 20U;
  p.begin();
  EXPECT_THAT(p.configuration(), ElementsAre("b"));
}

TEST(Sessions, DoNotSeeEachOthersScripts) {
  const std::string_view body =
      R"xml(<state id="a"><transition event="set"><script>secret = 1; try { Array.prototype.secret = 2; } catch (e) {}</script></transition>
    <transition event="ask" cond="typeof secret === 'undefined' &amp;&amp; [].secret === undefined" target="clean"/>
    <transition event="ask" target="dirty"/></state><state id="clean"/><state id="dirty"/>)xml";
  Player one(body);
  one.begin();
  one.send("set");
  Session other;
  Effects effects;
  start(one.chart, other, {}, {}, effects);
  step(one.chart, other, {.name = "ask"}, {}, effects);
  EXPECT_THAT(other.active_ids(one.chart), ElementsAre("clean"));
  one.send("ask");
  EXPECT_THAT(one.configuration(), ElementsAre("dirty"));
}

TEST(Session, ACopyGoesOnByItself) {
  Player p(R"xml(<datamodel><data id="n" expr="0"/><data id="o" expr="({list: [1, 2]})"/></datamodel>
    <state id="a"><transition event="add"><assign location="n" expr="n + 1"/><script>o.list.push(n)</script></transition></state>)xml");
  p.begin();
  p.send("add");
  Session copy = p.session;
  EXPECT_EQ(copy, p.session);
  EXPECT_EQ(copy.hash(), p.session.hash());
  p.send("add");
  EXPECT_NE(copy, p.session);
  Effects effects;
  step(p.chart, copy, {.name = "add"}, p.now, effects);
  EXPECT_EQ(copy, p.session);
  EXPECT_EQ(copy.data(p.chart), (Map{{"n", 2}, {"o", Map{{"list", List{1, 2, 1, 2}}}}}));
}

// Also where no interpreter makes the object.
TEST(Session, AnObjectLiteralIsToScriptsWhatItSays) {
  Player p(R"xml(<datamodel><data id="o" expr="({a: undefined, b: 1})"/><data id="shared"/></datamodel>
    <state id="s">
      <transition event="renew"><assign location="o" expr="({b: {c: 2}})"/></transition>
      <transition event="share"><script>shared = o.b; shared.c = 3</script></transition>
      <transition event="look" cond="'a' in o" target="has_what_is_undefined"/>
      <transition event="look" cond="o.b.c === 3" target="is_shared"/>
    </state>
    <state id="has_what_is_undefined"><transition event="back" target="s"/></state>
    <state id="is_shared"/>)xml");
  p.begin();
  p.send("look");
  EXPECT_THAT(p.configuration(), ElementsAre("has_what_is_undefined"));
  p.send("back");
  p.send("renew");
  EXPECT_EQ(*p.session.data(p.chart).find("o"), Value(Map{{"b", Map{{"c", 2}}}}));
  p.send("share");
  p.send("look");
  EXPECT_THAT(p.configuration(), ElementsAre("is_shared"));
}

TEST(Session, ClockAndRandomnessAreTheRuns) {
  const std::string_view body =
      R"xml(<datamodel><data id="r" expr="Math.random()"/><data id="t" expr="Date.now() + new Date().getTime()"/></datamodel><state id="a"/>)xml";
  Player one(body);
  one.now += std::chrono::seconds(3);
  one.begin();
  Player two(body);
  two.now += std::chrono::seconds(3);
  two.begin();
  EXPECT_EQ(one.session.data(one.chart), two.session.data(two.chart));
  EXPECT_EQ(*one.session.data(one.chart).find("t"), Value(6000));
}

}  // namespace
}  // namespace sentree::scxml
