#pragma once

#include <string_view>
#include <vector>

#include "sentree/monitor/detail/requirement_script.h"

namespace sentree::monitor {

/// The expressions that are all true where it is.
[[nodiscard]] std::vector<Js> conjuncts(const Js& js);

/// Whether it is known, by their texts alone, that `other` is false wherever `known` is true: one is the negation of
/// the other, or both compare one value with literals that leave nothing between them. Both are conjuncts.
[[nodiscard]] bool excludes(const Js& known, const Js& other);
/// As `excludes`, that `other` is true: it is a negation, or says that a value is unequal.
[[nodiscard]] bool implies(const Js& known, const Js& other);
/// Whether each of the conjuncts is among all.
[[nodiscard]] bool are_among(const std::vector<Js>& parts, const std::vector<Js>& all);
/// Whether one of the conjuncts `needed` is false wherever `taken` is true and all that was `refused` before it is not.
[[nodiscard]] bool rules_out(const Js& taken, const std::vector<Js>& refused, const std::vector<Js>& needed);
/// Without the conjuncts that others imply.
[[nodiscard]] Js without_repetition(const Js& js);
/// Whether a conjunct is false as long as the datum is undefined: it compares that with a literal.
[[nodiscard]] bool is_false_of_undefined(const Js& js, std::string_view name);

}  // namespace sentree::monitor
