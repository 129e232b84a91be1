#pragma once

#include <string>
#include <vector>

#include "sentree/base/result.h"
#include "sentree/base/time.h"
#include "sentree/scxml/chart.h"
#include "sentree/scxml/session.h"

namespace sentree::scxml {

/// Appends the canonical form of a session to `out`: two sessions of one chart with equal bytes have equal futures. The
/// same events, the same times after `now`, give the same effects and again equal bytes, however they came to be.
///
/// It holds what the future depends on: active states, history, data, events that wait, delayed sends by the time that
/// is left, invoked children. It leaves out what nothing can observe: counters, the session's name, places of sends
/// inside. Ids that the engine makes up (of <send> and <invoke>) are numbered in the order in which they appear; equal
/// futures are then equal but for them. What `Chart::ambient` finds is held where it matters: the time if the chart
/// reads the clock, the generator if it draws random numbers, its name if it asks for that; `Ambient::kAnything`: all
/// of it, and the ids as they are.
///
/// The bytes are for comparison and hashing within one version of the program; they cannot be read back (see `save`).
/// A text in the data that looks like an id that the engine makes up ("NAME.send7", of a session named NAME) is taken
/// for one.
///
/// Error: scxml.no-value-form, as of `save`; `out` is as before then.
/// Cost: O(size of the data), well under a microsecond for a small session.
///
/// @param dead  Data by slot that are never read before they are overwritten, where the caller knows of some.
Result<void> encode(const Chart& chart, const Session& session, TimePoint now, std::string& out,
                    const std::vector<bool>& dead = {});

/// Every delayed send, of invoked charts too, is due so much later.
void postpone(Session& session, Duration by);
/// `to` has the delayed sends of `from` from now on, and none of its own; both are sessions of one chart, or `from` is
/// of none.
void take_timers(Session& to, const Session& from);

}  // namespace sentree::scxml
