#pragma once

#include <cstdint>
#include <vector>

#include "sentree/bt/blackboard.h"
#include "sentree/bt/script.h"

// The short way of scripts in which nothing but numbers meets: conditions, and one assignment at the end. For the files
// of this library.

namespace sentree::bt {

/// The same script in steps whose operands may be entries and constants; empty where it is more than that.
[[nodiscard]] std::vector<NumberStep> number_steps(const Script& script);

/// @param step    The first of `count` steps, at least one, whose names are cells.
/// @param result  What the script gives, as a number.
/// @returns False where an entry is not linked yet or holds no number: nothing has happened then, and `run_script`
///          knows what to do or to say.
[[nodiscard]] bool run_numbers(const NumberStep* step, std::uint32_t count, Blackboard& blackboard, double& result);

}  // namespace sentree::bt
