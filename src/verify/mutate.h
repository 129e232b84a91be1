#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "sentree/base/diagnostic.h"
#include "sentree/verify/explore.h"

namespace sentree::verify {

/// Mutants of one file that are tried at most; of more, every so many.
inline constexpr std::size_t kMutantsMax = 200;

/// A small change of a text, such as somebody might make by mistake.
struct Mutant {
  SourceSpan place;
  std::string what;  ///< "threshold 30 → 31".
  std::string text;  ///< Of the whole file, changed.
};

/// Of a file of Behavior Trees: reactive for plain and the other way round, Sequence for Fallback, neighbours
/// exchanged, a node dropped with what is in it, a decorator alone, a number one more or less, a word that stands for
/// the same port elsewhere; of its scripts and conditions as of a chart.
/// Of a chart: comparisons that take or leave their bound, their negation, numbers one more or less, a transition
/// dropped, something dropped that is sent. Empty: it is neither, or cannot be read.
/// Source: the operators of P. Ammann, J. Offutt, Introduction to Software Testing, 2nd edition, section 9.2.
/// @param file  As messages show it.
[[nodiscard]] std::vector<Mutant> mutants(std::string_view source, const std::string& file);

/// Whether two explorations found the same, message for message. Both with `Options::tells_what_is_said`; else only
/// what monitors listen to is compared.
[[nodiscard]] bool same_behaviour(const Graph& a, const Graph& b);

}  // namespace sentree::verify
