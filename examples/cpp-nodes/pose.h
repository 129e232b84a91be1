#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "sentree/bt/types.h"

/// A type of the user's own that travels through ports.
struct Pose {
  double x = 0;
  double y = 0;
};

/// How it travels. With it, literals in the XML ("3;4") and saved states work; without, it would pass as an opaque
/// object.
template <>
struct sentree::bt::Convert<Pose> {
  static std::string name() { return "Pose"; }
  static Value to_value(const Pose& pose) { return Map{{"x", pose.x}, {"y", pose.y}}; }
  static std::optional<Pose> from_value(const Value& value) {
    const Value* x = value.find("x");
    const Value* y = value.find("y");
    if (x == nullptr || y == nullptr || !x->is_number() || !y->is_number()) return std::nullopt;
    return Pose{x->number(), y->number()};
  }
  static std::optional<Pose> from_text(std::string_view text) {
    const auto numbers = Convert<std::vector<double>>::from_text(text);
    if (!numbers || numbers->size() != 2) return std::nullopt;
    return Pose{(*numbers)[0], (*numbers)[1]};
  }
};
