#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "sentree/base/result.h"

namespace sentree::campaign {

/// How a run stands with one requirement.
enum class Verdict : std::uint8_t {
  kViolated,   ///< At least once.
  kSatisfied,  ///< Decided so.
  kHeld,       ///< Undecided when the run ended, and put to the test.
  kUntested,   ///< Undecided, and nothing of what it is about has happened.
};

/// How a run ended. kInvalid: it could not be run, or not to its end; kLost: its process died.
enum class Outcome : std::uint8_t { kSuccess, kFailure, kRunning, kInvalid, kLost };
[[nodiscard]] std::string_view to_string(Verdict verdict);
[[nodiscard]] std::string_view to_string(Outcome outcome);

/// What is kept of a run: a row of runs.csv.
struct Row {
  std::uint64_t run = 0;  ///< From 1.
  std::uint64_t seed = 0;
  Outcome outcome = Outcome::kLost;
  std::string reason;                   ///< Why it failed, was invalid or lost.
  double time_s = 0;                    ///< Run time at its end.
  std::optional<double> battery_least;  ///< Charge from 0 to 1; of several robots the least. Nothing: no world.
  std::optional<double> battery_end;
  struct Requirement {
    Verdict verdict = Verdict::kUntested;
    std::optional<double> at_s;  ///< First violation.
  };
  std::vector<Requirement> requirements;

  /// It counts in rates.
  [[nodiscard]] bool counts() const { return outcome != Outcome::kInvalid && outcome != Outcome::kLost; }
};

/// One line with its line break, as RFC 4180 has it. The columns of `factors` come last.
[[nodiscard]] std::string csv_header(const std::vector<std::string>& requirements,
                                     const std::vector<std::string>& factors);
[[nodiscard]] std::string csv_line(const Row& row, const std::vector<std::string>& levels);
/// A line without its line break; what stands in the columns of factors is left aside.
/// Error: campaign.table.
[[nodiscard]] Result<Row> parse_csv_line(std::string_view line, std::size_t requirements);

}  // namespace sentree::campaign
