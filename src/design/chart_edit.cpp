#include "sentree/design/chart_edit.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <functional>
#include <map>
#include <set>
#include <utility>

#include "sentree/design/detail/chart_paste.h"
#include "sentree/design/detail/element_edits.h"
#include "sentree/scxml/edit.h"
#include "sentree/scxml/loader.h"
#include "sentree/scxml/model.h"

namespace sentree::design {

namespace {

using scxml::StateIndex;
using scxml::TransitionIndex;
using text::XmlElement;

bool is_id(std::string_view id) {
  return !id.empty() && std::isdigit(static_cast<unsigned char>(id.front())) == 0 &&
         std::all_of(id.begin(), id.end(), [](char c) {
           const auto u = static_cast<unsigned char>(c);
           return std::isalnum(u) != 0 || u >= 0x80 || c == '_' || c == '-' || c == '.';
         });
}

std::string kind_of(const scxml::State& state) {
  switch (state.kind) {
    case scxml::StateKind::kRoot: return "";
    case scxml::StateKind::kParallel: return "parallel";
    case scxml::StateKind::kFinal: return "final";
    case scxml::StateKind::kHistoryShallow: return "history";
    case scxml::StateKind::kHistoryDeep: return "deep-history";
    case scxml::StateKind::kAtomic:
    case scxml::StateKind::kCompound: return "state";
  }
  return "";
}

bool is_history_kind(std::string_view kind) { return kind == "history" || kind == "deep-history"; }

// The elements of a chart's states and transitions.
class ChartElements {
 public:
  ChartElements(const scxml::Chart& chart, const text::XmlDocument& document) : chart_(chart) {
    text::for_each_element(document.root(), [&](const XmlElement& element) {
      const auto [line, column] = document.lines().position(element.offset());
      elements_.emplace(std::pair(line, column), element);
    });
  }
  [[nodiscard]] XmlElement of_state(StateIndex state) const { return at(chart_.states()[state].place); }
  /// Its <transition>; none: it is an initial state's, of an attribute or by default.
  [[nodiscard]] XmlElement of_transition(TransitionIndex transition) const {
    const XmlElement element = at(chart_.transitions()[transition].place);
    return element.local_name() == "transition" ? element : XmlElement();
  }
  /// <onentry>, …, of which there may be several; of a transition itself.
  [[nodiscard]] std::vector<XmlElement> blocks(StateIndex state, std::string_view name) const {
    std::vector<XmlElement> found = of_state(state).children();
    std::erase_if(found, [&](const XmlElement& child) { return child.local_name() != name; });
    return found;
  }

 private:
  [[nodiscard]] XmlElement at(const scxml::Place& place) const {
    const auto found = elements_.find(std::pair(place.line, place.column));
    return found != elements_.end() ? found->second : XmlElement();
  }
  const scxml::Chart& chart_;
  std::map<std::pair<int, int>, XmlElement> elements_;
};

std::vector<XmlElement> actions_in(const std::vector<XmlElement>& blocks) {
  std::vector<XmlElement> found;
  for (const XmlElement& block : blocks) {
    const auto children = block.children();
    found.insert(found.end(), children.begin(), children.end());
  }
  return found;
}

std::size_t place_among(const XmlElement& element) {
  const auto siblings = element.parent().children();
  return static_cast<std::size_t>(std::find(siblings.begin(), siblings.end(), element) - siblings.begin());
}

class ChartEditor {
 public:
  explicit ChartEditor(const scxml::Chart& chart)
      : chart_(chart), edit_(chart), moves_(edit_.document()), elements_(chart, edit_.document()) {}

  Result<std::string> operator()(const RenameState& rename) {
    const auto state = find(rename.state);
    if (!state) return tl::unexpected(state.error());
    if (auto ok = check_id(rename.id, false); !ok) return tl::unexpected(ok.error());
    if (auto renamed = edit_.rename_state(*state, rename.id); !renamed) return tl::unexpected(renamed.error());
    return fmt::format("rename {} to {}", rename.state, rename.id);
  }

  Result<std::string> operator()(const AddState& add) {
    const auto parent = parent_of(add.parent);
    if (!parent) return tl::unexpected(parent.error());
    if (auto ok = check_id(add.id, true); !ok) return tl::unexpected(ok.error());
    const XmlElement inside = elements_.of_state(*parent);
    if (!is_history_kind(add.kind)) {
      if (auto ok = check_kind(add.kind, {"state", "parallel", "final"}); !ok) return tl::unexpected(ok.error());
      moves_.put(inside, inside.children().size(),
                 fmt::format("<{}{}/>", tag(add.kind), text::xml_attribute("id", add.id)));
      return fmt::format("add {} {}", add.kind, add.id);
    }
    const auto& beside = chart_.states()[*parent].children;
    const auto first = std::find_if(beside.begin(), beside.end(), [&](StateIndex state) {
      return !chart_.states()[state].is_history() && !chart_.states()[state].id.empty();
    });
    if (*parent == 0 || first == beside.end())
      return fail("design.arity", "a history stands in a state that has others inside, which it remembers");
    moves_.put(inside, inside.children().size(),
               fmt::format("<{}{}{}><{}{}/></{}>", tag("history"), text::xml_attribute("id", add.id),
                           add.kind == "deep-history" ? text::xml_attribute("type", "deep") : "", tag("transition"),
                           text::xml_attribute("target", chart_.states()[*first].id), tag("history")));
    return "add history " + add.id;
  }

  Result<std::string> operator()(const RemoveState& remove) { return several(remove, {remove.state}); }
  Result<std::string> operator()(const MoveState& move) { return several(move, {move.state}); }
  Result<std::string> operator()(const WrapState& wrap) { return several(wrap, {wrap.state}); }
  Result<std::string> operator()(const EditStates& edit) {
    return std::visit([&](const auto& gesture) { return several(gesture, edit.states); }, edit.gesture);
  }

  Result<std::string> operator()(const PasteStates& paste) {
    const auto parent = parent_of(paste.parent);
    if (!parent) return tl::unexpected(parent.error());
    const auto given =
        pasted_states(paste.xml, chart_, edit_.document().root().attribute("datamodel").value_or("null"));
    if (!given) return tl::unexpected(given.error());
    const auto states = states_pasted(given->document.root());
    const ElementEdits written(given->document);
    std::string xml;
    for (const XmlElement& state : *states) {
      xml += (xml.empty() ? "" : "\n") + written.text_of(state);
      pasted_.emplace_back(state.attribute("id").value_or(""));
    }
    const XmlElement inside = elements_.of_state(*parent);
    moves_.put(inside, inside.children().size(), xml);
    return fmt::format("paste {}{}{}", pasted_.size() == 1 ? pasted_.front() : fmt::format("{} states", pasted_.size()),
                       *parent == 0 ? "" : " into " + paste.parent,
                       given->left_out == 0 ? ""
                                            : fmt::format(" without {} transition{} to what is not here",
                                                          given->left_out, given->left_out == 1 ? "" : "s"));
  }

  Result<std::string> operator()(const SetKind& set) {
    const auto state = find(set.state);
    if (!state) return tl::unexpected(state.error());
    if (auto ok = check_kind(set.kind, {"state", "parallel", "final", "history", "deep-history"}); !ok)
      return tl::unexpected(ok.error());
    const std::string now = kind_of(chart_.states()[*state]);
    if (now == set.kind) return fail("design.nothing-to-do", set.state + " is that already");
    const XmlElement element = elements_.of_state(*state);
    if (is_history_kind(now) != is_history_kind(set.kind))
      return fail("design.arity", "a history is added, or deleted; nothing else becomes one, or is made of one");
    if (is_history_kind(now)) {
      edit_.set_attribute(element, "type", set.kind == "history" ? "shallow" : "deep");
    } else {
      for (const XmlElement& child : element.children()) {
        const std::string_view name = child.local_name();
        const bool moot = name == "initial" && set.kind == "parallel";
        const bool fits = name == "onentry" || name == "onexit" || (set.kind != "final" && name != "donedata");
        if (moot)
          moves_.take_out(child);
        else if (!fits)
          return fail("design.arity",
                      fmt::format("{} holds <{}>, which {}", set.state, name,
                                  set.kind == "final" ? "a final state has not" : "only a final state has"));
      }
      edit_.remove_attribute(element, "initial");
      moves_.rename(element, tag(set.kind));
    }
    return fmt::format("make {} a {}", set.state, set.kind);
  }

  Result<std::string> operator()(const SetInitial& set) {
    const auto state = find(set.state);
    if (!state) return tl::unexpected(state.error());
    const StateIndex parent = chart_.states()[*state].parent;
    if (chart_.states()[parent].kind == scxml::StateKind::kParallel)
      return fail("design.arity", fmt::format("all that is in the parallel {} is entered", chart_.states()[parent].id));
    set_initial(parent, set.state);
    return "begin with " + set.state;
  }

  Result<std::string> operator()(const AddTransition& add) {
    const auto source = source_of(add.source);
    if (!source) return tl::unexpected(source.error());
    if (add.fresh) {
      if (auto made = (*this)(AddState{"", add.target}); !made) return made;
    } else if (auto ok = check_targets(add.target); !ok) {
      return tl::unexpected(ok.error());
    }
    if (add.target.empty() && add.event.empty() && add.condition.empty()) return fail_idle();
    std::string xml = "<" + tag("transition");
    for (const auto& [name, value] :
         {std::pair("event", add.event), std::pair("cond", add.condition), std::pair("target", add.target)}) {
      if (!value.empty()) xml += text::xml_attribute(name, value);
    }
    const XmlElement state = elements_.of_state(*source);
    moves_.put(state, behind_transitions(state), xml + "/>");
    return fmt::format("add transition from {}{}{}", add.source, add.target.empty() ? "" : " to ",
                       (add.fresh ? "new state " : "") + add.target);
  }

  Result<std::string> operator()(const SetTransition& set) {
    const auto transition = transition_at(set.transition);
    if (!transition) return tl::unexpected(transition.error());
    if (set.target) {
      if (auto ok = check_targets(*set.target); !ok) return tl::unexpected(ok.error());
    }
    const XmlElement element = elements_.of_transition(set.transition);
    if (!element) {
      if (!set.target || set.target->empty())
        return fail("design.arity", "where a state begins there is a target and nothing else");
      set_initial((*transition)->source, *set.target);
      return "begin with " + *set.target;
    }
    bool idle = true;
    for (const auto& [name, value] :
         {std::pair("event", &set.event), std::pair("cond", &set.condition), std::pair("target", &set.target)}) {
      const auto now = element.attribute(name);
      idle = idle && (*value ? (*value)->empty() : now.value_or("").empty());
      if (!*value || **value == now.value_or("")) continue;
      if ((*value)->empty())
        edit_.remove_attribute(element, name);
      else
        edit_.set_attribute(element, name, **value);
    }
    if (idle) return fail_idle();
    return "change a transition of " + shown((*transition)->source);
  }

  Result<std::string> operator()(const RemoveTransition& remove) {
    const auto transition = transition_at(remove.transition);
    if (!transition) return tl::unexpected(transition.error());
    const XmlElement element = elements_.of_transition(remove.transition);
    const std::string name = "delete a transition of " + shown((*transition)->source);
    if (element) {
      moves_.take_out(element.parent().local_name() == "initial" ? element.parent() : element);
      return name;
    }
    const XmlElement state = elements_.of_state((*transition)->source);
    if (!state.attribute("initial"))
      return fail("design.nothing-to-do", "nothing is written that says so: the first state inside is entered first");
    edit_.remove_attribute(state, "initial");
    return name;
  }

  Result<std::string> operator()(const MoveTransition& move) {
    const auto transition = transition_at(move.transition);
    if (!transition) return tl::unexpected(transition.error());
    const auto source = source_of(move.source);
    if (!source) return tl::unexpected(source.error());
    const XmlElement element = elements_.of_transition(move.transition);
    if (!element || element.parent() != elements_.of_state((*transition)->source))
      return fail("design.arity", "where a state begins stands in that state");
    const XmlElement state = elements_.of_state(*source);
    const auto others = elements_.blocks(*source, "transition");
    const auto own = static_cast<std::size_t>(std::find(others.begin(), others.end(), element) - others.begin());
    const bool stays = element.parent() == state;
    if (stays && (std::min(move.index, others.size()) == own || move.index == own + 1))
      return fail("design.nothing-to-do", "it is there already");
    moves_.put_copies(state, move.index < others.size() ? place_among(others[move.index]) : behind_transitions(state),
                      {{element, {}}});
    moves_.take_out(element);
    return (stays ? "order the transitions of " : "move a transition to ") + shown(*source);
  }

  Result<std::string> operator()(const InsertAction& insert) {
    const auto blocks = blocks_of(insert.place);
    if (!blocks) return tl::unexpected(blocks.error());
    if (auto ok = check_content(insert.xml); !ok) return tl::unexpected(ok.error());
    const auto actions = actions_in(*blocks);
    if (insert.index < actions.size()) {
      moves_.put(actions[insert.index].parent(), place_among(actions[insert.index]), insert.xml);
    } else if (!blocks->empty()) {
      moves_.put(blocks->back(), blocks->back().children().size(), insert.xml);
    } else {
      const auto state = insert.place.state.empty() ? Result<StateIndex>(kRootIndex) : find(insert.place.state);
      const XmlElement element = elements_.of_state(*state);
      const std::string step = moves_.indentation_step(element);
      std::string inner;
      for (const char c : insert.xml) inner += c == '\n' ? "\n" + step : std::string(1, c);
      const std::string block = tag(insert.place.block);
      moves_.put(element, insert.place.block == "onexit" ? behind(element, "onentry") : behind(element, "datamodel"),
                 fmt::format("<{}>\n{}{}\n</{}>", block, step, inner, block));
    }
    return "add to " + shown(insert.place);
  }

  Result<std::string> operator()(const SetAction& set) {
    const auto action = action_at(set.place, set.index);
    if (!action) return tl::unexpected(action.error());
    if (auto ok = check_content(set.xml); !ok) return tl::unexpected(ok.error());
    if (moves_.text_of(*action) == set.xml) return fail("design.nothing-to-do", "it is so already");
    moves_.replace(*action, set.xml);
    return "change " + shown(set.place);
  }

  Result<std::string> operator()(const RemoveAction& remove) {
    const auto action = action_at(remove.place, remove.index);
    if (!action) return tl::unexpected(action.error());
    const XmlElement block = action->parent();
    const bool last = block.size() == 1 + action->size() && block.text().empty() && !remove.place.transition &&
                      block.inner_source().find("<!--") == std::string_view::npos;
    moves_.take_out(last ? block : *action);
    return "delete from " + shown(remove.place);
  }

  Result<std::string> operator()(const MoveAction& move) {
    const auto action = action_at(move.place, move.index);
    if (!action) return tl::unexpected(action.error());
    const auto actions = actions_in(*blocks_of(move.place));
    const std::size_t to = std::min(move.to, actions.size());
    if (to == move.index || to == move.index + 1) return fail("design.nothing-to-do", "it is there already");
    const XmlElement beside = actions[to < actions.size() ? to : to - 1];
    moves_.put_copies(beside.parent(), place_among(beside) + (to < actions.size() ? 0 : 1), {{*action, {}}});
    moves_.take_out(*action);
    return "order " + shown(move.place);
  }

  [[nodiscard]] Result<std::string> apply() {
    for (TextEdit& edit : moves_.take()) edit_.replace_text(edit.from, edit.to, std::move(edit.text));
    return edit_.apply();
  }

  /// Ids of the states that were pasted.
  [[nodiscard]] std::vector<std::string> take_pasted() { return std::move(pasted_); }

 private:
  static constexpr StateIndex kRootIndex = 0;
  using States = std::vector<StateIndex>;

  // In the order written, without those inside of others of them.
  [[nodiscard]] Result<States> outermost(const std::vector<std::string>& ids) const {
    States all;
    for (const std::string& id : ids) {
      const auto state = find(id);
      if (!state) return tl::unexpected(state.error());
      all.push_back(*state);
    }
    if (all.empty()) return fail("design.nothing-to-do", "no state is chosen");
    std::sort(all.begin(), all.end());
    States found;
    for (const StateIndex state : all) {
      if (!is_among(state, found)) found.push_back(state);
    }
    return found;
  }
  [[nodiscard]] std::string shown(const States& states) const {
    return states.size() == 1 ? shown(states.front()) : fmt::format("{} states", states.size());
  }

  Result<std::string> several(const RemoveState&, const std::vector<std::string>& ids) {
    const auto states = outermost(ids);
    if (!states) return tl::unexpected(states.error());
    const std::string what = states->size() == 1 ? "state " + shown(*states) : shown(*states);
    const auto count = forget(*states);
    for (const StateIndex state : *states) moves_.take_out(elements_.of_state(state));
    return fmt::format("delete {}{}", what,
                       count == 0 ? ""
                                  : fmt::format(" with {}{} to {}", count, count == 1 ? " transition" : " transitions",
                                                states->size() == 1 ? "it" : "them"));
  }

  Result<std::string> several(const MoveState& move, const std::vector<std::string>& ids) {
    auto states = outermost(ids);
    if (!states) return tl::unexpected(states.error());
    const auto parent = parent_of(move.parent);
    if (!parent) return tl::unexpected(parent.error());
    if (is_among(*parent, *states))
      return fail("design.inside-itself",
                  shown(*states) + (states->size() == 1 ? " cannot go into itself" : " cannot go into themselves"));
    const std::string all = shown(*states);
    std::erase_if(*states, [&](StateIndex state) { return chart_.states()[state].parent == *parent; });
    if (states->empty())
      return fail("design.nothing-to-do", all + (ids.size() == 1 ? " is" : " are") + " there already");
    // Initial states that they are no longer inside of.
    forget_initials(*states, *parent);
    std::vector<ElementEdits::Copy> copies;
    for (const StateIndex state : *states) {
      copies.push_back({elements_.of_state(state), {}});
      moves_.take_out(elements_.of_state(state));
    }
    const XmlElement inside = elements_.of_state(*parent);
    moves_.put_copies(inside, inside.children().size(), copies);
    return fmt::format("move {}{}", shown(*states),
                       *parent == 0 ? std::string(" to the top level") : " into " + move.parent);
  }

  Result<std::string> several(const WrapState& wrap, const std::vector<std::string>& ids) {
    const auto states = outermost(ids);
    if (!states) return tl::unexpected(states.error());
    if (auto ok = check_id(wrap.id, true); !ok) return tl::unexpected(ok.error());
    if (auto ok = check_kind(wrap.kind, {"state", "parallel"}); !ok) return tl::unexpected(ok.error());
    std::vector<XmlElement> elements;
    for (const StateIndex state : *states) {
      elements.push_back(elements_.of_state(state));
      if (elements.back().parent() != elements.front().parent())
        return fail("design.arity", fmt::format("{} and {} are in different states; one state is put around those that "
                                                "are in the same",
                                                shown(states->front()), shown(state)));
    }
    if (std::all_of(states->begin(), states->end(),
                    [&](StateIndex state) { return chart_.states()[state].is_history(); }))
      return fail("design.arity", shown(states->front()) + " is a history: it stands beside what it remembers");
    const std::string open = fmt::format("<{}{}>", tag(wrap.kind), text::xml_attribute("id", wrap.id));
    const std::string close = fmt::format("</{}>", tag(wrap.kind));
    const XmlElement around = elements.front().parent();
    const std::size_t first = place_among(elements.front());
    if (place_among(elements.back()) - first + 1 == elements.size()) {
      moves_.wrap(elements, open, close);
    } else {
      // Something is between them: the others come to the first.
      const std::string step = moves_.indentation_step(around);
      std::string inside;
      for (const XmlElement& element : elements) {
        for (const char c : "\n" + moves_.text_of(element)) inside += c == '\n' ? "\n" + step : std::string(1, c);
        moves_.take_out(element);
      }
      moves_.put(around, first + 1, open + inside + "\n" + close);
    }
    return fmt::format("put {} into the new {} {}", shown(*states), wrap.kind, wrap.id);
  }

  // In the namespace that the chart's own elements have.
  [[nodiscard]] std::string tag(const std::string& name) const {
    const std::string_view root = edit_.document().root().name();
    const std::size_t colon = root.find(':');
    return (colon == std::string_view::npos ? "" : std::string(root.substr(0, colon + 1))) + name;
  }

  [[nodiscard]] std::string shown(StateIndex state) const {
    return state == kRootIndex ? "the chart" : chart_.states()[state].id;
  }
  [[nodiscard]] std::string shown(const ActionPlace& place) const {
    if (place.transition) return "a transition of " + shown(chart_.transitions()[*place.transition].source);
    return fmt::format("{} of {}", place.block, place.state.empty() ? "the chart" : place.state);
  }

  static tl::unexpected<Diagnostic> fail_idle() {
    return fail("design.arity", "a transition has an event, a condition or a target");
  }

  [[nodiscard]] Result<StateIndex> find(const std::string& id) const {
    if (const auto state = chart_.find(id); state && !id.empty()) return *state;
    return fail("design.no-such-node", fmt::format("there is no state \"{}\"", id));
  }
  [[nodiscard]] Result<StateIndex> parent_of(const std::string& id) const {
    if (id.empty()) return kRootIndex;
    auto found = find(id);
    if (!found) return found;
    const scxml::State& state = chart_.states()[*found];
    if (state.kind == scxml::StateKind::kFinal) return fail("design.arity", id + " is final: it has no states inside");
    if (state.is_history()) return fail("design.arity", id + " is a history: it has no states inside");
    return found;
  }
  [[nodiscard]] Result<StateIndex> source_of(const std::string& id) const {
    auto found = find(id);
    if (!found) return found;
    const scxml::State& state = chart_.states()[*found];
    if (state.kind == scxml::StateKind::kFinal || state.is_history())
      return fail("design.arity", fmt::format("nothing leads out of {}, which is final or a history", id));
    return found;
  }
  [[nodiscard]] Result<const scxml::Transition*> transition_at(TransitionIndex transition) const {
    if (transition < chart_.transitions().size()) return &chart_.transitions()[transition];
    return fail("design.no-such-node", "there is no such transition in the text as it is now");
  }
  [[nodiscard]] Result<void> check_id(const std::string& id, bool is_new) const {
    if (!is_id(id)) return fail("design.bad-name", fmt::format("\"{}\" is no id of a state", id));
    if (is_new && chart_.find(id))
      return fail("scxml.duplicate-id", fmt::format("there is a state \"{}\" already", id));
    return {};
  }
  static Result<void> check_kind(const std::string& kind, const std::vector<std::string>& kinds) {
    if (std::find(kinds.begin(), kinds.end(), kind) != kinds.end()) return {};
    return fail("design.bad-name", fmt::format("\"{}\" is no kind of state here", kind));
  }
  [[nodiscard]] Result<void> check_targets(const std::string& targets) const {
    std::string id;
    for (const char c : targets + ' ') {
      if (c != ' ') {
        id += c;
        continue;
      }
      if (id.empty()) continue;
      if (const auto found = find(id); !found) return tl::unexpected(found.error());
      id.clear();
    }
    return {};
  }
  static Result<void> check_content(const std::string& xml) {
    const auto document = text::XmlDocument::parse(fmt::format("<content>{}</content>", xml), {}, {.lenient = true});
    if (!document) return fail("design.bad-content", "this is no XML: " + document.error().message);
    if (document->root().children().size() != 1 || !document->root().text().empty())
      return fail("design.bad-content", "write one element, as <log expr=\"'here'\"/>");
    return {};
  }

  [[nodiscard]] bool is_inside(StateIndex state, StateIndex outer) const {
    return state > outer && state < chart_.states()[outer].end;
  }
  // One of them, or inside of one.
  [[nodiscard]] bool is_among(StateIndex state, const States& states) const {
    return std::any_of(states.begin(), states.end(),
                       [&](StateIndex one) { return state == one || is_inside(state, one); });
  }

  // Behind the last child of that name; before all if there is none.
  static std::size_t behind(const XmlElement& parent, std::string_view name) {
    const auto children = parent.children();
    std::size_t at = 0;
    for (std::size_t i = 0; i < children.size(); ++i) {
      if (children[i].local_name() == name) at = i + 1;
    }
    return at;
  }
  // Before the states inside, behind all else where there are none yet.
  static std::size_t behind_transitions(const XmlElement& state) {
    if (const std::size_t at = behind(state, "transition"); at > 0) return at;
    const auto children = state.children();
    const auto first = std::find_if(children.begin(), children.end(), [](const XmlElement& child) {
      const std::string_view name = child.local_name();
      return name == "state" || name == "parallel" || name == "final" || name == "history";
    });
    return static_cast<std::size_t>(first - children.begin());
  }

  void set_initial(StateIndex parent, const std::string& targets) {
    const auto initial = elements_.blocks(parent, "initial");
    const XmlElement element = elements_.of_state(parent);
    if (!initial.empty())
      edit_.set_attribute(initial.front().child("transition"), "target", targets);
    else
      edit_.set_attribute(element, element.attribute("initialstate") ? "initialstate" : "initial", targets);
  }

  // Of a transition that leads into `states`: the ids that remain without them.
  [[nodiscard]] std::string without(const scxml::Transition& transition, const States& states) const {
    std::string rest;
    for (const StateIndex target : transition.targets) {
      if (!is_among(target, states)) rest += (rest.empty() ? "" : " ") + chart_.states()[target].id;
    }
    return rest;
  }
  [[nodiscard]] bool leads_into(const scxml::Transition& transition, const States& states) const {
    return std::any_of(transition.targets.begin(), transition.targets.end(),
                       [&](StateIndex target) { return is_among(target, states); });
  }

  // What names the states from outside, or what is in them, names them no more. How many transitions are gone.
  std::size_t forget(const States& states) {
    forget_initials(states, scxml::kNoState);
    std::size_t gone = 0;
    for (TransitionIndex t = 0; t < chart_.transitions().size(); ++t) {
      const scxml::Transition& transition = chart_.transitions()[t];
      const XmlElement element = elements_.of_transition(t);
      if (is_among(transition.source, states) || !element || element.parent().local_name() == "initial" ||
          !leads_into(transition, states))
        continue;
      // A history that goes too takes its default along.
      if (std::any_of(states.begin(), states.end(),
                      [&](StateIndex state) { return is_in(element, elements_.of_state(state)); }))
        continue;
      if (const std::string rest = without(transition, states); !rest.empty()) {
        edit_.set_attribute(element, "target", rest);
        continue;
      }
      moves_.take_out(element);
      ++gone;
    }
    return gone;
  }

  static bool is_in(XmlElement element, const XmlElement& outer) {
    for (; element; element = element.parent()) {
      if (element == outer) return true;
    }
    return false;
  }

  // Initial states of those around them that are not around `kept`, too.
  void forget_initials(const States& states, StateIndex kept) {
    std::set<StateIndex> around;
    for (const StateIndex state : states) {
      for (StateIndex outer = chart_.states()[state].parent; outer != scxml::kNoState;
           outer = chart_.states()[outer].parent) {
        if (kept == scxml::kNoState || (outer != kept && !is_inside(kept, outer))) around.insert(outer);
      }
    }
    for (const StateIndex outer : around) {
      const TransitionIndex initial = chart_.model().state_code[outer].initial;
      if (initial == scxml::kNoTransition || !leads_into(chart_.transitions()[initial], states)) continue;
      const std::string rest = without(chart_.transitions()[initial], states);
      const auto written = elements_.blocks(outer, "initial");
      const XmlElement element = elements_.of_state(outer);
      if (!rest.empty()) {
        set_initial(outer, rest);
      } else if (!written.empty()) {
        moves_.take_out(written.front());
      } else {
        edit_.remove_attribute(element, "initial");
        edit_.remove_attribute(element, "initialstate");
      }
    }
  }

  [[nodiscard]] Result<std::vector<XmlElement>> blocks_of(const ActionPlace& place) const {
    if (place.transition) {
      const auto transition = transition_at(*place.transition);
      if (!transition) return tl::unexpected(transition.error());
      const XmlElement element = elements_.of_transition(*place.transition);
      if (!element) return fail("design.arity", "write the initial state as <initial> to have something done there");
      return std::vector{element};
    }
    if (place.block != "onentry" && place.block != "onexit" && place.block != "datamodel")
      return fail("design.bad-name", fmt::format("\"{}\" is no place for this", place.block));
    const auto state = place.state.empty() ? Result<StateIndex>(kRootIndex) : find(place.state);
    if (!state) return tl::unexpected(state.error());
    if (*state == kRootIndex && place.block != "datamodel")
      return fail("design.arity", "the chart as a whole does nothing on entry and exit; its states do");
    if (chart_.states()[*state].is_history())
      return fail("design.arity", place.state + " is a history: nothing is done there");
    return elements_.blocks(*state, place.block);
  }
  [[nodiscard]] Result<XmlElement> action_at(const ActionPlace& place, std::size_t index) const {
    const auto blocks = blocks_of(place);
    if (!blocks) return tl::unexpected(blocks.error());
    const auto actions = actions_in(*blocks);
    if (index >= actions.size()) return fail("design.no-such-node", "there is no such action in the text as it is now");
    return actions[index];
  }

  const scxml::Chart& chart_;
  scxml::ChartEdit edit_;
  ElementEdits moves_;
  ChartElements elements_;
  std::vector<std::string> pasted_;
};

}  // namespace

ChartParts parts_of(const scxml::Chart& chart) {
  const scxml::ChartEdit read(chart);
  const ChartElements elements(chart, read.document());
  const ElementEdits texts(read.document());
  const auto written = [&](const std::vector<XmlElement>& blocks) {
    std::vector<std::string> actions;
    for (const XmlElement& action : actions_in(blocks)) actions.push_back(texts.text_of(action));
    return actions;
  };
  ChartParts parts;
  for (StateIndex s = 0; s < chart.states().size(); ++s) {
    const scxml::State& state = chart.states()[s];
    ChartParts::StateParts& part = parts.states.emplace_back();
    part.kind = kind_of(state);
    part.onentry = written(elements.blocks(s, "onentry"));
    part.onexit = written(elements.blocks(s, "onexit"));
    if (const XmlElement element = elements.of_state(s)) {
      part.from = element.offset();
      part.to = element.end_offset();
    }
    if (s == 0) continue;
    const TransitionIndex initial = chart.model().state_code[state.parent].initial;
    const auto is_entered = [&](StateIndex target) { return target == s || (target > s && target < state.end); };
    if (initial != scxml::kNoTransition && chart.states()[state.parent].kind != scxml::StateKind::kParallel) {
      const auto& targets = chart.transitions()[initial].targets;
      part.initial = std::any_of(targets.begin(), targets.end(), is_entered);
    }
  }
  for (TransitionIndex t = 0; t < chart.transitions().size(); ++t) {
    ChartParts::TransitionParts& part = parts.transitions.emplace_back();
    const XmlElement element = elements.of_transition(t);
    if (!element) {
      for (const StateIndex target : chart.transitions()[t].targets)
        part.target += (part.target.empty() ? "" : " ") + chart.states()[target].id;
      continue;
    }
    part.written = true;
    part.event = element.attribute("event").value_or("");
    part.condition = element.attribute("cond").value_or("");
    part.target = element.attribute("target").value_or("");
    part.actions = written({element});
  }
  parts.data = written(elements.blocks(0, "datamodel"));
  return parts;
}

Result<GestureResult> edit_chart(std::string_view xml, const ChartGesture& gesture, const std::string& file) {
  scxml::LoadOptions options;
  // What it names elsewhere does not change with it.
  options.read = [](std::string_view) -> Result<std::string> { return std::string(); };
  const auto chart = scxml::load(xml, file, options);
  if (!chart.value) {
    const auto error = std::find_if(chart.diagnostics.begin(), chart.diagnostics.end(),
                                    [](const Diagnostic& d) { return d.severity == Severity::kError; });
    return tl::unexpected(error != chart.diagnostics.end() ? *error : Diagnostic{});
  }
  ChartEditor editor(*chart.value);
  auto name = std::visit(editor, gesture);
  if (!name) return tl::unexpected(name.error());
  const auto text = editor.apply();
  if (!text) return tl::unexpected(text.error());
  GestureResult result{edits_between(xml, *text), *name, {}, editor.take_pasted()};
  if (result.edits.empty()) return fail("design.nothing-to-do", "it is so already");
  end_lines_alike(xml, result.edits);
  return result;
}

}  // namespace sentree::design
