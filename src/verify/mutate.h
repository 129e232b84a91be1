#pragma once

#include <cstddef>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "sentree/base/diagnostic.h"
#include "sentree/idl/schema.h"
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

/// Constants of a project by what they are passed as: ports of trees and parameters of what charts send, "to", or
/// "SERVICE.METHOD.to" where only that one takes them.
using Passed = std::map<std::string, std::set<std::string>>;
/// Adds texts and whole numbers that a tree or a chart passes; of nodes with children, and of times, no numbers.
void collect_passed(std::string_view source, Passed& all);
/// Adds enumerators, for the arguments of a service that take them.
void collect_passed(const std::string& name, const idl::Service& service, Passed& all);

/// Of a file of Behavior Trees: reactive for plain and the other way round, Sequence for Fallback, neighbours
/// exchanged, a node dropped with what is in it, a decorator alone, a number one more or less, a word or a
/// number that stands for the same port elsewhere; of its scripts and conditions as of a chart.
/// Of a chart: comparisons that take or leave their bound, their negation, numbers one more or less, a transition
/// dropped, something dropped that is sent, another constant for a parameter. Empty: it is neither, or cannot be read.
/// Source: the operators of P. Ammann, J. Offutt, Introduction to Software Testing, 2nd edition, section 9.2.
/// @param file    As messages show it.
/// @param passed  Of the whole project; what the file itself passes counts anyway.
[[nodiscard]] std::vector<Mutant> mutants(std::string_view source, const std::string& file, Passed passed = {});

/// Whether two explorations found the same, message for message. Both with `Options::tells_what_is_said`; else only
/// what monitors listen to is compared.
[[nodiscard]] bool same_behaviour(const Graph& a, const Graph& b);

}  // namespace sentree::verify
