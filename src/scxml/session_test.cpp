#include "sentree/scxml/session.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <string>
#include <vector>

#include "sentree/base/rng.h"
#include "sentree/scxml/detail/test_random_chart.h"
#include "sentree/scxml/step.h"
#include "sentree/text/json.h"

namespace sentree::scxml {
namespace {

using testing::HasSubstr;

struct Running {
  Session session;
  Effects effects;
};

void advance(const Chart& chart, Running& running, const Event& event, TimePoint now, const Host& host) {
  running.effects.clear();
  step_timers(chart, running.session, now, running.effects, host);
  step(chart, running.session, event, now, running.effects, host);
}

TEST(Snapshot, ARestoredSessionGoesOnExactlyAsTheOriginal) {
  Host host;
  host.processors.push_back({"out", ""});
  host.limits.timers_max = 20;
  int restored_sessions = 0;
  for (std::uint64_t seed = 1; seed <= 100; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const auto loaded = load(RandomChart(seed).source());
    ASSERT_TRUE(loaded.ok()) << to_string(loaded.diagnostics.front());
    const Chart& chart = *loaded.value;
    Rng rng(seed);
    Running original;
    start(chart, original.session, {.seed = seed}, {}, original.effects, host);
    TimePoint now{};
    Running twin;
    for (int i = 0; i < 40; ++i) {
      const auto saved = save(chart, original.session);
      ASSERT_TRUE(saved) << saved.error().message;
      const auto read_again = text::parse_json(to_json(*saved));
      ASSERT_TRUE(read_again);
      auto restored = restore(chart, *read_again);
      ASSERT_TRUE(restored) << restored.error().message;
      EXPECT_EQ(*restored, original.session);
      EXPECT_EQ(restored->hash(), original.session.hash());
      twin.session = *std::move(restored);
      ++restored_sessions;
      now += std::chrono::milliseconds(rng.below(3000));
      const Event event{.name = "e" + std::to_string(rng.below(4))};
      advance(chart, original, event, now, host);
      advance(chart, twin, event, now, host);
      ASSERT_EQ(twin.session, original.session);
      ASSERT_EQ(twin.effects, original.effects);
    }
  }
  EXPECT_EQ(restored_sessions, 100 * 40);
}

TEST(Snapshot, RefusesWhatIsNoneOrBelongsToAnotherChart) {
  const auto one = load(RandomChart(1).source());
  const auto other = load(RandomChart(2).source());
  Running running;
  start(*one.value, running.session, {}, {}, running.effects);
  const auto saved = save(*one.value, running.session);
  ASSERT_TRUE(saved);
  EXPECT_EQ(restore(*other.value, *saved).error().code, "scxml.other-chart");
  EXPECT_EQ(restore(*one.value, Value(3)).error().code, "scxml.bad-snapshot");
  Map damaged = *saved->as_map();
  damaged["configuration"] = List{100'000};
  EXPECT_EQ(restore(*one.value, damaged).error().code, "scxml.bad-snapshot");
}

TEST(Snapshot, SavesInvokedChildrenAndTheirTimers) {
  const auto loaded = load(R"(<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" datamodel="ecmascript">
    <state id="a"><invoke id="child"><content><scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" datamodel="ecmascript">
      <datamodel><data id="n" expr="41"/></datamodel>
      <state id="c"><onentry><send event="up" delay="2s"/></onentry><transition event="up" target="d"><assign location="n" expr="n + 1"/></transition></state>
      <final id="d"><donedata><param name="n" expr="n"/></donedata></final></scxml></content></invoke>
      <transition event="done.invoke.child" cond="_event.data.n === 42" target="b"/></state><state id="b"/></scxml>)");
  ASSERT_TRUE(loaded.ok());
  Running running;
  start(*loaded.value, running.session, {}, {}, running.effects);
  const auto saved = save(*loaded.value, running.session);
  ASSERT_TRUE(saved);
  auto restored = restore(*loaded.value, *saved);
  ASSERT_TRUE(restored);
  EXPECT_EQ(restored->next_timer(), TimePoint(std::chrono::seconds(2)));
  step_timers(*loaded.value, *restored, restored->next_timer(), running.effects);
  EXPECT_THAT(restored->active_ids(*loaded.value), testing::ElementsAre("b"));
}

TEST(Snapshot, DataWithoutAValueFormWorkButAreARefusalToSave) {
  const auto loaded = load(
      R"xml(<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" datamodel="ecmascript"><datamodel><data id="f"/><data id="n" expr="0"/></datamodel>
    <state id="a"><onentry><script>f = function (x) { return x + 1; };</script></onentry><transition event="e"><assign location="n" expr="f(n)"/></transition>
    <transition event="drop"><script>f = null;</script></transition></state></scxml>)xml",
      "f.scxml");
  ASSERT_TRUE(loaded.ok());
  const Chart& chart = *loaded.value;
  Running running;
  start(chart, running.session, {}, {}, running.effects);
  step(chart, running.session, {.name = "e"}, {}, running.effects);
  step(chart, running.session, {.name = "e"}, {}, running.effects);
  EXPECT_EQ(*running.session.data(chart).find("n"), Value(2));
  const auto saved = save(chart, running.session);
  ASSERT_FALSE(saved);
  EXPECT_EQ(saved.error().message, "\"f\" holds a function, which cannot be saved");
  Session copy = running.session;
  step(chart, copy, {.name = "e"}, {}, running.effects);
  EXPECT_EQ(copy.status(), SessionStatus::kFailed);
  step(chart, running.session, {.name = "drop"}, {}, running.effects);
  EXPECT_TRUE(save(chart, running.session));
}

// Also past steps that only look, and until another value takes its place.
TEST(Snapshot, DataWithoutAValueFormStayAsTheyAre) {
  const auto chart = load(R"xml(<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" datamodel="ecmascript">
    <datamodel><data id="r"/><data id="d" expr="({k: 1})"/></datamodel>
    <state>
      <transition event="alias"><assign location="r" expr="d"/></transition>
      <transition event="look"><log expr="d"/></transition>
      <transition event="change"><assign location="r.k" expr="r.k + 1"/></transition>
      <transition event="part"><assign location="r" expr="5"/></transition>
      <transition event="nothing"><log expr="'nothing'"/></transition>
    </state></scxml>)xml");
  ASSERT_TRUE(chart.ok()) << to_string(chart.diagnostics.front());
  Running running;
  start(*chart.value, running.session, {}, {}, running.effects);
  const auto look = [&] {
    advance(*chart.value, running, {.name = "look"}, {}, {});
    const auto* const line = running.effects.empty() ? nullptr : std::get_if<LogLine>(&running.effects.front());
    return line != nullptr ? line->text : "nothing";
  };
  advance(*chart.value, running, {.name = "alias"}, {}, {});
  for (int i = 2; i < 4; ++i) {
    advance(*chart.value, running, {.name = "nothing"}, {}, {});
    EXPECT_EQ(look(), fmt::format("{{\"k\":{}}}", i - 1));
    advance(*chart.value, running, {.name = "change"}, {}, {});
    EXPECT_EQ(look(), fmt::format("{{\"k\":{}}}", i)) << "one object in two places";
    EXPECT_FALSE(save(*chart.value, running.session));
  }
  advance(*chart.value, running, {.name = "part"}, {}, {});
  EXPECT_EQ(look(), "{\"k\":3}");
  EXPECT_TRUE(save(*chart.value, running.session));
}

TEST(Invocation, SendsAndForwardsBothWays) {
  const auto loaded = load(
      R"xml(<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" datamodel="ecmascript"><datamodel><data id="got" expr="''"/></datamodel>
    <state id="a"><invoke id="c" autoforward="true"><finalize><assign location="got" expr="_event.data.v"/></finalize><content>
      <scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" datamodel="ecmascript">
      <state id="x"><transition event="ping"><send target="#_parent" event="pong"><param name="v" expr="_event.name"/></send></transition></state></scxml>
      </content></invoke><transition event="pong" cond="got === 'ping'" target="b"/></state><state id="b"/></scxml>)xml");
  ASSERT_TRUE(loaded.ok());
  Running running;
  start(*loaded.value, running.session, {}, {}, running.effects);
  ASSERT_EQ(running.session.invocations().size(), 1U);
  step(*loaded.value, running.session, {.name = "ping"}, {}, running.effects);
  EXPECT_THAT(running.session.active_ids(*loaded.value), testing::ElementsAre("b"));
  EXPECT_TRUE(running.session.invocations().empty());
}

// SCXML 6.5: each event of an invocation passes its <finalize>, while the state that invoked is active.
TEST(Invocation, WhatItSaysBeforeItEndsIsFinalized) {
  const auto loaded = load(
      R"xml(<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" datamodel="ecmascript"><datamodel><data id="n" expr="0"/></datamodel>
    <state id="a"><invoke id="c" autoforward="true"><finalize><assign location="n" expr="n + 10"/></finalize><content>
      <scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" datamodel="ecmascript">
      <state id="x"><transition event="go" target="f"><send target="#_parent" event="said"/></transition></state><final id="f"/></scxml>
      </content></invoke>
      <transition event="said" cond="n == 10"><send target="#_c" event="late"/></transition>
      <transition event="error.communication" cond="n == 10"><assign location="n" expr="n + 1"/></transition>
      <transition event="done.invoke.c" cond="n == 21" target="b"/></state>
    <state id="b"/></scxml>)xml");
  ASSERT_TRUE(loaded.ok());
  Running running;
  start(*loaded.value, running.session, {}, {}, running.effects);
  step(*loaded.value, running.session, {.name = "go"}, {}, running.effects);
  EXPECT_THAT(running.session.active_ids(*loaded.value), testing::ElementsAre("b"));
  EXPECT_TRUE(running.session.invocations().empty());
}

TEST(Invocation, OfAnotherFolderReadsWhatIsBesideIt) {
  const std::map<std::string, std::string, std::less<>> files{
      {"sub/child.scxml",
       R"xml(<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" datamodel="ecmascript"><script src="lib.js"/>
      <datamodel><data id="d" src="file:d.json"/><data id="next" expr="'deep/grand.scxml'"/></datamodel>
      <state id="s"><invoke id="g" srcexpr="next"/><transition event="done.invoke.g" cond="twice(d.q) == 10" target="f"/></state>
      <final id="f"/></scxml>)xml"},
      {"sub/lib.js", "function twice(x) { return 2 * x; }"},
      {"sub/d.json", "{\"q\": 5}"},
      {"sub/deep/grand.scxml",
       R"xml(<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0"><state id="s"><invoke src="../last.scxml" id="l"/><transition event="done.invoke.l" target="f"/></state><final id="f"/></scxml>)xml"},
      {"sub/deep/../last.scxml",
       R"xml(<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0"><final id="f"/></scxml>)xml"}};
  LoadOptions options;
  options.read = [&](std::string_view uri) -> Result<std::string> {
    const auto found = files.find(uri);
    return found != files.end() ? found->second : Result<std::string>(fail("none", std::string(uri)));
  };
  Running running;
  Host host;
  host.read = options.read;
  for (const char* src : {"src=\"sub/child.scxml\"", "src=\"file:sub/child.scxml\"", "srcexpr=\"'sub/child.scxml'\""}) {
    SCOPED_TRACE(src);
    const auto loaded = load(
        fmt::format(
            R"xml(<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" datamodel="ecmascript"><state id="a"><invoke id="c" {}/>
            <transition event="done.invoke.c" target="b"/></state><state id="b"/></scxml>)xml",
            src),
        "main.scxml", options);
    ASSERT_TRUE(loaded.ok());
    start(*loaded.value, running.session, {}, {}, running.effects, host);
    EXPECT_THAT(running.session.active_ids(*loaded.value), testing::ElementsAre("b"));
  }
}

TEST(Bounds, SessionsThatSendToEachOtherForeverAreStopped) {
  const auto loaded = load(R"xml(<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" datamodel="null">
    <state id="a"><onentry><send event="e"/></onentry><transition event="e"><send event="e"/></transition></state></scxml>)xml");
  ASSERT_TRUE(loaded.ok());
  Running running;
  start(*loaded.value, running.session, {}, {}, running.effects);
  ASSERT_TRUE(running.session.failure());
  EXPECT_THAT(running.session.failure()->message,
              HasSubstr("more than 10000 macrosteps in one step; the last event was e"));
}

TEST(Bounds, ChartsThatInvokeThemselvesStopAtTheDepth) {
  const std::string chart_text =
      R"xml(<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" datamodel="null"><state id="a"><invoke src="self"/></state></scxml>)xml";
  LoadOptions options;
  options.read = [&](std::string_view) -> Result<std::string> { return chart_text; };
  const auto loaded = load(chart_text, "self", options);
  ASSERT_TRUE(loaded.ok());
  Host host;
  host.read = options.read;
  Running running;
  start(*loaded.value, running.session, {}, {}, running.effects, host);
  int depth = 0;
  for (const Session* s = &running.session; !s->invocations().empty(); s = s->invocations().front().child.get())
    ++depth;
  EXPECT_EQ(depth, static_cast<int>(host.limits.invocation_depth_max));
}

// W3C test 230, which is manual: the child sees what the parent saw.
TEST(Invocation, AutoforwardKeepsTheFieldsOfTheEvent) {
  const auto loaded = load(
      R"xml(<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" datamodel="ecmascript"><datamodel><data id="child" expr="''"/><data id="own" expr="''"/></datamodel>
    <state id="a"><invoke id="c" autoforward="true"><content>
      <scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" datamodel="ecmascript"><state id="x">
      <transition event="ping"><send target="#_parent" event="saw"><param name="all" expr="JSON.stringify(_event)"/></send></transition></state></scxml>
      </content></invoke>
      <transition event="ping"><assign location="own" expr="JSON.stringify(_event)"/></transition>
      <transition event="saw"><assign location="child" expr="_event.data.all"/></transition></state></scxml>)xml");
  ASSERT_TRUE(loaded.ok());
  Running running;
  start(*loaded.value, running.session, {}, {}, running.effects);
  step(*loaded.value, running.session,
       {.name = "ping", .sendid = "s1", .origin = "#_o", .origintype = "t", .data = Value(Map{{"v", 1}})}, {},
       running.effects);
  const Map data = running.session.data(*loaded.value);
  EXPECT_EQ(*data.find("child"), *data.find("own"));
  EXPECT_THAT(std::string(data.find("own")->text()), HasSubstr("\"sendid\":\"s1\""));
}

// W3C test 250, which is manual.
TEST(Invocation, ACancelledChildRunsItsExitHandlers) {
  const auto loaded = load(
      R"xml(<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" datamodel="null">
    <state id="a"><invoke><content><scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" datamodel="null">
      <state id="x"><onexit><log label="outer"/></onexit><state id="y"><onexit><log label="inner"/></onexit></state></state></scxml></content></invoke>
      <transition event="leave" target="b"/></state><state id="b"/></scxml>)xml");
  ASSERT_TRUE(loaded.ok());
  Running running;
  start(*loaded.value, running.session, {}, {}, running.effects);
  step(*loaded.value, running.session, {.name = "leave"}, {}, running.effects);
  ASSERT_EQ(running.effects.size(), 2U);
  EXPECT_EQ(std::get<LogLine>(running.effects[0]).label, "inner");
  EXPECT_EQ(std::get<LogLine>(running.effects[1]).label, "outer");
}

// W3C test 178, which is manual: either answer is allowed.
TEST(Send, ParamsOfOneNameCollapse) {
  const auto loaded = load(
      R"xml(<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" datamodel="ecmascript"><datamodel><data id="got"/></datamodel>
    <state id="a"><onentry><send event="e"><param name="p" expr="1"/><param name="p" expr="2"/></send></onentry>
    <transition event="e"><assign location="got" expr="_event.data.p"/></transition></state></scxml>)xml");
  ASSERT_TRUE(loaded.ok());
  Running running;
  start(*loaded.value, running.session, {}, {}, running.effects);
  EXPECT_EQ(*running.session.data(*loaded.value).find("got"), Value(2));
}

// W3C test 307, which is manual: with either binding, data that have no value yet are undefined, and no error.
TEST(DataModel, DataIsUndefinedBeforeItIsBound) {
  for (const char* binding : {"early", "late"}) {
    const auto loaded = load(
        std::string(
            R"xml(<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" datamodel="ecmascript" binding=")xml") +
        binding +
        R"xml("><state id="a"><onentry><log expr="typeof later"/></onentry><transition event="error" target="failed"/></state>
        <state id="b"><datamodel><data id="later"/></datamodel></state><state id="failed"/></scxml>)xml");
    ASSERT_TRUE(loaded.ok());
    Running running;
    start(*loaded.value, running.session, {}, {}, running.effects);
    EXPECT_EQ(std::get<LogLine>(running.effects.front()).text, "undefined");
    EXPECT_THAT(running.session.active_ids(*loaded.value), testing::ElementsAre("a"));
  }
}

// W3C test 301, which is manual.
TEST(Load, RefusesAScriptThatCannotBeRead) {
  const auto loaded = load(
      R"xml(<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" datamodel="ecmascript"><script src="nowhere.js"/><state/></scxml>)xml",
      "c.scxml");
  ASSERT_FALSE(loaded.ok());
  EXPECT_EQ(loaded.diagnostics.front().code, "scxml.script-unreadable");
}

TEST(Send, OverHttpIsRefusedUntilAProgramTurnsItOn) {
  const auto loaded = load(
      R"xml(<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" datamodel="ecmascript">
    <state id="a"><onentry><send type="http://www.w3.org/TR/scxml/#BasicHTTPEventProcessor" target="http://127.0.0.1:1/" event="e"/></onentry>
    <transition event="error.execution" target="refused"/></state><state id="refused"/></scxml>)xml");
  ASSERT_TRUE(loaded.ok());
  Running off;
  start(*loaded.value, off.session, {}, {}, off.effects);
  EXPECT_THAT(off.session.active_ids(*loaded.value), testing::ElementsAre("refused"));
  EXPECT_TRUE(off.effects.empty());
  Host host;
  host.processors.push_back({std::string(kBasicHttpProcessor), "http://127.0.0.1:2/"});
  Running on;
  start(*loaded.value, on.session, {}, {}, on.effects, host);
  ASSERT_EQ(on.effects.size(), 1U);
  EXPECT_EQ(std::get<OutgoingSend>(on.effects[0]).target, "http://127.0.0.1:1/");
}

}  // namespace
}  // namespace sentree::scxml
