#pragma once

#include <cstdint>
#include <string_view>

namespace sentree::verify {

/// Decides from one run after the other whether a requirement holds in at least a share of all runs. Either answer is
/// wrong with at most 1 − confidence, whatever the true share is and however often one looks; near the share that is
/// asked for it may stay open for ever.
///
/// Two ratios of likelihoods, each against the rate of violations that is just allowed: half of that rate speaks for
/// *holds*, twice of it (or halfway to all runs) against.
/// Source: J. Ville, "Étude critique de la notion de collectif", 1939 (a ratio exceeds 1/α with probability at most α);
/// A. Wald, "Sequential Tests of Statistical Hypotheses", 1945.
class AtLeast {
 public:
  enum class State : std::uint8_t { kOpen, kHolds, kRefuted };

  /// @param share       Above 0, below 1.
  /// @param confidence  Likewise.
  AtLeast(double share, double confidence);

  enum class Run : std::uint8_t { kKept, kViolated, kUnknown };
  /// What is not known counts as violated for *holds*, and as kept against.
  void add(Run run);
  [[nodiscard]] State state() const { return state_; }

 private:
  struct Ratio {
    double violated = 0;
    double kept = 0;
    double sum = 0;  ///< Logarithms, as the steps.
    bool add(bool is_violated, double bound) {
      sum += is_violated ? violated : kept;
      return sum >= bound;
    }
  };
  static Ratio ratio(double rate, double against);

  Ratio holds_;
  Ratio refuted_;
  double bound_;
  State state_ = State::kOpen;
};
/// "undecided", "holds", "REFUTED".
[[nodiscard]] std::string_view to_string(AtLeast::State state);

}  // namespace sentree::verify
