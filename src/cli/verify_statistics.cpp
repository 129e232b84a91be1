#include "sentree/cli/verify_statistics.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>

#include "sentree/campaign/statistics.h"
#include "sentree/cli/interrupts.h"
#include "sentree/cli/output.h"
#include "sentree/cli/share.h"
#include "sentree/cli/verify_options.h"
#include "sentree/cli/verify_rare.h"
#include "sentree/verify/at_least.h"
#include "sentree/verify/statistics.h"

namespace sentree::cli {

namespace {

// Runs of a sequential test that has not decided: then nothing is said.
constexpr std::uint64_t kDecidingRunsMax = 1'000'000;

}  // namespace

int verify_by_runs(const VerifyCommand& command, const project::Plan& plan) {
  const auto read = read_statistics(command, plan);
  if (const int* code = std::get_if<int>(&read)) return *code;
  const Sampled& sampled = std::get<Sampled>(read);
  if (!command.split.empty()) return verify_rare(command, plan, sampled);
  const auto& asked = sampled.monitors;
  std::vector<verify::AtLeast> tests;
  if (!command.at_least.empty()) {
    const auto rate = share("--at-least", command.at_least);
    if (!rate) return kUsage;
    tests.assign(asked.size(), verify::AtLeast(*rate, sampled.confidence));
  }
  const Interrupts interrupts;
  std::vector<std::uint64_t> violated(asked.size());
  std::vector<std::uint64_t> owed(asked.size());
  std::uint64_t done = 0;
  verify::Sampling sampling;
  sampling.runs = command.runs ? *command.runs : tests.empty() ? sampling.runs : kDecidingRunsMax;
  sampling.seed = command.seed;
  sampling.order = command.order == "any" ? verify::Order::kAny : verify::Order::kVirtual;
  sampling.length = sampled.length;
  sampling.memory_of_periods = !command.no_memory;
  if (sampled.memory) sampling.memory = *sampled.memory;
  sampling.workers = command.threads;
  sampling.each = in_threads(command.threads);
  sampling.interrupted = is_interrupted;
  sampling.told = [&](const std::vector<verify::Came>& of_run) {
    if (++done % 256 == 0) show_status(fmt::format("{} runs", done));
    bool open = tests.empty();
    for (std::size_t k = 0; k < asked.size(); ++k) {
      const verify::Came came = of_run[asked[k]];
      violated[k] += came == verify::Came::kViolated ? 1U : 0U;
      owed[k] += came == verify::Came::kStillOwed ? 1U : 0U;
      if (tests.empty()) continue;
      tests[k].add(came == verify::Came::kViolated    ? verify::AtLeast::Run::kViolated
                   : came == verify::Came::kStillOwed ? verify::AtLeast::Run::kUnknown
                                                      : verify::AtLeast::Run::kKept);
      open = open || tests[k].state() == verify::AtLeast::State::kOpen;
    }
    return open;
  };
  const auto began = std::chrono::steady_clock::now();
  const auto runs = verify::sample(plan, sampling);
  const double wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
  show_status("");
  if (!runs) {
    say(to_string(runs.error()));
    return kInvalidInput;
  }
  std::string out = fmt::format(
      "{} runs of at most {} s, seed {}: what is left open without a probability comes by the throw of a die\n", *runs,
      shortest_decimal(seconds(sampling.length)), sampling.seed);
  out += sampled.left_out();
  List requirements;
  bool any = false;
  bool open = false;
  std::size_t width = 0;
  for (const std::size_t i : asked) width = std::max(width, plan.monitors[i].name().size());
  for (std::size_t k = 0; k < asked.size(); ++k) {
    const campaign::Interval in = campaign::clopper_pearson(violated[k], *runs, sampled.confidence);
    const std::string& name = plan.monitors[asked[k]].name();
    out += fmt::format("{:<{}}   violated in {} of {}: {:.4g}–{:.4g} % ({} %)", name, width, violated[k], *runs,
                       in.low * 100, in.high * 100, as_percent(sampled.confidence));
    if (owed[k] > 0) out += fmt::format(", still owed at the end of {}", owed[k]);
    Map one{{"name", name},
            {"verdict", violated[k] > 0 ? "refuted" : "unknown"},
            {"vacuous", false},
            {"complete", false},
            {"fair", List()},
            {"first_violation", Value()},
            {"counterexample", Value()},
            {"violated", static_cast<std::int64_t>(violated[k])},
            {"still_owed", static_cast<std::int64_t>(owed[k])},
            {"probability", Map{{"low", in.low},
                                {"high", in.high},
                                {"method", "Clopper-Pearson"},
                                {"confidence", sampled.confidence},
                                {"runs", static_cast<std::int64_t>(*runs)}}}};
    if (!tests.empty()) {
      const auto state = tests[k].state();
      out += fmt::format("   at least {}: {}", command.at_least, verify::to_string(state));
      one["at_least"] = verify::to_string(state);
      if (state == verify::AtLeast::State::kOpen) {
        const auto [low, high] = tests[k].indifference();
        out += fmt::format(", so many runs do not tell {:.4g}–{:.4g} % apart", low * 100, high * 100);
        one["indifference"] = Map{{"low", low}, {"high", high}};
      }
      any = any || state == verify::AtLeast::State::kRefuted;
      open = open || state == verify::AtLeast::State::kOpen;
    } else {
      any = any || violated[k] > 0;
    }
    out += "\n";
    requirements.emplace_back(std::move(one));
  }
  if (command.json) {
    out = to_json(Value(Map{{"tool", "sentree verify"},
                            {"version", SENTREE_VERSION},
                            {"complete", false},
                            {"limits", Map{{"time", seconds(sampling.length)}}},
                            {"order", command.order},
                            {"runs", static_cast<std::int64_t>(*runs)},
                            {"faults", 0},
                            {"faults_left_out", static_cast<std::int64_t>(sampled.faults_left_out)},
                            {"seed", static_cast<std::int64_t>(sampling.seed)},
                            {"requirements", std::move(requirements)},
                            {"wall_s", wall_s}})) +
          "\n";
  }
  print(out);
  if (any) return kFindings;
  if (is_interrupted()) return kInterrupted;
  return open ? kTimeLimit : kOk;
}

}  // namespace sentree::cli
