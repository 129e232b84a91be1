// With any number of threads the same graph is found, number by number.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <string>
#include <thread>
#include <vector>

#include "sentree/verify/detail/test_graphs.h"
#include "sentree/verify/verify.h"

namespace sentree::verify {
namespace {

// @param shares  Counts what was done in threads.
Each threads(std::size_t count, std::atomic<std::size_t>& shares) {
  return [count, &shares](std::size_t works, const std::function<void(std::size_t)>& work) {
    std::atomic<std::size_t> next = 0;
    std::vector<std::thread> all;
    for (std::size_t i = 0; i < count; ++i) {
      all.emplace_back([&] {
        for (std::size_t at = next++; at < works; at = next++) {
          work(at);
          ++shares;
        }
      });
    }
    for (std::thread& one : all) one.join();
  };
}

std::size_t compare(const project::Plan& plan, Options options) {
  const auto alone = explore(plan, options);
  std::atomic<std::size_t> shares = 0;
  for (const std::size_t count : {1U, 8U}) {
    options.each = threads(count, shares);
    const auto together = explore(plan, options);
    if (!alone || !together) {
      ADD_FAILURE() << to_string((alone ? together : alone).error());
      return shares;
    }
    EXPECT_EQ(difference(*alone, *together), "") << count << " threads";
    EXPECT_EQ(alone->reduced, together->reduced);
    EXPECT_EQ(alone->problems, together->problems);
  }
  return shares;
}

TEST(Threads, FindTheSameInTheExamples) {
  std::size_t shares = 0;
  for (const char* const example : {"recharge", "porter", "warehouse", "modelled", "minimal"}) {
    SCOPED_TRACE(example);
    auto project = project::load_project(std::string(SENTREE_SOURCE_DIR) + "/examples/" + example);
    ASSERT_TRUE(project.ok());
    const auto plan = project::prepare(with_models(project::plain_scenario(std::move(*project.value))));
    ASSERT_TRUE(plan.ok());
    if (has_errors(obstacles(*plan.value))) continue;
    for (const Order order : {Order::kAny, Order::kVirtual}) {
      Options options;
      options.order = order;
      options.states = 3'000;
      options.faults = plan.value->scenario.project.verify.faults;
      shares += compare(*plan.value, options);
    }
  }
  EXPECT_GT(shares, 100U) << "hardly anything was done in threads";
}

}  // namespace
}  // namespace sentree::verify
