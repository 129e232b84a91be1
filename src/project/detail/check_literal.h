#pragma once

#include <string>

#include "sentree/idl/schema.h"
#include "sentree/scxml/script_syntax.h"

namespace sentree::project {

/// What a record or a list that is written down in a script cannot be for an interface: members that are missing or
/// too many, unions that are several things, constants of another type. What is computed is taken to be right.
/// @param what  For messages: `param "goal"`.
/// Codes: those of `idl::conform`.
void check_literal(const idl::Type& type, const scxml::ScriptTree& tree, const std::string& what,
                   const SourceSpan& span, Diagnostics& diagnostics);

}  // namespace sentree::project
