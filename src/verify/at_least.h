#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

namespace sentree::verify {

/// Decides from one run after the other whether a requirement holds in at least a share of all runs. Either answer is
/// wrong with at most 1 − confidence, whatever the true share is and however often one looks.
///
/// Two means of ratios of likelihoods, each against the rate of violations that is just allowed: lower rates speak for
/// *holds*, higher ones against. Rates are halfway, a quarter of the way, … from the one that is allowed to 0, and
/// to 1, and those themselves, so that in the end it is known of every rate that differs from the one that is allowed
/// by more than kNearest of itself, or of its complement if that is less. How much in so many runs: `indifference`.
/// Source: J. Ville, "Étude critique de la notion de collectif", 1939 (a ratio exceeds 1/α with probability at most α);
/// H. Robbins, "Statistical Methods Related to the Law of the Iterated Logarithm", 1970 (means of such ratios).
class AtLeast {
 public:
  enum class State : std::uint8_t { kOpen, kHolds, kRefuted };

  static constexpr double kNearest = 1.0 / 1024;

  /// @param share       Above 0, below 1.
  /// @param confidence  Likewise.
  AtLeast(double share, double confidence);

  enum class Run : std::uint8_t { kKept, kViolated, kUnknown };
  /// What is not known counts as violated for *holds*, and as kept against.
  void add(Run run);
  [[nodiscard]] State state() const { return state_; }

  /// Shares of all runs, on both sides of the one that is asked for.
  struct Shares {
    double low = 0;
    double high = 1;
  };
  /// True shares between these are hardly told from the one that is asked for by as many runs as were added.
  [[nodiscard]] Shares indifference() const;

 private:
  // A mean of ratios, of one rate for each.
  class Ratios {
   public:
    // @param far  0 or 1.
    Ratios(double allowed, double far, double confidence);
    // Whether it exceeds what it exceeds with 1 − confidence at most if the rate is the one that is allowed.
    bool add(bool is_violated);
    [[nodiscard]] double bound() const { return bound_; }

   private:
    struct Ratio {
      double violated = 0;
      double kept = 0;
      double sum = 0;  // logarithms, as the steps
    };
    std::vector<Ratio> all_;
    double bound_;  // of the sum of ratios, its logarithm
  };

  double allowed_;
  Ratios holds_;
  Ratios refuted_;
  std::uint64_t runs_ = 0;
  State state_ = State::kOpen;
};
/// "undecided", "holds", "REFUTED".
[[nodiscard]] std::string_view to_string(AtLeast::State state);

}  // namespace sentree::verify
