#pragma once

#include <optional>
#include <vector>

#include "sentree/base/message.h"
#include "sentree/base/result.h"
#include "sentree/base/time.h"
#include "sentree/mission/state.h"
#include "sentree/project/plan.h"
#include "sentree/replay/recorded_run.h"

namespace sentree::replay {

/// A moment of a run in real time at which nothing was under way, and what was observed behind it.
struct AtRest {
  mission::State state;
  std::vector<Message> messages;
};

/// The latest such moment before `moment` of which the recording has a snapshot; nothing if the last few are none,
/// since something was on its way between the parts, or a call had no answer yet.
/// @param plan   Of the recording's own files, seed and speed.
/// @param known  Until when messages are read [run time].
/// Errors: those of reading. Cost: the messages between it and `known`.
[[nodiscard]] Result<std::optional<AtRest>> at_rest_before(RecordedRun& recorded, const project::Plan& plan,
                                                           TimePoint moment, TimePoint known);

/// The state as a replay goes on from it: models answer as they did then, so they are left out, and the next tick
/// begins when it did.
/// @param ticks  When those behind it began; may be none.
void prepare_for_replay(mission::State& state, const std::vector<TimePoint>& ticks);

}  // namespace sentree::replay
