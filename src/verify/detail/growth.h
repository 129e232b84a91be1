#pragma once

#include <cstddef>
#include <string>

#include "sentree/project/plan.h"
#include "sentree/verify/frontier.h"

namespace sentree::verify {

/// What takes ever new values in the states of a mission, for whoever waits for the end of them: data of charts,
/// entries of the blackboard, delayed <send>s that pile up, what is left of a delay, fresh(). Those with most values
/// first, with how many, and a way out: "keeper.asked (41); count no further than anybody tells apart (n % 8), …".
/// Empty: nothing has more than one.
/// @param count  At most so many are named.
[[nodiscard]] std::string most_varied(const project::Plan& plan, const Frontier& frontier, std::size_t count);

}  // namespace sentree::verify
