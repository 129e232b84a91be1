#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "sentree/base/value.h"
#include "sentree/campaign/row.h"
#include "sentree/campaign/statistics.h"
#include "sentree/campaign/vary.h"

namespace sentree::campaign {

/// What is asked of a campaign.
struct Asked {
  std::uint64_t seed = 1;
  std::uint64_t runs = 1000;  ///< At most.
  double confidence = 0.95;
  std::optional<double> precision;  ///< Ends when every rate is known to this, half of its interval.
  std::vector<Expectation> expectations;
};

/// What runs came to, taken in one by one in the order of their numbers, in memory that does not grow with them.
class Summary {
 public:
  static constexpr std::size_t kWorstMax = 10;
  static constexpr std::size_t kLostShownMax = 20;
  /// Rates are looked at for `precision` after each so many runs.
  static constexpr std::uint64_t kLook = 100;

  Summary(Asked asked, std::vector<std::string> requirements, std::vector<Factor> factors, Duration duration);

  /// The next run. No effect once it is `done`.
  void add(const Row& row, const std::vector<Level>& levels);
  /// Nothing more need be run.
  [[nodiscard]] bool done() const;
  /// Why; empty: it is not, or all runs have been.
  [[nodiscard]] std::string ended_by() const;

  struct Rate {
    std::uint64_t hits = 0;
    Interval interval;
  };
  struct Requirement {
    std::string name;
    std::uint64_t violated = 0;
    std::uint64_t satisfied = 0;
    std::uint64_t untested = 0;
    std::uint64_t first_run = 0;  ///< That violated it; 0: none.
    std::uint64_t first_seed = 0;
  };
  struct Unusable {
    std::uint64_t run = 0;
    std::uint64_t seed = 0;
    std::string why;
  };
  /// What explains an outcome: 0 is that the mission did not succeed, i that requirement i − 1 is violated, and behind
  /// them the time to the goal.
  struct Cause {
    std::size_t factor = 0;
    Influence influence;
  };

  [[nodiscard]] const Asked& asked() const { return asked_; }
  [[nodiscard]] std::uint64_t runs() const { return runs_; }
  [[nodiscard]] std::uint64_t counted() const { return counted_; }
  [[nodiscard]] Rate rate(std::uint64_t hits) const;
  [[nodiscard]] std::uint64_t ended(Outcome outcome) const { return ended_[static_cast<std::size_t>(outcome)]; }
  [[nodiscard]] const std::map<std::string, std::uint64_t>& reasons() const { return reasons_; }
  [[nodiscard]] const std::vector<Requirement>& requirements() const { return requirements_; }
  [[nodiscard]] const Requirement& failing() const { return failing_; }  ///< The first mission that failed.
  [[nodiscard]] const std::vector<SequentialTest>& tests() const { return tests_; }
  [[nodiscard]] const Tally& time_to_goal() const { return time_; }
  [[nodiscard]] const Tally& battery() const { return battery_; }  ///< The least of each run.
  [[nodiscard]] const std::vector<Row>& worst() const { return worst_; }
  [[nodiscard]] const std::vector<Unusable>& lost() const { return lost_; }
  [[nodiscard]] const std::vector<Unusable>& invalid() const { return invalid_; }
  [[nodiscard]] const std::vector<Factor>& factors() const { return factors_; }
  [[nodiscard]] std::size_t outcomes() const { return requirements_.size() + 2; }
  [[nodiscard]] std::string outcome_name(std::size_t outcome) const;
  /// By bin of the factor.
  [[nodiscard]] const std::vector<Group>& groups(std::size_t outcome, std::size_t factor) const {
    return groups_[outcome][factor];
  }
  /// The factors that matter, most first: those whose influence would hardly come by chance, over all that are asked.
  [[nodiscard]] std::vector<Cause> causes(std::size_t outcome) const;

  /// Everything as data, which depends on project, file and seed only.
  [[nodiscard]] Value to_value() const;

 private:
  void add_worst(const Row& row);
  [[nodiscard]] bool is_precise() const;

  Asked asked_;
  std::vector<Factor> factors_;
  std::vector<Requirement> requirements_;
  Requirement failing_;
  std::vector<SequentialTest> tests_;
  std::uint64_t runs_ = 0;
  std::uint64_t counted_ = 0;
  std::vector<std::uint64_t> ended_;
  std::map<std::string, std::uint64_t> reasons_;
  Tally time_;
  Tally battery_;
  Tally battery_end_;
  std::vector<Row> worst_;
  std::vector<Unusable> lost_;
  std::vector<Unusable> invalid_;
  std::vector<std::vector<std::vector<Group>>> groups_;  // by outcome, factor, bin
  bool precise_ = false;
};

/// As a few lines for people; `minimal`: by requirement (or "mission"), the file of its least scenario.
[[nodiscard]] std::string to_text(const Summary& summary, const std::map<std::string, std::string>& minimal);
/// One web page with its plots, which needs nothing else.
[[nodiscard]] std::string to_page(const Summary& summary, const std::string& title, const std::string& again,
                                  const std::map<std::string, std::string>& minimal);

}  // namespace sentree::campaign
