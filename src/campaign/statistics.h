#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "sentree/base/result.h"

namespace sentree::campaign {

struct Interval {
  double low = 0;
  double high = 1;
  friend bool operator==(const Interval&, const Interval&) = default;
};

/// In which a rate lies with `confidence` (0 to 1), whatever it is; without trials [0, 1]. Two-sided, exact, and so
/// rather too wide than too narrow.
/// Source: Clopper, Pearson, "The use of confidence or fiducial limits illustrated in the case of the binomial", 1934.
[[nodiscard]] Interval clopper_pearson(std::uint64_t hits, std::uint64_t trials, double confidence);

/// In which the mean of what the values were drawn from lies with about `confidence`: exact if they come from a normal
/// distribution, near it if there are many. Fewer than two: [0, 1]. Cut to [0, 1].
/// Source: Student, "The probable error of a mean", 1908.
[[nodiscard]] Interval mean_of_shares(const std::vector<double>& values, double confidence);

/// Values counted in equal bins: quantiles to the width of one, in memory that does not grow with their number.
class Tally {
 public:
  static constexpr std::size_t kBinsMax = 20'000;
  /// For values from 0 to `high`, what lies beyond counting as that; bins of `width` or wider.
  Tally(double width, double high);

  void add(double value);
  [[nodiscard]] std::uint64_t count() const { return count_; }
  [[nodiscard]] double least() const { return least_; }
  [[nodiscard]] double most() const { return most_; }
  [[nodiscard]] double mean() const { return count_ == 0 ? 0.0 : sum_ / static_cast<double>(count_); }
  /// The bin's lower bound below which at most the share `p` lies. 0 without values.
  [[nodiscard]] double quantile(double p) const;
  /// In at most `bins` equal parts from `least` to `most`: lower bound and number.
  [[nodiscard]] std::vector<std::pair<double, std::uint64_t>> histogram(std::size_t bins) const;

 private:
  double width_;
  std::vector<std::uint64_t> bins_;
  std::uint64_t count_ = 0;
  double sum_ = 0;
  double least_ = 0;
  double most_ = 0;
};

/// How much of the variance of an outcome the level of a factor explains, by groups.
struct Group {
  std::uint64_t count = 0;
  double sum = 0;
  double squares = 0;
  void add(double value) {
    ++count;
    sum += value;
    squares += value * value;
  }
};
struct Influence {
  double share = 0;    ///< Omega squared: what groups explain of the variance beyond what chance would; 0 to 1.
  double p_value = 1;  ///< Of as much by chance (F test).
};
/// One-way analysis of variance; groups of fewer than two values are left out.
/// Source: Hays, "Statistics for Psychologists", 1963.
[[nodiscard]] Influence influence(const std::vector<Group>& groups);

/// "1 %", "1%" or 0.01; nothing unless it lies between 0 and 1.
[[nodiscard]] std::optional<double> parse_share(const std::string& text);

/// What is expected of a rate: "never_empty violated < 1e-3", "mission SUCCESS > 95 %".
struct Expectation {
  std::string text;
  std::string subject;  ///< A requirement, or "mission".
  std::string what;     ///< violated, satisfied, SUCCESS, FAILURE or RUNNING.
  bool below = true;
  double rate = 0;
};
/// Error: campaign.expect.
[[nodiscard]] Result<Expectation> parse_expectation(const std::string& text,
                                                    const std::vector<std::string>& requirements);

/// Decides about a rate as early as the runs allow: that it is on the expected side, and beyond `indifference`, or that
/// it is not on that side. Either is wrong with at most 1 − confidence; within the indifference region both may come
/// out.
/// Source: Wald, "Sequential Tests of Statistical Hypotheses", 1945.
class SequentialTest {
 public:
  enum class State : std::uint8_t { kOpen, kHolds, kRefuted };
  SequentialTest(Expectation expectation, double confidence);

  /// A run that counts: whether it was as `what` says. No effect once it is decided.
  void add(bool hit);
  [[nodiscard]] State state() const { return state_; }
  [[nodiscard]] std::uint64_t runs() const { return runs_; }
  [[nodiscard]] std::uint64_t hits() const { return hits_; }
  [[nodiscard]] const Expectation& expectation() const { return expectation_; }
  /// From the bound to the expected side, to where the rate or its complement differs from that of the bound by a
  /// factor of two, whichever is nearer.
  [[nodiscard]] const Interval& indifference() const { return indifference_; }

 private:
  Expectation expectation_;
  Interval indifference_;
  double step_hit_;
  double step_miss_;
  double threshold_;
  double ratio_ = 0;  // logarithm of the likelihood of "holds" against that of "does not"
  std::uint64_t runs_ = 0;
  std::uint64_t hits_ = 0;
  State state_ = State::kOpen;
};
[[nodiscard]] std::string_view to_string(SequentialTest::State state);

}  // namespace sentree::campaign
