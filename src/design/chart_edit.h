#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "sentree/base/result.h"
#include "sentree/design/tree_edit.h"
#include "sentree/scxml/chart.h"

namespace sentree::design {

/// The state's id, with everything that names it: targets, initial states, done.state events, In().
struct RenameState {
  std::string state;
  std::string id;
};
/// "state", "parallel", "final", "history" or "deep-history".
using ChartStateKind = std::string;
struct AddState {
  std::string parent;  ///< Empty: the top level.
  std::string id;
  ChartStateKind kind = "state";  ///< A history gets the first state beside it for its default.
};
/// With what is in it, and the transitions that lead nowhere without it.
struct RemoveState {
  std::string state;
};
/// Behind what is in `parent`.
struct MoveState {
  std::string state;
  std::string parent;  ///< Empty: the top level.
};
/// A state of its own around it.
struct WrapState {
  std::string state;
  std::string id;
  ChartStateKind kind = "state";  ///< Or "parallel".
};
/// One gesture on several states, whose own `state` does not count. What is inside of another of them goes along with
/// it; they keep the order that they are written in. Those that are put into a new state are beside each other in one
/// state.
struct EditStates {
  std::vector<std::string> states;  ///< In any order.
  std::variant<RemoveState, MoveState, WrapState> gesture;
};
/// States written elsewhere, as another chart or another editor has them: one or several elements, or a chart. Ids that
/// are taken are followed by a free number, also where these states name each other (moving_2). Without positions of Qt
/// Creator, and without transitions to what is neither pasted nor there.
struct PasteStates {
  std::string parent;  ///< Empty: the top level.
  std::string xml;
};
struct SetKind {
  std::string state;
  ChartStateKind kind;
};
/// It is entered first of those in its parent.
struct SetInitial {
  std::string state;
};
/// Behind the transitions that `source` has.
struct AddTransition {
  std::string source;
  std::string target;  ///< Empty: none.
  std::string event;   ///< Empty: eventless.
  std::string condition;
  bool fresh = false;  ///< `target` is a state that is made for it, at the top level.
};
/// What is nothing stays as it is; what is empty goes. Of an initial state there is only a target.
struct SetTransition {
  scxml::TransitionIndex transition = 0;
  std::optional<std::string> event;
  std::optional<std::string> condition;
  std::optional<std::string> target;  ///< Ids, with spaces between.
};
struct RemoveTransition {
  scxml::TransitionIndex transition = 0;
};
/// The first of a state's transitions that can be taken is.
struct MoveTransition {
  scxml::TransitionIndex transition = 0;
  std::string source;
  std::size_t index = 0;  ///< Before which of the source's transitions, itself counted.
};

/// Where executable content stands, or <data>.
struct ActionPlace {
  std::optional<scxml::TransitionIndex> transition;
  std::string state;  ///< If it is no transition's; empty: the chart itself.
  std::string block;  ///< Of a state: "onentry", "onexit" or "datamodel".
};
/// `xml`: one element. Behind all if there are fewer than `index`.
struct InsertAction {
  ActionPlace place;
  std::size_t index = 0;
  std::string xml;
};
struct SetAction {
  ActionPlace place;
  std::size_t index = 0;
  std::string xml;
};
struct RemoveAction {
  ActionPlace place;
  std::size_t index = 0;
};
/// Before action `to`, itself counted.
struct MoveAction {
  ActionPlace place;
  std::size_t index = 0;
  std::size_t to = 0;
};
using ChartGesture = std::variant<RenameState, AddState, RemoveState, MoveState, WrapState, EditStates, PasteStates,
                                  SetKind, SetInitial, AddTransition, SetTransition, RemoveTransition, MoveTransition,
                                  InsertAction, SetAction, RemoveAction, MoveAction>;

/// What of a chart can be edited, as written: actions and <data> as XML.
struct ChartParts {
  struct StateParts {
    ChartStateKind kind;  ///< Empty: the chart itself.
    bool initial = false;
    std::size_t from = 0;  ///< Byte of its '<'.
    std::size_t to = 0;    ///< One past its last '>'.
    std::vector<std::string> onentry;
    std::vector<std::string> onexit;
  };
  struct TransitionParts {
    bool written = false;  ///< As a <transition>; else it is an initial state's, of an attribute or by default.
    std::string event;
    std::string condition;
    std::string target;
    std::vector<std::string> actions;
  };
  std::vector<StateParts> states;            ///< By `scxml::StateIndex`.
  std::vector<TransitionParts> transitions;  ///< By `scxml::TransitionIndex`.
  std::vector<std::string> data;             ///< Of the chart itself.
};
/// Cost: O(size).
[[nodiscard]] ChartParts parts_of(const scxml::Chart& chart);

/// A change of a chart as edits of its text, as `scxml::ChartEdit` makes it.
/// Comments, attributes, quotes and line ends outside of what is changed stay byte for byte.
///
/// Errors: those of `scxml::load` and `ChartEdit` (an id that is taken, an element where it may not be, …),
/// design.no-such-node, design.bad-name, design.arity, design.inside-itself, design.bad-content (no single element),
/// design.no-nodes (what is pasted), design.nothing-to-do. The message says why, for whoever drags.
/// Cost: O(size).
[[nodiscard]] Result<GestureResult> edit_chart(std::string_view xml, const ChartGesture& gesture,
                                               const std::string& file = {});

}  // namespace sentree::design
