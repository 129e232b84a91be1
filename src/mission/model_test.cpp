#include "sentree/mission/model.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

#include "sentree/idl/conform.h"

namespace sentree::mission {
namespace {

using std::chrono::milliseconds;
using testing::ElementsAre;
using testing::IsEmpty;
using testing::Not;

// A model in the hands of a test: what it does is written down as text.
class ModelPlayer final : public ModelHost {
 public:
  explicit ModelPlayer(const std::string& states, std::uint64_t seed = 1)
      : machine_({.name = "robot",
                  .file = "models/robot.scxml",
                  .seed = seed,
                  .patience = milliseconds(40),
                  .chart = load(states),
                  .serves = services()}) {
    machine_.step(state, StartModel{}, *this);
  }

  void call(const std::string& method, std::uint64_t id) {
    Call call{.run = 1, .id = id, .service = "s", .method = method, .args = Map{{"n", 1.5}}, .sendid = {}};
    machine_.step(state, ServeCall{0, "Leaf", Shared<Call>(std::move(call))}, *this);
  }
  void pass(Duration duration) {
    time += duration;
    while (wake <= time) machine_.step(state, ModelTimer{std::exchange(wake, kNever)}, *this);
  }
  void hear(const std::string& topic, Value args) {
    machine_.step(state, Published{Shared<Publication>({topic, "somebody", std::move(args)})}, *this);
  }
  std::vector<std::string> done() { return std::exchange(done_, {}); }
  std::vector<std::string> refusals() { return std::exchange(refusals_, {}); }

  bool vetoes = false;  // whatever is published
  ModelState state;
  TimePoint time{};
  TimePoint wake = kNever;

 private:
  static scxml::Chart load(const std::string& states) {
    auto chart = scxml::load(
        "<scxml xmlns='http://www.w3.org/2005/07/scxml' version='1.0' datamodel='ecmascript'>" + states + "</scxml>",
        "robot.scxml");
    EXPECT_TRUE(chart.ok()) << (chart.ok() ? "" : to_string(chart.diagnostics.front()));
    return *chart.value;
  }
  static std::map<std::string, idl::ServicePtr> services() {
    const auto schema = idl::Schema::load(
        "exception Worn { 1: string why }  service S { i32 ask(1: double n = 0)  void stop() throws (1: Worn worn)  "
        "oneway void level(1: double n) }",
        "s.thrift");
    return {{"s", *idl::find_service(*schema.value, "S")}};
  }

  TimePoint now() const override { return time; }
  void publish(Message message) override { done_.push_back(message.name + " " + to_json(message.data)); }
  std::uint64_t next_call() override { return ++calls_; }
  std::optional<Admission> request(Message message) override {
    if (vetoes) return Admission{Veto{"gate", "no"}};
    publish(std::move(message));
    return Admission{};
  }
  void deliver_at(TimePoint when, Rank rank, ModelDelivery) override {
    EXPECT_EQ(rank, Rank::kSimulator);
    wake = when;
  }
  void answer(std::size_t leaf, const Shared<Call>& call, CallOutcome outcome) override {
    EXPECT_EQ(leaf, 0U);
    done_.push_back(std::to_string(call->id) + " " + call->method + ": " +
                    (outcome.ok ? to_json(outcome.result) : std::string(outcome.kind_word()) + " " + outcome.message) +
                    (outcome.ok || outcome.result.is_null() ? "" : to_json(outcome.result)));
  }
  void problem(const std::string& what) override { done_.push_back("! " + what); }
  void refused(const Diagnostic& why) override { refusals_.push_back(to_string(why)); }

  ModelMachine machine_;
  std::uint64_t calls_ = 0;
  std::vector<std::string> done_;
  std::vector<std::string> refusals_;
};

constexpr const char* kAnswers = R"(
  <state id="a">
    <transition event="s.ask.request">
      <send type="thrift" target="s" event="ask.reply"><param name="result" expr="_event.data.args.n * 2"/></send>
    </transition>
    <transition event="s.stop.request">
      <send type="thrift" target="s" event="stop.error"><param name="kind" expr="'exception'"/><param name="message" expr="'of ' + _event.data.source"/></send>
    </transition>
  </state>)";

TEST(Model, AnswersACallAtOnceWithAResultOrAnError) {
  ModelPlayer p(kAnswers);
  p.call("ask", 1);
  p.call("stop", 2);
  EXPECT_THAT(p.done(), ElementsAre("1 ask: 3", "2 stop: exception of Leaf"));
  EXPECT_THAT(p.state.open, IsEmpty());
}

TEST(Model, AnswersTheOldestOpenCallOrTheOneThatIdNames) {
  ModelPlayer p(R"(
    <datamodel><data id="second" expr="0"/></datamodel>
    <state id="a"><transition event="s.ask.request" target="b"/></state>
    <state id="b"><transition event="s.ask.request" target="c"><assign location="second" expr="_event.data.id"/></transition></state>
    <state id="c"><transition event="s.ask.request" target="a">
      <send type="thrift" target="s" event="ask.reply"><param name="result" expr="20"/><param name="id" expr="second"/></send>
      <send type="thrift" target="s" event="ask.reply"><param name="result" expr="10"/></send>
      <send type="thrift" target="s" event="ask.reply" delay="10ms"><param name="result" expr="30"/></send>
    </transition></state>)");
  for (const std::uint64_t id : {7, 8, 9}) p.call("ask", id);
  EXPECT_THAT(p.done(), ElementsAre("8 ask: 20", "7 ask: 10"));
  p.pass(milliseconds(10));
  EXPECT_THAT(p.done(), ElementsAre("9 ask: 30"));
}

TEST(Model, ACallThatItDoesNotAnswerIsLateAndAnAnswerAfterThatReachesNobody) {
  ModelPlayer p(R"(<state id="a"><transition event="s.ask.request">
      <send type="thrift" target="s" event="ask.reply" delay="50ms"><param name="result" expr="1"/></send>
    </transition></state>)");
  p.call("ask", 1);
  p.pass(milliseconds(39));
  EXPECT_THAT(p.done(), IsEmpty());
  p.pass(milliseconds(1));
  EXPECT_THAT(p.done(), ElementsAre("1 ask: late the model robot has not answered in time"));
  p.pass(milliseconds(100));
  EXPECT_THAT(p.done(), IsEmpty());
}

TEST(Model, AnAnswerAtTheVeryEndOfThePatienceIsInTime) {
  ModelPlayer p(R"(<state id="a"><transition event="s.ask.request">
      <send type="thrift" target="s" event="ask.reply" delay="40ms"><param name="result" expr="1"/></send>
    </transition></state>)");
  p.call("ask", 1);
  p.pass(milliseconds(40));
  EXPECT_THAT(p.done(), ElementsAre("1 ask: 1"));
}

TEST(Model, AnAnswerThatTheInterfaceDoesNotHaveIsAnErrorOfTheChart) {
  ModelPlayer p(R"(<state id="a">
    <transition event="s.ask.request"><send type="thrift" target="s" event="ask.reply"><param name="result" expr="'x'"/></send></transition>
    <transition event="error.execution"><log label="error" expr="_event.data.message"/></transition></state>)");
  p.call("ask", 1);
  EXPECT_THAT(p.done(),
              ElementsAre("robot.log {\"label\":\"error\",\"text\":\"result: expected i32, got string \\\"x\\\"\"}"));
}

TEST(Model, AnErrorIsOfOneOfTheKindsThatThereAre) {
  ModelPlayer p(R"(<state id="a">
    <transition event="s.ask.request"><send type="thrift" target="s" event="ask.error"><param name="kind" expr="'unreachabel'"/></send></transition>
    <transition event="error.execution"><log label="error" expr="_event.data.message"/></transition></state>)");
  p.call("ask", 1);
  EXPECT_THAT(p.done(), ElementsAre(testing::ContainsRegex("no kind of error .*did you mean .*unreachable")));
}

TEST(Model, WhoseScriptFailsSaysSo) {
  const std::string ask = R"(<transition event="s.ask.request"><assign location="x" expr="nowhere.y"/>
      <send type="thrift" target="s" event="ask.reply"><param name="result" expr="1"/></send></transition>)";
  ModelPlayer p(R"(<datamodel><data id="x"/></datamodel><state id="a">)" + ask + "</state>");
  p.call("ask", 1);
  EXPECT_THAT(p.refusals(), ElementsAre(testing::StartsWith("robot.scxml:1:136: model robot: ")));
  ModelPlayer handled(R"(<datamodel><data id="x"/></datamodel><state id="a">)" + ask +
                      R"(<transition event="error.*"/></state>)");
  handled.call("ask", 1);
  EXPECT_THAT(handled.refusals(), IsEmpty());
}

TEST(Model, ThrowsWhatTheInterfaceDeclares) {
  const auto thrown = [](const std::string& exception) {
    ModelPlayer p(R"(<state id="a">
      <transition event="s.stop.request"><send type="thrift" target="s" event="stop.error"><param name="exception" expr=")" +
                  exception + R"("/></send></transition>
      <transition event="error.execution"><log label="error" expr="_event.data.message"/></transition></state>)");
    p.call("stop", 1);
    return p.done();
  };
  EXPECT_THAT(thrown("({Worn: {why: 'old'}})"), ElementsAre(R"(1 stop: exception {"Worn":{"why":"old"}})"));
  EXPECT_THAT(thrown("({Wron: {why: 'old'}})"),
              ElementsAre(testing::HasSubstr("throws no \\\"Wron\\\"; did you mean")));
  EXPECT_THAT(thrown("({Worn: {why: 5}})"), ElementsAre(testing::HasSubstr("exception.Worn.why: expected string")));
  EXPECT_THAT(thrown("({Worn: {why: 'old'}})\"/><param name=\"kind\" expr=\"'late'"),
              ElementsAre(testing::HasSubstr("and of no other")));
  EXPECT_THAT(thrown("'old'"), ElementsAre(testing::HasSubstr("expected the fields of one of stop's exceptions")));
}

TEST(Model, PublishesOnATopicOfAServiceThatItServes) {
  ModelPlayer p(R"(<state id="a">
    <transition event="go"><send type="thrift" target="s" event="level"><param name="n" expr="_event.data.n"/></send></transition>
    <transition event="bad"><send type="thrift" target="s" event="level"><param name="m" expr="1"/></send></transition>
    <transition event="call"><send type="thrift" target="s" event="ask"/></transition>
    <transition event="s.level.error"><log label="refused" expr="_event.data.vetoed_by"/></transition>
    <transition event="error.execution"><log label="error" expr="_event.data.message"/></transition></state>)");
  p.hear("go", Map{{"n", 0.5}});
  EXPECT_THAT(p.done(), ElementsAre(R"(s.level.request {"args":{"n":0.5}})"));
  p.hear("bad", Map());
  p.hear("call", Map());
  const auto errors = p.done();
  ASSERT_EQ(errors.size(), 2U);
  EXPECT_THAT(errors[0], testing::HasSubstr("\\\"m\\\""));
  EXPECT_THAT(errors[1], testing::HasSubstr("Published are one-way methods"));
  p.vetoes = true;
  p.hear("go", Map{{"n", 0.5}});
  EXPECT_THAT(
      p.done(),
      ElementsAre(
          R"(s.level.error {"args":{"n":0.5},"kind":"vetoed","message":"vetoed by gate: no","vetoed_by":"gate"})",
          R"(robot.log {"label":"refused","text":"gate"})"));
}

// A chart that answers a veto with the same publication is told a bounded number of times.
TEST(Model, ThatPublishesWhenItIsRefusedIsTurnedDownABoundedNumberOfTimes) {
  ModelPlayer p(R"(<state id="a"><transition event="go s.level.error">
    <send type="thrift" target="s" event="level"><param name="n" expr="1"/></send></transition></state>)");
  p.vetoes = true;
  p.hear("go", Map());
  EXPECT_EQ(p.done().size(), 256U);
}

TEST(Model, ACallOfAOneWayMethodIsTakenAndNeedsNoAnswer) {
  ModelPlayer p(R"(<state id="a">
    <transition event="s.level.request"><log label="level" expr="_event.data.args.n"/></transition></state>)");
  p.call("level", 1);
  EXPECT_THAT(p.done(), ElementsAre("1 level: null", R"(robot.log {"label":"level","text":"1.5"})"));
  EXPECT_THAT(p.state.open, IsEmpty());
}

TEST(Model, ThatHasEndedIsUnreachable) {
  ModelPlayer p("<final id='f'/>");
  p.call("ask", 1);
  EXPECT_THAT(p.done(), ElementsAre("1 ask: unreachable the model robot has ended"));
}

TEST(Model, TakesABoundedNumberOfCalls) {
  ModelPlayer p("<state id='a'/>");
  for (std::uint64_t id = 1; id <= kOpenCallsMax; ++id) p.call("ask", id);
  EXPECT_THAT(p.done(), IsEmpty());
  p.call("ask", 999);
  EXPECT_THAT(p.done(), ElementsAre("999 ask: unreachable 256 calls are open already"));
}

constexpr const char* kChooses = R"(
  <datamodel><data id="v" expr="0"/></datamodel>
  <state id="a"><transition event="s.ask.request">
    <assign location="v" expr="[choose(1, 2), pick('N', 'a', 'b'), between(0, 1, 0.25), chance(0.5), draw([[0.25, 'x'], [0.75, 'y'], [0, 'z']]), fresh()]"/>
    <send type="thrift" target="s" event="ask.reply"><param name="result" expr="v[5]"/></send>
  </transition></state>)";

TEST(Model, ChoosesByItsSeedAndSaysWhat) {
  const auto said = [](std::uint64_t seed) {
    ModelPlayer p(kChooses, seed);
    for (std::uint64_t id = 1; id <= 20; ++id) p.call("ask", id);
    return p.done();
  };
  const auto once = said(3);
  EXPECT_EQ(once, said(3));
  EXPECT_NE(once, said(4));
  ASSERT_EQ(once.size(), 20U * 6);  // five choices that are observed, and the answer
  EXPECT_THAT(once[1], testing::StartsWith("robot.choice {\"function\":\"pick\",\"name\":\"N\",\"value\":\""));
  EXPECT_THAT(once[1], testing::EndsWith(",\"place\":\"models/robot.scxml:4\"}"));
  EXPECT_EQ(once[5], "1 ask: 1");
  EXPECT_EQ(once[11], "2 ask: 2");
  for (const std::string& one : once) EXPECT_EQ(one.find("\"z\""), std::string::npos) << "has no chance";
}

TEST(Model, ACopyGoesOnAlike) {
  ModelPlayer p(kChooses);
  p.call("ask", 1);
  p.done();
  ModelPlayer q(kChooses);
  q.done();
  q.state = p.state;
  EXPECT_TRUE(q.state == p.state);
  p.call("ask", 2);
  q.call("ask", 2);
  EXPECT_EQ(p.done(), q.done());
  EXPECT_TRUE(q.state == p.state);
}

TEST(Model, AWrongChoiceIsAnErrorOfTheChart) {
  for (const char* wrong :
       {"choose()", "pick(1, 2)", "between(2, 1)", "chance(2)", "draw([[0.5, 1]])", "fresh(1)", "choose(undefined, 1)",
        "choose(NaN, 'NaN')", "pick('p', 1 / 0, 'Infinity')", "choose(['-Infinity'], [-1 / 0])",
        "choose(function () {}, 1)", "choose([undefined], [null])", "choose({a: [0 / 0]}, {a: ['NaN']})",
        "draw([[0.5, undefined], [0.5, null]])", "choose(new Uint8Array([1, 2]), {$bytes: 'AQI='})",
        "draw([[0.5, NaN], [0.5, 'NaN']])"}) {
    ModelPlayer p(std::string(R"(<state id="a">
      <transition event="s.ask.request"><log expr=")") +
                  wrong + R"("/></transition>
      <transition event="error.execution"><log label="error"/></transition></state>)");
    p.call("ask", 1);
    EXPECT_THAT(p.done(), ElementsAre("robot.log {\"label\":\"error\",\"text\":\"\"}")) << wrong;
  }
}

TEST(Model, AlternativesAreWhatAScenarioCanWrite) {
  for (const char* right :
       {"choose(null, -0, 0, 'NaN')", "choose(1, 1, NaN, 1 / 0)", "pick('p', [null], [], {}, {a: undefined})",
        "choose(new Uint8Array([1, 2]), 'AQI=')", "draw([[1, 1e300], [0, undefined]])"}) {
    ModelPlayer p(std::string(R"(<state id="a">
      <transition event="s.ask.request"><log expr="typeof )") +
                  right + R"("/></transition>
      <transition event="error.execution"><log label="error"/></transition></state>)");
    p.call("ask", 1);
    EXPECT_THAT(p.done(), Not(ElementsAre("robot.log {\"label\":\"error\",\"text\":\"\"}"))) << right;
  }
}

}  // namespace
}  // namespace sentree::mission
