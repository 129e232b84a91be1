#pragma once

#include "sentree/draw/chart.h"
#include "sentree/scxml/chart.h"
#include "sentree/scxml/session.h"

namespace sentree::scxml {

/// The chart as `draw` wants it: states with what they do on entry and exit, transitions with event, condition and
/// actions, a dot for each initial state. With a session, its active states are marked; `last` marks a transition.
///
/// `states_of`, if given, receives for each drawn state the chart's state (kNoState for dots), to map clicks back.
[[nodiscard]] draw::Chart to_graph(const Chart& chart, const Session* session = nullptr,
                                   TransitionIndex last = 0xFFFFFFFFU, std::vector<StateIndex>* states_of = nullptr);

}  // namespace sentree::scxml
