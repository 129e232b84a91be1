#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "sentree/project/plan.h"
#include "sentree/verify/walk.h"

namespace sentree::verify {

/// What came of a requirement in one run.
enum class Came : std::uint8_t {
  kKept,
  kStillOwed,  ///< Something was to come, where the run was ended before the mission was: nobody knows.
  kViolated,
};

/// How many runs are made, and how.
struct Sampling {
  std::uint64_t runs = 1'000;
  std::uint64_t seed = 1;
  Order order = Order::kAny;
  Duration length{};  ///< A run ends here if the mission did not before [run time].
  /// Periods that were gone through before are looked up; else every run is executed. The outcome is the same.
  bool memory_of_periods = true;
  std::uint64_t memory = 1'000'000'000;  ///< Bytes, about, at which what is known is forgotten.
  /// So many runs are made at a time by `each`, if there is one; what is told is the same, in the same order.
  std::size_t workers = 1;
  Each each;
  std::function<bool()> interrupted;  ///< May be empty; asked by every worker.
  /// After each run: what came of the monitors, by index. False: enough.
  std::function<bool(const std::vector<Came>& of_run)> told;
};

/// Runs a mission with models in virtual time, again and again: what is drawn by its probability, everything else that
/// is left open (choices, orders at one instant) by the throw of a die, which is no probability of anything. A run is a
/// walk through states of the mission and of the monitors, of which what was gone through before is known.
/// Deterministic by the seed.
/// @param plan  Without `obstacles`.
/// @returns the runs that were made. Errors: those of `period`.
[[nodiscard]] Result<std::uint64_t> sample(const project::Plan& plan, const Sampling& sampling);

}  // namespace sentree::verify
