#include "sentree/bt/detail/blackboard.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "sentree/base/assert.h"
#include "sentree/bt/detail/values.h"
#include "sentree/bt/tree.h"

namespace sentree::bt {

void Blackboard::link(std::uint32_t cell, std::uint32_t entry) {
  std::uint32_t& place = cell < cells_ ? links_[cell] : state_.dynamic_[cell - cells_].link;
  SENTREE_ASSERT(place == State::kNoEntry);
  place = entry;
  ++state_.entries_[entry].links;
}

Blackboard::Entry* Blackboard::find_slow(std::uint32_t cell) {
  // Up the remapping to the first link, then link everything below it.
  std::uint32_t up = cell;
  while (up != kNone && link_of(up) == State::kNoEntry) up = parent_of(up);
  if (up == kNone) return nullptr;
  const std::uint32_t entry = link_of(up);
  if (!keeps_links()) return &state_.entries_[entry];
  for (std::uint32_t at = cell; at != up; at = parent_of(at)) link(at, entry);
  return &state_.entries_[entry];
}

std::uint32_t Blackboard::allocate(std::uint32_t cell) {
  if (cell < model_.cells.size()) {
    const std::uint32_t home = model_.cells[cell].home;
    if (home != kNone && state_.entries_[home].links == 0) return home;
  }
  for (std::size_t i = model_.homes; i < state_.entries_.size(); ++i) {
    if (state_.entries_[i].links == 0) return static_cast<std::uint32_t>(i);
  }
  state_.entries_.emplace_back();
  return static_cast<std::uint32_t>(state_.entries_.size() - 1);
}

Blackboard::Entry* Blackboard::create(std::uint32_t cell, const PortType* type, std::string& error) {
  std::uint32_t owner = cell;
  while (link_of(owner) == State::kNoEntry && parent_of(owner) != kNone) owner = parent_of(owner);
  if (const std::uint32_t existing = link_of(owner); existing != State::kNoEntry) {
    Entry& entry = state_.entries_[existing];
    const bool both_strong = entry.type != nullptr && entry.type->strong() && type != nullptr && type->strong();
    if (both_strong && !(*entry.type == *type) && !castable(model_, *type, *entry.type)) {
      error = fmt::format("entry \"{}\" is of type {} and cannot become {}", name(cell), entry.type->name, type->name);
      return nullptr;
    }
    return &entry;
  }
  const std::uint32_t made = allocate(owner);
  state_.entries_[made] = Entry{};
  state_.entries_[made].type = type;
  link(owner, made);
  return &state_.entries_[made];
}

bool Blackboard::set(std::uint32_t cell, Datum&& datum, const PortType* type, std::string& error) {
  if (type != nullptr && !type->strong()) type = nullptr;
  const bool is_text = type != nullptr && type->kind == PortType::Class::kString;
  if (link_of(cell) == State::kNoEntry || !is_own(cell)) {
    // A string makes an entry of any type: it may be the text of something else. In format 3 it is a port that gives an
    // entry its type, when the tree is loaded, and no write does.
    Entry* entry = create(cell, is_text || model_.format == 3 ? nullptr : type, error);
    if (entry == nullptr) return false;
    const std::uint32_t index = static_cast<std::uint32_t>(entry - state_.entries_.data());
    if (link_of(cell) == State::kNoEntry && keeps_links()) link(cell, index);
    entry->datum = std::move(datum);
    written(*entry);
    return true;
  }
  Entry& entry = state_.entries_[link_of(cell)];
  if (type != nullptr && entry.type == type && entry.datum.value.type() == datum.value.type()) {
    entry.datum = std::move(datum);
    written(entry);
    return true;
  }
  if (entry.type == nullptr || !entry.type->strong()) {
    if (model_.format != 3) entry.type = type;
    // As recorded from BehaviorTree.CPP: text over a number loses both.
    const bool lost = is_text && model_.format != 3 && entry.datum.value.is_number();
    entry.datum = lost ? Datum{} : std::move(datum);
    written(entry);
    return true;
  }
  if (type != nullptr && !(*entry.type == *type)) {
    if (datum.object != nullptr) {
      if (auto cast = cast_object(model_, datum.object, *entry.type)) {
        entry.datum = Datum{Value(), std::move(cast)};
        written(entry);
        return true;
      }
    }
    std::optional<Value> converted;
    if (is_text) converted = value_of_text(model_, *entry.type, datum.value.text());
    const auto numeric = [](const PortType& t) {
      return t.kind == PortType::Class::kInteger || t.kind == PortType::Class::kReal ||
             t.kind == PortType::Class::kBool;
    };
    if (!converted && numeric(*type) && numeric(*entry.type) && accepts_value(*entry.type, datum.value)) {
      converted = std::move(datum.value);
    }
    if (!converted) {
      error = fmt::format("entry \"{}\" is of type {}; it cannot take a {}", name(cell), entry.type->name, type->name);
      return false;
    }
    datum.value = std::move(*converted);
  }
  if (!copy_into(datum, entry.datum)) {
    error = fmt::format("entry \"{}\" cannot take the value {}", name(cell), to_json(datum.value));
    return false;
  }
  written(entry);
  return true;
}

bool Blackboard::put(std::uint32_t cell, Datum&& datum, const PortType* type, std::string& error) {
  const bool local = is_own(cell) && link_of(cell) != State::kNoEntry;
  Entry* const entry = local ? &state_.entries_[link_of(cell)] : create(cell, type, error);
  if (entry == nullptr) return false;
  if (local) {
    if (entry->type == nullptr || !entry->type->strong()) {
      entry->type = &type_of<Value>();
    } else if (type == nullptr || !(*type == *entry->type)) {
      error = fmt::format("entry \"{}\" is of type {}; it cannot take {}", name(cell), entry->type->name,
                          type != nullptr ? "a " + type->name : "what has none");
      return false;
    }
  }
  entry->datum = std::move(datum);
  written(*entry);
  return true;
}

void Blackboard::unset(std::uint32_t cell) {
  const std::uint32_t index = link_of(cell);
  if (index == State::kNoEntry || !is_own(cell)) return;
  (cell < cells_ ? links_[cell] : state_.dynamic_[cell - cells_].link) = State::kNoEntry;
  if (--state_.entries_[index].links == 0) state_.entries_[index] = Entry{};
}

std::uint32_t Blackboard::find_cell(std::uint32_t scope, std::string_view name) const {
  if (name.starts_with('@')) {
    scope = 0;
    name.remove_prefix(1);
  }
  if (const std::uint32_t known = model_.find_string(name); known != kNone) {
    if (const std::uint32_t found = model_.find_cell(scope, known); found != kNone) return found;
  }
  for (std::size_t i = 0; i < state_.dynamic_.size(); ++i) {
    if (state_.dynamic_[i].scope == scope && state_.dynamic_[i].name == name) {
      return static_cast<std::uint32_t>(cells_ + i);
    }
  }
  return kNone;
}

std::uint32_t Blackboard::cell(std::uint32_t scope, std::string_view name) {
  if (const std::uint32_t known = find_cell(scope, name); known != kNone) return known;
  if (name.starts_with('@')) {
    scope = 0;
    name.remove_prefix(1);
  }
  const Scope& s = model_.scopes[scope];
  std::uint32_t parent = kNone;
  if (s.parent != kNone && (s.shared || (s.autoremap && !name.starts_with('_')))) {
    parent = cell(s.parent, name);
    if (parent == kNone) return kNone;
  }
  if (state_.dynamic_.size() >= kRuntimeEntriesMax) return kNone;
  state_.dynamic_.push_back({scope, std::string(name), parent, State::kNoEntry});
  return static_cast<std::uint32_t>(cells_ + state_.dynamic_.size() - 1);
}

std::string Blackboard::too_many(std::string_view name) {
  return fmt::format("entry \"{}\" would be one more than the {} that may be named at run time; name it in the tree",
                     name, kRuntimeEntriesMax);
}

std::string_view Blackboard::name(std::uint32_t cell) const {
  if (cell < cells_) return model_.strings[model_.cells[cell].name];
  return state_.dynamic_[cell - cells_].name;
}

std::uint32_t Blackboard::resolve(const Model& model, const State& state, std::uint32_t cell) {
  // The const_cast is safe: only const members are called.
  const Blackboard view(model, const_cast<State&>(state), TimePoint{});
  for (; cell != kNone; cell = view.parent_of(cell)) {
    if (const std::uint32_t link = view.link_of(cell); link != State::kNoEntry) return link;
  }
  return State::kNoEntry;
}

const Datum* Blackboard::peek_datum(const Model& model, const State& state, std::uint32_t scope,
                                    std::string_view name) {
  const Blackboard view(model, const_cast<State&>(state), TimePoint{});
  const std::uint32_t link = resolve(model, state, view.find_cell(scope, name));
  return link == State::kNoEntry ? nullptr : &state.entries_[link].datum;
}

const Value* Blackboard::peek(const Model& model, const State& state, std::uint32_t scope, std::string_view name) {
  const Datum* const datum = peek_datum(model, state, scope, name);
  return datum == nullptr || datum->value.is_null() ? nullptr : &datum->value;
}

std::vector<EntryFact> Blackboard::list(const Tree& tree, const State& state) {
  const Model& model = tree.model();
  const Blackboard view(model, const_cast<State&>(state), TimePoint{});
  std::vector<EntryFact> facts;
  std::vector<bool> listed(state.entries_.size(), false);
  const auto add = [&](std::uint32_t scope, std::uint32_t cell) {
    const std::uint32_t link = view.link_of(cell);
    if (link == State::kNoEntry || listed[link]) return;
    listed[link] = true;
    const Entry& entry = state.entries_[link];
    facts.push_back({model.scopes[scope].path, std::string(view.name(cell)), &entry.datum.value,
                     entry.type != nullptr ? std::string_view(entry.type->name) : std::string_view(), entry.sequence,
                     entry.stamp});
  };
  for (std::uint32_t scope = 0; scope < model.scopes.size(); ++scope) {
    for (const std::uint32_t cell : model.scopes[scope].first_mention) add(scope, cell);
    for (std::uint32_t i = 0; i < state.dynamic_.size(); ++i) {
      if (state.dynamic_[i].scope == scope) add(scope, view.cells_ + i);
    }
  }
  return facts;
}

bool copy_into(const Datum& from, Datum& into) {
  if (into.empty() || into.value.type() == from.value.type()) {
    into = from;
    return true;
  }
  switch (into.value.type()) {
    case Value::Type::kDouble:
      if (const auto number = detail::to_real(from.value)) {
        into.value = *number;
        return true;
      }
      return false;
    case Value::Type::kInt:
      if (const auto number = detail::to_integer(from.value)) {
        into.value = *number;
        return true;
      }
      return false;
    case Value::Type::kBool:
      if (const auto number = detail::to_real(from.value)) {
        into.value = *number != 0.0;
        return true;
      }
      return false;
    default: return false;
  }
}

}  // namespace sentree::bt
