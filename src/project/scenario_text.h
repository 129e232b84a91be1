#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "sentree/base/message.h"
#include "sentree/project/project.h"

namespace sentree::project {

/// What a run came to, for the scenario's `expect:`.
struct RunOutcome {
  std::string mission;  ///< Status; empty: it has none that a scenario can expect.
  std::map<std::string, std::string> verdicts;
};

/// A scenario file that does what `scenario` does and then `done`, each at its time: with the same seed, clock and
/// limits, its overrides and its own timeline. For the project's scenarios/ folder, where the project is one folder
/// above.
/// @param outcome  What it expects; nothing: it expects nothing.
/// @param project  The file's `project:`; empty: it has none.
[[nodiscard]] std::string scenario_text(const Scenario& scenario, const std::vector<Injection>& done,
                                        const std::optional<RunOutcome>& outcome = std::nullopt,
                                        const std::string& project = {});

}  // namespace sentree::project
