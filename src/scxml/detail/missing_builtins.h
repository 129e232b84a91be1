#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "sentree/scxml/model.h"

namespace sentree::scxml {

/// A built-in of a newer ECMAScript that an expression uses and no heap has.
struct MissingBuiltin {
  ExpressionId expression = kNoExpression;
  std::string_view where;  ///< In the expression's text.
  std::string message;     ///< What is missing, and what to write.
};

/// Each name once for an expression, in order. What the chart may have of its own under that name is left out, as is
/// what it asks for before it uses it. Cost: O(size).
[[nodiscard]] std::vector<MissingBuiltin> missing_builtins(const Model& model);

}  // namespace sentree::scxml
