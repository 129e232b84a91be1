// Charts that are synthesized from requirements against the evaluator of their semantics.
// SENTREE_SEEDS=N tries requirements of N seeds instead of the usual ones, SENTREE_SEED=S only those of seed S.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "sentree/base/detail/test_seeds.h"
#include "sentree/monitor/monitor.h"
#include "sentree/monitor/oracle/evaluator.h"
#include "sentree/monitor/oracle/random.h"

namespace sentree::monitor::oracle {

void PrintTo(const Outcome& outcome, std::ostream* out) {
  *out << (outcome.violated ? "violated" : "satisfied") << " at " << outcome.at.time_since_epoch().count() << " ns by "
       << (outcome.deciding == 0 ? "silence" : "observation " + std::to_string(outcome.deciding));
}

namespace {

constexpr int kTracesEach = 5;

struct Ran {
  std::vector<Outcome> outcomes;
  Decisions decisions;
};

Ran run(const Model& model, const std::vector<Message>& trace, TimePoint end) {
  Ran ran;
  State state = start(model, TimePoint{});
  const auto take = [&](Decisions decisions) {
    for (Decision& d : decisions) {
      ran.outcomes.push_back({d.verdict == Verdict::kViolated, d.at, d.deciding ? d.deciding->sequence : 0});
      ran.decisions.push_back(std::move(d));
    }
  };
  for (const Message& message : trace) take(observe(model, state, message));
  take(advance(model, state, end));
  EXPECT_FALSE(state.failure()) << to_string(*state.failure());
  return ran;
}

// Replayed alone, the witness decides the same at the same time.
bool witness_decides(const Model& model, const Decision& decision) {
  const Ran again = run(model, decision.witness, decision.at);
  if (again.outcomes.empty()) return false;
  const Outcome& last = again.outcomes.back();
  return last.at == decision.at && last.violated == (decision.verdict == Verdict::kViolated) &&
         last.deciding == (decision.deciding ? decision.deciding->sequence : 0);
}

Requirement parse(const std::string& definitions, const std::string& text) {
  auto file = parse_requirements(definitions + text, "r.req");
  for (const Diagnostic& diagnostic : file.diagnostics) ADD_FAILURE() << to_string(diagnostic) << "\n" << text;
  return file.ok() ? file.value->requirements.at(0) : Requirement();
}

struct Decided {
  int violated = 0;
  int satisfied = 0;
};

constexpr int kRequirementsEach = 10;

// Each requirement's chart decides as the evaluator does, on traces of its own. Ends with the first that does not.
void agree(std::uint64_t seed, std::string (*requirement_of)(Rng&), std::vector<Message> (*trace_of)(Rng&),
           Decided& decided) {
  SCOPED_TRACE("seed " + std::to_string(seed));
  Rng rng(seed);
  for (int i = 0; i < kRequirementsEach; ++i) {
    const std::string text = requirement_of(rng);
    const Requirement requirement = parse(random_definitions(), text);
    if (!requirement.p) return;
    const auto model = Model::make(requirement);
    ASSERT_TRUE(model.ok()) << text << to_string(model.diagnostics.front());
    for (int t = 0; t < kTracesEach; ++t) {
      const std::vector<Message> trace = trace_of(rng);
      const TimePoint end = (trace.empty() ? TimePoint{} : trace.back().time) + Duration(rng.below(6'000'000));
      const std::vector<Outcome> expected = evaluate(requirement, trace, end);
      const Ran ran = run(*model.value, trace, end);
      for (const Outcome& outcome : expected) ++(outcome.violated ? decided.violated : decided.satisfied);
      ASSERT_EQ(ran.outcomes, expected) << text << "\nend " << end.time_since_epoch().count() << " ns\n"
                                        << show(trace) << model.value->chart().source();
      for (const Decision& decision : ran.decisions) {
        ASSERT_TRUE(witness_decides(*model.value, decision)) << text << "\n"
                                                             << show(trace) << "witness\n"
                                                             << show(decision.witness);
      }
    }
  }
}

// Of how many pairs of requirement and trace something is decided.
Decided agree(const std::vector<std::uint64_t>& seeds, std::string (*requirement_of)(Rng&),
              std::vector<Message> (*trace_of)(Rng&)) {
  Decided decided;
  for (const std::uint64_t seed : seeds) {
    agree(seed, requirement_of, trace_of, decided);
    if (::testing::Test::HasFailure()) break;
  }
  std::printf("%zu pairs: %d violations, %d satisfied\n", seeds.size() * kRequirementsEach * kTracesEach,
              decided.violated, decided.satisfied);
  return decided;
}

// The draw is worth something: so many pairs decide.
int one_in(int n, const std::vector<std::uint64_t>& seeds) {
  return is_one_seed() ? -1 : static_cast<int>(seeds.size()) * kRequirementsEach * kTracesEach / n;
}

TEST(Synthesized, DecideAsTheSemanticsSay) {
  const auto all = seeds(1000);
  const Decided decided = agree(all, random_requirement, random_trace);
  EXPECT_GT(decided.violated, one_in(6, all));
  EXPECT_GT(decided.satisfied, one_in(50, all));
}

TEST(Synthesized, DecideWhatIsOwedFromClosedSegmentsByItself) {
  const auto all = seeds(250);
  const Decided decided = agree(all, random_owed_between, random_segments);
  EXPECT_GT(decided.violated, one_in(6, all));
}

}  // namespace
}  // namespace sentree::monitor::oracle
