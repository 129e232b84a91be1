#include "sentree/mission/choice.h"

#include <algorithm>

namespace sentree::mission {

std::optional<std::uint64_t> scripted(const project::Scenario& scenario, const Choice& choice) {
  if (!scenario.choices) return std::nullopt;
  const auto& given = *scenario.choices;
  const auto entry = std::find_if(given.begin(), given.end(), [&](const project::ScenarioChoice& one) {
    return one.model == choice.model && one.number == choice.number;
  });
  if (entry == given.end()) return 0;
  // Alternatives of between() are many: they are not all looked at.
  constexpr std::uint64_t kLookedAtMax = 1'000'000;
  for (std::uint64_t i = 0; i < std::min(choice.count, kLookedAtMax); ++i) {
    if (to_json(choice.alternative(i)) == to_json(entry->value)) return i;
  }
  return std::nullopt;
}

}  // namespace sentree::mission
