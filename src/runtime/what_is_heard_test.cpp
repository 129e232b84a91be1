// What nobody listens to is counted only, and nothing else of a run depends on who listens.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "sentree/monitor/quick.h"
#include "sentree/runtime/run.h"

namespace sentree::runtime {
namespace {

using testing::IsEmpty;
using testing::Not;

Message event_of(std::string name) {
  Message message;
  message.name = std::move(name);
  return message;
}

TEST(Passing, KeepsThePlaceInTheOrder) {
  const auto scheduler = make_virtual_scheduler();
  Stream stream(*scheduler);
  std::vector<Message> heard;
  stream.subscribe([&](const Message& message) { heard.push_back(message); },
                   [](const std::string& name) { return name == "wanted"; });
  int passed = 0;
  stream.on_passed([&](TimePoint) { ++passed; });
  bool all = false;
  stream.hear_all_while([&] { return all; });
  mission::ObservationName wanted("wanted");
  mission::ObservationName unwanted("unwanted");
  EXPECT_TRUE(stream.is_heard(wanted));
  EXPECT_FALSE(stream.is_heard(unwanted));
  stream.pass();
  stream.publish(event_of("wanted"));
  ASSERT_EQ(heard.size(), 1U);
  EXPECT_EQ(heard[0].sequence, 2U);
  EXPECT_EQ(heard[0].stamp, 2U);
  EXPECT_EQ(stream.published(), 2U);
  EXPECT_EQ(passed, 1);
  all = true;
  EXPECT_TRUE(stream.is_heard(unwanted));
  all = false;
  EXPECT_FALSE(stream.is_heard(unwanted));
  stream.subscribe([](const Message&) {});
  EXPECT_TRUE(stream.is_heard(unwanted));
}

const std::vector<std::string>& watched() {
  static const std::vector<std::string> names{"mission.tick", "mission.status", "monitor.violated",
                                              "battery.isCharging.reply"};
  return names;
}

struct Said {
  std::vector<std::string> messages;
  std::vector<std::string> monitors;
  std::uint64_t observations = 0;
};

// @param all  Somebody listens to everything.
Said said(const project::Plan& plan, bool all) {
  Said out;
  RunOptions options;
  const auto hear = [&](const Message& message) { out.messages.push_back(to_json(message)); };
  if (all) {
    options.listeners.emplace_back([=](const Message& message) {
      const auto& names = watched();
      if (std::find(names.begin(), names.end(), message.name) != names.end()) hear(message);
    });
  } else {
    for (const std::string& name : watched()) options.listeners_of.emplace_back(name, hear);
  }
  const RunReport report = Run(plan, std::move(options)).execute();
  EXPECT_THAT(report.problems, IsEmpty());
  out.observations = report.observations;
  for (const MonitorReport& monitor : report.monitors) {
    std::string text = monitor.name + " " + std::string(to_string(monitor.verdict)) + " " +
                       std::to_string(monitor.violations) + " " + std::to_string(monitor.vetoes) + " " +
                       monitor.vacuity + " " + monitor.standing;
    if (monitor.decision) text += " " + std::to_string(monitor.decision->at.time_since_epoch().count());
    const bool explains = std::any_of(plan.monitors.begin(), plan.monitors.end(), monitor::keeps_observations);
    if (explains) text += " " + monitor.leaf;
    out.monitors.push_back(text);
  }
  return out;
}

class Listening : public testing::TestWithParam<const char*> {};

TEST_P(Listening, ChangesNothing) {
  auto loaded =
      project::load_scenario(std::string(SENTREE_SOURCE_DIR) + "/examples/recharge/scenarios/" + GetParam() + ".yaml");
  ASSERT_TRUE(loaded.ok());
  auto plan = prepare(std::move(*loaded.value));
  ASSERT_TRUE(plan.ok());
  for (const bool explains : {true, false}) {
    SCOPED_TRACE(explains ? "with witnesses" : "without");
    if (!explains) {
      for (monitor::Model& model : plan.value->monitors) model = monitor::without_witnesses(model);
    }
    const Said whole = said(*plan.value, true);
    const Said part = said(*plan.value, false);
    EXPECT_THAT(whole.messages, Not(IsEmpty()));
    EXPECT_TRUE(whole.messages == part.messages);
    EXPECT_EQ(whole.monitors, part.monitors);
    EXPECT_EQ(whole.observations, part.observations);
  }
}

// None is violated; one is, each; a gate vetoes.
INSTANTIATE_TEST_SUITE_P(Recharge, Listening, testing::Values("normal", "experiment1", "experiment2", "shield"));

}  // namespace
}  // namespace sentree::runtime
