#include "sentree/scxml/session.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "sentree/base/rng.h"
#include "sentree/scxml/step.h"
#include "sentree/text/json.h"

namespace sentree::scxml {
namespace {

using testing::HasSubstr;

// A random chart: nested and parallel states, history, guards, data that expressions and scripts change, delayed
// events.
class RandomChart {
 public:
  explicit RandomChart(std::uint64_t seed) : rng_(seed) {}

  std::string source() {
    for (int i = 0; i < 24; ++i) ids_.push_back("s" + std::to_string(i));
    std::string text =
        R"(<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" datamodel="ecmascript"><datamodel><data id="n" expr="0"/><data id="list" expr="[]"/></datamodel>)";
    text += "<script>function twice(x) { return 2 * x; }</script>";
    while (next_ < 12) text += state(0);
    return text + "</scxml>";
  }

 private:
  std::string action() {
    switch (rng_.below(6)) {
      case 0: return "<assign location=\"n\" expr=\"n + 1\"/>";
      case 1: return "<script>list.push(n); if (list.length &gt; 5) list.shift();</script>";
      case 2:
        return "<send event=\"e" + std::to_string(rng_.below(4)) + "\" delay=\"" + std::to_string(1 + rng_.below(5)) +
               "s\"/>";
      case 3: return "<assign location=\"n\" expr=\"twice(n) % 97\"/>";
      case 4: return "<send id=\"x\" type=\"out\" event=\"o\"><param name=\"n\" expr=\"n\"/></send>";
      default: return "<log expr=\"n + Math.floor(Math.random() * 10)\"/>";
    }
  }

  std::string transition() {
    std::string text = "<transition event=\"e" + std::to_string(rng_.below(4)) + "\"";
    if (rng_.below(3) == 0) text += " cond=\"n % 2 == " + std::to_string(rng_.below(2)) + "\"";
    if (rng_.below(5) != 0) text += " target=\"s" + std::to_string(rng_.below(12)) + "\"";
    if (rng_.below(4) == 0) text += " type=\"internal\"";
    return text + ">" + (rng_.below(2) ? action() : "") + "</transition>";
  }

  std::string state(int depth) {
    const int id = next_++;
    const bool parallel = depth < 3 && rng_.below(4) == 0;
    std::string text = std::string(parallel ? "<parallel" : "<state") + " id=\"s" + std::to_string(id) + "\">";
    if (rng_.below(2)) text += "<onentry>" + action() + "</onentry>";
    if (rng_.below(3) == 0) text += "<onexit>" + action() + "</onexit>";
    const auto transitions = rng_.below(4);
    for (std::uint64_t i = 0; i < transitions; ++i) text += transition();
    const std::uint64_t children = depth < 3 ? (parallel ? 2 : rng_.below(3)) : 0;
    for (std::uint64_t i = 0; i < children; ++i) text += state(depth + 1);
    return text + (parallel ? "</parallel>" : "</state>");
  }

  Rng rng_;
  int next_ = 0;
  std::vector<std::string> ids_;
};

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
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
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
  EXPECT_EQ(restored_sessions, 40 * 40);
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

}  // namespace
}  // namespace sentree::scxml
