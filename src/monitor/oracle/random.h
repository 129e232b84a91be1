#pragma once

#include <string>
#include <vector>

#include "sentree/base/message.h"
#include "sentree/base/rng.h"

namespace sentree::monitor::oracle {

/// The definitions that random requirements are about.
[[nodiscard]] std::string random_definitions();
/// One requirement "R: ….", every pattern, scope and kind of bound.
[[nodiscard]] std::string random_requirement(Rng& rng);
/// Observations in order, with equal stamps, missing values and exact hits of deadlines.
[[nodiscard]] std::vector<Message> random_trace(Rng& rng);
/// One requirement "R: between …, ….", of a pattern from which something is owed for a while.
[[nodiscard]] std::string random_owed_between(Rng& rng);
/// As `random_trace`, of what opens and closes segments and of what the former speaks of, so that what is owed from one
/// segment often meets what is owed from the next.
[[nodiscard]] std::vector<Message> random_segments(Rng& rng);
/// One line for each message.
[[nodiscard]] std::string show(const std::vector<Message>& trace);

}  // namespace sentree::monitor::oracle
