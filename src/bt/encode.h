#pragma once

#include <cstdint>
#include <string>

#include "sentree/base/result.h"
#include "sentree/base/time.h"
#include "sentree/bt/state.h"
#include "sentree/bt/tree.h"

namespace sentree::bt {

/// How times are written: from `now` on, so that no node may have asked what time it is; or `now` too, so that states
/// of different times differ.
enum class Times : std::uint8_t { kFromNow, kAbsolute };

/// Appends the canonical form of a state to `out`: what the future of the tree depends on, and nothing else.
///
/// Two states of one tree with equal forms behave alike from here on: equal inputs at times equally far from their
/// `now` give equal effects, results and forms again, timers equally far away. Written are statuses, what nodes
/// remember, the suspended tick, outstanding halts, and the blackboard's links, types and values; times are relative to
/// `now`. Left out are what the next tick sets anew, the places of entries, and the numbers and times of writes. How a
/// node that waits for a write stands to its entry is written as up to date or not; where the tree has an
/// UnsetBlackboard, which makes entries count anew, all numbers are written. Nodes in C++ may read numbers and times
/// of the entries on their ports: those are written. A node in C++ that asks a clock of its own is outside of what is
/// promised.
///
/// The form is for comparing states of one tree within one version; it cannot be read back (see `save`).
/// Errors: bt.unsavable, as `save`; bt.asks-time, a node in C++ has asked for the time (`Context::now`), may do
/// otherwise at another, and times are written from `now` on. `out` is then as it was. Cost: O(nodes + entries); of
/// nodes a copy of what each has.
[[nodiscard]] Result<void> encode(const Tree& tree, const State& state, TimePoint now, std::string& out,
                                  Times times = Times::kFromNow);

}  // namespace sentree::bt
