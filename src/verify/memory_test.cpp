// What is looked up is what would have been executed: the same graph, of every example with models and of random
// projects.
//
// SENTREE_SEEDS=N tries N random projects instead of the usual ones, SENTREE_SEED=S only that of seed S.

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <string>
#include <vector>

#include "sentree/base/detail/test_seeds.h"
#include "sentree/base/temporary_folder.h"
#include "sentree/verify/detail/test_graphs.h"
#include "sentree/verify/detail/test_random_project.h"
#include "sentree/verify/statistics.h"
#include "sentree/verify/verify.h"

namespace sentree::verify {
namespace {

constexpr std::uint64_t kMemorySeeds = 120;

// Explores with and without a memory.
struct Both {
  // @param looks  How often it is looked whether to go on: at each state, and after 64 ways on from one.
  Both(const project::Plan& plan, Options options, int looks) {
    options.reduce_orders = false;  // what is executed tries them all
    const auto explored = [&] {
      int left = looks;
      options.interrupted = [&left] { return --left < 0; };
      return explore(plan, options);
    };
    const auto remembered = explored();
    options.memory_of_steps = false;
    const auto executed = explored();
    if (remembered && executed) {
      states = executed->nodes.size();
      wrong = difference(*remembered, *executed);
    } else if (remembered || executed) {
      wrong = "only one of them fails: " + to_string((remembered ? executed : remembered).error());
    } else if (remembered.error().code != executed.error().code) {
      wrong = to_string(remembered.error()) + " and " + to_string(executed.error());
    }
  }
  std::size_t states = 0;
  std::string wrong;
};

TEST(PartMemory, FindsWhatIsExecutedInTheExamples) {
  for (const char* const example : {"recharge", "modelled", "topics", "telemetry", "grasp", "handover", "porter"}) {
    SCOPED_TRACE(example);
    auto project = project::load_project(std::string(SENTREE_SOURCE_DIR) + "/examples/" + example);
    ASSERT_TRUE(project.ok());
    const auto plan = project::prepare(with_models(project::plain_scenario(std::move(*project.value))));
    ASSERT_TRUE(plan.ok());
    for (const Order order : {Order::kAny, Order::kVirtual}) {
      Options options;
      options.order = order;
      options.faults = plan.value->scenario.project.verify.faults;
      const Both both(*plan.value, options, 600);
      EXPECT_EQ(both.wrong, "");
      EXPECT_GT(both.states, 3U);
    }
  }
}

TEST(Statistics, OfLongRunsAreTheSameAgain) {
  auto project = project::load_project(std::string(SENTREE_SOURCE_DIR) + "/examples/recharge");
  ASSERT_TRUE(project.ok());
  const auto plan = project::prepare(with_models(project::plain_scenario(std::move(*project.value))));
  ASSERT_TRUE(plan.ok());
  const auto violated = [&] {
    std::vector<std::vector<Came>> all;
    Sampling sampling;
    sampling.runs = 5;
    sampling.length = std::chrono::seconds(60);
    sampling.told = [&](const std::vector<Came>& run) {
      all.push_back(run);
      return true;
    };
    EXPECT_EQ(sample(*plan.value, sampling), sampling.runs);
    return all;
  };
  // Long enough for the monitors to throw away what no verdict needs any more.
  const auto first = violated();
  EXPECT_EQ(first, violated());
  EXPECT_EQ(first.size(), 5U);
}

TEST(PartMemory, FindsWhatIsExecutedInRandomProjects) {
  std::size_t tried = 0;
  std::size_t states = 0;
  for (const std::uint64_t seed : seeds(kMemorySeeds)) {
    const TemporaryFolder folder("memory");
    RandomProject(seed).write(folder.path());
    auto project = project::load_project(folder.path());
    ASSERT_TRUE(project.ok()) << "seed " << seed << ": " << to_string(project.diagnostics.front());
    const auto plan = project::prepare(with_models(project::plain_scenario(std::move(*project.value))));
    if (!plan.ok()) continue;  // what no project may be
    Options options;
    options.order = seed % 3 == 0 ? Order::kAny : Order::kVirtual;
    options.faults = plan.value->scenario.project.verify.faults;
    options.faults_at_most = plan.value->scenario.project.verify.faults_at_most;
    const Both both(*plan.value, options, 30);
    EXPECT_EQ(both.wrong, "") << "seed " << seed;
    if (!both.wrong.empty()) return;
    tried += both.states > 1 ? 1U : 0U;
    states += both.states;
  }
  std::cout << tried << " projects, " << states << " states\n";
  if (is_one_seed()) return;
  EXPECT_GT(tried, seeds(kMemorySeeds).size() / 2) << "hardly any project does anything";
  EXPECT_GT(states, seeds(kMemorySeeds).size() * 5);
}

// What runs violate, one after the other.
std::vector<std::vector<Came>> sampled(const project::Plan& plan, Sampling sampling) {
  std::vector<std::vector<Came>> all;
  sampling.length = std::chrono::milliseconds(900);
  sampling.told = [&](const std::vector<Came>& of_run) {
    all.push_back(of_run);
    return true;
  };
  const auto made = sample(plan, sampling);
  if (!made) ADD_FAILURE() << to_string(made.error());
  return all;
}

TEST(Statistics, OfWhatIsRememberedAreThoseOfWhatIsExecuted) {
  std::size_t violated = 0;
  for (const std::uint64_t seed : seeds(kMemorySeeds / 2)) {
    const TemporaryFolder folder("statistics");
    RandomProject(seed).write(folder.path());
    auto project = project::load_project(folder.path());
    ASSERT_TRUE(project.ok()) << "seed " << seed;
    const auto plan = project::prepare(with_models(project::plain_scenario(std::move(*project.value))));
    if (!plan.ok() || has_errors(obstacles(*plan.value))) continue;
    Sampling sampling;
    sampling.runs = 12;
    sampling.seed = seed;
    sampling.order = seed % 2 == 0 ? Order::kAny : Order::kVirtual;
    const auto remembered = sampled(*plan.value, sampling);
    sampling.memory = 1;  // each run begins with nothing
    const auto forgotten = sampled(*plan.value, sampling);
    sampling.memory_of_periods = false;
    const auto executed = sampled(*plan.value, sampling);
    ASSERT_EQ(remembered, executed) << "seed " << seed;
    ASSERT_EQ(forgotten, executed) << "seed " << seed;
    for (const auto& run : executed)
      violated += std::find(run.begin(), run.end(), Came::kViolated) != run.end() ? 1U : 0U;
  }
  std::cout << violated << " runs violate something\n";
  if (!is_one_seed()) {
    EXPECT_GT(violated, kMemorySeeds / 4);
  }
}

}  // namespace
}  // namespace sentree::verify
