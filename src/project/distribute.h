#pragma once

#include <string>

#include "sentree/project/plan.h"

namespace sentree::project {

/// How often `in_processes` lets a part be started again within a minute.
inline constexpr int kPartRestarts = 5;

/// The plan's scenario with each skill, and the simulator if there is one, in a process of its own, restarted within
/// limits. Parts that have an address already stay where they are. The clock becomes the real one. To be prepared anew.
[[nodiscard]] Scenario in_processes(const Plan& plan);

/// Which part runs where, in a sentence: "in processes of their own: …; at tcp://…: …; in this one: …". Empty: all do
/// here.
[[nodiscard]] std::string shown_places(const Plan& plan);

}  // namespace sentree::project
