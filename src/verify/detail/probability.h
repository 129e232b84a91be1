#pragma once

#include <functional>
#include <vector>

#include "sentree/verify/detail/branching.h"
#include "sentree/verify/judge.h"

namespace sentree::verify {

/// How likely it is at most, over all ways to decide what nobody draws, that one of `targets` is ever reached from the
/// first place: between two bounds (interval iteration: Haddad, Monmege 2018; components in which one can stay for ever
/// are worth what their best way out is worth).
/// @param targets      By place; what follows them does not count.
/// @param interrupted  May be empty; if it says so, the bounds are as far apart as they are then.
[[nodiscard]] Judgement::Probability greatest_chance(const Branching& of, const std::vector<bool>& targets,
                                                     const std::function<bool()>& interrupted = {});

}  // namespace sentree::verify
