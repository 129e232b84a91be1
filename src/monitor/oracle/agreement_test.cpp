// Charts that are synthesized from requirements against the evaluator of their semantics.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>

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

// Each requirement's chart decides as the evaluator does, on traces of its own. Ends with the first that does not.
void agree(int requirements, std::string (*requirement_of)(Rng&), std::vector<Message> (*trace_of)(Rng&),
           Decided& decided) {
  const char* given = std::getenv("SENTREE_RANDOM_SEED");
  const std::uint64_t seed = given != nullptr ? std::strtoull(given, nullptr, 10) : 20'240'607;
  std::printf("seed %llu, %d requirements x %d traces\n", static_cast<unsigned long long>(seed), requirements,
              kTracesEach);
  Rng rng(seed);
  for (int i = 0; i < requirements; ++i) {
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
  std::printf("%d violations, %d satisfied\n", decided.violated, decided.satisfied);
}

TEST(Synthesized, DecideAsTheSemanticsSay) {
  constexpr int kRequirements = 20'000;
  Decided decided;
  agree(kRequirements, random_requirement, random_trace, decided);
  // The draw is worth something: many pairs decide.
  EXPECT_GT(decided.violated, kRequirements * kTracesEach / 6);
  EXPECT_GT(decided.satisfied, kRequirements * kTracesEach / 50);
}

TEST(Synthesized, DecideWhatIsOwedFromClosedSegmentsByItself) {
  constexpr int kRequirements = 5'000;
  Decided decided;
  agree(kRequirements, random_owed_between, random_segments, decided);
  EXPECT_GT(decided.violated, kRequirements * kTracesEach / 6);
}

}  // namespace
}  // namespace sentree::monitor::oracle
