#pragma once

#include "sentree/base/value.h"
#include "sentree/idl/schema.h"

namespace sentree::idl {

/// A service's methods and the types that they use, as data from which a page or a tool can make a form:
///
///   {methods: [{name, args: [field], result: type, oneway, unit?}], types: {type: description}}
///   field        {name, type, required, default?, unit?}; `default` is what an absent one counts as
///   description  {kind: "struct" | "union" | "exception", fields: [field]}, {kind: "enum", values: [name]},
///                {kind: "list" | "set", element: type}, {kind: "map", key: type, element: type}
///
/// A `type` is a name: of a base type ("void", "bool", "i32", "double", "string", "binary" …), else a key of `types`. A
/// struct may contain itself. Cost: O(methods + types).
[[nodiscard]] Value describe(const Service& service);

}  // namespace sentree::idl
