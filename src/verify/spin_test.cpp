// Verdicts against those of SPIN: graphs of random projects as one process in Promela, an observation a state, and
// requirements as formulas of linear temporal logic; fairness is a premise. Only where `spin` and `gcc` are installed.
//
// SENTREE_SEEDS=N tries N random projects instead of the usual ones.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sys/wait.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <map>
#include <string>
#include <vector>

#include "sentree/base/detail/test_seeds.h"
#include "sentree/base/temporary_folder.h"
#include "sentree/text/file.h"
#include "sentree/verify/detail/test_random_project.h"
#include "sentree/verify/verify.h"

namespace sentree::verify {
namespace {

constexpr std::uint64_t kSpinSeeds = 20;
// Larger graphs make compiling slow.
constexpr std::size_t kSpinEdgesMax = 400;
const std::string kSays = "model.says";

int shell(const std::string& command) {
  const int status = std::system(command.c_str());
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

// What one behaviour may say of `said`, the latest answer, in both languages. Before the first answer it is nothing,
// for SPIN -1.
struct Sentence {
  const char* name;
  const char* requirement;
  const char* formula;  ///< IT: the process took this project.
};
constexpr Sentence kSentences[] = {
    {"small", "always said <= 1", "[] (IT -> said <= 1)"},
    {"other", "whenever said = 1, robot shall said != 1 eventually", "[] ((IT && said == 1) -> <> (said != 1))"},
    {"back", "whenever said = 2, robot shall said = 1 eventually", "[] ((IT && said == 2) -> <> (said == 1))"},
    {"zero", "whenever said = 0, robot shall said > 0 eventually", "[] ((IT && said == 0) -> <> (said > 0))"},
};

// All projects as one process, which begins by taking one of them.
class Promela {
 public:
  void add(std::uint64_t project, const Graph& graph) {
    begin_ += "  :: which = " + std::to_string(project) + " -> goto " + node(project, 0) + "\n";
    for (std::uint32_t at = 0; at < graph.nodes.size(); ++at) {
      text_ += node(project, at) + ":\n";
      const Graph::Node& of = graph.nodes[at];
      if (of.edges == 0) {
        text_ += "  goto over;\n";
        continue;
      }
      text_ += "  if\n";
      for (std::uint32_t e = of.first_edge; e < of.first_edge + of.edges; ++e) {
        const Edge& edge = graph.edges[e];
        text_ += "  :: " + fairness(graph, edge);
        for (const Seen& seen : graph.sequences[edge.seen]) {
          const Message& message = graph.observations[seen.observation];
          const Value* const result = message.data.find("result");
          if (message.name != "device.ask.reply" || result == nullptr || !result->is_number()) continue;
          text_ += " said = " + to_json(*result) + ";";
        }
        text_ += " goto " + node(project, edge.to) + "\n";
      }
      text_ += "  fi;\n";
    }
  }

  // @param fair  Each alternative that is offered again and again is taken again and again.
  void claim(const std::string& name, std::uint64_t project, const std::string& formula, bool fair) {
    const std::string it = "which == " + std::to_string(project);
    // Nested deeper, SPIN takes a minute to translate it.
    if (fair)
      claims_ += "ltl " + name + " { (<> [] !(offered && " + it + ") || ([]<> (taken == 1) && []<> (taken == 2))) -> ";
    else
      claims_ += "ltl " + name + " { ";
    std::string text = formula;
    text.replace(text.find("IT"), 2, it);
    claims_ += text + " }\n";
  }

  [[nodiscard]] std::string text() const {
    return "short which = -1; short said = -1; bool offered; byte taken;\nactive proctype mission() {\n  if\n" +
           begin_ + "  fi;\n" + text_ + "over:\n  offered = false;\n  taken = 0\n}\n" + claims_;
  }

 private:
  static std::string node(std::uint64_t project, std::uint32_t at) {
    return "p" + std::to_string(project) + "_" + std::to_string(at);
  }
  // What is chosen in a period, as long as it lasts.
  static std::string fairness(const Graph& graph, const Edge& edge) {
    std::string taken = "0";
    for (const Made& made : graph.decisions[edge.made]) {
      if (made.kind != Made::Kind::kChoice || made.count < 2) continue;
      const ChoicePoint& point = graph.choices[made.what];
      // Of several in one period the model is asked for the first; such graphs are left out.
      if (point.name == "says") taken = point.value;
    }
    return std::string("offered = ") + (taken == "0" ? "false" : "true") + "; taken = " + taken + ";";
  }

  std::string begin_;
  std::string text_;
  std::string claims_;
};

// It is asked twice in some period, which `Promela` cannot tell.
bool asks_twice(const Graph& graph) {
  return std::any_of(graph.decisions.begin(), graph.decisions.end(), [&](const std::vector<Made>& decisions) {
    return std::count_if(decisions.begin(), decisions.end(), [&](const Made& made) {
             return made.kind == Made::Kind::kChoice && graph.choices[made.what].name == "says";
           }) > 1;
  });
}

TEST(Spin, AgreesOnEveryVerdict) {
  if (shell("command -v spin gcc >/dev/null 2>&1") != 0)
    GTEST_SKIP() << "spin or gcc is not installed: apt-get install spin gcc";
  struct Claim {
    std::string claim;
    bool holds = false;
  };
  Promela promela;
  std::vector<Claim> all;
  std::size_t fair_ones = 0;
  for (const std::uint64_t seed : seeds(kSpinSeeds)) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const TemporaryFolder folder("spin");
    RandomProject(seed).write(folder.path());
    std::string requirements = "let said = reply(device.ask)\n";
    for (const Sentence& one : kSentences)
      requirements += std::string(one.name) + " \"It is so.\": " + one.requirement + ".\n";
    ASSERT_TRUE(text::write_file(folder.path() / "r.req", requirements));
    auto project = project::load_project(folder.path());
    ASSERT_TRUE(project.ok()) << to_string(project.diagnostics.front());
    const auto plan = project::prepare(with_models(project::plain_scenario(std::move(*project.value))));
    if (!plan.ok() || has_errors(obstacles(*plan.value))) continue;
    Asked asked;
    asked.explore.states = kSpinEdgesMax;
    asked.explore.order = Order::kVirtual;
    asked.judge.probabilities = false;
    const auto explored = explore(*plan.value, asked.explore);
    if (!explored || !explored->complete || explored->edges.size() > kSpinEdgesMax || explored->probabilistic) continue;
    const Verification found = verify(*plan.value, asked);
    const Graph& graph = found.graph;
    ASSERT_THAT(found.errors, testing::IsEmpty());
    const bool can_be_fair = graph.values.contains(kSays) && !asks_twice(graph);
    promela.add(seed, graph);
    for (const bool fair : {false, true}) {
      if (fair && !can_be_fair) continue;
      if (fair) asked.judge.fair = {kSays};
      const Verification judged = fair ? verify(*plan.value, asked) : found;
      for (const Sentence& one : kSentences) {
        const auto judgement = std::find_if(judged.judgements.begin(), judged.judgements.end(),
                                            [&](const Judgement& other) { return other.requirement == one.name; });
        ASSERT_NE(judgement, judged.judgements.end());
        ASSERT_EQ(judgement->error, "");
        const std::string claim = one.name + std::to_string(seed) + (fair ? "_fair" : "");
        promela.claim(claim, seed, one.formula, fair);
        all.push_back({claim, judgement->finding == Finding::kHolds});
        fair_ones += fair ? 1U : 0U;
      }
    }
  }
  const TemporaryFolder work("spin");
  const std::string at = "cd '" + work.path().string() + "' && ";
  ASSERT_TRUE(text::write_file(work.path() / "all.pml", promela.text()));
  ASSERT_EQ(shell(at + "spin -a all.pml >made 2>&1"), 0) << *text::read_file(work.path() / "made");
  ASSERT_EQ(shell(at + "gcc -O0 -w -o pan pan.c >made 2>&1"), 0) << *text::read_file(work.path() / "made");
  std::size_t refuted = 0;
  for (const Claim& one : all) {
    ASSERT_EQ(shell(at + "./pan -a -m200000 -N " + one.claim + " >told 2>&1"), 0);
    const std::string told = *text::read_file(work.path() / "told");
    ASSERT_NE(told.find("errors: "), std::string::npos) << told;
    EXPECT_EQ(told.find("errors: 0") != std::string::npos, one.holds) << one.claim << '\n' << told;
    refuted += one.holds ? 0U : 1U;
  }
  std::cout << all.size() << " verdicts, " << refuted << " of them refuted, " << fair_ones << " with fairness\n";
  EXPECT_GT(all.size(), seeds(kSpinSeeds).size()) << "hardly any project could be compared";
  EXPECT_GT(refuted, 0U);
  EXPECT_LT(refuted, all.size());
}

}  // namespace
}  // namespace sentree::verify
