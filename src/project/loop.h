#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "sentree/base/diagnostic.h"
#include "sentree/base/result.h"
#include "sentree/text/yaml.h"

namespace sentree::project {

struct Scenario;

/// Ticks of a run that come again and again until it ends: a behaviour on which something is owed for ever, as
/// `sentree verify` writes it. What is chosen, what comes first and what is done to the run in them comes again.
struct ScenarioLoop {
  /// Both from 1, both included.
  struct Range {
    std::uint64_t first = 1;
    std::uint64_t last = 1;
    friend bool operator==(const Range&, const Range&) = default;
  };
  Range ticks;
  std::map<std::string, Range> choices;  ///< By model: the numbers of those that it makes in the first round.
  std::optional<Range> orders;           ///< Likewise.
  SourceSpan span;

  /// The number in the first round of what has that number in the run.
  [[nodiscard]] std::uint64_t choice(const std::string& model, std::uint64_t number) const;
  [[nodiscard]] std::uint64_t order(std::uint64_t number) const;
};

/// Entries that the timeline of a loop may have in all its rounds together.
inline constexpr std::size_t kLoopInjectionsMax = 100'000;

/// `loop:` of a scenario, whose timeline has been read. Codes: scenario.loop, yaml.*.
void read_loop(const text::YamlNode& node, Scenario& scenario, Diagnostics& diagnostics);

/// Lets the timeline of the first round come again until the scenario's duration (`Injection::again`); what a `clear`
/// ends is what says the same and stands then. Does nothing the second time, or without a loop. Codes: scenario.loop.
[[nodiscard]] Result<void> unroll(Scenario& scenario);

/// Rounds that are written out at most, and entries of a list: what comes behind them takes the first alternative.
inline constexpr std::uint64_t kLoopRoundsMax = 1'000;
inline constexpr std::uint64_t kLoopEntriesMax = 20'000;

/// Writes the loop out, round by round until the scenario's duration: choices, orders and timeline. There is none then.
void write_out(Scenario& scenario);

}  // namespace sentree::project
