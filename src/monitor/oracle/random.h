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
/// One line for each message.
[[nodiscard]] std::string show(const std::vector<Message>& trace);

}  // namespace sentree::monitor::oracle
