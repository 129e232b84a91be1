#pragma once

#include <string>

#include "sentree/project/plan.h"
#include "sentree/verify/judge.h"

namespace sentree::cli {

/// Whether a model chose something; a topic of a service may be called so too.
[[nodiscard]] bool is_choice(const project::Plan& plan, const Message& message);

/// Tick by tick, what is not as it was, up to what refutes the requirement, in lines; times in seconds of the run.
/// Errors are its text: those of `verify::retell`. Cost: that of executing the counterexample once.
/// @param plan  Of the counterexample's scenario.
[[nodiscard]] std::string story_of(const project::Plan& plan, const verify::Judgement& judgement);

}  // namespace sentree::cli
