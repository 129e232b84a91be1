#include <fmt/format.h>

#include <algorithm>

#include "sentree/base/shown.h"
#include "sentree/campaign/summary.h"

namespace sentree::campaign {

namespace {

// Worst runs that people are shown on a terminal.
constexpr std::size_t kWorstShown = 5;

std::string percent(double rate) {
  const double value = rate * 100;
  if (value == 0 || value >= 100) return fmt::format("{:.0f} %", value);
  return value < 0.1 ? fmt::format("{:.2g} %", value) : fmt::format("{:.2f} %", value);
}

std::string rate_text(const Summary& summary, std::uint64_t hits) {
  if (summary.counted() == 0) return "no run counts";
  const auto known = summary.rate(hits).interval;
  return fmt::format("{:>8}  [{}, {}]", percent(static_cast<double>(hits) / static_cast<double>(summary.counted())),
                     percent(known.low), percent(known.high));
}

std::string tally_text(const Tally& tally, double factor, const char* unit) {
  const auto text = [&](double value) { return fmt::format("{:.1f} {}", value * factor, unit); };
  return fmt::format("least {}, 5 % {}, median {}, 95 % {}, most {}", text(tally.least()), text(tally.quantile(0.05)),
                     text(tally.quantile(0.5)), text(tally.quantile(0.95)), text(tally.most()));
}

}  // namespace

std::string to_text(const Summary& summary, const std::map<std::string, std::string>& minimal) {
  const Asked& asked = summary.asked();
  std::size_t width = 13;
  for (const auto& requirement : summary.requirements()) width = std::max(width, requirement.name.size());
  const auto line = [&](const std::string& name, const std::string& what) {
    return fmt::format("{:<{}}  {}\n", name, width, what);
  };
  const auto file = [&](const std::string& of) {
    const auto found = minimal.find(of);
    return found == minimal.end() ? std::string() : "   " + found->second;
  };
  std::string out = line("runs", fmt::format("{}, seed {}, intervals of {}{}", grouped(summary.runs()), asked.seed,
                                             fmt::format("{:.6g} %", asked.confidence * 100),
                                             summary.ended_by().empty() ? "" : "; " + summary.ended_by()));
  out += line("mission", "SUCCESS   " + rate_text(summary, summary.ended(Outcome::kSuccess)));
  for (const Outcome outcome : {Outcome::kFailure, Outcome::kRunning}) {
    if (const auto count = summary.ended(outcome); count > 0) {
      out += line("", fmt::format("{}   {}{}", to_string(outcome), rate_text(summary, count),
                                  outcome == Outcome::kFailure ? file("mission") : ""));
    }
  }
  for (const auto& [reason, count] : summary.reasons())
    out += line("", fmt::format("  {} × {}", grouped(count), reason.empty() ? "no reason given" : reason));
  for (const auto& requirement : summary.requirements()) {
    out += line(requirement.name,
                fmt::format("violated  {}{}", rate_text(summary, requirement.violated), file(requirement.name)));
    if (requirement.untested > 0)
      out += line("", fmt::format("not put to the test in {}", requirement.untested == summary.counted()
                                                                   ? "any run"
                                                                   : grouped(requirement.untested) + " runs"));
  }
  for (const SequentialTest& test : summary.tests()) {
    out += line("expected",
                fmt::format("{}: {} after {} runs, {} of them so; of {} to {} it says either", test.expectation().text,
                            to_string(test.state()), grouped(test.runs()), grouped(test.hits()),
                            percent(test.indifference().low), percent(test.indifference().high)));
  }
  if (summary.time_to_goal().count() > 0) out += line("time to goal", tally_text(summary.time_to_goal(), 1, "s"));
  if (summary.battery().count() > 0) out += line("battery least", tally_text(summary.battery(), 100, "%"));
  for (std::size_t outcome = 0; outcome < summary.outcomes(); ++outcome) {
    std::string causes;
    for (const auto& cause : summary.causes(outcome)) {
      causes += fmt::format("{}{} {:.0f} %", causes.empty() ? "" : ", ", summary.factors()[cause.factor].name,
                            cause.influence.share * 100);
    }
    if (!causes.empty()) out += line("what matters", fmt::format("{}: {}", summary.outcome_name(outcome), causes));
  }
  std::size_t shown = 0;
  for (const Row& row : summary.worst()) {
    if (++shown > kWorstShown) break;
    std::string violated;
    for (std::size_t i = 0; i < row.requirements.size(); ++i) {
      if (row.requirements[i].verdict == Verdict::kViolated)
        violated += (violated.empty() ? "  ✗ " : ", ") + summary.requirements()[i].name;
    }
    out += line(
        shown == 1 ? "worst runs" : "",
        fmt::format("--seed {}  {} after {:.1f} s{}{}", row.seed, to_string(row.outcome), row.time_s,
                    row.battery_least ? fmt::format(", battery {:.1f} %", *row.battery_least * 100) : "", violated));
  }
  for (const auto& [name, rows, count] :
       {std::tuple{"lost", &summary.lost(), summary.ended(Outcome::kLost)},
        std::tuple{"invalid", &summary.invalid(), summary.ended(Outcome::kInvalid)}}) {
    if (count == 0) continue;
    out += line(name, grouped(count) + " runs, which count in no rate");
    for (std::size_t i = 0; i < std::min<std::size_t>(rows->size(), 3); ++i)
      out += line("", fmt::format("  run {}, seed {}: {}", (*rows)[i].run, (*rows)[i].seed, (*rows)[i].why));
  }
  return out;
}

}  // namespace sentree::campaign
