#include "sentree/bt/state.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "sentree/base/assert.h"
#include "sentree/bt/detail/blackboard.h"
#include "sentree/bt/detail/values.h"
#include "sentree/bt/model.h"
#include "sentree/bt/tree.h"

namespace sentree::bt {

State::State(const Tree& tree) {
  const Model& model = tree.model();
  status_.assign(model.nodes.size(), Status::kIdle);
  memory_.assign(model.memory_words, 0);
  links_.assign(model.cells.size(), kNoEntry);
  entries_.resize(model.homes);
  objects_.resize(model.objects);
  for (const UserNode& user : model.users) {
    if (user.object == kNone) continue;
    // Copying somebody else's prototype may throw. The node's first tick fails then.
    try {
      objects_[user.object] = ObjectSlot(user.behaviour->make_memory());
    } catch (...) {
      objects_[user.object] = ObjectSlot();
    }
  }
  Blackboard blackboard(model, *this, TimePoint{});
  std::string error;
  for (const Constant& constant : model.constants) {
    // Never remapped.
    const std::uint32_t home = model.cells[constant.cell].home;
    entries_[home] = Entry{constant.datum, constant.type, 1, TimePoint{}, 1};
    links_[constant.cell] = home;
  }
  for (const DeclaredEntry& entry : model.declared) {
    if (blackboard.find(entry.cell) == nullptr) blackboard.create(entry.cell, entry.type, error);
  }
}

TimePoint State::next_timer() const {
  TimePoint next = kNever;
  for (const Timer& timer : timers_) next = std::min(next, timer.due);
  return next;
}

NodeId State::next_to_ring() const {
  const auto next =
      std::min_element(timers_.begin(), timers_.end(), [](const Timer& a, const Timer& b) { return a.due < b.due; });
  return next != timers_.end() ? next->node : 0;
}

namespace {

std::uint32_t scope_of(const Model& model, NodeId subtree) {
  if (subtree == kNoNode) return 0;
  for (std::size_t i = 1; i < model.scopes.size(); ++i) {
    if (model.scopes[i].subtree == subtree) return static_cast<std::uint32_t>(i);
  }
  return model.scope(subtree);
}

}  // namespace

const Value* entry(const Tree& tree, const State& state, std::string_view name, NodeId subtree) {
  const Model& model = tree.model();
  return Blackboard::peek(model, state, scope_of(model, subtree), name);
}

std::string scope_path(const Tree& tree, NodeId subtree) {
  const Scope& scope = tree.model().scopes[scope_of(tree.model(), subtree)];
  return scope.subtree == subtree ? scope.path : tree.path(subtree);
}

NodeId find_scope(const Tree& tree, std::string_view path) {
  for (const Scope& scope : tree.model().scopes) {
    if (scope.subtree != kNoNode && scope.path == path) return scope.subtree;
  }
  const NodeId node = tree.find(path);
  return node != kNoNode && tree.category(node) == Category::kSubTree ? node : kNoNode;
}

std::vector<EntryFact> blackboard(const Tree& tree, const State& state) { return Blackboard::list(tree, state); }

Result<void> set_entry(const Tree& tree, State& state, std::string_view name, Value value, TimePoint now,
                       NodeId subtree) {
  const Model& model = tree.model();
  Blackboard blackboard(model, state, now);
  std::string error;
  const std::uint32_t cell = blackboard.cell(scope_of(model, subtree), name);
  if (cell == kNone) return fail("bt.too-many-entries", Blackboard::too_many(name));
  if (auto* held = blackboard.find(cell)) {
    if (!copy_into(Datum{std::move(value), nullptr}, held->datum)) {
      return fail("bt.entry-type", fmt::format("entry \"{}\" holds {} and cannot take that value", name,
                                               to_string(held->datum.value.type())));
    }
    blackboard.written(*held);
    return {};
  }
  if (!blackboard.set(cell, Datum{std::move(value), nullptr}, nullptr, error)) return fail("bt.entry-type", error);
  return {};
}

namespace detail {

Result<void> set_datum(const Tree& tree, State& state, std::string_view name, Datum datum, const PortType& type,
                       TimePoint now, NodeId subtree) {
  Blackboard blackboard(tree.model(), state, now);
  const std::uint32_t cell = blackboard.cell(scope_of(tree.model(), subtree), name);
  if (cell == kNone) return fail("bt.too-many-entries", Blackboard::too_many(name));
  std::string error;
  if (!blackboard.set(cell, std::move(datum), &type, error)) return fail("bt.entry-type", error);
  return {};
}

Result<const Datum*> datum_as(const Tree& tree, const State& state, std::string_view name, const PortType& wanted,
                              NodeId subtree, Datum& scratch) {
  const Datum* const datum = Blackboard::peek_datum(tree.model(), state, scope_of(tree.model(), subtree), name);
  if (datum == nullptr) return fail("bt.no-entry", fmt::format("there is no entry \"{}\"", name));
  if (datum->empty()) return fail("bt.empty-entry", fmt::format("entry \"{}\" holds no value yet", name));
  if (fits(wanted, *datum)) return datum;
  if (convert(tree.model(), wanted, *datum, scratch)) return &scratch;
  return fail("bt.conversion", fmt::format("entry \"{}\": {} is no {}", name, shown(*datum), wanted.name));
}

}  // namespace detail

Value export_blackboard(const Tree& tree, const State& state) {
  Map scopes;
  for (const EntryFact& fact : blackboard(tree, state)) {
    if (fact.value->is_null()) continue;
    Value& scope = scopes[fact.scope];
    if (scope.is_null()) scope = Map{};
    scope.as_map()->append(fact.name, *fact.value);
  }
  return scopes;
}

Result<void> import_blackboard(const Tree& tree, State& state, const Value& blackboard, TimePoint now) {
  const Map* scopes = blackboard.as_map();
  if (scopes == nullptr) return fail("bt.bad-blackboard", "a blackboard is a map of SubTrees, each a map of entries");
  State changed = state;
  for (const auto& [path, entries] : *scopes) {
    const NodeId subtree = path.empty() ? kNoNode : find_scope(tree, path);
    if (!path.empty() && subtree == kNoNode) {
      return fail("bt.bad-blackboard", fmt::format("there is no SubTree \"{}\"", path));
    }
    if (entries.as_map() == nullptr) {
      return fail("bt.bad-blackboard",
                  fmt::format("\"{}\" holds {}; it must be a map of entries", path, to_json(entries)));
    }
    for (const auto& [name, value] : *entries.as_map()) {
      if (auto written = set_entry(tree, changed, name, value, now, subtree); !written) return written;
    }
  }
  state = std::move(changed);
  return {};
}

void restore_blackboard(State& state, const State& backup) {
  state.links_ = backup.links_;
  state.entries_ = backup.entries_;
  state.dynamic_ = backup.dynamic_;
}

}  // namespace sentree::bt
