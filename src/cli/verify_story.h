#pragma once

#include <string>

#include "sentree/project/plan.h"
#include "sentree/verify/judge.h"

namespace sentree::cli {

/// Whether a model chose something; a topic of a service may be called so too.
[[nodiscard]] bool is_choice(const project::Plan& plan, const Message& message);

/// Tick by tick, what is not as it was, up to what refutes the requirement; `plan` is of the counterexample's scenario.
[[nodiscard]] std::string story_of(const project::Plan& plan, const verify::Judgement& judgement);

}  // namespace sentree::cli
