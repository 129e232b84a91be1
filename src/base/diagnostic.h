#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "sentree/base/source.h"

namespace sentree {

enum class Severity { kError, kWarning, kNote };

/// One finding about an input: what, where, and the way out.
struct Diagnostic {
  Severity severity = Severity::kError;
  std::string code;     ///< Stable, for programs: "scxml.unknown-target". Library, dot, kebab-case.
  std::string message;  ///< For people: names the thing, the value and the fix. No trailing full stop.
  SourceSpan span;

  friend bool operator==(const Diagnostic&, const Diagnostic&) = default;
};

using Diagnostics = std::vector<Diagnostic>;

/// "file:line:column: message"; warnings and notes are marked as such after the place.
[[nodiscard]] std::string to_string(const Diagnostic& diagnostic);
[[nodiscard]] std::string_view to_string(Severity severity);

/// True if any of them is an error.
[[nodiscard]] bool has_errors(std::span<const Diagnostic> diagnostics);

/// By file, line and column; findings of one place keep their order.
void sort_by_place(Diagnostics& diagnostics);
void add(Diagnostics& diagnostics, Severity severity, std::string code, std::string message, SourceSpan span);

/// The candidate nearest to `name` by edit distance (Damerau-Levenshtein, case-insensitive at half
/// cost), or empty if none is near enough to be a likely slip. O(candidates · length²).
[[nodiscard]] std::string_view closest(std::string_view name, std::span<const std::string> candidates);

/// `; did you mean "x"?`, or empty when nothing is near. For the end of a message.
[[nodiscard]] std::string did_you_mean(std::string_view name, std::span<const std::string> candidates);

}  // namespace sentree
