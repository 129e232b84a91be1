#pragma once

#include "sentree/base/diagnostic.h"
#include "sentree/scxml/chart.h"
#include "sentree/scxml/session.h"

namespace sentree::scxml {

/// `session`, of the chart `before`, as a session of the chart `after`, which takes its place while it goes on.
///
/// States are the same if their ids are, data if their names are. Active states stay active, with the states that they
/// lie in now; data, timers, history, running invocations stay. Data that are new have the values with which a session
/// of `after` begins. Nothing is executed: neither <onentry> nor <onexit>.
/// Code scxml.cannot-carry, one for each thing that stands in the way: an active state that is gone, or whose new
/// neighbourhood makes of them no legal configuration; an invocation that is gone; another data model.
[[nodiscard]] Loaded<Session> carry(const Chart& before, const Session& session, const Chart& after);

}  // namespace sentree::scxml
