// Orders that nobody tells apart are left out: what each monitor hears must be the same as with all of them.
//
// SENTREE_SEEDS=N tries N random projects instead of the usual ones, SENTREE_SEED=S only that of seed S.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <iostream>
#include <set>
#include <span>
#include <string>
#include <utility>

#include "sentree/base/detail/test_seeds.h"
#include "sentree/base/temporary_folder.h"
#include "sentree/text/file.h"
#include "sentree/verify/detail/test_random_project.h"
#include "sentree/verify/monitor_memory.h"
#include "sentree/verify/verify.h"

namespace sentree::verify {
namespace {

constexpr std::uint64_t kOrderSeeds = 14;
constexpr std::uint32_t kDepth = 3;
constexpr std::size_t kHeardMax = 1'000;

// What one monitor can hear in some ticks: one text for each way.
class Heard {
 public:
  static std::set<std::string> all(const Graph& graph, const monitor::Model& model) {
    Heard heard(graph, model);
    heard.walk(0, 0, "");
    return std::move(heard.all_);
  }

 private:
  Heard(const Graph& graph, const monitor::Model& model)
      : graph_(graph), memory_(graph, model), dispatch_(std::span<const monitor::Model>(&model, 1)) {}

  void walk(std::uint32_t at, std::uint32_t tick, const std::string& text) {
    if (all_.size() >= kHeardMax) return;
    const Graph::Node& node = graph_.nodes[at];
    if (node.ended || tick == kDepth) {
      all_.insert(text);
      return;
    }
    std::set<std::pair<std::uint32_t, std::uint32_t>> gone;
    for (std::uint32_t e = node.first_edge; e < node.first_edge + node.edges; ++e) {
      const Edge& edge = graph_.edges[e];
      if (!gone.emplace(edge.to, memory_.heard(edge.seen)).second) continue;
      std::string more = text + '\n';
      for (const Seen& seen : graph_.sequences[edge.seen]) {
        const Message& message = graph_.observations[seen.observation];
        if (dispatch_.route(message.name).of(message.source).monitors.empty()) continue;
        more += std::to_string(seen.after.count()) + ' ' + message.name + ' ' + message.source + to_json(message.data);
      }
      walk(edge.to, tick + 1, more);
    }
  }

  const Graph& graph_;
  MonitorMemory memory_;
  monitor::Dispatch dispatch_;
  std::set<std::string> all_;
};

TEST(Orders, ThatNobodyTellsApartChangeNothing) {
  std::size_t compared = 0;
  std::size_t fewer = 0;
  for (const std::uint64_t seed : seeds(kOrderSeeds)) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const TemporaryFolder folder("orders");
    RandomProject(seed, 3).write(folder.path());
    auto project = project::load_project(folder.path());
    ASSERT_TRUE(project.ok()) << to_string(project.diagnostics.front());
    const auto plan = project::prepare(with_models(project::plain_scenario(std::move(*project.value))));
    if (!plan.ok() || has_errors(obstacles(*plan.value)) || !plan.value->gates.empty()) continue;
    Asked asked;
    asked.explore.ticks = kDepth;
    asked.explore.states = 3'000;
    if (seed % 2 == 0) asked.explore.faults = plan.value->scenario.project.verify.faults;
    asked.judge.probabilities = false;
    const Verification few = verify(*plan.value, asked);
    asked.explore.reduce_orders = false;
    const Verification all = verify(*plan.value, asked);
    if (has_errors(all.errors)) continue;  // too many ways
    ASSERT_THAT(few.errors, testing::IsEmpty());
    if (all.graph.complete_to < kDepth && !all.graph.complete) continue;
    ASSERT_EQ(few.judgements.size(), all.judgements.size());
    for (std::size_t i = 0; i < all.judgements.size(); ++i) {
      SCOPED_TRACE(all.judgements[i].requirement);
      EXPECT_EQ(few.judgements[i].finding, all.judgements[i].finding);
      EXPECT_EQ(few.judgements[i].vacuous, all.judgements[i].vacuous);
      EXPECT_EQ(few.judgements[i].at, all.judgements[i].at);
      EXPECT_EQ(few.judgements[i].can_stay_open.has_value(), all.judgements[i].can_stay_open.has_value());
      const std::set<std::string> heard = Heard::all(all.graph, plan.value->monitors[i]);
      if (heard.size() < kHeardMax) {
        EXPECT_EQ(Heard::all(few.graph, plan.value->monitors[i]), heard);
      }
    }
    EXPECT_EQ(few.graph.taken, all.graph.taken);
    EXPECT_EQ(few.graph.statuses, all.graph.statuses);
    EXPECT_LE(few.graph.edges.size(), all.graph.edges.size());
    ++compared;
    fewer += few.graph.edges.size() < all.graph.edges.size() ? 1U : 0U;
  }
  std::cout << compared << " projects, " << fewer << " with fewer ways\n";
  if (is_one_seed()) return;
  EXPECT_GT(compared, seeds(kOrderSeeds).size() / 4);
  EXPECT_GT(fewer, compared / 10) << "hardly anything is left out";
}

TEST(Orders, OfPartsApartAreTriedOnce) {
  auto project = project::load_project(std::string(SENTREE_SOURCE_DIR) + "/examples/warehouse");
  ASSERT_TRUE(project.ok());
  const auto plan = project::prepare(with_models(project::plain_scenario(std::move(*project.value))));
  ASSERT_TRUE(plan.ok());
  Asked asked;
  asked.judge.fair = plan.value->scenario.project.verify.fair;
  const Verification few = verify(*plan.value, asked);
  asked.explore.reduce_orders = false;
  const Verification all = verify(*plan.value, asked);
  ASSERT_THAT(few.errors, testing::IsEmpty());
  EXPECT_TRUE(few.graph.reduced);
  EXPECT_FALSE(all.graph.reduced);
  EXPECT_EQ(few.graph.nodes.size(), all.graph.nodes.size());
  EXPECT_LT(few.graph.edges.size(), all.graph.edges.size() / 2);
  for (std::size_t i = 0; i < all.judgements.size(); ++i) {
    EXPECT_EQ(few.judgements[i].finding, all.judgements[i].finding) << all.judgements[i].requirement;
    EXPECT_EQ(few.judgements[i].fair, all.judgements[i].fair) << all.judgements[i].requirement;
  }
}

}  // namespace
}  // namespace sentree::verify
