#pragma once

#include <string>
#include <string_view>
#include <variant>

#include "sentree/base/result.h"
#include "sentree/design/tree_edit.h"

namespace sentree::design {

/// The state's id, with everything that names it: targets, initial states, done.state events, In().
struct RenameState {
  std::string state;
  std::string id;
};
struct AddState {
  std::string parent;  ///< Empty: the top level.
  std::string id;
  bool final = false;
};
struct RemoveState {
  std::string state;
};
/// Behind the transitions that `source` has.
struct AddTransition {
  std::string source;
  std::string target;  ///< Empty: none.
  std::string event;   ///< Empty: eventless.
  std::string condition;
};
using ChartGesture = std::variant<RenameState, AddState, RemoveState, AddTransition>;

/// A change of a chart as edits of its text, as `scxml::ChartEdit` makes it.
/// Errors: those of `scxml::load` and `ChartEdit` (a target that would be gone, an id that is taken, …),
/// design.no-such-node, design.bad-name.
[[nodiscard]] Result<GestureResult> edit_chart(std::string_view xml, const ChartGesture& gesture,
                                               const std::string& file = {});

}  // namespace sentree::design
