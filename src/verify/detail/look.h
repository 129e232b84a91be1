#pragma once

#include <string>
#include <utility>
#include <vector>

#include "sentree/base/value.h"
#include "sentree/idl/schema.h"
#include "sentree/verify/detail/distinctions.h"

namespace sentree::verify {

/// A reply as a mission sees it.
struct Look {
  /// Equal for replies that nothing in the mission tells apart: members that nothing names are not there, numbers are
  /// places among the constants that they are compared with.
  Value alike;
  /// What it consists of, by path ("percentage", "target.pose.x"; of a bare value "result").
  std::vector<std::pair<std::string, Value>> shown;
  /// Numbers and texts that are named and compared with nothing, by name: they can be handed back.
  std::vector<std::pair<std::string, Value>> handed;
};
/// @param result  Conforms to the method's type.
/// @param exact   Everything is told apart, numbers too.
[[nodiscard]] Look look(const Distinctions& distinctions, const idl::Method& method, const Value& result,
                        bool exact = false);

}  // namespace sentree::verify
