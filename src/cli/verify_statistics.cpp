#include "sentree/cli/verify_statistics.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <string_view>

#include "sentree/campaign/statistics.h"
#include "sentree/cli/interrupts.h"
#include "sentree/cli/output.h"
#include "sentree/cli/share.h"
#include "sentree/cli/verify_options.h"
#include "sentree/cli/verify_rare.h"
#include "sentree/cli/verify_result.h"
#include "sentree/verify/at_least.h"
#include "sentree/verify/statistics.h"

namespace sentree::cli {

namespace {

// Runs of a sequential test that has not decided: then nothing is said.
constexpr std::uint64_t kDecidingRunsMax = 1'000'000;

// What came of the runs, requirement by requirement, and what is said of it.
class TallyOfRuns {
 public:
  /// @param rate  What each is tested for; nothing: runs are counted only.
  TallyOfRuns(const VerifyCommand& command, const project::Plan& plan, const Sampled& sampled,
              std::optional<double> rate)
      : command_(command), plan_(plan), sampled_(sampled), asked_(sampled.monitors) {
    if (rate) tests_.assign(asked_.size(), verify::AtLeast(*rate, sampled.confidence));
    for (const std::size_t i : asked_) width_ = std::max(width_, plan.monitors[i].name().size());
  }

  [[nodiscard]] bool is_tested() const { return !tests_.empty(); }

  /// @return  Whether more runs are wanted.
  bool add(const std::vector<verify::Came>& of_run) {
    if (++done_ % 256 == 0) show_status(fmt::format("{} runs", done_));
    for (std::size_t k = 0; k < asked_.size(); ++k) {
      const verify::Came came = of_run[asked_[k]];
      violated_[k] += came == verify::Came::kViolated ? 1U : 0U;
      owed_[k] += came == verify::Came::kStillOwed ? 1U : 0U;
      if (tests_.empty()) continue;
      tests_[k].add(came == verify::Came::kViolated    ? verify::AtLeast::Run::kViolated
                    : came == verify::Came::kStillOwed ? verify::AtLeast::Run::kUnknown
                                                       : verify::AtLeast::Run::kKept);
    }
    return is_open();
  }

  /// Of all runs, as text and as the list of --json.
  void tell(std::uint64_t runs, std::string& out, List& requirements) const {
    for (std::size_t k = 0; k < asked_.size(); ++k) {
      requirements.emplace_back(tell_one(k, runs, out));
      out += "\n";
    }
  }

  /// More runs would tell more.
  [[nodiscard]] bool is_open() const {
    return tests_.empty() || std::any_of(tests_.begin(), tests_.end(), [](const verify::AtLeast& one) {
             return one.state() == verify::AtLeast::State::kOpen;
           });
  }

  [[nodiscard]] int code(bool is_cut) const {
    for (std::size_t k = 0; k < asked_.size(); ++k) {
      const bool refuted = is_tested() ? tests_[k].state() == verify::AtLeast::State::kRefuted : violated_[k] > 0;
      if (refuted) return kFindings;
    }
    if (is_cut) return kInterrupted;
    return is_tested() && is_open() ? kTimeLimit : kOk;
  }

 private:
  // Of what was asked for: that it holds in that share of all runs.
  static std::string_view verdict_of(verify::AtLeast::State state) {
    switch (state) {
      case verify::AtLeast::State::kOpen: return "unknown";
      case verify::AtLeast::State::kHolds: return "holds";
      case verify::AtLeast::State::kRefuted: return "refuted";
    }
    return "";
  }

  Map tell_one(std::size_t k, std::uint64_t runs, std::string& out) const {
    // Nobody knows of what is open where a run is ended: below it counts as kept, above as violated.
    const campaign::Interval in{campaign::clopper_pearson(violated_[k], runs, sampled_.confidence).low,
                                campaign::clopper_pearson(violated_[k] + owed_[k], runs, sampled_.confidence).high};
    const std::string& name = plan_.monitors[asked_[k]].name();
    out += fmt::format("{:<{}}   violated in {} of {}: {:.4g}–{:.4g} % ({} %)", name, width_, violated_[k], runs,
                       in.low * 100, in.high * 100, as_percent(sampled_.confidence));
    if (owed_[k] > 0) out += fmt::format(", still owed at the end of {}", owed_[k]);
    Map probability = probability_result(in.low, in.high, "Clopper-Pearson", sampled_.confidence);
    probability["runs"] = static_cast<std::int64_t>(runs);
    Map one = requirement_result(name, is_tested()        ? verdict_of(tests_[k].state())
                                       : violated_[k] > 0 ? "refuted"
                                                          : "unknown");
    one["probability"] = std::move(probability);
    one["violated"] = static_cast<std::int64_t>(violated_[k]);
    one["still_owed"] = static_cast<std::int64_t>(owed_[k]);
    if (!is_tested()) return one;
    const auto state = tests_[k].state();
    out += fmt::format("   at least {}: {}", command_.at_least, verify::to_string(state));
    one["at_least"] = state == verify::AtLeast::State::kOpen ? "undecided" : verdict_of(state);
    if (state == verify::AtLeast::State::kOpen) {
      const auto [low, high] = tests_[k].indifference();
      out += fmt::format(", so many runs do not tell {:.4g}–{:.4g} % apart", low * 100, high * 100);
      one["indifference"] = Map{{"low", low}, {"high", high}};
    }
    return one;
  }

  const VerifyCommand& command_;
  const project::Plan& plan_;
  const Sampled& sampled_;
  const std::vector<std::size_t>& asked_;
  std::vector<verify::AtLeast> tests_;
  std::vector<std::uint64_t> violated_ = std::vector<std::uint64_t>(asked_.size());
  std::vector<std::uint64_t> owed_ = violated_;
  std::uint64_t done_ = 0;
  std::size_t width_ = 0;
};

}  // namespace

int verify_by_runs(const VerifyCommand& command, const project::Plan& plan, const std::vector<verify::MadeModel>& any) {
  const auto read = read_statistics(command, plan);
  if (const int* code = std::get_if<int>(&read)) return *code;
  const Sampled& sampled = std::get<Sampled>(read);
  if (!command.split.empty()) return verify_rare(command, plan, sampled, any);
  std::optional<double> rate;
  if (!command.at_least.empty()) {
    rate = share("--at-least", command.at_least);
    if (!rate) return kUsage;
  }
  TallyOfRuns tally(command, plan, sampled, rate);
  const Interrupts interrupts;
  verify::Sampling sampling;
  sampling.runs = command.runs ? *command.runs : tally.is_tested() ? kDecidingRunsMax : sampling.runs;
  sampling.seed = command.seed;
  sampling.order = command.order == "any" ? verify::Order::kAny : verify::Order::kVirtual;
  sampling.length = sampled.length;
  sampling.memory_of_periods = !command.no_memory;
  if (sampled.memory) sampling.memory = *sampled.memory;
  sampling.workers = command.threads;
  sampling.each = in_threads(command.threads);
  sampling.interrupted = is_interrupted;
  sampling.told = [&](const std::vector<verify::Came>& of_run) { return tally.add(of_run); };
  const auto began = std::chrono::steady_clock::now();
  const auto runs = verify::sample(plan, sampling);
  const double wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
  show_status("");
  if (!runs) return refuse(command, {runs.error()});
  const bool is_cut = is_interrupted() && *runs < sampling.runs && tally.is_open();
  std::string out = fmt::format(
      "{}{} runs of at most {} s, seed {}: what is left open without a probability comes by the throw of a "
      "die\n",
      is_cut ? fmt::format("INTERRUPTED after {} of {}", *runs, tally.is_tested() ? "at most " : "") : "",
      is_cut ? sampling.runs : *runs, shortest_decimal(seconds(sampling.length)), sampling.seed);
  out += sampled.left_out();
  List requirements;
  tally.tell(*runs, out, requirements);
  if (command.json) {
    Map result = verify_result(command, plan, any, {});
    result["requirements"] = std::move(requirements);
    result["runs"] = static_cast<std::int64_t>(*runs);
    result["problems"] = to_list(sampled.warnings);
    result["faults_left_out"] = static_cast<std::int64_t>(sampled.faults_left_out);
    (*result["limits"].as_map())["run_s"] = seconds(sampling.length);
    if (is_cut) (*result["limits"].as_map())["ended_by"] = "interrupted";
    result["wall_s"] = wall_s;
    out = to_json(Value(std::move(result))) + "\n";
  }
  print(out);
  return tally.code(is_cut);
}

}  // namespace sentree::cli
