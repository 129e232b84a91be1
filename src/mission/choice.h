#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "sentree/base/value.h"
#include "sentree/project/project.h"

namespace sentree::mission {

/// Something that a model leaves open: which of several alternatives comes.
struct Choice {
  std::string model;
  const char* function = "";  ///< "choose", "pick", "between", "chance" or "draw".
  std::string name;           ///< Of pick('NAME', …); else empty.
  std::uint64_t number = 0;   ///< Among those of its model in the run, from 1.
  std::uint64_t count = 0;    ///< Of alternatives, at least 1.
  /// Alternative number `i`, from 0.
  std::function<Value(std::uint64_t i)> alternative;
  /// Its probability; empty: nobody says how likely an alternative is.
  std::function<double(std::uint64_t i)> probability;
};

/// What a scenario says of a choice: the alternative whose value is that of its entry, the first one without an entry.
/// Nothing: the scenario says nothing of choices at all, or no alternative has that value.
[[nodiscard]] std::optional<std::uint64_t> scripted(const project::Scenario& scenario, const Choice& choice);

}  // namespace sentree::mission
