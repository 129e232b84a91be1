#include "sentree/verify/verify.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <ctime>
#include <filesystem>
#include <utility>

#include "sentree/base/temporary_folder.h"
#include "sentree/text/file.h"
#include "sentree/verify/any_reply.h"
#include "sentree/verify/detail/test_in_folder.h"
#include "sentree/verify/statistics.h"

namespace sentree::verify {
namespace {

using ::testing::_;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::Pair;
using ::testing::StartsWith;

const std::string kHead = "<scxml xmlns=\"http://www.w3.org/2005/07/scxml\" version=\"1.0\" datamodel=\"ecmascript\" ";

// A mission that asks a door at each tick until it is open.
class Verify : public InFolder {
 protected:
  Verify() : InFolder("verify") {}

  void SetUp() override {
    write("interfaces/door.thrift", "service Door { i32 ask() }\n");
    write("skills/Ask.scxml", kHead + R"(initial="asking"><state id="asking">
  <onentry><send type="thrift" target="door" event="ask"/></onentry>
  <transition event="door.ask.reply" cond="_event.data.result === 6" target="success"/>
  <transition event="door.ask.reply" target="failure"/><transition event="error" target="failure"/>
</state><final id="success"/><final id="failure"/></scxml>)");
    tree("<RetryUntilSuccessful num_attempts=\"2\"><Condition ID=\"Ask\"/></RetryUntilSuccessful>");
  }

  // Every 100 ms.
  void ask_until_it_is_open() {
    tree(
        "<RetryUntilSuccessful num_attempts=\"-1\"><Sequence><Sleep msec=\"100\"/><Condition ID=\"Ask\"/></Sequence>"
        "</RetryUntilSuccessful>");
  }
  // @param answer  Of the model, an expression.
  void model(const std::string& answer, const std::string& attributes = "") {
    write("models/door.scxml", kHead + R"(initial="there"><state id="there"><transition event="door.ask.request">
  <send type="thrift" target="door" event="ask.reply" )" +
                                   attributes + "><param name=\"result\" expr=\"" + answer +
                                   "\"/></send></transition></state></scxml>");
  }
  void requirements(const std::string& text) { write("r.req", "let said = reply(door.ask)\n" + text); }

  project::Plan plan(const std::string& more = "") {
    write("sentree.yaml",
          "mission: {file: mission.xml, rate: 10 Hz}\nservices: {door: {interface: door.thrift/Door, at: model}}\n"
          "models: [{file: models/door.scxml, name: keeper, serves: [door]}]\nmonitors: [{file: r.req}]\n" +
              more);
    auto project = project::load_project(folder_.path());
    EXPECT_TRUE(project.ok()) << to_string(project.diagnostics.front());
    auto prepared = project::prepare(with_models(project::plain_scenario(std::move(*project.value))));
    EXPECT_TRUE(prepared.ok()) << to_string(prepared.diagnostics.front());
    return std::move(prepared.value.value());
  }

  // Executes a counterexample again and gives what its monitor says of it.
  monitor::Verdict verdict_of(const Verification& found, const project::Plan& of) {
    const Judgement& judgement = found.judgements.front();
    auto prepared = project::prepare(counterexample(found.graph, judgement, of.scenario));
    EXPECT_TRUE(prepared.ok());
    const project::Plan& again = *prepared.value;
    const auto told = retell(again);
    EXPECT_TRUE(told);
    monitor::MonitorSet monitors(again.monitors, TimePoint{});
    std::vector<monitor::MonitorSet::Decided> decided;
    for (const Told& tick : *told) {
      for (const Message& message : tick.messages) monitors.observe(message, decided);
    }
    monitors.advance(TimePoint{} + again.scenario.duration, decided);
    return monitors.state(0).verdict;
  }
};

TEST_F(Verify, HoldsOnEveryBehaviourOrShowsOne) {
  model("pick('says', 1, 2, 6)");
  requirements("small \"It says little.\": always said <= 6.\n");
  const project::Plan holds = plan();
  const Verification all = verify(holds, {});
  ASSERT_THAT(all.errors, IsEmpty());
  EXPECT_TRUE(all.graph.complete);
  EXPECT_EQ(all.judgements.front().finding, Finding::kHolds);
  EXPECT_EQ(all.judgements.front().vacuous, "");

  requirements("small \"It says little.\": always said <= 5.\n");
  const project::Plan fails = plan();
  const Verification some = verify(fails, {});
  ASSERT_THAT(some.errors, IsEmpty());
  EXPECT_EQ(some.judgements.front().finding, Finding::kRefuted);
  EXPECT_EQ(some.judgements.front().observation, "door.ask.reply");
  EXPECT_EQ(some.judgements.front().path->edges.size(), 1U) << "the first tick can do it";
  EXPECT_EQ(verdict_of(some, fails), monitor::Verdict::kViolated);
}

TEST_F(Verify, SaysOfAScopeWhetherItNeverBeginsOrNeverEnds) {
  write("interfaces/door.thrift", "service Door { i32 ask() i32 other() }\n");
  model("pick('says', 1, 2)");
  requirements(
      "a: between said = 1 and reply(door.other) = 3, never said = 7.\n"
      "b: between said = 1 and said = 9, never said = 7.\n"
      "c: between said = 9 and said = 1, never said = 7.\n"
      "d: between said = 1 and said < 2, never said = 7.\n");
  const Verification found = verify(plan(), {});
  ASSERT_THAT(found.errors, IsEmpty());
  const auto why = [&](std::size_t i) { return found.judgements[i].vacuous; };
  EXPECT_EQ(why(0), "its scope never ends, and only what is closed counts");
  EXPECT_EQ(why(1), "its scope never ends, and only what is closed counts");
  EXPECT_EQ(why(2), "its scope never begins");
  EXPECT_EQ(why(3), "its scope never begins") << "what opens it closes it";
}

TEST_F(Verify, ShowsWhatTheEndOfTheMissionLeavesOpen) {
  model("pick('says', 1, 6)");
  requirements("answered: whenever said = 6, event(request(door.ask)) within 2 s.\n");
  const project::Plan of = plan();
  const Verification found = verify(of, {});
  ASSERT_THAT(found.errors, IsEmpty());
  const Judgement& judgement = found.judgements.front();
  EXPECT_EQ(judgement.finding, Finding::kHolds);
  ASSERT_TRUE(judgement.can_stay_open);
  const Judgement open = left_open(judgement);
  EXPECT_EQ(open.at, TimePoint{}) << "the first answer ends it";
  const project::Scenario example = counterexample(found.graph, open, of.scenario);
  EXPECT_THAT(example.verdicts, ElementsAre(std::pair<const std::string, std::string>("answered", "owed")));
  EXPECT_THAT(scenario_text(example, open, ""),
              HasSubstr("is open when the mission ends at 0.0 s, which is no violation"));
  auto prepared = project::prepare(example);
  ASSERT_TRUE(prepared.ok());
  const auto told = retell(*prepared.value);
  ASSERT_TRUE(told);
  monitor::MonitorSet monitors(prepared.value->monitors, TimePoint{});
  std::vector<monitor::MonitorSet::Decided> decided;
  for (const Told& tick : *told) {
    for (const Message& message : tick.messages) monitors.observe(message, decided);
  }
  EXPECT_EQ(monitors.state(0).verdict, monitor::Verdict::kUndecided);
  EXPECT_TRUE(monitor::standing(prepared.value->monitors[0], monitors.state(0)).pending);

  // Of what is refuted nothing else is said.
  ask_until_it_is_open();
  requirements("answered: whenever said = 1, said = 6 within 50 ms.\nopen: whenever said = 6, said = 1 within 2 s.\n");
  const Verification refuted = verify(plan(), {});
  EXPECT_EQ(refuted.judgements[0].finding, Finding::kRefuted);
  EXPECT_FALSE(refuted.judgements[0].can_stay_open);
  EXPECT_TRUE(refuted.judgements[1].can_stay_open);
}

// Two throws of a coin, of which the second one only is another value than before in half of all cases.
TEST_F(Verify, JudgesEventsOfMonitorsByWhatTheyAreMadeOf) {
  model("draw([[1/2, 1], [1/2, 2]])");
  requirements("small \"It says little.\": always said <= 2.\n");
  write("skills/Ask.scxml", kHead + R"(initial="first"><state id="first">
  <onentry><send type="thrift" target="door" event="ask"/></onentry>
  <transition event="door.ask.reply" target="second"/></state><state id="second">
  <onentry><send type="thrift" target="door" event="ask"/></onentry>
  <transition event="door.ask.reply" target="success"/></state><final id="success"/><final id="failure"/></scxml>)");
  tree("<Condition ID=\"Ask\"/>");
  write("twice.scxml", kHead + R"(initial="a"><state id="a"><transition event="new" target="b"/></state>
<state id="b"><transition event="new" target="violated"/></state><final id="violated"/></scxml>)");
  write("sentree.yaml",
        "mission: {file: mission.xml, rate: 10 Hz}\nservices: {door: {interface: door.thrift/Door, at: model}}\n"
        "models: [{file: models/door.scxml, name: keeper, serves: [door]}]\n"
        "monitors: [{file: twice.scxml, events: {new: {on: door.ask.reply, data: {v: result}, when: changed}}}]\n");
  auto project = project::load_project(folder_.path());
  ASSERT_TRUE(project.ok());
  const auto plan = project::prepare(with_models(project::plain_scenario(std::move(*project.value))));
  ASSERT_TRUE(plan.ok()) << to_string(plan.diagnostics.front());
  for (const bool remembers : {true, false}) {
    Asked asked;
    asked.explore.memory_of_steps = remembers;
    const Verification found = verify(*plan.value, asked);
    ASSERT_THAT(found.errors, IsEmpty());
    ASSERT_TRUE(found.judgements.front().least);
    EXPECT_NEAR(found.judgements.front().least->low, 0.5, 1e-9);
  }
}

TEST_F(Verify, RefusesMonitorsOfWhatIsSaidInRunsOnly) {
  model("pick('says', 1, 6)");
  requirements("never_told: never event(observation(monitor.violated)).\n");
  EXPECT_EQ(verify(plan(), {}).errors.front().code, "verify.monitor");
  requirements("first: never observation(scenario.injection).id = 2.\n");
  Asked asked;
  asked.explore.faults.emplace_back(project::intervention::Unreachable{.call = "door.ask"});
  const Verification counted = verify(plan(), asked);
  ASSERT_FALSE(counted.errors.empty());
  EXPECT_EQ(counted.errors.front().code, "verify.clock");
}

TEST_F(Verify, ExecutesSkillsOfOtherProcessesHere) {
  model("pick('says', 1, 6)");
  requirements("small \"It says little.\": always said <= 5.\n");
  const project::Plan of = plan("skills: {Ask: {at: \"tcp://127.0.0.1:9\"}}\n");
  const Verification found = verify(of, {});
  ASSERT_THAT(found.errors, IsEmpty());
  ASSERT_EQ(found.judgements.front().finding, Finding::kRefuted);
  // So does the scenario that shows it.
  const auto example = counterexample(found.graph, found.judgements.front(), of.scenario);
  write("found.yaml", scenario_text(example, found.judgements.front(), "."));
  const auto again = project::load_scenario(folder_.path() / "found.yaml");
  ASSERT_TRUE(again.ok()) << to_string(again.diagnostics.front());
  EXPECT_EQ(again.value->project.skills.front().at, "");
  const auto prepared = project::prepare(*again.value);
  EXPECT_TRUE(prepared.ok()) << to_string(prepared.diagnostics.front());
}

TEST_F(Verify, GivesTheProbabilityOfADie) {
  model("draw([[1/6, 1], [1/6, 2], [1/6, 3], [1/6, 4], [1/6, 5], [1/6, 6]])");
  requirements("never_six \"No six.\": always said <= 5.\n");
  const Verification found = verify(plan(), {});
  ASSERT_THAT(found.errors, IsEmpty());
  ASSERT_TRUE(found.judgements.front().least);
  // Two throws: 1 - (5/6)².
  EXPECT_NEAR(found.judgements.front().least->low, 11.0 / 36, 1e-9);
  EXPECT_NEAR(found.judgements.front().greatest->high, 11.0 / 36, 1e-9);
}

TEST(Probability, IsToldAsFarAsItIsKnown) {
  const auto told = [](double least_low, double least_high, double greatest_low, double greatest_high) {
    return to_string(Judgement::Probability{least_low, least_high}, {greatest_low, greatest_high});
  };
  EXPECT_EQ(told(0.027, 0.027, 0.027, 0.027), "0.027");
  EXPECT_EQ(told(0, 0, 0, 0), "0");
  EXPECT_EQ(told(1, 1, 1, 1), "1");
  EXPECT_EQ(told(0, 0, 0.5, 0.5), "0 to 0.5, as what is left open is chosen");
  EXPECT_EQ(told(11.0 / 36 - 1e-11, 11.0 / 36, 11.0 / 36, 11.0 / 36 + 1e-11), "0.305555556");
  EXPECT_EQ(told(11.0 / 36 - 1e-8, 11.0 / 36, 11.0 / 36, 11.0 / 36 + 1e-8), "0.305556");
  // What can happen is not told to have probability 0, and digits that are not known are not told.
  EXPECT_EQ(told(0, 1e-14, 0, 1e-14), "at most 1e-14");
  EXPECT_EQ(told(9.5e-10, 1.05e-9, 1e-9, 1e-9), "between 9.5e-10 and 1.05e-09");
  EXPECT_EQ(told(0.1, 0.3, 0.4, 0.4), "between 0.1 and 0.3 to 0.4, as what is left open is chosen");
}

// Of a ten-thousand-millionth, a ten-thousand-millionth.
TEST_F(Verify, GivesWhatIsRareAsPrecisely) {
  ask_until_it_is_open();
  write("models/door.scxml", kHead + R"xml(initial="t">
  <datamodel><data id="k" expr="0"/><data id="z" expr="1"/></datamodel>
  <state id="t"><transition event="door.ask.request">
  <if cond="k === 0"><assign location="k" expr="draw([[0.0000000002, 1], [0.9999999998, 2]])"/>
  <elseif cond="k === 1"/><assign location="z" expr="draw([[0.98, 1], [0.01, 2], [0.01, 6]])"/>
  <else/><assign location="z" expr="6"/></if>
  <send type="thrift" target="door" event="ask.reply"><param name="result" expr="z"/></send></transition></state></scxml>)xml");
  requirements("two \"Two is never said.\": never said = 2.\n");
  const Verification found = verify(plan(), {});
  ASSERT_THAT(found.errors, IsEmpty());
  ASSERT_TRUE(found.judgements.front().least);
  EXPECT_NEAR(found.judgements.front().least->low, 1e-10, 1e-19);
  EXPECT_NEAR(found.judgements.front().greatest->high, 1e-10, 1e-19);
  EXPECT_FALSE(found.judgements.front().improbable_states);
  // Of more states than one wants to wait for it is told that it was left out; the verdict is as before.
  Asked hurried;
  hurried.judge.probable_states = 3;
  const Verification known = verify(plan(), hurried);
  EXPECT_EQ(known.judgements.front().finding, Finding::kRefuted);
  EXPECT_EQ(known.judgements.front().at, found.judgements.front().at);
  EXPECT_FALSE(known.judgements.front().least);
  EXPECT_EQ(known.judgements.front().improbable_states, 3U);
}

// Nobody has to come to a choice that is said to be fair.
TEST_F(Verify, TakesFairnessOfWhatIsNeverChosen) {
  write("models/door.scxml", kHead + R"xml(initial="t"><datamodel><data id="k" expr="0"/></datamodel><state id="t">
  <transition event="door.ask.request"><send type="thrift" target="door" event="ask.reply">
  <param name="result" expr="k &gt; 0 ? pick('says', 1, 2) : 6"/></send></transition></state></scxml>)xml");
  requirements("six \"Six is said.\": eventually said = 6.\n");
  Asked asked;
  asked.judge.fair = {"keeper.says"};
  EXPECT_THAT(verify(plan(), asked).errors, IsEmpty());
  asked.judge.fair = {"keeper.say"};
  EXPECT_THAT(verify(plan(), asked).errors.front().message, HasSubstr("did you mean \"keeper.says\"?"));
}

TEST_F(Verify, EstimatesWhatItCanCompute) {
  model("draw([[5/6, 1], [1/6, 6]])");
  requirements("never_six \"No six.\": always said <= 5.\n");
  const project::Plan of = plan();
  std::uint64_t violated = 0;
  Sampling sampling;
  sampling.runs = 4'000;
  sampling.length = std::chrono::seconds(10);
  sampling.told = [&](const std::vector<Came>& run) {
    violated += run.front() == Came::kViolated ? 1U : 0U;
    return true;
  };
  ASSERT_EQ(sample(of, sampling), sampling.runs);
  // Four standard deviations around 1 - (5/6)².
  EXPECT_NEAR(static_cast<double>(violated) / 4'000, 11.0 / 36, 4 * std::sqrt(11.0 / 36 * 25.0 / 36 / 4'000));
  const std::uint64_t first = std::exchange(violated, 0);
  ASSERT_TRUE(sample(of, sampling));
  EXPECT_EQ(violated, first) << "the same seed throws the same";
}

TEST_F(Verify, GivesTheLeastAndTheGreatestProbability) {
  // Before each throw somebody picks one of two dice.
  model("pick('die', 1, 2) === 1 ? draw([[0.9, 1], [0.1, 6]]) : draw([[0.5, 1], [0.5, 6]])");
  requirements("never_six \"No six.\": always said <= 5.\n");
  const Verification found = verify(plan(), {});
  ASSERT_THAT(found.errors, IsEmpty());
  const Judgement& judgement = found.judgements.front();
  ASSERT_TRUE(judgement.least && judgement.greatest);
  // A six ends it, so there is a second throw only after the first gave none.
  EXPECT_NEAR(judgement.least->low, 1 - 0.9 * 0.9, 1e-9);
  EXPECT_NEAR(judgement.least->high, 1 - 0.9 * 0.9, 1e-9);
  EXPECT_NEAR(judgement.greatest->low, 1 - 0.5 * 0.5, 1e-9);
  EXPECT_NEAR(judgement.greatest->high, 1 - 0.5 * 0.5, 1e-9);
}

// The way there counts as much as once round: staying at 1 takes fewer ticks than 0, 1, 2.
TEST_F(Verify, ShowsALoopOfTheFewestTicks) {
  ask_until_it_is_open();
  write("models/door.scxml", kHead + R"xml(initial="t"><datamodel><data id="n" expr="0"/></datamodel><state id="t">
  <transition event="door.ask.request"><if cond="n === 1"><assign location="n" expr="pick('next', 2, 1)"/>
  <else/><assign location="n" expr="(n + 1) % 3"/></if>
  <send type="thrift" target="door" event="ask.reply"><param name="result" expr="n"/></send></transition></state></scxml>)xml");
  requirements("opens \"It opens.\": eventually said = 6.\n");
  const Verification found = verify(plan(), {});
  ASSERT_THAT(found.errors, IsEmpty());
  const Judgement& judgement = found.judgements.front();
  ASSERT_EQ(judgement.finding, Finding::kRefuted);
  ASSERT_TRUE(judgement.path->loop);
  EXPECT_EQ(judgement.path->edges.size() - *judgement.path->loop, 1U);
  EXPECT_EQ(judgement.at, TimePoint{} + found.graph.period * static_cast<std::int64_t>(*judgement.path->loop))
      << "the time of the tick with which it begins";
  EXPECT_EQ(verdict_of(found, plan()), monitor::Verdict::kUndecided) << "it owes for ever";
}

TEST_F(Verify, LeavesALoopOnlyWhereItIsFair) {
  ask_until_it_is_open();
  model("pick('says', 1, 6)");
  requirements("opens \"It opens in the end.\": whenever said = 1, door shall said = 6 eventually.\n");
  const project::Plan of = plan();
  const Verification unfair = verify(of, {});
  ASSERT_THAT(unfair.errors, IsEmpty());
  ASSERT_TRUE(unfair.graph.complete);
  ASSERT_EQ(unfair.judgements.front().finding, Finding::kRefuted);
  EXPECT_TRUE(unfair.judgements.front().path->loop.has_value());
  EXPECT_THAT(unfair.judgements.front().avoided, ElementsAre("keeper.says = 6"));
  EXPECT_EQ(verdict_of(unfair, of), monitor::Verdict::kUndecided) << "no end of it is seen";

  Asked asked;
  asked.judge.fair = {"keeper.says"};
  EXPECT_EQ(verify(of, asked).judgements.front().finding, Finding::kHolds);
  asked.judge.fair = {"keeper.sais"};
  EXPECT_THAT(to_string(verify(of, asked).errors.front()), HasSubstr("did you mean \"keeper.says\"?"));
}

TEST_F(Verify, NamesWhatIsNotFairAlready) {
  ask_until_it_is_open();
  model("pick('mode', 'skip', 'try') === 'try' &amp;&amp; pick('open', false, true) ? 6 : 1");
  requirements("opens \"It opens in the end.\": whenever said = 1, door shall said = 6 eventually.\n");
  const project::Plan of = plan();
  Asked asked;
  EXPECT_THAT(verify(of, asked).judgements.front().avoided, testing::SizeIs(2));
  asked.judge.fair = {"keeper.mode"};
  EXPECT_THAT(verify(of, asked).judgements.front().avoided, ElementsAre("keeper.open = true"));
}

TEST_F(Verify, TellsWhereAChoiceWithoutANameStands) {
  ask_until_it_is_open();
  model("choose(1, 6)");
  requirements("opens \"It opens in the end.\": whenever said = 1, door shall said = 6 eventually.\n");
  const project::Plan of = plan();
  EXPECT_THAT(verify(of, {}).judgements.front().avoided, ElementsAre("keeper = 6 at models/door.scxml:2"));
  Asked asked;
  asked.judge.all_fair = true;
  EXPECT_THAT(verify(of, asked).judgements.front().fair, ElementsAre("keeper at models/door.scxml:2"));
}

TEST_F(Verify, JudgesGatesAsARunDoes) {
  model("pick('says', 1, 6)");
  requirements(
      "never_asked_again \"After a 1 nobody asks.\": after event(reply(door.ask)), never event(request(door.ask)).\n");
  // Closed by the first answer that is no 6.
  write("monitors/gate.scxml", kHead + R"(initial="open"><state id="open">
  <transition event="door.ask.reply" cond="_event.data.result !== 6" target="closed"/></state>
<state id="closed"><transition event="door.ask.request" target="asked"/></state><state id="asked"/></scxml>)");
  const auto with = [&](const std::string& gate) {
    write("sentree.yaml",
          "mission: {file: mission.xml, rate: 10 Hz}\nservices: {door: {interface: door.thrift/Door, at: model}}\n"
          "models: [{file: models/door.scxml, name: keeper, serves: [door]}]\n"
          "monitors: [{file: r.req}, {file: monitors/gate.scxml, violated: [asked]" +
              gate + "}]\n");
    auto project = project::load_project(folder_.path());
    EXPECT_TRUE(project.ok()) << to_string(project.diagnostics.front());
    auto prepared = project::prepare(with_models(project::plain_scenario(std::move(*project.value))));
    EXPECT_TRUE(prepared.ok()) << to_string(prepared.diagnostics.front());
    return std::move(prepared.value.value());
  };
  const Verification open = verify(with(""), {});
  ASSERT_THAT(open.errors, IsEmpty());
  EXPECT_EQ(open.judgements[0].finding, Finding::kRefuted) << "it is tried twice";
  EXPECT_EQ(open.judgements[1].finding, Finding::kRefuted);
  const project::Plan gated = with(", gate: [door.*]");
  for (const bool memory : {true, false}) {
    Asked asked;
    asked.explore.memory_of_steps = memory;
    const Verification shut = verify(gated, asked);
    ASSERT_THAT(shut.errors, IsEmpty());
    EXPECT_EQ(shut.judgements[0].finding, Finding::kHolds);
    EXPECT_EQ(shut.judgements[1].finding, Finding::kHolds);
  }
}

TEST_F(Verify, ComparesStatesIfAskedTo) {
  ask_until_it_is_open();
  model("pick('says', 1, 6)");
  requirements("small \"It says little.\": always said <= 6.\n");
  const project::Plan of = plan();
  Asked asked;
  asked.explore.exact = true;
  const Verification exact = verify(of, asked);
  ASSERT_THAT(exact.errors, IsEmpty());
  EXPECT_TRUE(exact.graph.complete);
  EXPECT_EQ(exact.graph.nodes, verify(of, {}).graph.nodes);
}

TEST_F(Verify, RefusesAModelWhoseFunctionsKeepSomething) {
  write("models/door.scxml", kHead + R"x(initial="there"><script>
var next = (function () { var n = 0; return function () { n = (n + 1) % 3; return n; }; })();</script>
<state id="there"><transition event="door.ask.request"><send type="thrift" target="door" event="ask.reply"><param
name="result" expr="next()"/></send></transition></state></scxml>)x");
  requirements("zero: never said = 0.\n");
  const project::Plan of = plan();
  for (const bool memory : {true, false}) {
    Asked asked;
    asked.explore.memory_of_steps = memory;
    const Verification found = verify(of, asked);
    ASSERT_EQ(found.errors.size(), 1U);
    EXPECT_EQ(found.errors.front().code, "scxml.no-value-form");
    EXPECT_THAT(found.errors.front().message, testing::HasSubstr("\"next\""));
    EXPECT_THAT(found.errors.front().span.file, testing::HasSubstr("door.scxml"));
  }
}

TEST_F(Verify, TriesFaults) {
  model("6");
  requirements("answers \"It answers.\": never node(Ask) in FAILURE.\n");
  const project::Plan of = plan("verify: {faults: {at_most: 1, any_of: [{kill: door}]}}\n");
  EXPECT_EQ(verify(of, {}).judgements.front().finding, Finding::kHolds);
  Asked asked;
  asked.explore.faults = of.scenario.project.verify.faults;
  ASSERT_EQ(asked.explore.faults.size(), 1U);
  const Verification found = verify(of, asked);
  ASSERT_EQ(found.judgements.front().finding, Finding::kRefuted);
  EXPECT_EQ(counterexample(found.graph, found.judgements.front(), of.scenario).timeline.size(), 1U);
}

TEST_F(Verify, TriesCallsThatAreUnreachableOrLate) {
  model("6");
  requirements("answers \"It answers.\": never node(Ask) in FAILURE.\n");
  for (const char* const fault : {"unreachable: door.ask", "late: door.*"}) {
    SCOPED_TRACE(fault);
    const project::Plan of = plan("verify: {faults: {any_of: [{" + std::string(fault) + "}]}}\n");
    for (const bool memory : {true, false}) {
      Asked asked;
      asked.explore.memory_of_steps = memory;
      EXPECT_EQ(verify(of, asked).judgements.front().finding, Finding::kHolds);
      asked.explore.faults = of.scenario.project.verify.faults;
      ASSERT_EQ(asked.explore.faults.size(), 1U);
      const Verification found = verify(of, asked);
      ASSERT_THAT(found.errors, IsEmpty());
      ASSERT_EQ(found.judgements.front().finding, Finding::kRefuted);
      const project::Scenario example = counterexample(found.graph, found.judgements.front(), of.scenario);
      ASSERT_EQ(example.timeline.size(), 1U);
      EXPECT_EQ(example.timeline.front().what, asked.explore.faults.front());
      EXPECT_EQ(verdict_of(found, of), monitor::Verdict::kViolated);
    }
  }
}

TEST_F(Verify, EndsFaultsByTheirNumberBesideThoseOfTheScenario) {
  ask_until_it_is_open();
  model("5");
  requirements("stays \"What is wrong stays so.\": after said = 1, never said = 5.\n");
  const project::Plan plain = plan("verify: {faults: {any_of: [{falsify: {call: door.ask, value: 1}}]}}\n");
  project::Scenario scenario = plain.scenario;
  scenario.delays.push_back({.message = "door.ask.reply", .by = std::chrono::milliseconds(10), .span = {}});
  const auto delayed = project::prepare(std::move(scenario));
  ASSERT_TRUE(delayed.ok()) << to_string(delayed.diagnostics.front());
  Asked asked;
  asked.explore.faults = plain.scenario.project.verify.faults;
  const Verification found = verify(*delayed.value, asked);
  ASSERT_THAT(found.errors, IsEmpty());
  ASSERT_EQ(found.judgements.front().finding, Finding::kRefuted);
  EXPECT_EQ(verdict_of(found, *delayed.value), monitor::Verdict::kViolated);
}

TEST_F(Verify, RefusesWhatNeverComesAgain) {
  model("Math.random() &lt; 0.5 ? 1 : 6");
  requirements("small \"It says little.\": always said <= 6.\n");
  EXPECT_THAT(to_string(verify(plan(), {}).errors.front()), HasSubstr("model keeper asks for Math.random"));
  model("6");
  for (const char* const condition : {"_event.data.tick == 3", "JSON.stringify(_event.data).length == 3"}) {
    write("late.scxml", kHead + "initial=\"a\"><state id=\"a\">\n<transition event=\"door.ask.reply\" cond=\"" +
                            condition + "\" target=\"bad\"/></state><final id=\"bad\"/></scxml>");
    write("sentree.yaml",
          "mission: {file: mission.xml, rate: 10 Hz}\nservices: {door: {interface: door.thrift/Door, at: model}}\n"
          "models: [{file: models/door.scxml, name: keeper, serves: [door]}]\n"
          "monitors: [{file: late.scxml, violated: [bad]}]\n");
    auto project = project::load_project(folder_.path());
    ASSERT_TRUE(project.ok());
    const auto prepared = project::prepare(with_models(project::plain_scenario(std::move(*project.value))));
    ASSERT_TRUE(prepared.ok());
    const Verification found = verify(*prepared.value, {});
    ASSERT_FALSE(found.errors.empty());
    EXPECT_THAT(to_string(found.errors.front()), AllOf(StartsWith((folder_.path() / "late.scxml:2:").string()),
                                                       HasSubstr("monitor late looks at the ")));
  }
}

// Who is invoked is known by its id, however often it is.
TEST_F(Verify, FollowsTheCallsOfInvokedCharts) {
  const auto verified = [&](const std::string& invoke) {
    write("skills/Ask.scxml", kHead + "initial=\"asking\"><state id=\"asking\">" + invoke + R"(<content><scxml
  xmlns="http://www.w3.org/2005/07/scxml" version="1.0" datamodel="ecmascript"><state id="a">
  <onentry><send type="thrift" target="door" event="ask"/></onentry>
  <transition event="door.ask.reply" cond="_event.data.result === 6" target="open"/>
  <transition event="door.ask.reply error" target="end"/></state>
  <final id="open"><onentry><send target="#_parent" event="opened"/></onentry></final><final id="end"/></scxml></content>
  </invoke><transition event="opened" target="success"/>
  <transition event="done.invoke" target="failure"/></state><final id="success"/><final id="failure"/></scxml>)");
    return verify(plan(), {});
  };
  model("pick('says', 1, 2, 6)");
  requirements("small \"It says little.\": always said <= 5.\n");
  const Verification named = verified("<invoke type=\"scxml\" id=\"asker\">");
  ASSERT_THAT(named.errors, IsEmpty());
  EXPECT_TRUE(named.graph.complete);
  EXPECT_EQ(named.judgements.front().finding, Finding::kRefuted);
  EXPECT_EQ(verdict_of(named, plan()), monitor::Verdict::kViolated);
  const Verification unnamed = verified("<invoke type=\"scxml\">");
  ASSERT_FALSE(unnamed.errors.empty());
  EXPECT_THAT(unnamed.errors.front().message, HasSubstr("an <invoke> without id begins, so that no state of it ever "
                                                        "comes again; give it an id"));
}

// An id that the engine makes up is never the same again, which matters to who reads it.
TEST_F(Verify, RefusesToTakeIdsThatAreReadForOthers) {
  const auto told = [&](const std::string& answer) {
    write("models/door.scxml", kHead + R"(initial="t"><datamodel><data id="i" expr="''"/></datamodel><state id="t">
  <transition event="door.ask.request"><send idlocation="i" event="q" delay="10ms"/>
  <send type="thrift" target="door" event="ask.reply"><param name="result" expr=")" +
                                   answer + R"("/></send></transition><transition event="q"/></state></scxml>)");
    const Verification found = verify(plan(), {});
    return found.errors.empty() ? "" : found.errors.front().message;
  };
  ask_until_it_is_open();
  requirements("small \"It says little.\": always said <= 4.\n");
  EXPECT_EQ(told("1"), "");
  EXPECT_EQ(told("i == null ? 6 : 1"), "");
  EXPECT_THAT(told("Number(i.slice(-1)) === 5 ? 6 : 1"),
              HasSubstr("asks for the spelling of an id that the engine makes up, so that no state of it ever comes "
                        "again; compare ids"));
}

TEST_F(Verify, SaysWhichAnswerIsNone) {
  model("JSON.parse('[&quot;six&quot;]')[0]");
  requirements("small \"It says little.\": always said <= 6.\n");
  const Verification found = verify(plan(), {});
  ASSERT_FALSE(found.errors.empty());
  EXPECT_EQ(found.errors.front().code, "verify.reply");
  EXPECT_THAT(to_string(found.errors.front()), HasSubstr("door.scxml:2"));
}

TEST_F(Verify, RefusesAModelThatLeavesNothingOpen) {
  requirements("small \"It says little.\": always said <= 6.\n");
  // What can be told before anything runs, `check` tells.
  for (const char* const wrong : {"choose.apply(null)", "between('ab'.length, 1)", "pick.apply(null, ['says'])",
                                  "chance('ab'.length)", "draw([[0.5 * 'a'.length, 1]])", "choose(undefined, 1)",
                                  "choose(NaN, 'NaN')", "pick('says', 1 / 0, 'Infinity')"}) {
    model(wrong);
    const Verification found = verify(plan(), {});
    ASSERT_FALSE(found.errors.empty()) << wrong;
    EXPECT_EQ(found.errors.front().code, "verify.choice") << wrong;
    EXPECT_THAT(to_string(found.errors.front()), HasSubstr("door.scxml:2:")) << "where it is called";
    EXPECT_THAT(to_string(found.errors.front()), HasSubstr("model keeper: "));
    EXPECT_THAT(to_string(found.errors.front()), HasSubstr("(tick 1)"));
  }
}

TEST_F(Verify, RefusesTooManyAlternativesWhereTheyStand) {
  requirements("small \"It says little.\": always said <= 20000.\n");
  model("between(0, 20000)");
  const Verification found = verify(plan(), {});
  ASSERT_FALSE(found.errors.empty());
  EXPECT_EQ(found.errors.front().span.file, (folder_.path() / "models/door.scxml").string());
  EXPECT_EQ(found.errors.front().span.line, 2);
}

TEST_F(Verify, RefusesAModelThatDoesNotComeToRest) {
  write("models/door.scxml", kHead + R"(initial="there"><state id="there">
  <transition event="door.ask.request" target="here"/></state>
  <state id="here"><transition target="back"/></state><state id="back"><transition target="here"/></state></scxml>)");
  requirements("small \"It says little.\": always said <= 6.\n");
  const Verification found = verify(plan(), {});
  ASSERT_FALSE(found.errors.empty());
  EXPECT_EQ(found.errors.front().code, "verify.endless");
  EXPECT_THAT(to_string(found.errors.front()), HasSubstr("the model keeper was given up"));
}

TEST_F(Verify, SaysWhoAnswersWhomForEverWithoutTimePassing) {
  requirements("small \"It says little.\": always said <= 6.\n");
  model("1");
  write("skills/Ask.scxml", kHead + R"(initial="asking"><state id="asking">
  <onentry><send type="thrift" target="door" event="ask"/></onentry>
  <transition event="door.ask.reply" cond="_event.data.result === 6" target="success"/>
  <transition event="door.ask.reply" target="asking"/><transition event="error" target="failure"/>
</state><final id="success"/><final id="failure"/></scxml>)");
  for (const bool remembers : {false, true}) {
    Asked asked;
    asked.explore.memory_of_steps = remembers;
    const Verification found = verify(plan(), asked);
    ASSERT_FALSE(found.errors.empty());
    EXPECT_EQ(found.errors.front().code, "verify.endless");
    EXPECT_THAT(to_string(found.errors.front()),
                AllOf(HasSubstr("skills/Ask.scxml"), HasSubstr("models/door.scxml"),
                      HasSubstr("answer each other for ever"), HasSubstr("keeper gets door.ask.request of Ask"),
                      HasSubstr("Ask gets door.ask.reply"), HasSubstr("a <send> with a delay")));
  }
}

TEST_F(Verify, LetsPartsSayMuchAtOneInstantIfTheyComeToAnEnd) {
  requirements("small \"It says little.\": always said <= 6.\n");
  write("models/door.scxml", kHead + R"(initial="there"><datamodel><data id="n" expr="0"/></datamodel><state id="there">
  <transition event="door.ask.request"><assign location="n" expr="n + 1"/>
  <send type="thrift" target="door" event="ask.reply"><param name="result" expr="n &lt; 30000 ? 1 : 6"/></send>
  </transition></state></scxml>)");
  write("skills/Ask.scxml", kHead + R"(initial="asking"><state id="asking">
  <onentry><send type="thrift" target="door" event="ask"/></onentry>
  <transition event="door.ask.reply" cond="_event.data.result === 6" target="success"/>
  <transition event="door.ask.reply" target="asking"/><transition event="error" target="failure"/>
</state><final id="success"/><final id="failure"/></scxml>)");
  Asked asked;
  asked.explore.memory_of_steps = false;
  const Verification found = verify(plan(), asked);
  ASSERT_THAT(found.errors, IsEmpty());
  EXPECT_EQ(found.judgements.front().finding, Finding::kHolds);
}

TEST_F(Verify, StopsAtItsLimits) {
  ask_until_it_is_open();
  model("fresh() + 10");
  requirements("small \"It says little.\": always said <= 1000000.\n");
  Asked asked;
  asked.explore.states = 50;
  const Verification few = verify(plan(), asked);
  EXPECT_FALSE(few.graph.complete);
  EXPECT_THAT(few.graph.limit, HasSubstr("50 states"));
  EXPECT_EQ(few.judgements.front().finding, Finding::kUnknown);
  asked.explore = {};
  asked.explore.ticks = 7;
  EXPECT_EQ(verify(plan(), asked).graph.complete_to, 7U);
  asked.explore = {};
  asked.explore.time = std::chrono::nanoseconds(0);
  EXPECT_EQ(verify(plan(), asked).graph.limit, "the limit of time");
  asked.explore = {};
  asked.explore.memory = 1;
  EXPECT_THAT(verify(plan(), asked).graph.limit, HasSubstr("the limit of memory"));
  asked.explore = {};
  asked.explore.interrupted = [] { return true; };
  EXPECT_EQ(verify(plan(), asked).graph.limit, "interrupted");
}

TEST_F(Verify, TellsWhatItFoundWhereAPeriodGoesOnInTooManyWays) {
  std::string asks;
  for (int i = 0; i < 17; ++i) asks += "<Condition ID=\"Ask\" name=\"A" + std::to_string(i) + "\"/>";
  tree("<ParallelAll>" + asks + "</ParallelAll>");
  model("pick('way', 6, 1)");
  requirements("six: never said = 1.\nseven: never said = 7.\n");
  const Verification found = verify(plan(), {});
  ASSERT_THAT(found.errors, IsEmpty());
  EXPECT_FALSE(found.graph.complete);
  EXPECT_EQ(found.graph.complete_to, 0U);
  EXPECT_THAT(found.graph.limit, AllOf(HasSubstr("tick 1 can go on in more than 100000 ways"),
                                       HasSubstr("17 times keeper.way of 2"), HasSubstr("--runs")));
  EXPECT_EQ(found.judgements[0].finding, Finding::kRefuted);
  EXPECT_EQ(found.judgements[1].finding, Finding::kUnknown);
}

TEST_F(Verify, StopsAtItsLimitOfMemoryWhileItJudges) {
  ask_until_it_is_open();
  model("1");
  requirements("six: never said = 6.\n");
  write("monitors/counts.scxml", kHead + R"(initial="w"><datamodel><data id="n" expr="0"/></datamodel><state id="w">
  <transition event="door.ask.reply" cond="n > 100000000" target="bad"/>
  <transition event="door.ask.reply"><assign location="n" expr="n + 1"/></transition></state><state id="bad"/></scxml>)");
  write("sentree.yaml",
        "mission: {file: mission.xml, rate: 10 Hz}\nservices: {door: {interface: door.thrift/Door, at: model}}\n"
        "models: [{file: models/door.scxml, name: keeper, serves: [door]}]\n"
        "monitors: [{file: r.req}, {file: monitors/counts.scxml, violated: [bad]}]\n");
  auto project = project::load_project(folder_.path());
  ASSERT_TRUE(project.ok()) << to_string(project.diagnostics.front());
  const auto prepared = project::prepare(with_models(project::plain_scenario(std::move(*project.value))));
  ASSERT_TRUE(prepared.ok());
  Asked asked;
  asked.explore.memory = 20'000'000;
  const Verification found = verify(*prepared.value, asked);
  EXPECT_TRUE(found.graph.complete);
  EXPECT_EQ(found.judgements[0].finding, Finding::kHolds);
  EXPECT_EQ(found.judgements[1].finding, Finding::kUnknown);
  EXPECT_THAT(found.judgements[1].limit,
              AllOf(HasSubstr("the limit of memory"), HasSubstr("most values had n"), HasSubstr("--memory")));
}

// A period is not gone through to its end if it takes more.
TEST_F(Verify, StopsAtItsLimitsWithinAPeriod) {
  model("6");
  std::string asks;
  for (int i = 0; i < 400; ++i) asks += "<Condition ID=\"Ask\" name=\"A" + std::to_string(i) + "\"/>";
  tree("<Sequence>" + asks + "</Sequence>");
  requirements("small: always said <= 6.\n");
  Asked asked;
  const Verification all = verify(plan(), asked);
  ASSERT_TRUE(all.graph.complete);
  EXPECT_EQ(all.graph.nodes.size(), 2U);
  asked.explore.memory = 500'000;
  const Verification few = verify(plan(), asked);
  EXPECT_EQ(few.graph.limit, "the limit of memory (0 MB; --memory)");
  EXPECT_EQ(few.graph.nodes.size(), 1U);
}

// A timer that drifts against the ticks leaves many ages of a state behind.
TEST_F(Verify, TakesNoLongerForEachOfManyDelays) {
  model("1");
  write("models/door.scxml", kHead + R"(initial="t"><datamodel><data id="k" expr="0"/></datamodel><state id="t">
  <onentry><send event="x" delay="100ms"/></onentry>
  <transition event="x" target="t"><assign location="k" expr="1 - k"/></transition><transition event="door.ask.request">
  <send type="thrift" target="door" event="ask.reply"><param name="result" expr="k"/></send></transition></state></scxml>)");
  tree("<KeepRunningUntilFailure><ForceSuccess><Condition ID=\"Ask\"/></ForceSuccess></KeepRunningUntilFailure>");
  requirements("nine: never said = 9.\n");
  write("sentree.yaml",
        "mission: {file: mission.xml, rate: 3 Hz}\nservices: {door: {interface: door.thrift/Door, at: model}}\n"
        "models: [{file: models/door.scxml, name: keeper, serves: [door]}]\nmonitors: [{file: r.req}]\n");
  auto project = project::load_project(folder_.path());
  ASSERT_TRUE(project.ok()) << to_string(project.diagnostics.front());
  const auto prepared = project::prepare(with_models(project::plain_scenario(std::move(*project.value))));
  ASSERT_TRUE(prepared.ok());
  const auto takes = [&](std::uint64_t ticks) {
    Options options;
    options.ticks = ticks;
    const std::clock_t began = std::clock();
    EXPECT_EQ(explore(*prepared.value, options)->complete_to, ticks);
    return static_cast<double>(std::clock() - began);
  };
  // Four times as many would take sixteen times as long.
  const double few = std::min(takes(5'000), takes(5'000));
  EXPECT_LT(std::min(takes(20'000), takes(20'000)), 10 * few);
}

TEST_F(Verify, SaysWhatGrowsWithoutEnd) {
  ask_until_it_is_open();
  write("models/door.scxml",
        kHead + R"(initial="there"><datamodel><data id="asked" expr="10"/><data id="odd" expr="0"/></datamodel>
<state id="there"><transition event="door.ask.request">
  <assign location="asked" expr="asked + 1"/><assign location="odd" expr="asked % 2"/>
  <send type="thrift" target="door" event="ask.reply"><param name="result" expr="asked + odd"/></send>
</transition></state></scxml>)");
  requirements("small \"It says little.\": always said <= 1000000.\n");
  Asked asked;
  asked.explore.states = 50;
  const Graph counts = verify(plan(), asked).graph;
  EXPECT_EQ(counts.limit, "the limit of 50 states");
  EXPECT_THAT(counts.grows,
              AllOf(StartsWith("keeper.asked ("), HasSubstr("count no further than anybody tells apart")));
  asked.explore.states = 1'000'000;
  asked.explore.interrupted = [looks = 0]() mutable { return ++looks > 100; };
  EXPECT_THAT(verify(plan(), asked).graph.grows, StartsWith("keeper.asked ("));
  asked.explore = {};
  asked.explore.ticks = 20;
  EXPECT_EQ(verify(plan(), asked).graph.grows, "") << "somebody wanted so many";

  asked.explore.ticks = UINT64_MAX;
  asked.explore.states = 50;
  model("fresh() * 0 + 1");
  EXPECT_THAT(verify(plan(), asked).graph.grows, StartsWith("fresh() of keeper ("));
  write("models/door.scxml", kHead + R"(initial="there"><state id="there"><transition event="door.ask.request">
  <send event="later" delay="3600s"/><send type="thrift" target="door" event="ask.reply"><param name="result" expr="1"/></send>
  </transition></state></scxml>)");
  EXPECT_THAT(verify(plan(), asked).graph.grows,
              AllOf(HasSubstr("the number of delayed <send>s of keeper ("), HasSubstr("what is left of a delay")));
  model("1");
  tree(
      "<Sequence><Script code=\"n := 0\"/><KeepRunningUntilFailure><Sequence><Sleep msec=\"100\"/>"
      "<Script code=\"n := n + 1\"/><ForceSuccess><Condition ID=\"Ask\"/></ForceSuccess></Sequence>"
      "</KeepRunningUntilFailure></Sequence>");
  EXPECT_THAT(verify(plan(), asked).graph.grows, StartsWith("the blackboard's n ("));
}

// Faults multiply states: what goes wrong without any is found behind the limit too.
TEST_F(Verify, GoesOnWithoutFaultsWhereALimitEndsIt) {
  ask_until_it_is_open();
  write("models/door.scxml", kHead + R"(initial="there"><datamodel><data id="asked" expr="0"/></datamodel>
<state id="there"><transition event="door.ask.request"><assign location="asked" expr="asked + 1"/>
<send type="thrift" target="door" event="ask.reply"><param name="result" expr="asked === 6 ? 7 : asked"/></send></transition>
</state></scxml>)");
  requirements("small \"It says little.\": always said <= 40.\nnone \"It says nothing.\": always said <= 1000.\n");
  Asked asked;
  asked.explore.faults = {project::intervention::Unreachable{"door.ask"}, project::intervention::Kill{"Ask"}};
  asked.explore.states = 120;
  const project::Plan of = plan();
  const Verification found = verify(of, asked);
  EXPECT_EQ(found.graph.limit, "the limit of 120 states");
  EXPECT_LT(found.graph.complete_to, 40U);
  ASSERT_EQ(found.judgements.front().finding, Finding::kRefuted);
  EXPECT_GT(found.judgements.front().path->edges.size(), 40U);
  EXPECT_EQ(found.judgements.back().finding, Finding::kUnknown);
  EXPECT_FALSE(found.graph.faultless_complete);
  EXPECT_GT(found.graph.faultless_to, 40U);
  EXPECT_EQ(verdict_of(found, of), monitor::Verdict::kViolated);
  EXPECT_EQ(found.graph.partial, UINT32_MAX);
}

TEST_F(Verify, IsCompleteToWhereEveryBehaviourIsKnown) {
  ask_until_it_is_open();
  // Each tick has ten times the states of the one before.
  write("models/door.scxml", kHead + R"x(initial="there"><datamodel><data id="n" expr="0"/></datamodel>
<state id="there"><transition event="door.ask.request"><assign location="n" expr="n * 10 + between(0, 9)"/>
<send type="thrift" target="door" event="ask.reply"><param name="result" expr="1"/></send></transition></state></scxml>)x");
  requirements("small \"It says little.\": always said <= 1.\n");
  Asked asked;
  asked.explore.states = 500;
  const Graph graph = verify(plan(), asked).graph;
  EXPECT_EQ(graph.limit, "the limit of 500 states");
  std::size_t known = 0;
  for (const Graph::Node& node : graph.nodes) known += node.depth < graph.complete_to ? 1U : 0U;
  std::size_t gone_on = 0;
  while (gone_on < graph.nodes.size() && graph.nodes[gone_on].edges > 0) ++gone_on;
  EXPECT_LE(known, gone_on) << "from each of them every way on is known";
}

TEST_F(Verify, AnyOrderReachesWhatVirtualTimeReaches) {
  tree(
      "<Parallel success_count=\"2\" failure_count=\"2\"><Condition ID=\"Ask\" name=\"A\"/>"
      "<Condition ID=\"Ask\" name=\"B\"/></Parallel>");
  model("pick('says', 1, 6)");
  requirements("small \"It says little.\": always said <= 6.\n");
  const project::Plan of = plan();
  Asked asked;
  asked.explore.order = Order::kVirtual;
  const Verification one = verify(of, asked);
  const Verification any = verify(of, {});
  ASSERT_THAT(any.errors, IsEmpty());
  EXPECT_GE(any.graph.nodes.size(), one.graph.nodes.size());
  EXPECT_GE(any.graph.edges.size(), one.graph.edges.size());
  EXPECT_EQ(any.judgements.front().finding, one.judgements.front().finding);
}

TEST_F(Verify, FindsWhatOnlyAnotherOrderBrings) {
  tree(
      "<Parallel success_count=\"1\" failure_count=\"2\"><Action ID=\"Ask\" name=\"A\"/>"
      "<Action ID=\"Ask\" name=\"B\"/></Parallel>");
  // Both ask at one instant, and who is first gets in.
  write("skills/Ask.scxml",
        kHead + R"(initial="waiting"><state id="waiting"><onentry><send event="go" delay="50ms"/></onentry>
  <transition event="go" target="asking"/></state>
<state id="asking"><onentry><send type="thrift" target="door" event="ask"/></onentry>
  <transition event="door.ask.reply" cond="_event.data.result === 6" target="success"/>
  <transition event="door.ask.reply" target="failure"/><transition event="error" target="failure"/>
</state><final id="success"/><final id="failure"/></scxml>)");
  write("models/door.scxml",
        kHead + R"(initial="free"><state id="free"><transition event="door.ask.request" target="taken">
  <send type="thrift" target="door" event="ask.reply"><param name="result" expr="6"/></send></transition></state>
  <state id="taken"><transition event="door.ask.request"><send type="thrift" target="door" event="ask.reply">
  <param name="result" expr="1"/></send></transition></state></scxml>)");
  requirements("first \"A is first.\": never node(B) in SUCCESS.\n");
  const project::Plan of = plan();
  const Verification found = verify(of, {});
  ASSERT_EQ(found.judgements.front().finding, Finding::kRefuted);
  project::Scenario example = counterexample(found.graph, found.judgements.front(), of.scenario);
  EXPECT_FALSE(example.orders.empty());
  EXPECT_EQ(verdict_of(found, of), monitor::Verdict::kViolated);
  Asked asked;
  asked.explore.order = Order::kVirtual;
  EXPECT_EQ(verify(of, asked).judgements.front().finding, Finding::kHolds);
}

TEST_F(Verify, TriesAnyReplyOfWhatHasNoModel) {
  write("interfaces/door.thrift",
        "enum Way { IN, OUT, BOTH }\nstruct Seen { 1: i32 people, 2: Way way, 3: string who, 4: double heat (min = "
        "\"0\") }\n"
        "service Door { Seen ask() }\n");
  write("skills/Ask.scxml", kHead + R"(initial="asking"><datamodel><data id="most"/><data id="n" expr="0"/></datamodel>
<state id="asking"><onentry><send type="thrift" target="door" event="ask"/></onentry>
  <transition event="door.ask.reply" cond="_event.data.result.way === 'OUT'" target="failure"/>
  <transition event="door.ask.reply" target="counting"><assign location="n" expr="_event.data.result.people * 2 - 1"/></transition>
  <transition event="error" target="failure"/></state>
<state id="counting"><transition cond="n &gt; most" target="failure"/><transition target="success"/></state>
<final id="success"/><final id="failure"/></scxml>)");
  tree("<Condition ID=\"Ask\" most=\"9\"/>");
  write("r.req", "let heat = reply(door.ask).heat\ncold \"It is cold.\": always heat <= 40.\n");
  const std::string yaml =
      "mission: {file: mission.xml, rate: 10 Hz}\nservices: {door: {interface: door.thrift/Door, at: sim}}\n"
      "monitors: [{file: r.req}]\n";
  write("sentree.yaml", yaml);
  auto project = project::load_project(folder_.path());
  ASSERT_TRUE(project.ok());
  project::Scenario scenario = project::plain_scenario(std::move(*project.value));
  for (project::ServiceEntry& service : scenario.project.services) service.at = "tcp://localhost:1";
  const auto remote = project::prepare(scenario);
  ASSERT_TRUE(remote.ok()) << to_string(remote.diagnostics.front());
  const auto made = add_models(scenario, *remote.value, folder_.path() / "verify" / "any");
  ASSERT_TRUE(made) << made.error().message;
  EXPECT_THAT(made->front().tried,
              ElementsAre("ask.people: 4, 5, 6", "ask.way: 'OUT', 'IN'", "ask.heat: 0, 39, 40, 41"))
      << "2 n - 1 > 9 where n > 5";
  const auto modelled = project::prepare(with_models(std::move(scenario)));
  ASSERT_TRUE(modelled.ok()) << to_string(modelled.diagnostics.front());
  const Verification found = verify(*modelled.value, {});
  ASSERT_THAT(found.errors, IsEmpty());
  EXPECT_EQ(found.judgements.front().finding, Finding::kRefuted);
  EXPECT_THAT(found.not_reached, ElementsAre(HasSubstr("Ask.scxml:5:3: leaf Ask never takes this transition")))
      << "the one for errors";
}

TEST_F(Verify, SaysWhatNothingReaches) {
  model("6");
  requirements("small \"It says little.\": always said <= 6.\n");
  const Verification found = verify(plan(), {});
  EXPECT_THAT(found.not_reached, Contains("leaf Ask never fails"));
  EXPECT_THAT(found.not_reached, Contains(HasSubstr("Ask.scxml:4:")));
}

TEST_F(Verify, TellsALeafThatIsAlwaysLateFromOneThatIsNeverTicked) {
  write("skills/Ask.scxml", kHead + R"(initial="asking"><state id="asking">
  <onentry><send event="enough" delay="5s"/></onentry><transition event="enough" target="success"/>
</state><final id="success"/><final id="failure"/></scxml>)");
  write("models/door.scxml", kHead + R"(initial="there"><state id="there"/></scxml>)");
  requirements("small: always said <= 6.\n");
  const Verification found = verify(plan(), {});
  EXPECT_THAT(found.not_reached, Contains("leaf Ask never answers a tick in time"));
  EXPECT_THAT(found.not_reached, Not(Contains("leaf Ask is never ticked")));
}

TEST_F(Verify, SaysWhatOfAModelNothingReaches) {
  write("models/door.scxml", kHead + R"(initial="there"><state id="there"><transition event="door.ask.request">
  <if cond="pick('says', 1, 6) === 6"><raise event="well"/></if>
  <send type="thrift" target="door" event="ask.reply"><param name="result" expr="1"/></send></transition>
  <transition event="well" target="here"/><transition event="ill" target="away"/></state>
  <state id="here"/><state id="away"/></scxml>)");
  requirements("small \"It says little.\": always said <= 6.\n");
  const Verification found = verify(plan(), {});
  EXPECT_THAT(found.not_reached, Contains(HasSubstr("door.scxml:4:43: model keeper never takes this transition")));
  EXPECT_THAT(found.not_reached, Not(Contains(HasSubstr("door.scxml:4:3:"))));
  EXPECT_THAT(found.graph.models_entered.front(), ElementsAre(_, true, true, false)) << "there, here, and not away";
  // The one of the skill for 6 is never taken, as its condition never holds.
  EXPECT_THAT(found.graph.guards.front(), Contains(1U));
  EXPECT_THAT(found.graph.guards.front(), Not(Contains(2U)));
  EXPECT_THAT(found.graph.calls, Contains(Pair("door.ask", "reply")));
  EXPECT_THAT(found.graph.calls, Contains(Pair("door.ask", "late"))) << "nobody answers in `here`";
}

}  // namespace
}  // namespace sentree::verify
