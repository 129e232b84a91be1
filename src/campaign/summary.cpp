#include "sentree/campaign/summary.h"

#include <fmt/format.h>

#include <algorithm>
#include <tuple>
#include <utility>

namespace sentree::campaign {

namespace {

// Reasons of failures that are told apart.
constexpr std::size_t kReasonsMax = 20;
// Chance that any factor at all is named though none matters.
constexpr double kByChance = 0.01;
// What explains less is not worth a word.
constexpr double kShareMin = 0.005;

Value interval_value(const Interval& interval) { return List{interval.low, interval.high}; }

Value tally_value(const Tally& tally) {
  if (tally.count() == 0) return Map{{"count", 0}};
  Map map{{"count", static_cast<std::int64_t>(tally.count())},
          {"mean", tally.mean()},
          {"min", tally.least()},
          {"max", tally.most()}};
  for (const auto& [name, p] : {std::pair{"p05", 0.05}, {"p25", 0.25}, {"p50", 0.5}, {"p75", 0.75}, {"p95", 0.95}})
    map[name] = tally.quantile(p);
  List histogram;
  for (const auto& [low, count] : tally.histogram(40))
    histogram.emplace_back(List{low, static_cast<std::int64_t>(count)});
  map["histogram"] = std::move(histogram);
  return map;
}

auto badness(const Row& row) {
  std::size_t violated = 0;
  for (const auto& requirement : row.requirements) violated += requirement.verdict == Verdict::kViolated ? 1 : 0;
  const int mission = row.outcome == Outcome::kFailure ? 0 : row.outcome == Outcome::kRunning ? 1 : 2;
  return std::tuple(-static_cast<std::int64_t>(violated), mission, row.battery_least.value_or(1.0), -row.time_s,
                    row.run);
}

}  // namespace

Summary::Summary(Asked asked, std::vector<std::string> requirements, std::vector<Factor> factors, Duration duration)
    : asked_(std::move(asked)),
      factors_(std::move(factors)),
      ended_(5, 0),
      time_(0.1, seconds(duration)),
      battery_(0.001, 1.0),
      battery_end_(0.001, 1.0) {
  for (std::string& name : requirements) requirements_.push_back({.name = std::move(name)});
  failing_.name = "mission";
  for (const Expectation& expectation : asked_.expectations) tests_.emplace_back(expectation, asked_.confidence);
  std::vector<std::vector<Group>> bins;
  for (const Factor& factor : factors_) bins.emplace_back(factor.bins.size());
  groups_.assign(outcomes(), bins);
}

void Summary::add(const Row& row, const std::vector<Level>& levels) {
  if (done()) return;
  ++runs_;
  ++ended_[static_cast<std::size_t>(row.outcome)];
  if (!row.counts()) {
    auto& list = row.outcome == Outcome::kLost ? lost_ : invalid_;
    if (list.size() < kLostShownMax) list.push_back({row.run, row.seed, row.reason});
    precise_ = runs_ % kLook == 0 && is_precise();
    return;
  }
  ++counted_;
  const auto note_first = [&](Requirement& requirement) {
    if (requirement.first_run != 0) return;
    requirement.first_run = row.run;
    requirement.first_seed = row.seed;
  };
  for (std::size_t i = 0; i < requirements_.size(); ++i) {
    const Verdict verdict = row.requirements[i].verdict;
    requirements_[i].violated += verdict == Verdict::kViolated ? 1 : 0;
    requirements_[i].satisfied += verdict == Verdict::kSatisfied ? 1 : 0;
    requirements_[i].untested += verdict == Verdict::kUntested ? 1 : 0;
    if (verdict == Verdict::kViolated) note_first(requirements_[i]);
  }
  if (row.outcome == Outcome::kFailure) note_first(failing_);
  if (row.outcome == Outcome::kFailure || !row.reason.empty()) {
    if (reasons_.size() < kReasonsMax || reasons_.contains(row.reason)) ++reasons_[row.reason];
  }
  if (row.outcome == Outcome::kSuccess) time_.add(row.time_s);
  if (row.battery_least) battery_.add(*row.battery_least);
  if (row.battery_end) battery_end_.add(*row.battery_end);
  for (std::size_t factor = 0; factor < factors_.size(); ++factor) {
    const std::size_t bin = levels[factor].bin;
    groups_[0][factor][bin].add(row.outcome == Outcome::kSuccess ? 0.0 : 1.0);
    for (std::size_t i = 0; i < requirements_.size(); ++i)
      groups_[i + 1][factor][bin].add(row.requirements[i].verdict == Verdict::kViolated ? 1.0 : 0.0);
    if (row.outcome == Outcome::kSuccess) groups_.back()[factor][bin].add(row.time_s);
  }
  add_worst(row);
  for (SequentialTest& test : tests_) {
    const std::string& what = test.expectation().what;
    bool hit = to_string(row.outcome) == what;
    for (std::size_t i = 0; i < requirements_.size(); ++i) {
      if (requirements_[i].name == test.expectation().subject) hit = to_string(row.requirements[i].verdict) == what;
    }
    test.add(hit);
  }
  precise_ = runs_ % kLook == 0 && is_precise();
}

void Summary::add_worst(const Row& row) {
  const auto place = std::upper_bound(worst_.begin(), worst_.end(), row,
                                      [](const Row& a, const Row& b) { return badness(a) < badness(b); });
  if (place == worst_.end() && worst_.size() >= kWorstMax) return;
  worst_.insert(place, row);
  if (worst_.size() > kWorstMax) worst_.pop_back();
}

bool Summary::is_precise() const {
  if (!asked_.precision || counted_ == 0) return false;
  const auto known = [&](std::uint64_t hits) {
    const Interval interval = rate(hits).interval;
    return (interval.high - interval.low) / 2.0 <= *asked_.precision;
  };
  return known(ended(Outcome::kSuccess)) &&
         std::all_of(requirements_.begin(), requirements_.end(), [&](const auto& r) { return known(r.violated); });
}

bool Summary::done() const { return runs_ >= asked_.runs || !ended_by().empty(); }

std::string Summary::ended_by() const {
  if (!tests_.empty() && std::all_of(tests_.begin(), tests_.end(), [](const SequentialTest& test) {
        return test.state() != SequentialTest::State::kOpen;
      }))
    return "every expectation is decided";
  if (precise_) return fmt::format("every rate is known to {:.3g} %", *asked_.precision * 100);
  return {};
}

Summary::Rate Summary::rate(std::uint64_t hits) const {
  return {hits, clopper_pearson(hits, counted_, asked_.confidence)};
}

std::string Summary::outcome_name(std::size_t outcome) const {
  if (outcome == 0) return "mission not SUCCESS";
  if (outcome + 1 == outcomes()) return "time to goal";
  return requirements_[outcome - 1].name + " violated";
}

std::vector<Summary::Cause> Summary::causes(std::size_t outcome) const {
  std::vector<Cause> causes;
  const double tried = std::max<double>(1.0, static_cast<double>(factors_.size() * outcomes()));
  for (std::size_t factor = 0; factor < factors_.size(); ++factor) {
    const Influence found = influence(groups_[outcome][factor]);
    if (found.p_value * tried <= kByChance && found.share >= kShareMin) causes.push_back({factor, found});
  }
  std::stable_sort(causes.begin(), causes.end(),
                   [](const Cause& a, const Cause& b) { return a.influence.share > b.influence.share; });
  return causes;
}

Value Summary::to_value() const {
  const auto count = [](std::uint64_t n) { return static_cast<std::int64_t>(n); };
  const auto rate_value = [&](std::uint64_t hits) -> Value {
    const Rate known = rate(hits);
    return Map{{"count", count(hits)},
               {"rate", counted_ == 0 ? 0.0 : static_cast<double>(hits) / static_cast<double>(counted_)},
               {"interval", interval_value(known.interval)}};
  };
  Map mission;
  for (const Outcome outcome : {Outcome::kSuccess, Outcome::kFailure, Outcome::kRunning})
    mission[std::string(to_string(outcome))] = rate_value(ended(outcome));
  Map reasons;
  for (const auto& [reason, times] : reasons_) reasons[reason] = count(times);
  mission["reasons"] = std::move(reasons);
  List requirements;
  for (const Requirement& requirement : requirements_) {
    Map one{{"name", requirement.name},
            {"violated", rate_value(requirement.violated)},
            {"satisfied", count(requirement.satisfied)},
            {"untested", count(requirement.untested)}};
    if (requirement.first_run != 0)
      one["first"] = Map{{"run", count(requirement.first_run)}, {"seed", count(requirement.first_seed)}};
    requirements.emplace_back(std::move(one));
  }
  List sensitivity;
  for (std::size_t outcome = 0; outcome < outcomes(); ++outcome) {
    for (std::size_t factor = 0; factor < factors_.size(); ++factor) {
      const Influence found = influence(groups_[outcome][factor]);
      List bins;
      for (std::size_t bin = 0; bin < factors_[factor].bins.size(); ++bin) {
        const Group& group = groups_[outcome][factor][bin];
        bins.emplace_back(Map{{"count", count(group.count)},
                              {"mean", group.count == 0 ? 0.0 : group.sum / static_cast<double>(group.count)}});
      }
      sensitivity.emplace_back(Map{{"of", outcome_name(outcome)},
                                   {"factor", factors_[factor].name},
                                   {"share", found.share},
                                   {"p_value", found.p_value},
                                   {"bins", std::move(bins)}});
    }
  }
  List factors;
  for (const Factor& factor : factors_) {
    List bins;
    for (const std::string& bin : factor.bins) bins.emplace_back(bin);
    factors.emplace_back(Map{{"name", factor.name}, {"bins", std::move(bins)}});
  }
  List tests;
  for (const SequentialTest& test : tests_) {
    tests.emplace_back(Map{{"expectation", test.expectation().text},
                           {"verdict", to_string(test.state())},
                           {"indifference", interval_value(test.indifference())},
                           {"runs", count(test.runs())},
                           {"count", count(test.hits())}});
  }
  List worst;
  for (const Row& row : worst_) {
    List violated;
    for (std::size_t i = 0; i < requirements_.size(); ++i) {
      if (row.requirements[i].verdict == Verdict::kViolated) violated.emplace_back(requirements_[i].name);
    }
    Map one{{"run", count(row.run)},
            {"seed", count(row.seed)},
            {"mission", to_string(row.outcome)},
            {"time", row.time_s},
            {"violated", std::move(violated)}};
    if (row.battery_least) one["battery_least"] = *row.battery_least;
    worst.emplace_back(std::move(one));
  }
  const auto list = [&](const std::vector<Unusable>& rows) {
    List out;
    for (const Unusable& row : rows)
      out.emplace_back(Map{{"run", count(row.run)}, {"seed", count(row.seed)}, {"why", row.why}});
    return out;
  };
  return Map{{"seed", count(asked_.seed)},
             {"runs", count(runs_)},
             {"counted", count(counted_)},
             {"confidence", asked_.confidence},
             {"ended_by", ended_by()},
             {"mission", std::move(mission)},
             {"requirements", std::move(requirements)},
             {"expectations", std::move(tests)},
             {"time_to_goal_s", tally_value(time_)},
             {"battery_least", tally_value(battery_)},
             {"battery_end", tally_value(battery_end_)},
             {"worst", std::move(worst)},
             {"factors", std::move(factors)},
             {"sensitivity", std::move(sensitivity)},
             {"lost", Map{{"count", count(ended(Outcome::kLost))}, {"first", list(lost_)}}},
             {"invalid", Map{{"count", count(ended(Outcome::kInvalid))}, {"first", list(invalid_)}}}};
}

}  // namespace sentree::campaign
