#include "sentree/idl/call_error.h"

#include <algorithm>
#include <array>

namespace sentree::idl {

namespace {

// In the order of the enumeration.
constexpr std::array<std::string_view, 7> kKinds{"exception", "vetoed",    "unreachable", "late",
                                                 "protocol",  "arguments", "interrupted"};
static_assert(kKinds.size() == static_cast<std::size_t>(CallErrorKind::kInterrupted) + 1);

}  // namespace

std::string_view to_string(CallErrorKind kind) { return kKinds[static_cast<std::size_t>(kind)]; }

std::optional<CallErrorKind> parse_call_error_kind(std::string_view word) {
  const auto* const found = std::find(kKinds.begin(), kKinds.end(), word);
  if (found == kKinds.end()) return std::nullopt;
  return static_cast<CallErrorKind>(found - kKinds.begin());
}

std::vector<std::string> call_error_kinds() { return {kKinds.begin(), kKinds.end()}; }

}  // namespace sentree::idl
