#include "sentree/cli/verify_rare.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <numeric>

#include "sentree/campaign/statistics.h"
#include "sentree/cli/interrupts.h"
#include "sentree/cli/output.h"
#include "sentree/cli/share.h"
#include "sentree/cli/verify_result.h"
#include "sentree/verify/splitting.h"

namespace sentree::cli {

namespace {

// Fewer do not tell how far their mean may be off.
constexpr std::uint64_t kRepetitionsMin = 10;

struct Estimate {
  double mean = 0;
  campaign::Interval in;
};

// Of what hardly ever happens, no repetition may have seen anything: then as many runs as began have not. What is open
// where a run is ended counts as kept below, and as violated above.
Estimate estimate(const verify::Splits& found, double confidence) {
  const auto interval = [&](const std::vector<double>& shares) {
    const bool nothing = std::all_of(shares.begin(), shares.end(), [](double share) { return share == 0; });
    return nothing ? campaign::clopper_pearson(0, found.runs, confidence)
                   : campaign::mean_of_shares(shares, confidence);
  };
  const double sum = std::accumulate(found.estimates.begin(), found.estimates.end(), 0.0);
  return {sum / std::max<double>(1, static_cast<double>(found.estimates.size())),
          {interval(found.estimates).low, interval(found.with_open).high}};
}

}  // namespace

int verify_rare(const VerifyCommand& command, const project::Plan& plan, const Sampled& sampled,
                const std::vector<verify::MadeModel>& any_replies) {
  const Interrupts interrupts;
  verify::Splitting splitting;
  splitting.score = command.split;
  if (command.runs) splitting.repetitions = std::max(kRepetitionsMin, *command.runs / splitting.walkers);
  splitting.seed = command.seed;
  splitting.order = command.order == "any" ? verify::Order::kAny : verify::Order::kVirtual;
  splitting.length = sampled.length;
  if (sampled.memory) splitting.memory = *sampled.memory;
  splitting.workers = command.threads;
  splitting.each = in_threads(command.threads);
  splitting.interrupted = is_interrupted;
  splitting.progress = [&](std::uint64_t done) {
    show_status(fmt::format("{} of {} repetitions", done, splitting.repetitions));
  };
  std::vector<std::string> warnings = sampled.warnings;
  if (splitting.score == verify::kOwed) {
    for (const std::size_t i : sampled.monitors) {
      const monitor::Model& model = plan.monitors[i];
      if (model.origin() != nullptr && model.origin()->requirement.bound) continue;
      warnings.push_back(
          fmt::format("{} has no bound that could be used up, so that nothing is nearer to a violation; "
                      "--split MODEL.DATA names something that is",
                      model.name()));
      say("! " + warnings.back());
    }
  }
  std::string out = fmt::format(
      "{} repetitions of {} runs of at most {} s, split by {}, seed {}: what is left open without a probability comes "
      "by the throw of a die\n",
      splitting.repetitions, splitting.walkers, shortest_decimal(seconds(splitting.length)), splitting.score,
      splitting.seed);
  out += sampled.left_out();
  List requirements;
  bool any = false;
  bool is_cut = false;  // by an interruption
  std::size_t width = 0;
  for (const std::size_t i : sampled.monitors) width = std::max(width, plan.monitors[i].name().size());
  const auto began = std::chrono::steady_clock::now();
  for (const std::size_t i : sampled.monitors) {
    const std::string& name = plan.monitors[i].name();
    if (is_interrupted()) {
      out += fmt::format("{:<{}}   INTERRUPTED before it was begun\n", name, width);
      requirements.emplace_back(requirement_result(name, "unknown"));
      is_cut = true;
      continue;
    }
    const auto found = verify::split(plan, i, splitting);
    show_status("");
    if (!found) return refuse(command, {found.error()});
    const auto [mean, in] = estimate(*found, sampled.confidence);
    const auto seen =
        std::count_if(found->estimates.begin(), found->estimates.end(), [](double share) { return share > 0; });
    out +=
        fmt::format("{:<{}}   violated with probability {:.3g}: {:.3g} to {:.3g} ({} %), seen in {} of {} repetitions",
                    name, width, mean, in.low, in.high, as_percent(sampled.confidence), seen, found->estimates.size());
    if (found->owed > 0) out += fmt::format(", still owed at the end of {} of {} runs", found->owed, found->runs);
    if (found->estimates.size() < splitting.repetitions) {
      out += fmt::format(", INTERRUPTED before the other {}", splitting.repetitions - found->estimates.size());
      is_cut = true;
    }
    out += '\n';
    any = any || mean > 0;
    Map probability = probability_result(in.low, in.high, "adaptive multilevel splitting", sampled.confidence);
    probability["mean"] = mean;
    probability["runs"] = static_cast<std::int64_t>(found->runs);
    probability["branches"] = static_cast<std::int64_t>(found->branches);
    probability["repetitions"] = static_cast<std::int64_t>(found->estimates.size());
    probability["seen"] = static_cast<std::int64_t>(seen);
    Map one = requirement_result(name, mean > 0 ? "refuted" : "unknown");
    one["probability"] = std::move(probability);
    one["still_owed"] = static_cast<std::int64_t>(found->owed);
    requirements.emplace_back(std::move(one));
  }
  if (command.json) {
    const double wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
    Map result = verify_result(command, plan, any_replies, {});
    result["requirements"] = std::move(requirements);
    result["problems"] = to_list(warnings);
    result["faults_left_out"] = static_cast<std::int64_t>(sampled.faults_left_out);
    (*result["limits"].as_map())["run_s"] = seconds(splitting.length);
    if (is_cut) (*result["limits"].as_map())["ended_by"] = "interrupted";
    result["wall_s"] = wall_s;
    out = to_json(Value(std::move(result))) + "\n";
  }
  print(out);
  return any ? kFindings : is_cut ? kInterrupted : kOk;
}

}  // namespace sentree::cli
