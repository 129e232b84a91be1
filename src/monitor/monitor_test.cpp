#include "sentree/monitor/monitor.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "sentree/base/rng.h"
#include "sentree/scxml/step.h"

namespace sentree::monitor {
namespace {

using std::chrono::milliseconds;
using testing::ElementsAre;

scxml::Chart chart(const std::string& states) {
  auto loaded = scxml::load(
      "<scxml xmlns='http://www.w3.org/2005/07/scxml' version='1.0' datamodel='ecmascript'>" + states + "</scxml>",
      "m.scxml");
  EXPECT_TRUE(loaded.ok()) << (loaded.ok() ? "" : to_string(loaded.diagnostics.front()));
  return *loaded.value;
}

Model model(const std::string& states, std::vector<std::string> violated = {}, std::vector<Rename> renames = {}) {
  auto made = Model::make({.name = "m",
                           .chart = chart(states),
                           .violated = std::move(violated),
                           .renames = std::move(renames),
                           .span = {}});
  EXPECT_TRUE(made.ok()) << (made.ok() ? "" : to_string(made.diagnostics.front()));
  return *made.value;
}

Message message(const std::string& name, int ms, Value data = Map()) {
  Message m;
  m.name = name;
  m.time = TimePoint(milliseconds(ms));
  m.sequence = static_cast<std::uint64_t>(ms) + 1;
  m.data = std::move(data);
  return m;
}

// The one decision, if any.
std::optional<Decision> see(const Model& model, State& state, const Message& message) {
  Decisions decisions = observe(model, state, message);
  EXPECT_LE(decisions.size(), 1U);
  return decisions.empty() ? std::nullopt : std::optional(decisions.front());
}
std::optional<Decision> pass(const Model& model, State& state, TimePoint now) {
  Decisions decisions = advance(model, state, now);
  EXPECT_LE(decisions.size(), 1U);
  return decisions.empty() ? std::nullopt : std::optional(decisions.front());
}

std::vector<std::string> names(const std::vector<Message>& messages) {
  std::vector<std::string> all;
  for (const Message& m : messages)
    all.push_back(m.name + "@" + std::to_string(m.time.time_since_epoch() / milliseconds(1)));
  return all;
}

constexpr const char* kLevel =
    "<state id='ok'><transition event='level' cond='_event.data.value &lt; 20' target='bad'/></state><state id='bad'/>";

TEST(Monitor, DecidesOnceAtTheEntryOfABadState) {
  const Model m = model(kLevel, {"bad"});
  State state = start(m, TimePoint{});
  EXPECT_FALSE(see(m, state, message("level", 1, Map{{"value", 20}})));
  const auto decision = see(m, state, message("level", 2, Map{{"value", 19}}));
  ASSERT_TRUE(decision);
  EXPECT_EQ(decision->verdict, Verdict::kViolated);
  EXPECT_EQ(decision->state, "bad");
  EXPECT_EQ(decision->deciding->time, TimePoint(milliseconds(2)));
  EXPECT_FALSE(see(m, state, message("level", 3, Map{{"value", 1}})));
}

TEST(Monitor, SeesABadStateThatIsLeftAtOnce) {
  const Model m = model(
      "<state id='ok'><transition event='e' target='bad'/></state><state id='bad'><transition target='ok'/></state>",
      {"bad"});
  State state = start(m, TimePoint{});
  EXPECT_TRUE(see(m, state, message("e", 1)));
}

TEST(Monitor, FinalStatesNameTheirVerdict) {
  const Model m = model(
      "<state id='a'><transition event='good' target='satisfied'/><transition event='bad' target='violated'/></state>"
      "<final id='satisfied'/><final id='violated'/>");
  State good = start(m, TimePoint{});
  State bad = good;
  EXPECT_EQ(see(m, good, message("good", 1))->verdict, Verdict::kSatisfied);
  EXPECT_EQ(see(m, bad, message("bad", 1))->verdict, Verdict::kViolated);
}

constexpr const char* kDeadline =
    "<state id='idle'><transition event='ask' target='owing'/></state>"
    "<state id='owing'><onentry><send event='late' id='t' delay='100ms'/></onentry><onexit><cancel "
    "sendid='t'/></onexit>"
    "<transition event='answer' target='idle'/><transition event='late' target='bad'/></state><state id='bad'/>";

TEST(Monitor, AnObservationWinsOverATimerAtTheSameInstant) {
  const Model m = model(kDeadline, {"bad"});
  State state = start(m, TimePoint{});
  see(m, state, message("ask", 10));
  EXPECT_FALSE(see(m, state, message("answer", 110)));
  see(m, state, message("ask", 200));
  const auto decision = see(m, state, message("answer", 301));
  ASSERT_TRUE(decision);
  EXPECT_EQ(decision->at, TimePoint(milliseconds(300)));
  EXPECT_FALSE(decision->deciding);
}

TEST(Monitor, NoticesSilence) {
  const Model m = model(kDeadline, {"bad"});
  State state = start(m, TimePoint{});
  see(m, state, message("ask", 10));
  EXPECT_EQ(next_timer(m, state), TimePoint(milliseconds(110)));
  EXPECT_FALSE(pass(m, state, TimePoint(milliseconds(109))));
  const auto decision = pass(m, state, TimePoint(milliseconds(500)));
  ASSERT_TRUE(decision);
  EXPECT_EQ(decision->at, TimePoint(milliseconds(110)));
  EXPECT_THAT(names(decision->witness), ElementsAre("ask@10"));
}

constexpr const char* kAfterArmed =
    "<datamodel><data id='armed' expr='0'/><data id='seen' expr='0'/></datamodel>"
    "<state id='s'><transition event='arm'><assign location='armed' expr='1'/></transition>"
    "<transition event='disarm'><assign location='armed' expr='0'/></transition>"
    "<transition event='other'><assign location='seen' expr='seen + 1'/></transition>"
    "<transition event='shot' cond='armed === 1' target='bad'/></state><state id='bad'/>";

TEST(Witness, KeepsOnlyWhatIsNeeded) {
  const Model m = model(kAfterArmed, {"bad"});
  State state = start(m, TimePoint{});
  int ms = 0;
  for (int i = 0; i < 50; ++i) see(m, state, message("other", ++ms));
  see(m, state, message("arm", ++ms));
  see(m, state, message("disarm", ++ms));
  see(m, state, message("arm", ++ms));
  for (int i = 0; i < 50; ++i) see(m, state, message("other", ++ms));
  const auto decision = see(m, state, message("shot", ++ms));
  ASSERT_TRUE(decision);
  EXPECT_EQ(decision->witness.size(), 2U);
  EXPECT_EQ(decision->witness[0].name, "arm");
  EXPECT_EQ(decision->witness[1].name, "shot");
}

TEST(Witness, ReplayedAloneDecidesAlikeAndIsMinimal) {
  const Model m = model(kAfterArmed, {"bad"});
  for (std::uint64_t seed = 1; seed <= 50; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Rng rng(seed);
    State state = start(m, TimePoint{});
    std::optional<Decision> decision;
    for (int ms = 1; ms < 200 && !decision; ++ms) {
      constexpr const char* kNames[] = {"other", "arm", "disarm", "shot"};
      decision = see(m, state, message(kNames[rng.below(4)], ms));
    }
    ASSERT_TRUE(decision);
    const auto replay = [&](std::size_t without) {
      State again = start(m, TimePoint{});
      std::optional<Decision> found;
      for (std::size_t i = 0; i < decision->witness.size(); ++i) {
        if (i != without && !found) found = see(m, again, decision->witness[i]);
      }
      return found;
    };
    const auto same = replay(decision->witness.size());
    ASSERT_TRUE(same);
    EXPECT_EQ(same->at, decision->at);
    for (std::size_t i = 0; i < decision->witness.size(); ++i) EXPECT_FALSE(replay(i));
  }
}

TEST(Monitor, ForgetsThePastWhenItIsBackAtItsBeginning) {
  const Model m = model(
      "<state id='a'><transition event='e' target='b'/></state><state id='b'><transition event='e' "
      "target='a'/><transition event='x' target='bad'/></state><state id='bad'/>",
      {"bad"});
  State state = start(m, TimePoint{});
  for (int i = 1; i <= 1000; ++i) see(m, state, message("e", i));
  EXPECT_TRUE(state.trail.history->empty());
}

TEST(Trail, IsSharedByCopiesUntilOneOfThemObservesMore) {
  const Model m = model(
      "<state id='a'><transition event='e' target='b'/></state><state id='b'><transition event='x' "
      "target='bad'/></state><state id='bad'/>",
      {"bad"});
  State state = start(m, TimePoint{});
  for (int i = 1; i <= 100; ++i) see(m, state, message("e", i));
  State copy = state;
  EXPECT_EQ(&*copy.trail.history, &*state.trail.history);
  EXPECT_EQ(&*copy.trail.entered_by, &*state.trail.entered_by);
  const auto decision = see(m, copy, message("x", 101));
  ASSERT_TRUE(decision);
  EXPECT_THAT(decision->witness, testing::SizeIs(2));
  EXPECT_THAT(*state.trail.history, testing::SizeIs(100));
  EXPECT_FALSE((*state.trail.entered_by)[*m.chart().find("bad")]);
  const auto later = see(m, state, message("x", 101));
  ASSERT_TRUE(later);
  EXPECT_EQ(later->witness, decision->witness);
  EXPECT_EQ(state, copy);
}

TEST(Witness, RemembersAsMuchAsItSays) {
  // The chart counts, so that every observation matters and none can be forgotten.
  const auto decision_after = [](std::size_t count) {
    const Model m = model(
        "<datamodel><data id='n' expr='0'/></datamodel><state id='s'><transition event='e' cond='n + 1 "
        "&lt; " +
            std::to_string(count) +
            "'><assign location='n' expr='n + 1'/></transition>"
            "<transition event='e' target='bad'/></state><state id='bad'/>",
        {"bad"});
    State state = start(m, TimePoint{});
    const auto e = std::make_shared<const Message>(message("e", 1));
    for (std::size_t i = 0; i + 1 < count; ++i) EXPECT_FALSE(see(m, state, *e));
    return see(m, state, *e);
  };
  const auto whole = decision_after(kHistoryMax);
  ASSERT_TRUE(whole);
  EXPECT_TRUE(whole->witness_complete);
  EXPECT_EQ(whole->witness.size(), kHistoryMax);
  const auto cut = decision_after(kHistoryMax + 1);
  ASSERT_TRUE(cut);
  EXPECT_FALSE(cut->witness_complete);
  EXPECT_LE(cut->witness.size(), kHistoryMax);
}

TEST(Monitor, RenamedEventsHaveEveryMemberOfTheirObservation) {
  const Model m = model(
      "<state id='ok'><transition event='refused' cond=\"_event.data.what === 'door by gate'\" target='bad'/></state>"
      "<state id='bad'/>",
      {"bad"},
      {{.event = "refused",
        .on = {"door.open.error"},
        .data = {{"what", "exception.Shut.door + ' by ' + vetoed_by"}}}});
  State state = start(m, TimePoint{});
  const auto error = [](const char* by) {
    return Map{{"kind", "exception"}, {"exception", Map{{"Shut", Map{{"door", "door"}}}}}, {"vetoed_by", by}};
  };
  EXPECT_FALSE(see(m, state, message("door.open.error", 1, error("lock"))));
  EXPECT_TRUE(see(m, state, message("door.open.error", 2, error("gate"))));
}

TEST(Monitor, AChartWrittenElsewhereSeesRenamedEventsOnly) {
  Rename rename{.event = "batteryLevelChanged",
                .on = {"battery.getBatteryState.reply"},
                .data = {{"level", "result.percentage * 100"}}};
  const Model m = model(
      "<state id='ok'><transition event='batteryLevelChanged' cond='_event.data.level &lt; 20' "
      "target='bad'/></state><state id='bad'/>",
      {"bad"}, {rename});
  EXPECT_TRUE(m.listens_to("battery.getBatteryState.reply"));
  EXPECT_FALSE(m.listens_to("batteryLevelChanged"));
  State state = start(m, TimePoint{});
  const auto level = [](double ratio) { return Map{{"result", Map{{"percentage", ratio}}}}; };
  EXPECT_FALSE(see(m, state, message("batteryLevelChanged", 1, Map{{"level", 1}})));
  EXPECT_FALSE(see(m, state, message("battery.getBatteryState.reply", 2, level(0.2))));
  const auto decision = see(m, state, message("battery.getBatteryState.reply", 3, level(0.19)));
  ASSERT_TRUE(decision);
  EXPECT_THAT(names(decision->witness), ElementsAre("battery.getBatteryState.reply@3"));
}

// Violated at the third event "e".
constexpr const char* kThird =
    "<state id='a'><transition event='e' target='b'/></state><state id='b'><transition event='e' target='c'/></state>"
    "<state id='c'><transition event='e' target='bad'/></state><state id='bad'/>";

Message from(std::string source, Message message) {
  message.source = std::move(source);
  return message;
}

TEST(RenamedEvents, ComeOnlyWhenTheirDataHaveChanged) {
  const Model m =
      model(kThird, {"bad"}, {{.event = "e", .on = {"s.get.reply"}, .data = {{"v", "result"}}, .when = "changed"}});
  State state = start(m, TimePoint{});
  const auto value = [&](int time, Value result) {
    return see(m, state, message("s.get.reply", time, Map{{"result", std::move(result)}})).has_value();
  };
  EXPECT_FALSE(value(1, 5));
  EXPECT_FALSE(value(2, 5));
  EXPECT_FALSE(value(3, 6));
  EXPECT_FALSE(value(4, 6));
  EXPECT_TRUE(value(5, 5));
}

TEST(RenamedEvents, ComeWhenAConditionOnThePresentAndTheLastValueHolds) {
  const Model m = model(kThird, {"bad"},
                        {{.event = "e",
                          .on = {"s.get.reply"},
                          .data = {{"v", "result"}},
                          .when = "value < 30 && !(last < 30) && args.id !== 9"}});
  State state = start(m, TimePoint{});
  const auto value = [&](int time, double result, int id = 1) {
    return see(m, state, message("s.get.reply", time, Map{{"args", Map{{"id", id}}}, {"result", result}})).has_value();
  };
  EXPECT_FALSE(value(1, 20));  // the first: nothing was below 30 before
  EXPECT_FALSE(value(2, 10));
  EXPECT_FALSE(value(3, 40));
  EXPECT_FALSE(value(4, 29, 9));
  EXPECT_FALSE(value(5, 40));
  EXPECT_FALSE(value(6, 20));
  EXPECT_FALSE(value(7, 40));
  EXPECT_TRUE(value(8, 20));
}

TEST(RenamedEvents, HaveSeveralSourcesAndRememberOneLastValue) {
  const Model m = model(
      kThird, {"bad"},
      {{.event = "e", .on = {"nav.goto*.request"}, .from = {"GoTo*"}, .data = {{"to", "args.name"}}, .when = "changed"},
       {.event = "e", .on = {"nav.stop.request", "nav.cancel.request"}, .data = {{"to", "''"}}, .when = "changed"}});
  EXPECT_TRUE(m.listens_to("nav.gotoA.request"));
  EXPECT_TRUE(m.listens_to("nav.cancel.request"));
  EXPECT_FALSE(m.listens_to("nav.gotoA.reply"));
  State state = start(m, TimePoint{});
  const auto goes = [&](int time, const char* who, const char* where) {
    return see(m, state, from(who, message("nav.gotoByName.request", time, Map{{"args", Map{{"name", where}}}})))
        .has_value();
  };
  EXPECT_FALSE(goes(1, "GoToKitchen", "kitchen"));
  EXPECT_FALSE(goes(2, "Somebody", "station"));
  EXPECT_FALSE(goes(3, "GoToHall", "kitchen"));
  EXPECT_FALSE(see(m, state, from("X", message("nav.stop.request", 4))));
  EXPECT_FALSE(see(m, state, from("X", message("nav.cancel.request", 5))));
  EXPECT_TRUE(goes(6, "GoToHall", "kitchen"));
}

TEST(RenamedEvents, WhatWasLastIsPartOfWhatDecides) {
  const Model m =
      model(kThird, {"bad"}, {{.event = "e", .on = {"s.get.reply"}, .data = {{"v", "result"}}, .when = "changed"}});
  const auto encoded = [&](std::vector<int> results) {
    Core core = begin(m, TimePoint{});
    int time = 0;
    for (const int result : results) step(m, core, message("s.get.reply", ++time, Map{{"result", result}}));
    std::string out;
    EXPECT_TRUE(encode(m, core, TimePoint(std::chrono::seconds(10)), out));
    return out;
  };
  EXPECT_EQ(encoded({5, 5}), encoded({5}));
  EXPECT_NE(encoded({5}), encoded({6}));
}

TEST(RenamedEvents, ThatDoNotParseAreErrorsWithTheirPlace) {
  const auto made = Model::make(
      {.name = "m",
       .chart = chart(kThird),
       .violated = {"bad"},
       .renames = {{.event = "good", .on = {"a"}},
                   {.event = "e", .on = {"a"}, .data = {{"v", "result +"}}, .span = {"sentree.yaml", 7, 3, 0}},
                   {.event = "f", .on = {"a"}, .when = "value <", .span = {"sentree.yaml", 8, 3, 0}}}});
  std::vector<std::string> said;
  for (const Diagnostic& diagnostic : made.diagnostics) said.push_back(to_string(diagnostic));
  EXPECT_THAT(
      said,
      ElementsAre(testing::StartsWith("sentree.yaml:7:3: event \"e\" of monitor \"m\": \"result +\" does not parse"),
                  testing::StartsWith("sentree.yaml:8:3: event \"f\" of monitor \"m\": \"value <\" does not parse")));
}

TEST(Monitor, AVetoIsAskedOfACopy) {
  const Model m = model(kLevel, {"bad"});
  const State state = start(m, TimePoint{});
  EXPECT_EQ(veto(m, state, message("level", 1, Map{{"value", 1}})), "it would enter \"bad\"");
  EXPECT_FALSE(veto(m, state, message("level", 1, Map{{"value", 50}})));
  EXPECT_EQ(state.verdict, Verdict::kUndecided);
}

TEST(Monitor, AGateThatIsViolatedAlreadyRefusesEverything) {
  const Model m = model(kLevel, {"bad"});
  State state = start(m, TimePoint{});
  ASSERT_TRUE(see(m, state, message("level", 1, Map{{"value", 1}})));
  EXPECT_EQ(veto(m, state, message("level", 2, Map{{"value", 50}})), "it is violated already");
}

TEST(Monitor, AChartThatExceedsABoundIsGivenUp) {
  const Model m = model(
      "<state id='a'><transition event='e' target='b'/></state><state id='b'><transition target='c'/></state>"
      "<state id='c'><transition target='b'/></state><state id='bad'/>",
      {"bad"});
  State state = start(m, TimePoint{});
  EXPECT_FALSE(see(m, state, message("e", 1)));
  ASSERT_TRUE(state.failure());
}

TEST(Monitor, WhoseScriptFailsIsGivenUpUnlessItsChartTakesThat) {
  const std::string failing =
      "<datamodel><data id='last' expr='null'/></datamodel>\n"
      "<state id='a'><transition event='e' cond='last.value > 3' target='bad'/>MORE</state><state id='bad'/>";
  const auto with = [&](const std::string& more) {
    std::string text = failing;
    return model(text.replace(text.find("MORE"), 4, more), {"bad"});
  };
  const Model silent = with("");
  State state = start(silent, TimePoint{});
  EXPECT_FALSE(see(silent, state, message("e", 1)));
  ASSERT_TRUE(state.failure());
  EXPECT_EQ(state.failure()->code, "monitor.script");
  EXPECT_EQ(state.failure()->span.line, 2) << to_string(*state.failure());
  const Model takes_it = with("<transition event='error.execution' target='bad'/>");
  state = start(takes_it, TimePoint{});
  EXPECT_TRUE(see(takes_it, state, message("e", 1)));
  EXPECT_FALSE(state.failure());
}

TEST(Monitor, RefusesWhatCanDecideNothing) {
  const auto unknown = Model::make(
      {.name = "m", .chart = chart(kLevel), .violated = {"bda"}, .renames = {}, .span = {"sentree.yaml", 4, 5, 0}});
  EXPECT_EQ(to_string(unknown.diagnostics.front()),
            "sentree.yaml:4:5: monitor \"m\": \"bda\" is no state of m.scxml; did you mean \"bad\"?");
  const auto none = Model::make({.name = "m", .chart = chart(kLevel), .violated = {}, .renames = {}, .span = {}});
  EXPECT_EQ(none.diagnostics.front().code, "monitor.no-verdict");
}

TEST(Monitor, OfAParallelChartStandsInTheRegionsThatMatter) {
  const Model watches = model(R"(<parallel id="p">
      <state id="battery"><state id="full"><transition event="drop" target="low"/></state>
        <state id="low"><transition event="move" target="bad"/></state></state>
      <state id="noise"><state id="quiet"/></state></parallel><final id="bad"/>)",
                              {"bad"});
  const State state = start(watches, {});
  EXPECT_EQ(standing(watches, state).says, "in state full of battery");
  const Model plain = model("<state id='idle'><transition event='e' target='bad'/></state><final id='bad'/>", {"bad"});
  EXPECT_EQ(standing(plain, start(plain, {})).says, "in state idle");
}

}  // namespace
}  // namespace sentree::monitor
