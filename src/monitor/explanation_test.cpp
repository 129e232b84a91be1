#include "sentree/monitor/explanation.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <iterator>
#include <set>
#include <string>

#include "sentree/monitor/monitor_set.h"
#include "sentree/scxml/loader.h"

namespace sentree::monitor {
namespace {

using std::chrono::milliseconds;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

Model explained_model(const std::string& text) {
  const auto file = parse_requirements(
      "let level = reply(battery.getBatteryState).percentage * 100\n"
      "let dest = request(nav.goto).name\nevent ask = request(s.ask)\nevent answer = reply(s.ask)\n" +
          text,
      "r.req");
  for (const Diagnostic& diagnostic : file.diagnostics) ADD_FAILURE() << to_string(diagnostic);
  return *Model::make(file.value->requirements.at(0)).value;
}

class Recording {
 public:
  Recording& add(int ms, const std::string& name, Map data, const std::string& source = "Leaf") {
    Message m;
    m.name = name;
    m.source = source;
    m.time = TimePoint(milliseconds(ms));
    m.sequence = messages.size() + 1;
    m.data = std::move(data);
    messages.push_back(std::move(m));
    return *this;
  }
  Recording& level(int ms, double ratio) {
    return add(ms, "battery.getBatteryState.reply", Map{{"args", Map()}, {"result", Map{{"percentage", ratio}}}},
               "BatteryLevelAbove30");
  }
  Recording& go(int ms, const char* where) {
    return add(ms, "nav.goto.request", Map{{"args", Map{{"name", where}}}}, "GoTo");
  }
  Recording& ticks(int from, int to) {
    for (int t = from; t <= to; ++t) add(t * 100, "mission.tick", Map{{"tick", t}}, "mission");
    return *this;
  }
  std::vector<Message> messages;
};

constexpr const char* kTurns =
    "turns (critical) \"Low, the robot turns to the station.\":\n"
    "  whenever level < 30 and dest = kitchen, dest = station within 10 ticks.";

TEST(Explanation, TellsTriggerValuesDecidingObservationAndLeaf) {
  Recording r;
  r.go(10, "garden").level(20, 0.9).go(30, "kitchen").add(50, "GoTo.tick.reply", Map{{"status", "RUNNING"}}, "GoTo");
  r.level(60, 0.28).level(70, 0.27).ticks(1, 12);
  const Model m = explained_model(kTurns);
  const auto decided = evaluate({m}, r.messages, TimePoint{}, TimePoint(milliseconds(5000)));
  ASSERT_EQ(decided.size(), 1U);
  const auto e = *explain(m, decided[0].decision, decided[0].leaf);
  EXPECT_EQ(e.requirement, "turns");
  EXPECT_EQ(e.trigger->time, TimePoint(milliseconds(60)));
  EXPECT_EQ(e.triggered, TimePoint(milliseconds(60)));
  EXPECT_EQ(e.detected, TimePoint(milliseconds(1100)));
  EXPECT_EQ(e.deciding->name, "mission.tick");
  EXPECT_EQ(e.bound, "10 ticks");
  EXPECT_EQ(e.leaf, "GoTo");
  EXPECT_THAT(e.steps.at(0).set, ElementsAre("dest = kitchen"));
  EXPECT_TRUE(e.steps.at(1).is_trigger);
  EXPECT_TRUE(e.steps.back().is_deciding);
  EXPECT_EQ(e.steps.size(), 2U + 11U);
  const std::string text = story(e, "  ");
  EXPECT_THAT(text,
              HasSubstr("0.060 s  battery.getBatteryState.reply of BatteryLevelAbove30: battery_percentage = 0.28  ← "
                        "from here on it owes dest = station\n"));
  EXPECT_THAT(text, HasSubstr("  0.100 s to 1.000 s  mission.tick, 10 times\n"));
  EXPECT_THAT(text, HasSubstr("  1.100 s  mission.tick  ← violated\n"));
  EXPECT_THAT(text, HasSubstr("owed since 0.060 s, 10 ticks long; decided at 1.100 s while GoTo was at work\n"));
}

TEST(Explanation, TellsOfSilence) {
  Recording r;
  r.add(100, "s.ask.request", Map{{"args", Map()}});
  const Model m = explained_model("R: whenever event(ask), event(answer) within 500 ms.");
  const auto decided = evaluate({m}, r.messages, TimePoint{}, TimePoint(milliseconds(5000)));
  const auto e = *explain(m, decided.at(0).decision, "");
  EXPECT_FALSE(e.deciding);
  EXPECT_EQ(e.deadline, TimePoint(milliseconds(600)));
  EXPECT_THAT(story(e, ""), HasSubstr("0.600 s  nothing came: the deadline passed, and the requirement owes "
                                      "event(answer)\n"));
  const Value value = to_value(e);
  EXPECT_TRUE(value.find("deciding")->is_null());
  EXPECT_EQ(value.find("trigger")->find("name")->text(), "s.ask.request");
}

TEST(Explanation, TellsWhatWasObservedWhereNothingIsRemembered) {
  Recording r;
  r.add(10, "s.ask.request", Map{{"args", Map()}}).add(20, "s.ask.reply", Map{{"result", 1}});
  r.add(30, "s.ask.request", Map{{"args", Map()}}).add(40, "s.ask.reply", Map{{"result", 1}});
  const Model events = explained_model("again: whenever event(ask), not event(answer) for 15 ms.");
  const auto answered = evaluate({events}, r.messages, TimePoint{}, TimePoint(milliseconds(50)));
  ASSERT_EQ(answered.size(), 1U);
  const auto by_events = *explain(events, answered[0].decision, {});
  ASSERT_EQ(by_events.steps.size(), 2U);
  EXPECT_THAT(by_events.steps[0].set, ElementsAre("ask"));
  EXPECT_TRUE(by_events.steps[0].is_trigger);
  EXPECT_THAT(by_events.steps[1].set, ElementsAre("answer"));

  const Model values = explained_model("level_held (re-arming): always level >= 20.");
  Recording low;
  low.level(10, 0.9).level(20, 0.15).level(30, 0.14).level(40, 0.5).level(50, 0.1);
  const auto decided = evaluate({values}, low.messages, TimePoint{}, TimePoint(milliseconds(60)));
  ASSERT_EQ(decided.size(), 2U);
  EXPECT_THAT(explain(values, decided[0].decision, {})->steps.back().set, ElementsAre("battery_percentage = 0.15"));
  EXPECT_THAT(explain(values, decided[1].decision, {})->steps.back().set, ElementsAre("battery_percentage = 0.1"));
}

TEST(Explanation, OfALongRunNeedsOnlyWhatStillMatters) {
  // Hours of readings, then the violation: what led there is found although nothing else is remembered.
  Recording r;
  r.go(1, "kitchen");
  for (int i = 0; i < 150'000; ++i) r.level(10 + i, 0.5 + 0.001 * (i % 7));
  const int end_ms = 10 + 150'000;
  r.level(end_ms, 0.2).ticks(end_ms / 100 + 1, end_ms / 100 + 20);
  const Model m = explained_model(kTurns);
  const auto decided = evaluate({m}, r.messages, TimePoint{}, TimePoint(milliseconds(2 * end_ms)));
  ASSERT_EQ(decided.size(), 1U);
  EXPECT_TRUE(decided[0].decision.witness_complete);
  EXPECT_EQ(decided[0].decision.witness.size(), 13U);
}

TEST(Explanation, OfThousandsOfTicksThatAllMatterTakesNoForever) {
  // No tick can be left out, and to try that with each would replay the others every time.
  Recording r;
  r.add(0, "s.ask.request", Map{{"args", Map()}}).ticks(1, 10'100);
  const Model m = explained_model("R: whenever event(ask), event(answer) within 10000 ticks.");
  const auto decided = evaluate({m}, r.messages, TimePoint{}, TimePoint(milliseconds(2'000'000)));
  ASSERT_EQ(decided.size(), 1U);
  EXPECT_EQ(decided[0].decision.witness.size(), 10'002U);
  EXPECT_TRUE(decided[0].decision.witness_complete);
  EXPECT_FALSE(decided[0].decision.witness_minimal);
  const auto again = evaluate({m}, decided[0].decision.witness, TimePoint{}, TimePoint(milliseconds(2'000'000)));
  ASSERT_EQ(again.size(), 1U);
  EXPECT_EQ(again[0].decision.at, decided[0].decision.at);
}

TEST(Explanation, AStoryLeavesOutTheMiddleOfALongOne) {
  // Requests without an answer, as many as are shown, and one more.
  const auto told = [](std::size_t steps) {
    Recording r;
    for (std::size_t i = 0; i < steps; ++i) r.add(static_cast<int>(i), "s.ask.request", Map{{"args", Map()}});
    const Model m =
        explained_model("R: whenever event(ask), event(answer) within " + std::to_string(steps - 1) + " events.");
    const auto decided = evaluate({m}, r.messages, TimePoint{}, TimePoint(milliseconds(10'000)));
    const auto e = *explain(m, decided.at(0).decision, "");
    EXPECT_EQ(e.steps.size(), steps);
    return story(e, "");
  };
  EXPECT_THAT(told(kStoryStepsMax), testing::Not(HasSubstr("more (--json has all)")));
  EXPECT_THAT(told(kStoryStepsMax + 1), HasSubstr("… 1 more (--json has all)"));
}

TEST(Explanation, IsTheSameBytesEachTime) {
  Recording r;
  r.go(30, "kitchen").level(60, 0.28).ticks(1, 12);
  const auto text = [&] {
    const Model m = explained_model(kTurns);
    const auto decided = evaluate({m}, r.messages, TimePoint{}, TimePoint(milliseconds(5000)));
    return to_json(to_value(*explain(m, decided.at(0).decision, decided[0].leaf)));
  };
  EXPECT_EQ(text(), text());
}

TEST(MonitorSet, DecidesInOrderOfTimeForAllMonitors) {
  Recording r;
  r.add(100, "s.ask.request", Map{{"args", Map()}}).level(550, 0.1);
  const auto decided = evaluate({explained_model("A: always level >= 20."),
                                 explained_model("B: whenever event(ask), event(answer) within 400 ms."),
                                 explained_model("C: whenever event(ask), event(answer) within 300 ms."),
                                 explained_model("D: never event(answer).")},
                                r.messages, TimePoint{}, TimePoint(milliseconds(5000)));
  std::vector<std::size_t> order;
  for (const auto& one : decided) order.push_back(one.monitor);
  EXPECT_THAT(order, ElementsAre(2U, 1U, 0U));
}

TEST(MonitorSet, GivesUpAMonitorWhoseTimersSwarm) {
  const auto every = [](const char* delay) {
    return scxml::load(
        fmt::format("<scxml xmlns='http://www.w3.org/2005/07/scxml' version='1.0'><state id='a'><onentry>"
                    "<send event='z' delay='{}'/></onentry><transition event='z' target='a'/>"
                    "<transition event='e' target='violated'/></state><final id='violated'/></scxml>",
                    delay),
        "swarm.scxml");
  };
  std::vector<Model> models;
  for (const char* delay : {"0.000001ms", "1ms"}) {
    auto chart = every(delay);
    ASSERT_TRUE(chart.ok());
    models.push_back(*Model::make({.name = delay, .chart = *chart.value}).value);
  }
  MonitorSet set(models, TimePoint{});
  std::vector<MonitorSet::Decided> decided;
  set.advance(TimePoint(std::chrono::seconds(3)), decided);
  ASSERT_TRUE(set.state(0).failure());
  EXPECT_THAT(to_string(*set.state(0).failure()), HasSubstr("swarm.scxml: its timers ring more than 1000000 times"));
  EXPECT_FALSE(set.state(1).failure());
  EXPECT_EQ(set.next_timer(), TimePoint(milliseconds(3001)));
  // So are those that are stepped without a set, by whoever tries many futures.
  for (std::size_t i = 0; i < 2; ++i) {
    Core core = begin(models[i], TimePoint{});
    step_timers(models[i], core, TimePoint(std::chrono::seconds(3)));
    EXPECT_EQ(core.failure(), set.state(i).failure());
  }
}

TEST(MonitorSet, HearsNamesBeyondThoseItRemembers) {
  Dispatch dispatch(std::vector<Model>{explained_model("A: always level >= 20.")});
  for (std::size_t i = 0; i <= kRoutesMax; ++i)
    EXPECT_TRUE(dispatch.route("service.m" + std::to_string(i) + ".reply").any.monitors.empty());
  EXPECT_EQ(dispatch.remembered(), kRoutesMax);
  for (int i = 0; i < 2; ++i)
    EXPECT_THAT(dispatch.route("battery.getBatteryState.reply").any.monitors, ElementsAre(0U));
  EXPECT_EQ(dispatch.remembered(), kRoutesMax);
}

TEST(MonitorSet, StepsAMonitorOverNodesOnTheirStatusesOnly) {
  const Model one = explained_model("A: never node(Dock) in FAILURE.");
  const Model every = explained_model("B: event(observation(node.status)) at most 1000 times per 1 s.");
  MonitorSet set({one, every}, TimePoint{});
  EXPECT_THAT(set.listeners("node.status", "Dock"), ElementsAre(0U, 1U));
  EXPECT_THAT(set.listeners("node.status", "Look"), ElementsAre(1U));
  Recording r;
  for (int i = 0; i < 5; ++i) r.add(10 * i, "node.status", Map{{"from", "RUNNING"}, {"to", "FAILURE"}}, "Look");
  r.add(100, "node.status", Map{{"from", "RUNNING"}, {"to", "FAILURE"}}, "Dock");
  std::vector<MonitorSet::Decided> decided;
  for (const Message& message : r.messages) {
    EXPECT_TRUE(decided.empty());
    EXPECT_THAT(*set.state(0).trail.history, IsEmpty());
    set.observe(message, decided);
  }
  ASSERT_EQ(decided.size(), 1U);
  EXPECT_EQ(decided[0].monitor, 0U);
  EXPECT_EQ(decided[0].decision.witness.size(), 1U);
}

TEST(MonitorSet, GoesOnBehindAMonitorThatIsGivenUp) {
  // The first of two hangs in its second observation: its thread is left there, and the call repeated.
  struct Hangs : MonitorSet::Listener {
    bool is_given_up(std::size_t monitor) override { return monitor == 0 && given_up; }
    void stepped(std::size_t monitor, Decisions decisions) override {
      told.push_back(monitor);
      decided += decisions.size();
      if (hang_in == told.size()) throw told.size();
    }
    std::vector<std::size_t> told;
    std::size_t decided = 0;
    std::size_t hang_in = 0;
    bool given_up = false;
  } listener;
  MonitorSet set({explained_model("A: always level >= 20."), explained_model("B: always level >= 30.")});
  set.start(TimePoint{}, listener);
  Recording r;
  r.level(10, 0.9).level(20, 0.25);
  const auto share = [](const Message& message) { return std::make_shared<const Message>(message); };
  set.observe(share(r.messages[0]), listener);
  EXPECT_THAT(listener.told, ElementsAre(0U, 1U, 0U, 1U));
  listener.hang_in = 5;
  EXPECT_ANY_THROW(set.observe(share(r.messages[1]), listener));
  listener.hang_in = 0;
  listener.given_up = true;
  set.observe(share(r.messages[1]), listener);
  EXPECT_THAT(listener.told, ElementsAre(0U, 1U, 0U, 1U, 0U, 0U, 1U));
  EXPECT_EQ(listener.decided, 1U);
}

TEST(MonitorSet, LooksOnlyAtWhatChartsName) {
  const auto chart = scxml::load(
      "<scxml xmlns='http://www.w3.org/2005/07/scxml' version='1.0' datamodel='ecmascript'><state id='s'>"
      "<transition event='e' cond=\"_event.data.result.a.indexOf('x') === 0 &amp;&amp; _event.data.source === 'L'\" "
      "target='violated'/></state><final id='violated'/></scxml>");
  Message m;
  m.source = "L";
  m.data = Map{{"args", Map{{"big", 1}}}, {"result", Map{{"a", "xyz"}, {"b", 2}}}};
  EXPECT_EQ(to_json(Projection::of(*chart.value).data(m)), R"({"result":{"a":"xyz"},"source":"L"})");
  const auto form = [&](const Value& data) {
    Message other = m;
    other.data = data;
    std::string out;
    Projection::of(*chart.value).encode(other, out);
    return out;
  };
  EXPECT_EQ(form(m.data), form(Map{{"result", Map{{"c", 3}, {"a", "xyz"}}}}));
  // Each is looked at as another one.
  const Value others[] = {Map{{"result", Map{{"a", "xy"}}}},
                          Map{{"result", Map{{"a", List{"xyz"}}}}},
                          Map{{"result", Map{}}},
                          Map{{"result", Map{{"a", Value()}}}},
                          Map{{"result", "xyz"}},
                          Map{}};
  std::set<std::string> forms{form(m.data)};
  for (const Value& other : others) forms.insert(form(other));
  EXPECT_EQ(forms.size(), 1 + std::size(others));
  const auto whole = scxml::load(
      "<scxml xmlns='http://www.w3.org/2005/07/scxml' version='1.0' datamodel='ecmascript'><datamodel><data "
      "id='x'/></datamodel><state id='s'><transition event='e'><assign location='x' "
      "expr='_event.data'/></transition></state></scxml>");
  EXPECT_TRUE(Projection::of(*whole.value).is_whole());
}

TEST(LeafTracker, KnowsWhoIsAtWork) {
  LeafTracker leaves;
  const auto see = [&](const std::string& name, Map data = {}) {
    Message m;
    m.name = name;
    m.data = std::move(data);
    leaves.see(m, LeafTracker::sign(name));
    return leaves.active();
  };
  EXPECT_EQ(see("Sub.A.tick.request"), "Sub.A");
  EXPECT_EQ(see("battery.getBatteryState.reply"), "Sub.A");
  EXPECT_EQ(see("Sub.A.tick.reply", Map{{"status", "RUNNING"}}), "Sub.A");
  EXPECT_EQ(see("B.tick.request"), "B");
  EXPECT_EQ(see("B.tick.reply", Map{{"status", "SUCCESS"}}), "Sub.A");
  EXPECT_THAT(see("Sub.A.halt.reply"), IsEmpty());
}

}  // namespace
}  // namespace sentree::monitor
