#pragma once

#include <cstdint>
#include <string>

#include "sentree/campaign/runner.h"

namespace sentree::campaign {

/// A run that is as short and simple as was found.
struct Least {
  Draw draw;
  Runner::Executed executed;
  std::uint64_t tried = 0;  ///< Runs that it took.
};

/// Runs that shrinking one takes at most.
inline constexpr std::uint64_t kShrinkRunsMax = 300;

/// The simplest run found that still violates `property` (a requirement; "mission": the mission fails): fewer events
/// and changes to the project, rounder numbers, shorter, seed 1. Nothing of it can be left out by itself, unless the
/// bound on runs came first. Nothing, if `draw` does not show it.
[[nodiscard]] std::optional<Least> shrink(Runner& runner, const Draw& draw, const std::string& property);

/// The file of a scenario that expects what that run came to.
/// @param about    Its description.
/// @param project  The project's folder, from the file's.
[[nodiscard]] std::string least_text(const Runner& runner, const Least& least, const std::string& about,
                                     const std::string& project);

}  // namespace sentree::campaign
