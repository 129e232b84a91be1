#include "sentree/mission/choice.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "sentree/base/diagnostic.h"

namespace sentree::mission {
namespace {

const project::ScenarioChoice* entry_of(const project::Scenario& scenario, const Choice& choice) {
  const auto& given = *scenario.choices;
  const std::uint64_t number = scenario.loop ? scenario.loop->choice(choice.model, choice.number) : choice.number;
  const auto entry = std::find_if(given.begin(), given.end(), [&](const project::ScenarioChoice& one) {
    return one.model == choice.model && one.number == number;
  });
  return entry == given.end() ? nullptr : &*entry;
}

}  // namespace

bool is_meant(const Value& alternative, const Value& given) {
  // 0 is not written for -0.
  if (alternative.is_number() && given.is_number())
    return alternative.number() == given.number() && std::signbit(alternative.number()) == std::signbit(given.number());
  return to_json(alternative) == to_json(given);
}

std::optional<std::uint64_t> scripted(const project::Scenario& scenario, const Choice& choice) {
  if (!scenario.choices) return std::nullopt;
  const project::ScenarioChoice* const entry = entry_of(scenario, choice);
  if (entry == nullptr) return 0;
  // Alternatives of between() are many: they are not all looked at.
  constexpr std::uint64_t kLookedAtMax = 1'000'000;
  for (std::uint64_t i = 0; i < std::min(choice.count, kLookedAtMax); ++i) {
    if (is_meant(choice.alternative(i), entry->value)) return i;
  }
  return std::nullopt;
}

std::string no_such_alternative(const project::Scenario& scenario, const Choice& choice) {
  return no_such_alternative(choice, entry_of(scenario, choice)->value, ", and one is drawn");
}

std::string no_such_alternative(const Choice& choice, const Value& given, std::string_view what_then) {
  constexpr std::uint64_t kShown = 8;
  std::string there;
  std::vector<std::string> texts;
  for (std::uint64_t i = 0; i < std::min(choice.count, kShown); ++i) {
    const Value alternative = choice.alternative(i);
    there += (i > 0 ? ", " : "") + to_json(alternative);
    if (const std::string* const text = alternative.as_string()) texts.push_back(*text);
  }
  if (choice.count > kShown)
    there += fmt::format(" … {}, {} in all", to_json(choice.alternative(choice.count - 1)), choice.count);
  const std::string* const text = given.as_string();
  return fmt::format("choice {}#{} ({}{}{}) has no alternative {}{}; there are {}{}", choice.model, choice.number,
                     choice.name.empty() ? choice.function : choice.name, choice.place.empty() ? "" : " at ",
                     choice.place, to_json(given), what_then, there, text != nullptr ? did_you_mean(*text, texts) : "");
}

std::optional<std::size_t> scripted(const project::Plan& plan, std::uint64_t number,
                                    std::span<const Delivery* const> due) {
  const auto& given = plan.scenario.orders;
  if (plan.scenario.loop) number = plan.scenario.loop->order(number);
  const auto entry =
      std::find_if(given.begin(), given.end(), [&](const project::ScenarioOrder& one) { return one.number == number; });
  if (entry == given.end()) return 0;
  for (std::size_t i = 0; i < due.size(); ++i) {
    if (part_of(plan, *due[i]) == entry->first) return i;
  }
  return std::nullopt;
}

std::size_t part_number(const Delivery& delivery) {
  return 2 * delivery.leaf + (std::holds_alternative<ModelDelivery>(delivery.what) ? 1 : 0);
}

std::string_view part_of(const project::Plan& plan, const Delivery& delivery) {
  if (std::holds_alternative<TreeDelivery>(delivery.what)) return "mission";
  return std::holds_alternative<SkillDelivery>(delivery.what) ? plan.leaves[delivery.leaf].name
                                                              : plan.models[delivery.leaf].name;
}

}  // namespace sentree::mission
