// Topics from who publishes to who subscribes: order, delay, gates, real time.

#include "sentree/runtime/topics.h"
#include "sentree/mission/subscriptions.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "sentree/project/plan.h"
#include "sentree/runtime/run.h"

namespace sentree::runtime {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::Contains;
using testing::ElementsAre;
using testing::Field;
using testing::Not;

struct SeenTopic {
  RunReport report;
  std::vector<Message> messages;

  [[nodiscard]] std::vector<Message> named(const std::string& name) const {
    std::vector<Message> found;
    for (const Message& message : messages) {
      if (message.name == name) found.push_back(message);
    }
    return found;
  }
};

template <class Change>
SeenTopic run(const char* scenario, const Change& change) {
  auto loaded = project::load_scenario(fs::path(SENTREE_SOURCE_DIR) / "examples/topics/scenarios" / scenario);
  EXPECT_TRUE(loaded.ok()) << to_string(loaded.diagnostics.front());
  change(*loaded.value);
  const auto plan = project::prepare(std::move(*loaded.value));
  EXPECT_TRUE(plan.ok()) << to_string(plan.diagnostics.front());
  SeenTopic seen;
  RunOptions options;
  options.listeners.push_back([&](const Message& message) { seen.messages.push_back(message); });
  Run run(*plan.value, std::move(options));
  seen.report = run.execute();
  EXPECT_EQ(seen.report.error, "");
  return seen;
}

TEST(Topics, EachPublicationIsOneObservationAndReachesItsSubscribersInOrder) {
  const SeenTopic seen = run("drains.yaml", [](project::Scenario&) {});
  EXPECT_EQ(seen.report.mission, bt::Status::kSuccess);
  const auto published = seen.named("battery.state.request");
  ASSERT_GT(published.size(), 3U);
  for (std::size_t i = 0; i < published.size(); ++i) {
    EXPECT_EQ(published[i].source, "pack");
    EXPECT_EQ(published[i].target, "battery");
    EXPECT_EQ(published[i].time, TimePoint(std::chrono::seconds(i)));
  }
  EXPECT_LT(published.back().data.find("args")->find("percentage")->number(), 30);
  for (const char* name : {"battery.state.reply", "battery.state.error", "notices.said.reply"})
    EXPECT_THAT(seen.messages, Not(Contains(Field(&Message::name, name)))) << name;
  ASSERT_EQ(seen.named("display.log").size(), 1U);
  EXPECT_GT(seen.named("display.log")[0].sequence, seen.named("notices.said.request").at(0).sequence);
}

TEST(Topics, AScenarioPublishesToo) {
  const SeenTopic seen = run("told.yaml", [](project::Scenario&) {});
  EXPECT_THAT(
      seen.named("battery.state.request"),
      Contains(AllOf(Field(&Message::source, "scenario"), Field(&Message::time, TimePoint(std::chrono::seconds(2))))));
  EXPECT_LT(seen.report.ended, TimePoint(std::chrono::seconds(3)));
}

TEST(Topics, ADelayHoldsBackWhatSubscribersHearAndNotWhatIsObserved) {
  const auto delay = [](project::Scenario& scenario) {
    scenario.delays.push_back({"notices.said", std::chrono::milliseconds(700), {}});
    scenario.project.repeat = true;  // so that the run goes on
    scenario.duration = std::chrono::seconds(30);
  };
  const SeenTopic seen = run("drains.yaml", delay);
  const auto said = seen.named("notices.said.request");
  const auto shown = seen.named("display.log");
  ASSERT_FALSE(said.empty());
  ASSERT_FALSE(shown.empty());
  EXPECT_EQ(shown[0].time - said[0].time, std::chrono::milliseconds(700));
}

TEST(Topics, WhatAGateRefusesReachesNobodyAndWhoPublishedHearsOfIt) {
  const auto gate = [](project::Scenario& scenario) {
    project::MonitorEntry entry{.name = "quiet", .file = {"monitors/quiet.scxml", {}}};
    entry.violated = {"loud"};
    entry.gate = {"battery.state"};
    scenario.project.monitors.push_back(entry);
    scenario.duration = std::chrono::milliseconds(4500);
  };
  const SeenTopic seen = run("drains.yaml", gate);
  EXPECT_THAT(seen.named("battery.state.request"), testing::IsEmpty());
  ASSERT_EQ(seen.named("battery.state.error").size(), 5U);
  EXPECT_EQ(seen.named("battery.state.error")[0].data.find("vetoed_by")->text(), "quiet");
  EXPECT_EQ(seen.report.mission, bt::Status::kRunning);
}

TEST(Topics, WorkInRealTimeToo) {
  const auto real = [](project::Scenario& scenario) {
    scenario.virtual_time = false;
    scenario.factor = 50;
  };
  const SeenTopic seen = run("drains.yaml", real);
  EXPECT_EQ(seen.report.mission, bt::Status::kSuccess);
  EXPECT_THAT(seen.report.problems, testing::IsEmpty());
  EXPECT_EQ(seen.named("notices.said.request").size(), 1U);
}

class Quiet final : public Publisher {
 public:
  void publish(Message message) override { messages.push_back(std::move(message)); }
  std::optional<mission::Admission> request(Message, Stream::Decided) override { return mission::Admission{}; }
  std::uint64_t next_call() override { return 1; }
  std::vector<Message> messages;
};

ToldTopic told(const char* topic) {
  return {.what = mission::Shared<mission::Publication>({topic, "somebody", {}}), .sequence = 1};
}

TEST(Topics, ASubscriberThatDoesNotKeepUpLosesWhatComesThenAndItIsTold) {
  const auto scheduler = make_real_scheduler();
  TopicInbox inbox;
  Quiet publisher;
  const ToldTopic first = told("a.a");
  ASSERT_TRUE(inbox.add(*scheduler, first));
  for (std::size_t i = 1; i < TopicInbox::kWaitingMax; ++i) ASSERT_TRUE(inbox.add(*scheduler, told("a.b")));
  EXPECT_FALSE(inbox.add(*scheduler, told("a.c")));
  EXPECT_FALSE(inbox.add(*scheduler, told("a.d")));
  const auto taken = inbox.taken(*first.what, "Leaf", publisher);
  ASSERT_TRUE(taken);
  EXPECT_EQ(taken->what, first.what);
  EXPECT_FALSE(inbox.taken(*first.what, "Leaf", publisher));
  ASSERT_EQ(publisher.messages.size(), 1U);
  EXPECT_EQ(publisher.messages[0].name, "observer.lost");
  EXPECT_EQ(to_json(publisher.messages[0].data), R"({"count":2,"first":"a.c"})");
  EXPECT_TRUE(inbox.add(*scheduler, told("a.b")));
}

TEST(Topics, WhatWasHeldBackIsNotOvertaken) {
  TimePoint not_before{};
  const TimePoint now(std::chrono::seconds(1));
  EXPECT_EQ(mission::Subscriptions::time_of(not_before, now, std::chrono::seconds(2)),
            TimePoint(std::chrono::seconds(3)));
  EXPECT_EQ(mission::Subscriptions::time_of(not_before, now, Duration(0)), TimePoint(std::chrono::seconds(3)));
}

}  // namespace
}  // namespace sentree::runtime
