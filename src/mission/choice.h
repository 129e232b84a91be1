#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "sentree/base/value.h"
#include "sentree/mission/delivery.h"
#include "sentree/project/plan.h"

namespace sentree::mission {

/// Something that a model leaves open: which of several alternatives comes.
struct Choice {
  std::string model;
  const char* function = "";  ///< "choose", "pick", "between", "chance" or "draw".
  std::string name;           ///< Of pick('NAME', …); else empty.
  std::string place;          ///< Where it stands, "models/robot.scxml:31".
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

/// That the scenario's entry of a choice means none of its alternatives, and which there are.
[[nodiscard]] std::string no_such_alternative(const project::Scenario& scenario, const Choice& choice);

/// Whether `given`, as somebody wrote it, is that alternative: 60 is 60.0 too.
[[nodiscard]] bool is_meant(const Value& alternative, const Value& given);

/// That none of its alternatives is meant by `given`, and which there are; `what_then` stands between.
[[nodiscard]] std::string no_such_alternative(const Choice& choice, const Value& given,
                                              std::string_view what_then = {});

/// What a scenario says of an instant at which deliveries to different parts are due: which of them comes first. The
/// first one, if it says nothing of that instant.
/// @param number  Of the instant, from 1.
/// Nothing: none of them is for the part that it names.
[[nodiscard]] std::optional<std::size_t> scripted(const project::Plan& plan, std::uint64_t number,
                                                  std::span<const Delivery* const> due);

/// Of the part of the run that it goes to.
[[nodiscard]] std::size_t part_number(const Delivery& delivery);
/// The name of a delivery's part: that of a leaf or of a model; "mission".
[[nodiscard]] std::string_view part_of(const project::Plan& plan, const Delivery& delivery);

}  // namespace sentree::mission
