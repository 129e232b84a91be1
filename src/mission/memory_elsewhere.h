#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "sentree/base/result.h"
#include "sentree/mission/state.h"
#include "sentree/project/plan.h"
#include "sentree/scxml/chart.h"
#include "sentree/sim/state.h"

// What parts of a run in other processes, each with a clock of its own, remember: told as octets, and put into the
// state of the run, which is complete then.

namespace sentree::mission {

/// Octets of a larger memory are neither told nor read.
inline constexpr std::size_t kMemoryMax = std::size_t{16} << 20U;

/// @param now  On the clock by which the skill's times are.
/// @returns empty if it has data without a saved form, or is too large.
[[nodiscard]] std::string remember(const scxml::Chart& chart, const SkillState& skill, TimePoint now);
[[nodiscard]] std::string remember(const sim::State& world, TimePoint now);

/// Puts what was told at `now` of the run into its state: for a leaf, the skill and the timer that it waits for. The
/// leaf's plan has a chart. Times become those of the run. Octets may come from anybody.
/// Error: mission.bad-state; nothing has been done.
[[nodiscard]] Result<void> recall_skill(const project::Plan& plan, std::size_t leaf, std::string_view memory,
                                        TimePoint now, State& state);
/// The plan has a world. Error: likewise.
[[nodiscard]] Result<void> recall_world(const project::Plan& plan, std::string_view memory, TimePoint now,
                                        State& state);

}  // namespace sentree::mission
