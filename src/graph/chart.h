#pragma once

#include <vector>

#include "sentree/draw/chart.h"
#include "sentree/scxml/chart.h"
#include "sentree/scxml/session.h"

namespace sentree::graph {

/// The chart as `draw` wants it: states with what they do on entry and exit, transitions with event, condition and
/// actions, a dot for each initial state. With a session, its active states are marked; `last` marks a transition.
///
/// `states_of`, if given, receives for each drawn state the chart's state (kNoState for dots), to map clicks back;
/// `transitions_of` the same of transitions.
[[nodiscard]] draw::Chart drawing_of(const scxml::Chart& chart, const scxml::Session* session = nullptr,
                                     scxml::TransitionIndex last = 0xFFFFFFFFU,
                                     std::vector<scxml::StateIndex>* states_of = nullptr,
                                     std::vector<scxml::TransitionIndex>* transitions_of = nullptr);

}  // namespace sentree::graph
