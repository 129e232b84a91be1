#pragma once

#include <set>
#include <string>

#include "sentree/base/result.h"
#include "sentree/bt/encode.h"
#include "sentree/mission/parts.h"
#include "sentree/mission/state.h"

namespace sentree::mission {

/// Takes out of the queue what can have no effect any more: timers that were overtaken, deadlines of ticks that were
/// answered.
void prune(State& state);

/// Appends the canonical form of a pruned state to `out`: states of one plan with equal forms behave alike from here
/// on, if the surroundings decide every choice and the host reuses numbers. Times are relative to `state.now`. Left out
/// are counters, monitors, what only views show, and the generators of the models.
///
/// For comparison within one version; it cannot be read back. Errors: those of `bt::encode` and `scxml::encode`.
[[nodiscard]] Result<void> encode(const Parts& parts, const State& state, std::string& out,
                                  bt::Times times = bt::Times::kFromNow);

// The forms that it consists of, each of one part. What holds back deliveries to a part belongs to who sends them.
[[nodiscard]] Result<void> encode(const Parts& parts, const TreeState& tree, TimePoint now, std::string& out,
                                  bt::Times times = bt::Times::kFromNow);
[[nodiscard]] Result<void> encode(const Parts& parts, std::size_t leaf, const SkillState& skill, TimePoint now,
                                  std::string& out);
[[nodiscard]] Result<void> encode(const Parts& parts, std::size_t index, const ModelState& model, TimePoint now,
                                  std::string& out);
/// Of something on its way.
/// @param when  When it is due.
void encode(const Parts& parts, const Delivery& what, TimePoint when, std::string& out);
/// Of what stands, and of what is killed.
void encode(const Faults& faults, const std::set<std::string>& down, std::string& out);

/// Whether a chart can see ids that the engine makes up.
[[nodiscard]] bool asks_for_ids(const scxml::Chart& chart);

}  // namespace sentree::mission
