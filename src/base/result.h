#pragma once

#include <optional>
#include <string>
#include <tl/expected.hpp>
#include <utility>

#include "sentree/base/diagnostic.h"

namespace sentree {

/// A value, or why there is none. For one failure; a file with several goes through `Loaded`.
template <class T>
using Result = tl::expected<T, Diagnostic>;

/// Shorthand for the failing side of a `Result`.
[[nodiscard]] inline tl::unexpected<Diagnostic> fail(std::string code, std::string message, SourceSpan span = {}) {
  return tl::unexpected<Diagnostic>(Diagnostic{Severity::kError, std::move(code), std::move(message), std::move(span)});
}

/// What a loader returns: everything it found, and the value if no finding is an error.
template <class T>
struct Loaded {
  std::optional<T> value;
  Diagnostics diagnostics;

  [[nodiscard]] bool ok() const { return value.has_value(); }
};

}  // namespace sentree
