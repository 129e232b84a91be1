// What untrusted charts, data and scripts can reach: every bound, with its message and place.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <thread>
#include <vector>

#include "sentree/scxml/step.h"
#include "sentree/text/json.h"

namespace sentree::scxml {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;

std::string document(std::string_view body, std::string_view data_model = "ecmascript") {
  return "<scxml xmlns=\"http://www.w3.org/2005/07/scxml\" version=\"1.0\" datamodel=\"" + std::string(data_model) +
         "\">\n" + std::string(body) + "</scxml>";
}

Chart bounded_chart(std::string_view body) {
  auto loaded = load(document(body), "c.scxml");
  for (const Diagnostic& diagnostic : loaded.diagnostics) ADD_FAILURE() << to_string(diagnostic);
  return *std::move(loaded.value);
}

std::vector<std::string> load_messages(std::string_view source, const LoadLimits& limits = {}) {
  LoadOptions options;
  options.limits = limits;
  std::vector<std::string> messages;
  for (const Diagnostic& diagnostic : load(source, "c.scxml", options).diagnostics)
    messages.push_back(to_string(diagnostic));
  return messages;
}

struct Ran : Observer {
  explicit Ran(std::string_view body, Host given = {}) : chart(bounded_chart(body)), host(std::move(given)) {
    host.observer = this;
    start(chart, session, {}, {}, effects, host);
  }
  void send(std::string_view name, std::optional<Value> data = {}) {
    step(chart, session, {.name = std::string(name), .data = std::move(data)}, {}, effects, host);
  }
  void event(const Chart&, std::string_view, const Event& e) override {
    const Value* message = e.data ? e.data->find("message") : nullptr;
    events.push_back(e.name + (message ? ": " + std::string(message->text()) : ""));
  }
  [[nodiscard]] std::string failure() const { return session.failure() ? to_string(*session.failure()) : ""; }
  [[nodiscard]] std::vector<std::string> configuration() const { return session.active_ids(chart); }

  Chart chart;
  Host host;
  Session session;
  Effects effects;
  std::vector<std::string> events;
};

// ---- Loading ----

TEST(LoadBounds, RefuseASourceThatIsTooLarge) {
  LoadLimits limits;
  limits.source_bytes_max = 100;
  EXPECT_THAT(load_messages(document("<state/>"), limits), ElementsAre("c.scxml: the chart is larger than 100 bytes"));
}

TEST(LoadBounds, RefuseTooManyTransitionsWithThePlace) {
  LoadLimits limits;
  limits.transitions_max = 2;
  EXPECT_THAT(load_messages(document("<state><transition event='a'/>\n<transition event='b'/>\n"
                                     "<transition event='c'/></state>"),
                            limits),
              Contains("c.scxml:4:1: the chart has more than 2 transitions"));
}

TEST(LoadBounds, RefuseAnExpressionThatIsTooLongWithThePlace) {
  LoadLimits limits;
  limits.expression_bytes_max = 10;
  EXPECT_THAT(load_messages(document("<state><transition cond='1 + 1 + 1 + 1'/></state>"), limits),
              Contains("c.scxml:2:26: the expression is longer than 10 bytes"));
}

TEST(LoadBounds, RefuseEntitiesInsteadOfExpandingThem) {
  std::string bomb = "<!DOCTYPE scxml [<!ENTITY a \"aaaaaaaaaa\">";
  for (char c = 'b'; c <= 'k'; ++c) {
    bomb += std::string("<!ENTITY ") + c + " \"";
    for (int i = 0; i < 10; ++i) bomb += std::string("&") + static_cast<char>(c - 1) + ";";
    bomb += "\">";
  }
  bomb += "]>\n" + document("<state id='s'><onentry><log label='&k;'/></onentry></state>");
  const auto messages = load_messages(bomb);
  ASSERT_EQ(messages.size(), 1U);
  EXPECT_THAT(messages[0], HasSubstr("c.scxml:3:"));
  EXPECT_THAT(messages[0], HasSubstr("entity"));
}

TEST(LoadBounds, RefuseElementsNestedTooDeepInExecutableContentToo) {
  std::string deep = "<state><onentry>";
  for (int i = 0; i < 300; ++i) deep += "<if cond='true'>";
  for (int i = 0; i < 300; ++i) deep += "</if>";
  EXPECT_THAT(load_messages(document(deep + "</onentry></state>")),
              Contains(HasSubstr("elements are nested more than 200 deep")));
}

TEST(LoadBounds, RefuseXmlNestedBeyondWhatTheParserTakes) {
  std::string deep;
  for (int i = 0; i < 100'000; ++i) deep += "<state>";
  EXPECT_THAT(load_messages(document(deep)), testing::SizeIs(1));
}

TEST(LoadBounds, AGiganticChartIsRefusedWithOneMessage) {
  std::string states;
  for (int i = 0; i < 100'001; ++i) states += "<state/>\n";
  EXPECT_THAT(load_messages(document(states)), ElementsAre("c.scxml:100001:1: the chart has more than 100000 states"));
}

// ---- Running ----

TEST(Bounds, TooManyInternalEventsFailWithThePlaceOfTheLast) {
  Host host;
  host.limits.events_max = 5;
  Ran ran(
      "<state id='a'><onentry>\n  <raise event='e'/><raise event='e'/><raise event='e'/><raise event='e'/>"
      "<raise event='e'/>\n  <raise event='last'/></onentry></state>",
      host);
  EXPECT_EQ(ran.failure(), "c.scxml:4:3: more than 5 internal events wait; the last is last");
}

TEST(Bounds, TooManyExternalEventsFailWithThePlaceOfTheLast) {
  Host host;
  host.limits.events_max = 3;
  Ran ran(
      "<datamodel><data id='list' expr='[1,2,3,4,5]'/></datamodel><state id='a'><onentry><foreach array='list' "
      "item='i'>\n<send event='e'/></foreach></onentry></state>",
      host);
  EXPECT_EQ(ran.failure(), "c.scxml:3:1: more than 3 external events wait; the last is e");
}

TEST(Bounds, TooManyInvocationsAreAnErrorInTheSession) {
  Host host;
  host.limits.invocations_max = 2;
  const std::string invoke =
      "<invoke><content><scxml xmlns='http://www.w3.org/2005/07/scxml' "
      "version='1.0'><state/></scxml></content></invoke>";
  Ran ran("<state id='a'>" + invoke + invoke + invoke + "</state>", host);
  EXPECT_EQ(ran.session.invocations().size(), 2U);
  EXPECT_THAT(ran.events, ElementsAre("error.execution: more than 2 invocations at once"));
}

TEST(Bounds, LoopsInsideLoopsFailWithThePlace) {
  Host host;
  host.limits.actions_max = 10'000;
  Ran ran(
      "<datamodel><data id='list'/></datamodel><state id='a'><onentry>\n"
      "<script>list = []; for (var i = 0; i &lt; 1000; ++i) list.push(i);</script>\n"
      "<foreach array='list' item='i'><foreach array='list' item='k'/></foreach></onentry></state>",
      host);
  EXPECT_EQ(ran.failure(), "c.scxml:4:32: the chart executes more than 10000 pieces of executable content in one step");
}

TEST(Bounds, ATextThatDoublesWithoutEndRunsIntoTheMemoryOfScripts) {
  Host host;
  host.limits.script_memory_max = 2U << 20U;
  host.limits.microsteps_max = 100;
  Ran ran(R"(<datamodel><data id="s" expr="'0123456789'"/></datamodel>
    <state id="a"><transition target="a"><assign location="s" expr="s + s"/></transition></state>)",
          std::move(host));
  EXPECT_THAT(ran.failure(), HasSubstr("does not come to rest in \"a\""));
  EXPECT_LT(ran.session.data(ran.chart).find("s")->text().size(), 2U << 20U);
}

TEST(Bounds, WhatOneStepLogsIsBounded) {
  Ran ran(R"x(<datamodel><data id="list" expr="new Array(1000)"/>
    <data id="line" expr="new Array(10000).join('x')"/></datamodel>
    <state id="a"><onentry><foreach array="list" item="i"><foreach array="list" item="k">
      <log expr="line"/></foreach></foreach></onentry></state>)x");
  EXPECT_THAT(ran.failure(), HasSubstr("the chart logs and sends more than 64 MiB in one step"));
}

TEST(Bounds, SessionsThatSendToEachOtherNameThePlaceOfTheSend) {
  Ran ran(
      "<state id='a'><onentry><send event='e'/></onentry>\n<transition event='e'><send "
      "event='e'/></transition></state>");
  EXPECT_EQ(ran.failure(),
            "c.scxml:3:23: sessions keep sending to each other: more than 10000 macrosteps in one step; the last event "
            "was e");
}

TEST(Bounds, DataNestedTooDeepWorkButCannotBeSaved) {
  Ran ran(
      "<datamodel><data id='x'/></datamodel><state id='a'><onentry>"
      "<script>x = 0; for (var i = 0; i &lt; 150; ++i) x = [x];</script></onentry></state>");
  EXPECT_EQ(ran.failure(), "");
  const auto saved = save(ran.chart, ran.session);
  ASSERT_FALSE(saved);
  EXPECT_THAT(saved.error().message, HasSubstr("\"x\" holds objects nested too deep"));
}

TEST(Bounds, JsonNestedTooDeepIsRefusedAsEventData) {
  const auto deep = text::parse_json(std::string(200, '[') + std::string(200, ']'));
  ASSERT_FALSE(deep);
  EXPECT_EQ(deep.error().code, "json.too-deep");
}

TEST(Bounds, AScriptThatEatsMemoryIsCaughtEvenIfItCatchesTheError) {
  Host host;
  host.limits.script_memory_max = 1U << 20U;
  Ran ran(
      "<state id='a'><onentry><script>\n"
      "var kept = []; for (var i = 0; i &lt; 50; ++i) { try { while (true) kept.push(new Array(1000).join('x')); } "
      "catch (e) {} }\nkept = null;</script></onentry><transition event='go' target='b'/></state><state id='b'/>",
      host);
  ran.send("go");
  EXPECT_THAT(ran.configuration(), ElementsAre("b"));
}

TEST(Bounds, RecursionWithoutEndIsAnErrorInTheSession) {
  Ran ran(
      "<state id='a'><onentry><script>function f() { return f() + 1; }\nf();</script></onentry>"
      "<transition event='error.execution' target='b'/></state><state id='b'/>");
  EXPECT_THAT(ran.configuration(), ElementsAre("b"));
  EXPECT_THAT(ran.events, ElementsAre(HasSubstr("error.execution: RangeError")));
}

TEST(Watch, TakesTheSessionFromAThreadWhoseScriptNeverEnds) {
  // The thread and all that it works on are lost, as they are in a run.
  struct Lost {
    Chart chart;
    Host host;
    Session session;
    Effects effects;
    ExecutionWatch watch;
  };
  auto* const lost = new Lost{bounded_chart("<state id='a'><transition event='e'>\n <script>\nwhile (true) {}</script>"
                                            "</transition></state>"),
                              {},
                              {},
                              {},
                              {}};
  [[maybe_unused]] static Lost* keep = nullptr;
  keep = lost;
  lost->host.watch = &lost->watch;
  start(lost->chart, lost->session, {}, {}, lost->effects, lost->host);
  EXPECT_EQ(lost->watch.step(), 0U);
  std::thread([lost] { step(lost->chart, lost->session, {.name = "e"}, {}, lost->effects, lost->host); }).detach();
  std::optional<SourceSpan> script;
  while (!script) {
    const std::uint64_t number = lost->watch.step();
    if (number != 0) script = lost->watch.give_up(number);
  }
  EXPECT_EQ(to_string(*script), "c.scxml:3:10");
  EXPECT_TRUE(lost->watch.given_up());
}

TEST(Watch, LetsAThreadGoOnThatHasBegunAnotherStep) {
  Host host;
  ExecutionWatch watch;
  host.watch = &watch;
  Ran ran("<state id='a'><transition event='e'><script>var x = 1;</script></transition></state>", host);
  EXPECT_EQ(watch.step(), 0U);
  EXPECT_EQ(watch.give_up(1), std::nullopt);
  ran.send("e");
  EXPECT_FALSE(watch.given_up());
}

// ---- Sessions and each other ----

class Tampering : public testing::TestWithParam<const char*> {};

// One session tries to leave something behind in the heap that sessions of a chart share; the next looks for it.
TEST_P(Tampering, DoesNotReachAnotherSession) {
  const std::string body =
      "<datamodel><data id='x' expr='({list: [1]})'/></datamodel><state id='a'>"
      "<transition event='set'><script>try { " +
      std::string(GetParam()) +
      " } catch (e) {}</script></transition><transition event='ask' "
      "cond=\"({}).evil === undefined &amp;&amp; [].evil === undefined &amp;&amp; ''.evil === undefined &amp;&amp; "
      "(0).evil === undefined &amp;&amp; (function () {}).evil === undefined &amp;&amp; typeof evil === 'undefined' "
      "&amp;&amp; [3,1].sort()[0] === 1 &amp;&amp; Math.max(1, 2) === 2 &amp;&amp; JSON.stringify([1]) === '[1]' "
      "&amp;&amp; x.list.length === 1 &amp;&amp; String(1) === '1' &amp;&amp; new Date().getTime() === 0 "
      "&amp;&amp; new Error('m').message === 'm' &amp;&amp; /a/.test('a') &amp;&amp; In('a') &amp;&amp; _name === '' "
      "&amp;&amp; Object.keys(globalThis).length === 1\" target='clean'/>"
      "<transition event='ask' target='dirty'/></state><state id='clean'/><state id='dirty'/>";
  const Chart chart = bounded_chart(body);
  Effects effects;
  Session evil;
  Session good;
  start(chart, evil, {.session_id = "evil"}, {}, effects);
  start(chart, good, {.session_id = "good"}, {}, effects);
  step(chart, evil, {.name = "set"}, {}, effects);
  Session fresh;
  start(chart, fresh, {.session_id = "fresh"}, {}, effects);
  for (Session* session : {&good, &fresh}) {
    step(chart, *session, {.name = "ask"}, {}, effects);
    EXPECT_THAT(session->active_ids(chart), ElementsAre("clean"));
  }
}

INSTANTIATE_TEST_SUITE_P(
    Sessions, Tampering,
    testing::Values("Object.prototype.evil = 1", "Array.prototype.evil = 1", "String.prototype.evil = 1",
                    "Number.prototype.evil = 1", "Function.prototype.evil = 1", "evil = 1", "var evil = 1",
                    "globalThis.evil = 1", "Object.defineProperty(globalThis, 'evil', {value: 1})",
                    "Object.defineProperty(globalThis, 'evil', {get: function () { return 1; }, configurable: true})",
                    "Object.defineProperty(Object.prototype, 'evil', {value: 1})",
                    "Math.max = function () { return 0; }", "JSON.stringify = null", "Array.prototype.sort = null",
                    "Date.prototype.getTime = null", "RegExp.prototype.test = null", "String = null", "Object = null",
                    "In = null", "Object.setPrototypeOf(globalThis, {evil: 1})", "globalThis.__proto__ = {evil: 1}",
                    "Object.setPrototypeOf(Object.getPrototypeOf(globalThis), {evil: 1})", "({}).__proto__.evil = 1",
                    "({}).constructor.prototype.evil = 1", "this.evil = 1", "(function () { return this; })().evil = 1",
                    "Object.freeze(globalThis)", "Object.preventExtensions(globalThis)", "Object.seal(globalThis)",
                    "delete Object.prototype.toString", "x.list.push(2); _event.data = 1; _name = 'evil'",
                    "Error.prototype.message = 'evil'", "new Function('return this')().evil = 1", "eval('evil = 1')",
                    "(0, eval)('var evil = 1')", "Symbol.prototype.evil = 1; globalThis[Symbol('evil')] = 1",
                    "Object.defineProperty(globalThis, 'x', {value: 1, writable: false})"));

// ---- What the embedding program offers ----

TEST(Native, FunctionsAreCalledWithValuesAndTheirFailuresAreErrors) {
  Host host;
  host.functions.push_back({"distance", [](std::span<const Value> arguments) -> Result<Value> {
                              if (arguments.size() != 2)
                                return fail("map.arguments", "distance(from, to) takes two places");
                              return Value(arguments[0].number() + arguments[1].number());
                            }});
  Ran ran(
      "<datamodel><data id='d'/></datamodel><state id='a'><onentry><assign location='d' expr='distance(1, 2.5)'/>"
      "<assign location='d' expr='distance(1)'/></onentry></state>",
      host);
  EXPECT_EQ(*ran.session.data(ran.chart).find("d"), Value(3.5));
  EXPECT_THAT(ran.events, ElementsAre(HasSubstr("distance(from, to) takes two places")));
}

// Also where what they give is left to the interpreter, which evaluates all of it again.
TEST(Native, FunctionsAreCalledOnceForEachCall) {
  Host host;
  int calls = 0;
  host.functions.push_back({"count", [&calls](std::span<const Value> arguments) -> Result<Value> {
                              ++calls;
                              if (arguments.empty()) return fail("count.nothing", "count(what) takes something");
                              if (arguments[0].text() == "map") return Value(Map{{"calls", calls}});
                              return Value(calls);
                            }});
  const auto counted = [&](const std::string& expression) {
    calls = 0;
    Ran ran(
        "<datamodel><data id='d' expr='0'/><data id='m' expr='({a: 1})'/></datamodel><state id='a'><onentry>"
        "<assign location='d' expr=\"" +
            expression + "\"/><assign location='m' expr=\"'' + m\"/><log expr='[]'/></onentry></state>",
        host);
    const Map data = ran.session.data(ran.chart);
    return to_json(*data.find("d")) + (ran.events.empty() ? "" : " and an error") + ", calls: " + std::to_string(calls);
  };
  EXPECT_EQ(counted("count(1)"), "1, calls: 1");
  EXPECT_EQ(counted("count(1) + 10 * count('x')"), "21, calls: 2");
  EXPECT_EQ(counted("count('map')"), R"({"calls":1}, calls: 1)");
  EXPECT_EQ(counted("count('map').calls + count(1)"), "3, calls: 2");
  EXPECT_EQ(counted("count(1) + m.a.b.c"), "0 and an error, calls: 1");
  EXPECT_EQ(counted("count(1) + count()"), "0 and an error, calls: 2");
  EXPECT_EQ(counted("[count(1), count(2)].length + count(3)"), "5, calls: 3");
  EXPECT_EQ(counted("m.a === 1 ? count(m) : count()"), "1, calls: 1");
}

TEST(Native, FunctionsCannotBeReplacedByScripts) {
  Host host;
  host.functions.push_back({"one", [](std::span<const Value>) -> Result<Value> { return Value(1); }});
  Ran ran(
      "<datamodel><data id='d'/></datamodel><state id='a'><onentry><script>try { one = 2; } catch (e) {} one.x = "
      "3;</script>"
      "<assign location='d' expr='[one(), typeof one.x]'/></onentry></state>",
      host);
  EXPECT_EQ(*ran.session.data(ran.chart).find("d"), Value(List{1, "undefined"}));
}

TEST(Native, ValuesCanBeReadAndNothingElse) {
  Host host;
  host.values.push_back({"robot", Map{{"name", "R1"}, {"speeds", List{0.2, 0.5}}}});
  Ran ran(
      "<datamodel><data id='d'/></datamodel><state id='a'><onentry><script>"
      "try { robot.name = 'x'; } catch (e) {} try { robot.speeds.push(9); } catch (e) {} try { robot = 1; } catch (e) "
      "{}"
      "</script><assign location='d' expr='[robot.name, robot.speeds.length, Math.max.apply(null, robot.speeds)]'/>"
      "</onentry></state>",
      host);
  EXPECT_EQ(*ran.session.data(ran.chart).find("d"), Value(List{"R1", 2, 0.5}));
  EXPECT_TRUE(save(ran.chart, ran.session));
}

TEST(Evaluate, LooksAtASessionAndLeavesItAsItIs) {
  Ran ran(
      "<datamodel><data id='n' expr='3'/></datamodel><script>function twice(v) { return 2 * v; }</script>"
      "<state id='a'/>");
  const Session before = ran.session;
  const auto value = [&](std::string_view text) { return evaluate(ran.chart, ran.session, text, {}, ran.host); };
  EXPECT_EQ(*value("twice(n) + 1"), Value(7));
  EXPECT_EQ(*value("n = 10; n"), Value(10));
  EXPECT_EQ(*value("In('a')"), Value(true));
  EXPECT_EQ(*value("undefined"), std::nullopt);
  EXPECT_EQ(value("nobody").error().code, "scxml.script");
  EXPECT_EQ(value("1 +").error().code, "scxml.script");
  EXPECT_EQ(ran.session, before);
}

}  // namespace
}  // namespace sentree::scxml
