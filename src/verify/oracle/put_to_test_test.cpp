// Whether a requirement was put to the test: what a run says, what `verify` says of a mission that can only go so, and
// what the semantics of requirements say.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>

#include "sentree/monitor/oracle/evaluator.h"
#include "sentree/monitor/oracle/random.h"
#include "sentree/monitor/tested.h"
#include "sentree/verify/judge.h"

namespace sentree::verify {
namespace {

using monitor::Pattern;
namespace oracle = monitor::oracle;

// A mission that does this, and ends.
Graph graph_of(const std::vector<Message>& trace, TimePoint end) {
  Graph graph;
  graph.period = end - TimePoint{};
  graph.nodes = {{.at = {}, .depth = 0, .first_edge = 0, .edges = 1, .ended = false, .cut_off = false},
                 {.at = {}, .depth = 1, .first_edge = 1, .edges = 1, .ended = false, .cut_off = false},
                 {.at = end, .depth = 2, .first_edge = 2, .edges = 0, .ended = true, .cut_off = false}};
  graph.edges = {{.from = 0, .to = 1, .seen = 0, .made = 0}, {.from = 1, .to = 2, .seen = 1, .made = 0}};
  graph.decisions.resize(1);
  graph.sequences.resize(2);
  for (const Message& message : trace) {
    graph.sequences[1].push_back({message.time - TimePoint{}, static_cast<std::uint32_t>(graph.observations.size())});
    graph.observations.push_back(message);
  }
  return graph;
}

// Time alone violates these, whatever came.
bool is_violated_by_silence(Pattern pattern) {
  return pattern == Pattern::kEventually || pattern == Pattern::kAtLeastEvery;
}

struct Counts {
  std::array<int, 12> tested{};
  std::array<int, 12> untested{};
  std::array<int, 12> vacuous{};
};

void agree(int requirements, std::string (*requirement_of)(Rng&), std::vector<Message> (*trace_of)(Rng&),
           Counts& counts) {
  constexpr int kTracesEach = 5;
  Rng rng(20'261'128);
  for (int i = 0; i < requirements; ++i) {
    const std::string text = requirement_of(rng);
    const auto file = monitor::parse_requirements(oracle::random_definitions() + text, "r.req");
    ASSERT_TRUE(file.ok()) << text;
    const monitor::Requirement& requirement = file.value->requirements.at(0);
    const auto model = monitor::Model::make(requirement);
    ASSERT_TRUE(model.ok()) << text;
    const auto test = monitor::test_of(requirement);
    ASSERT_EQ(test.has_value(), model.value->test() != nullptr) << text;
    for (int t = 0; t < kTracesEach; ++t) {
      const std::vector<Message> trace = trace_of(rng);
      const TimePoint end = (trace.empty() ? TimePoint{} : trace.back().time) + Duration(1 + rng.below(6'000'000));
      const auto decided = oracle::evaluate(requirement, trace, end);
      const bool violated = std::any_of(decided.begin(), decided.end(), [](const auto& one) { return one.violated; });
      const auto asked = test ? oracle::evaluate(*test, trace, end) : std::vector<oracle::Outcome>{{.violated = true}};
      const bool tested = !asked.empty() && asked.front().violated;
      if (violated && !is_violated_by_silence(requirement.pattern)) {
        EXPECT_TRUE(tested) << text << "\n" << oracle::show(trace);
      }

      monitor::State state = monitor::start(*model.value, TimePoint{});
      for (const Message& message : trace) (void)monitor::observe(*model.value, state, message);
      (void)monitor::advance(*model.value, state, end);
      const std::string untested = monitor::vacuity(*model.value, state);
      ASSERT_EQ(untested.empty(), tested || violated) << text << "\n" << oracle::show(trace) << untested;

      JudgeOptions options;
      options.probabilities = false;
      const Judgement judged = judge(graph_of(trace, end), *model.value, options);
      ASSERT_EQ(judged.error, "");
      if (judged.finding == Finding::kHolds) {
        ASSERT_EQ(judged.vacuous.empty(), untested.empty()) << text << "\n" << oracle::show(trace) << judged.vacuous;
        counts.vacuous[static_cast<std::size_t>(requirement.pattern)] += untested.empty() ? 0 : 1;
      } else {
        ASSERT_EQ(judged.finding, Finding::kRefuted);
      }
      ++(tested ? counts.tested : counts.untested)[static_cast<std::size_t>(requirement.pattern)];
      if (testing::Test::HasFailure()) return;
    }
  }
}

TEST(PutToTheTest, IsTheSameOfRunsAndOfVerify) {
  Counts counts;
  agree(2'000, oracle::random_requirement, oracle::random_trace, counts);
  agree(500, oracle::random_owed_between, oracle::random_segments, counts);
  // Of each pattern, many of either.
  EXPECT_THAT(counts.tested, testing::Each(testing::Gt(60)));
  EXPECT_THAT(counts.untested, testing::Each(testing::Gt(60)));
  EXPECT_THAT(counts.vacuous, testing::Each(testing::Gt(40)));
}

}  // namespace
}  // namespace sentree::verify
