// The host of the library `mission` and the run-time system do the same.

#include "sentree/mission/virtual_host.h"

#include <gtest/gtest.h>

#include "sentree/base/rng.h"
#include "sentree/mission/choice.h"
#include "sentree/project/plan.h"
#include "sentree/runtime/run.h"

namespace sentree::runtime {
namespace {

class Listener final : public mission::Surroundings {
 public:
  void observed(const Message& message) override {
    if (!message.name.starts_with("monitor.")) lines.push_back(line_of(message));
  }
  // Monitors take numbers of their own.
  static std::string line_of(Message message) {
    message.sequence = 0;
    message.stamp = 0;
    return to_json(message);
  }
  // With a generator, any order may come.
  std::size_t order(std::uint64_t number, std::span<const mission::Delivery* const> due) override {
    if (!rng) return 0;
    const std::size_t which = rng->next() % due.size();
    if (which > 0) orders.push_back({.number = number, .first = std::string(part_of(*plan, *due[which])), .span = {}});
    return which;
  }

  std::vector<std::string> lines;
  const project::Plan* plan = nullptr;
  std::optional<Rng> rng;
  std::vector<project::ScenarioOrder> orders;
};

// @param any_order  Throws a die at each instant with messages for several parts; `others` counts what is not as in
//                   virtual time.
void same(const std::string& folder, bool models, std::uint64_t seed, bool any_order, std::size_t& others) {
  SCOPED_TRACE(folder + ", seed " + std::to_string(seed));
  auto project = project::load_project(std::string(SENTREE_SOURCE_DIR) + "/examples/" + folder);
  ASSERT_TRUE(project.ok());
  project::Scenario scenario = project::plain_scenario(std::move(*project.value));
  scenario.virtual_time = true;
  scenario.seed = seed;
  scenario.duration = std::chrono::seconds(20);
  if (models) {
    for (project::ServiceEntry& service : scenario.project.services) service.at = "model";
  }
  auto plan = project::prepare(std::move(scenario));
  ASSERT_TRUE(plan.ok());
  ASSERT_TRUE(mission::VirtualHost::obstacles(*plan.value).empty());
  Listener ours;
  ours.plan = &*plan.value;
  if (any_order) ours.rng.emplace(seed);
  mission::VirtualHost host(*plan.value);
  mission::State state = host.begin();
  const TimePoint end = TimePoint{} + plan.value->scenario.duration;
  while (!mission::VirtualHost::ended(state) && mission::VirtualHost::next(state) < end) host.step(state, ours);

  others += ours.orders.size();
  plan.value->scenario.orders = ours.orders;
  Listener theirs;
  RunOptions options;
  options.listeners.push_back([&](const Message& message) {
    if (message.time < end) theirs.observed(message);
  });
  const RunReport report = Run(*plan.value, std::move(options)).execute();
  EXPECT_EQ(report.error, "");
  ASSERT_GT(ours.lines.size(), 20U);
  EXPECT_EQ(ours.lines, theirs.lines);
}

TEST(VirtualHost, IsTheRunTimeSystemMessageForMessage) {
  std::size_t others = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    same("recharge", true, seed, false, others);
    same("modelled", false, seed, false, others);
    same("topics", false, seed, false, others);
  }
  EXPECT_EQ(others, 0U);
}

TEST(VirtualHost, IsTheRunTimeSystemInEveryOrder) {
  std::size_t others = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    same("recharge", true, seed, true, others);
    same("topics", false, seed, true, others);
    // Three robots: of more than two parts the others keep their order.
    same("warehouse", false, seed, true, others);
  }
  EXPECT_GT(others, 1'000U) << "hardly anything came in another order";
}

}  // namespace
}  // namespace sentree::runtime
