#pragma once

#include <cstdint>
#include <string>
#include <utility>

namespace sentree::mission {

/// The name of observations that a part publishes again and again, with whether anybody listens to them: that is asked
/// once, of what lives as long as the part.
struct ObservationName {
  enum class Heard : std::uint8_t { kUnknown, kNo, kYes };

  ObservationName() = default;
  explicit ObservationName(std::string name) : text(std::move(name)) {}

  std::string text;
  Heard heard = Heard::kUnknown;
};

}  // namespace sentree::mission
