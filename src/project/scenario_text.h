#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "sentree/base/message.h"
#include "sentree/base/result.h"
#include "sentree/project/project.h"

namespace sentree::project {

/// What the text of a behaviour that `verify` has found begins with.
inline constexpr std::string_view kFoundByVerify = "# A behaviour that `sentree verify` found.";

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

/// A scenario's text with what was `done`, each at its time among the entries of its timeline, as the scenario's own.
/// What is there already at that time is left out; all else stays byte for byte.
/// @param timeline  What the text has, as it was read.
/// Errors: those of `text::with_item`.
[[nodiscard]] Result<std::string> with_injections(std::string text, std::vector<Injection> timeline,
                                                  const std::vector<Injection>& done, const std::string& file = {});

}  // namespace sentree::project
