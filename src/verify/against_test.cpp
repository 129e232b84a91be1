#include "sentree/verify/against.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "sentree/base/detail/test_seeds.h"
#include "sentree/base/rng.h"
#include "sentree/base/temporary_folder.h"
#include "sentree/mission/virtual_host.h"
#include "sentree/text/file.h"
#include "sentree/verify/detail/period.h"
#include "sentree/verify/detail/test_in_folder.h"
#include "sentree/verify/detail/test_random_project.h"
#include "sentree/verify/verify.h"

namespace sentree::verify {
namespace {

using std::chrono::milliseconds;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::SizeIs;
using ::testing::StartsWith;

const std::string kAgainstHead =
    "<scxml xmlns=\"http://www.w3.org/2005/07/scxml\" version=\"1.0\" datamodel=\"ecmascript\" ";

// What a run of a plan gives in so many ticks, with everything that is left open thrown by a die.
class Recorded final : public mission::Surroundings {
 public:
  Recorded(const project::Plan& plan, std::uint64_t seed, int ticks) : rng_(seed) {
    mission::VirtualHost host(plan);
    mission::State state = host.begin();
    for (int tick = 0; tick < ticks && !mission::VirtualHost::ended(state); ++tick) {
      const auto done = period(host, state, *this, [] { return Result<void>(); });
      EXPECT_TRUE(done) << to_string(done.error());
      if (state.tree.over) break;
    }
  }
  std::vector<Message> messages;
  std::optional<Diagnostic> error;  // of the model

 private:
  void observed(const Message& message) override { messages.push_back(message); }
  std::optional<std::uint64_t> choose(const mission::Choice& choice) override { return rng_.below(choice.count); }
  std::size_t order(std::uint64_t, std::span<const mission::Delivery* const> due) override {
    return rng_.below(due.size());
  }
  void refused(const Diagnostic& why) override { error = why; }

  Rng rng_;
};

// A mission that asks how warm a stove is, and gives it a number.
class Against : public InFolder {
 protected:
  Against() : InFolder("against") {}

  void SetUp() override {
    write("interfaces/stove.thrift",
          "enum Way { ON, OFF, BROKEN }\nstruct Heat { 1: double degrees, 2: i32 job, 3: Way way, 4: double weight }\n"
          "service Stove { Heat ask(), bool stop(1: i32 job) }\n");
    write("skills/Cook.scxml", kAgainstHead + R"(initial="asking"><datamodel><data id="job" expr="0"/></datamodel>
<state id="asking"><onentry><send type="thrift" target="stove" event="ask"/></onentry>
  <transition event="stove.ask.reply" cond="_event.data.result.way === 'BROKEN'" target="failure"/>
  <transition event="stove.ask.reply" cond="_event.data.result.degrees * 2 - 10 &gt; 90" target="stopping">
    <assign location="job" expr="_event.data.result.job"/></transition>
  <transition event="stove.ask.reply" target="waiting"/></state>
<state id="waiting"><transition event="tick" target="asking"/><transition event="halt" target="failure"/></state>
<state id="stopping"><onentry><send type="thrift" target="stove" event="stop"><param name="job" expr="job"/></send></onentry>
  <transition event="stove.stop.reply" cond="_event.data.result" target="success"/>
  <transition event="stove.stop.reply" target="failure"/></state>
<final id="success"/><final id="failure"/></scxml>)");
    tree("<Action ID=\"Cook\"/>");
    // It warms up by ten degrees every 300 ms, and knows one job.
    write("models/stove.scxml", kAgainstHead + R"x(initial="there"><datamodel><data id="heat" expr="20"/></datamodel>
<state id="there"><onentry><send event="warmer" delay="300ms"/></onentry>
  <transition event="warmer" target="there"><assign location="heat" expr="heat + pick('warms', 10, 20)"/></transition>
  <transition event="stove.ask.request"><send type="thrift" target="stove" event="ask.reply">
    <param name="result" expr="({degrees: heat, job: 1, way: 'ON', weight: 0})"/></send></transition>
  <transition event="stove.stop.request"><send type="thrift" target="stove" event="stop.reply">
    <param name="result" expr="_event.data.args.job === 1"/></send></transition>
</state></scxml>)x");
    write("r.req", "let heat = reply(stove.ask).degrees\ncold \"It is not too hot.\": always heat <= 200.\n");
    write("sentree.yaml",
          "mission: {file: mission.xml, rate: 10 Hz}\nservices: {stove: {interface: stove.thrift/Stove, at: model}}\n"
          "models: [{file: models/stove.scxml, name: cooker, serves: [stove]}]\nmonitors: [{file: r.req}]\n");
  }
  project::Plan plan() {
    auto project = project::load_project(folder_.path());
    EXPECT_TRUE(project.ok()) << to_string(project.diagnostics.front());
    auto prepared = project::prepare(with_models(project::plain_scenario(std::move(*project.value))));
    for (const Diagnostic& one : prepared.diagnostics) EXPECT_NE(one.severity, Severity::kError) << to_string(one);
    return std::move(prepared.value.value());
  }

  // A recording, line by line: a request and what answers it, `took` later.
  void asked(Duration at, Value result, Duration took = {}) {
    called(at, "ask", Map(), {{"result", std::move(result)}}, took);
  }
  void called(Duration at, const std::string& method, Map args, Map outcome, Duration took = {}) {
    Message request;
    request.kind = MessageKind::kRequest;
    request.source = "Cook";
    request.target = "stove";
    request.name = "stove." + method + ".request";
    request.call = ++calls_;
    request.time = TimePoint{} + at;
    request.data = Map{{"args", args}};
    recording_.push_back(request);
    const bool ok = outcome.find("result") != nullptr;
    request.kind = ok ? MessageKind::kReply : MessageKind::kError;
    request.name = "stove." + method + (ok ? ".reply" : ".error");
    request.time += took;
    outcome["args"] = std::move(args);
    request.data = std::move(outcome);
    recording_.push_back(std::move(request));
  }
  static Value heat(double degrees, int job = 1, const char* way = "ON", double weight = 0) {
    return Map{{"degrees", degrees}, {"job", job}, {"way", way}, {"weight", weight}};
  }
  Agreement found(Duration tolerance = {}, bool exact = false) {
    const project::Plan of = plan();
    auto all = against(of, recording_, {.tolerance = tolerance, .exact = exact});
    EXPECT_TRUE(all) << to_string(all.error());
    EXPECT_THAT(*all, SizeIs(1));
    return all->front();
  }

  std::vector<Message> recording_;
  std::uint64_t calls_ = 0;
};

TEST_F(Against, RepliesAreAlikeThatTheMissionCannotTellApart) {
  // 2 n - 10 > 90 where n > 50; nothing looks at the weight, and no word but BROKEN is written.
  asked(milliseconds(0), heat(21.5, 7, "OFF", 3));
  asked(milliseconds(100), heat(49.9));
  EXPECT_EQ(found().not_allowed, 0U);
  EXPECT_EQ(found().answers, 2U);
  const Agreement exact = found({}, true);
  EXPECT_EQ(exact.not_allowed, 2U);
  EXPECT_EQ(exact.disallowed.front().call, "stove.ask");
  EXPECT_THAT(exact.disallowed.front().allowed, ElementsAre(HasSubstr("degrees 20")));
}

TEST_F(Against, SaysWhatTheModelDoesNotAllowAndGoesOn) {
  asked(milliseconds(0), heat(55));
  asked(milliseconds(100), heat(30));
  asked(milliseconds(200), heat(30, 1, "BROKEN"));
  const Agreement agreement = found();
  EXPECT_EQ(agreement.answers, 3U);
  ASSERT_THAT(agreement.disallowed, SizeIs(2));
  EXPECT_EQ(agreement.disallowed[0].at, TimePoint{});
  EXPECT_THAT(agreement.disallowed[0].answered, HasSubstr("degrees 55"));
  EXPECT_THAT(agreement.disallowed[0].allowed, ElementsAre(HasSubstr("degrees 20")));
  EXPECT_EQ(agreement.disallowed[1].at, TimePoint{} + milliseconds(200));
  EXPECT_THAT(agreement.disallowed[1].answered, HasSubstr("BROKEN"));
}

TEST_F(Against, FollowsEveryChoiceOfTheModel) {
  // Above 50 after two steps of 20, or one of 20 and two of 10; not after two of 10.
  asked(milliseconds(650), heat(55));
  EXPECT_EQ(found().not_allowed, 0U);
  recording_.clear();
  asked(milliseconds(650), heat(45));
  asked(milliseconds(950), heat(50));
  EXPECT_EQ(found().not_allowed, 0U) << "20, 30, 40, 50";
  asked(milliseconds(1250), heat(50));
  EXPECT_EQ(found().not_allowed, 1U) << "it is warmer by then";
}

TEST_F(Against, TimesMayDifferByTheTolerance) {
  asked(milliseconds(550), heat(55));
  EXPECT_EQ(found().not_allowed, 1U) << "it cannot be so warm before 600 ms";
  EXPECT_EQ(found(milliseconds(49)).not_allowed, 1U);
  EXPECT_EQ(found(milliseconds(50)).not_allowed, 0U);
  recording_.clear();
  asked(milliseconds(0), heat(25), milliseconds(30));
  EXPECT_EQ(found(milliseconds(20)).not_allowed, 1U) << "it answers at once";
  EXPECT_EQ(found(milliseconds(30)).not_allowed, 0U);
}

TEST_F(Against, WhatIsHandedBackMeansWhatTheModelSaid) {
  asked(milliseconds(650), heat(55, 41));
  called(milliseconds(650), "stop", Map{{"job", 41}}, Map{{"result", true}});
  EXPECT_EQ(found().not_allowed, 0U) << "the model calls that job 1";
  called(milliseconds(700), "stop", Map{{"job", 40}}, Map{{"result", true}});
  const Agreement agreement = found();
  ASSERT_EQ(agreement.not_allowed, 1U) << "of that one nobody has heard";
  EXPECT_THAT(agreement.disallowed.front().allowed, ElementsAre("false"));
}

TEST_F(Against, RequestsThatDoNotArriveAreLeftOut) {
  called(milliseconds(0), "ask", Map(), Map{{"kind", "unreachable"}, {"message", "nobody"}});
  called(milliseconds(0), "ask", Map(), Map{{"kind", "vetoed"}, {"message", "no"}});
  called(milliseconds(0), "ask", Map(), Map{{"kind", "late"}, {"message", "a fault: the answer comes too late"}});
  EXPECT_EQ(found().answers, 0U);
  EXPECT_EQ(found().requests, 1U);
  called(milliseconds(0), "ask", Map(), Map{{"kind", "late"}, {"message", "no answer within 2 s"}},
         std::chrono::seconds(2));
  called(milliseconds(0), "ask", Map(), Map{{"kind", "exception"}, {"message", "off"}});
  EXPECT_EQ(found().answers, 2U);
  EXPECT_EQ(found().not_allowed, 2U);
}

TEST_F(Against, AModelThatCanBeInTooManyStatesIsGivenUp) {
  write("models/stove.scxml", kAgainstHead + R"x(initial="there"><datamodel><data id="heat" expr="20"/></datamodel>
<state id="there"><onentry><send event="warmer" delay="100ms"/></onentry>
  <transition event="warmer" target="there"><assign location="heat" expr="heat * 7 % 10007 + between(0, 99)"/></transition>
  <transition event="stove.ask.request"><send type="thrift" target="stove" event="ask.reply">
    <param name="result" expr="({degrees: 20, job: 1, way: 'ON', weight: 0})"/></send></transition>
  <transition event="stove.stop.request"><send type="thrift" target="stove" event="stop.reply">
    <param name="result" expr="true"/></send></transition>
</state></scxml>)x");
  asked(milliseconds(1000), heat(20));
  recording_.front().tick = 11;
  EXPECT_EQ(
      found().given_up,
      "it can be in more than 4096 states; most is left open at models/stove.scxml:3 (tick 11: stove.ask.request)");
  // Where it is given up while an answer is waited for, nothing is said of that.
  recording_.clear();
  asked(milliseconds(0), heat(20), milliseconds(1000));
  const Agreement late = found();
  EXPECT_THAT(late.given_up, HasSubstr("it can be in more than 4096 states"));
  EXPECT_EQ(late.not_allowed, 0U);
  EXPECT_EQ(late.answers, 0U);
}

TEST_F(Against, WhatLeavesTooMuchOpenIsToldWithItsPlace) {
  const auto refused = [&](const std::string& degrees) {
    write("models/stove.scxml", kAgainstHead + R"x(initial="there">
<state id="there"><transition event="stove.ask.request">
  <send type="thrift" target="stove" event="ask.reply">
    <param name="result" expr="({degrees: )x" +
                                    degrees + R"x(, job: 1, way: 'ON', weight: 0})"/></send></transition>
  <transition event="stove.stop.request"><send type="thrift" target="stove" event="stop.reply">
    <param name="result" expr="true"/></send></transition>
</state></scxml>)x");
    recording_.clear();
    asked(milliseconds(300), heat(20));
    recording_.front().tick = 4;
    const project::Plan of = plan();
    const auto all = against(of, recording_, {});
    EXPECT_FALSE(all);
    return all ? std::string() : to_string(all.error());
  };
  EXPECT_THAT(refused("between(0, 20000)"),
              AllOf(StartsWith((folder_.path() / "models/stove.scxml:4:").string()),
                    HasSubstr("cooker: between() leaves 20001 alternatives open"), HasSubstr("greater step"),
                    HasSubstr("(0.3 s, tick 4: stove.ask.request)")));
  EXPECT_THAT(refused("between(0, 999) + between(0, 999)"),
              AllOf(StartsWith((folder_.path() / "models/stove.scxml: ").string()),
                    HasSubstr("model cooker can go on in more than 100000 ways at once"),
                    HasSubstr("leave less open at models/stove.scxml:4 (0.3 s, tick 4: stove.ask.request)")));
}

// What models do is what they allow; another number is not, unless some other behaviour gives it.
TEST(AgainstRandomProjects, RunsWithModelsAreAllowed) {
  std::size_t compared = 0;
  std::uint64_t answers = 0;
  std::size_t changed = 0;
  std::size_t noticed = 0;
  for (const std::uint64_t seed : seeds(60)) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const TemporaryFolder folder("allowed");
    RandomProject(seed).write(folder.path());
    auto project = project::load_project(folder.path());
    ASSERT_TRUE(project.ok());
    const auto prepared = project::prepare(with_models(project::plain_scenario(std::move(*project.value))));
    if (!prepared.ok() || has_errors(obstacles(*prepared.value))) continue;
    Recorded run(*prepared.value, seed, 30);
    if (run.error) continue;
    const auto agreement = against(*prepared.value, run.messages, {.exact = true});
    ASSERT_TRUE(agreement) << to_string(agreement.error());
    if (!agreement->front().given_up.empty()) continue;
    EXPECT_EQ(agreement->front().not_allowed, 0U)
        << to_json(agreement->front().disallowed.front().args) << " " << agreement->front().disallowed.front().call
        << " at " << seconds(agreement->front().disallowed.front().at) << ": "
        << agreement->front().disallowed.front().answered << " not "
        << agreement->front().disallowed.front().allowed.front();
    answers += agreement->front().answers;
    ++compared;
    for (Message& message : run.messages) {
      if (message.kind != MessageKind::kReply || message.name != "device.ask.reply") continue;
      message.data = Map{{"args", Map()}, {"result", 77}};
      const auto other = against(*prepared.value, run.messages, {.exact = true});
      ASSERT_TRUE(other);
      ++changed;
      noticed += other->front().not_allowed > 0 ? 1U : 0U;
      break;
    }
  }
  std::cout << compared << " runs, " << answers << " answers; " << noticed << " of " << changed << " changes noticed\n";
  EXPECT_GT(compared, seeds(60).size() / 2);
  EXPECT_GT(answers, 3 * compared);
  EXPECT_GT(changed, 0U);
  EXPECT_EQ(noticed, changed) << "no model says 77";
}

}  // namespace
}  // namespace sentree::verify
