#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "sentree/base/result.h"
#include "sentree/project/plan.h"
#include "sentree/verify/walk.h"

namespace sentree::verify {

/// Levels that one repetition may pass; beyond it the score grows without end.
inline constexpr std::size_t kLevelsMax = 100'000;
/// What `Splitting::score` is called that says how far the monitor's own obligation has come.
inline constexpr const char* kOwed = "owed";

/// How the probability of something rare is estimated.
struct Splitting {
  /// How near a violation is: the more, the nearer. "MODEL.DATA", a number (or a truth value) that a model's chart
  /// holds; kOwed: how much of its bound what the monitor owes has used up.
  std::string score = kOwed;
  std::size_t walkers = 200;  ///< Runs that are kept on their way at a time.
  std::uint64_t repetitions = 30;
  std::uint64_t seed = 1;
  Order order = Order::kAny;
  Duration length{};                     ///< As `Sampling::length`.
  std::uint64_t memory = 1'000'000'000;  ///< As `Sampling::memory`; one repetition that needs more is an error.
  std::size_t workers = 1;               ///< As `Sampling::workers`.
  Each each;
  std::function<bool()> interrupted;                        ///< May be empty; asked by every worker.
  std::function<void(std::uint64_t repetitions)> progress;  ///< Told now and then; may be empty.
};

/// What the repetitions found, each on its own.
struct Splits {
  std::vector<double> estimates;  ///< Of the probability; each right on average, whatever the score is.
  /// Of that and the probability together with which a run is ended while something is still to come (`is_to_come`), of
  /// which nobody knows whether it violates the requirement; likewise, one for each of `estimates`.
  std::vector<double> with_open;
  std::uint64_t runs = 0;      ///< That were begun at the beginning of the mission,
  std::uint64_t violated = 0;  ///< of which so many violated the requirement without being split.
  std::uint64_t owed = 0;      ///< Of them those that were ended while something was still to come.
  std::uint64_t branches = 0;  ///< Runs that went on from where others were.
};

/// Estimates how likely a run violates a monitor by adaptive multilevel splitting: of `walkers` runs those with the
/// least best score, a tenth at least, are given up, and go on instead from where others first had more, until nearly
/// all that are left violate it. The product of the shares that were left, times the share that violates, is an
/// estimate without bias. What is drawn comes with its probability, the rest by the throw of a die.
/// Deterministic by the seed, however many workers there are.
///
/// Source: Cérou, Guyader, "Adaptive multilevel splitting for rare event analysis", 2007; Bréhier, Gazeau, Goudenège,
/// Lelièvre, Rousset, "Unbiasedness of some generalized adaptive multilevel splitting algorithms", 2016 (ties).
/// @param plan     Without `obstacles`.
/// @param monitor  Its index in the plan.
/// Errors: verify.score (no such data, or no number; too many levels), verify.memory, those of `Walk`.
[[nodiscard]] Result<Splits> split(const project::Plan& plan, std::size_t monitor, const Splitting& splitting);

}  // namespace sentree::verify
