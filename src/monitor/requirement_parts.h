#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "sentree/monitor/requirement.h"

namespace sentree::monitor {

/// A part of a requirement's sentence, for those who edit it where it stands.
struct RequirementPart {
  enum class Role : std::uint8_t {
    kScope,  ///< All of it, without the comma; there is none if it is not written.
    kOpen,
    kClose,
    kBody,  ///< All between scope and assumption.
    kP,
    kQ,
    kR,
    kBound,
    kTimes,
    kAssuming,
  };
  Role role = Role::kBody;
  SourceSpan first;  ///< Of its first word.
  SourceSpan last;
};
/// Those of one requirement, in the order in which they end.
using RequirementParts = std::vector<RequirementPart>;

/// As `parse_requirements` without them.
/// @param parts  Gets those of each requirement that can be read.
[[nodiscard]] Loaded<RequirementFile> parse_requirements(std::string_view source, const std::string& file,
                                                         std::vector<RequirementParts>& parts);

}  // namespace sentree::monitor
