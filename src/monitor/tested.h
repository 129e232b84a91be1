#pragma once

#include <optional>

#include "sentree/monitor/requirement.h"

namespace sentree::monitor {

/// It forbids events and nothing else: that they never come is what is asked for.
[[nodiscard]] bool is_ruled_out(const Requirement& requirement);

/// What puts `requirement` to the test: something comes, where it applies, by which it would be violated, or begin to
/// owe something, if what it asks for were otherwise. Runs and `verify` both ask for this and for nothing else.
///
/// As a requirement that is violated as soon as that has happened; whatever violates `requirement` by an observation
/// violates it too, then or before. Nothing: it is put to the test from the beginning.
///
/// | pattern | put to the test |
/// |---|---|
/// | always P, never P, at most | P is known, as far as it takes to violate it |
/// | whenever P, Q within; P holds for | P triggers it |
/// | whenever P, Q immediately; keep Q; not Q for | P triggers it, and Q is known, as far as that, while it is asked
/// for | | P precedes Q | Q comes | | eventually P; P at least every | something of P is known |
///
/// Cost: O(size).
[[nodiscard]] std::optional<Requirement> test_of(const Requirement& requirement);

}  // namespace sentree::monitor
