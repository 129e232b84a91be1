#include "sentree/bt/entry_uses.h"

#include <algorithm>
#include <numeric>
#include <optional>

#include "sentree/bt/model.h"

namespace sentree::bt {

namespace {

bool only_reads(const Manifest& manifest, const Binding& binding) {
  return binding.declared != 0xFFFF && manifest.ports[binding.declared].direction == PortDirection::kInput;
}

// What a port asks of its entry; nothing where any value will do, as for text.
std::optional<Wanted> wanted_by(const Manifest& manifest, const Binding& binding) {
  if (binding.type == nullptr) return std::nullopt;
  // Nodes of C++ count with signed numbers; milliseconds, of which 0 are none, have no sign.
  const bool counts = !manifest.external && only_reads(manifest, binding) && binding.type->min < 0;
  switch (binding.type->kind) {
    case PortType::Class::kBool: return Wanted::kTruth;
    case PortType::Class::kInteger:
    case PortType::Class::kReal: return counts ? Wanted::kPositive : Wanted::kNumber;
    case PortType::Class::kStatus: return Wanted::kStatus;
    case PortType::Class::kOther:
      return binding.type->name.starts_with("std::vector<") ? std::optional(Wanted::kList) : std::nullopt;
    default: return std::nullopt;
  }
}

}  // namespace

EntryUses::EntryUses(const Tree& tree) : tree_(tree), group_(tree.model().cells.size()) {
  const Model& model = tree.model();
  std::iota(group_.begin(), group_.end(), 0U);
  const auto find = [this](std::uint32_t cell) {
    while (group_[cell] != cell) cell = group_[cell] = group_[group_[cell]];
    return cell;
  };
  const auto unite = [&](std::uint32_t a, std::uint32_t b) { group_[find(a)] = find(b); };

  // What a SubTree is given is outside what it is inside; a constant ends that.
  std::vector<bool> constant(model.cells.size(), false);
  for (const Constant& one : model.constants) constant[one.cell] = true;
  for (std::uint32_t cell = 0; cell < model.cells.size(); ++cell) {
    if (model.cells[cell].parent != kNone && !constant[cell]) unite(cell, model.cells[cell].parent);
  }
  std::vector<std::uint32_t> home(group_.size());
  for (std::uint32_t cell = 0; cell < home.size(); ++cell) home[cell] = find(cell);
  std::vector<bool> written(home.size(), false);
  struct Use {
    std::uint32_t cell;
    Wanted wanted;
    NodeId node;
  };
  std::vector<Use> uses;
  std::vector<Use> enums;  // names in scripts that may be such
  const std::function<bool(std::string_view)> is_number = [&](std::string_view text) {
    return model.enum_value(text) || detail::parse_real(text);
  };
  const auto read_script = [&](std::uint32_t index, NodeId node, bool is_condition) {
    const ScriptUse& use = model.uses[index];
    const ScriptNeeds needs = needs_of(model.scripts[use.script], is_condition, is_number);
    for (const auto& [name, wanted] : needs.needs)
      uses.push_back({model.script_cells[use.first_cell + name], wanted, node});
    const std::vector<NameUse>& names = model.scripts[use.script].names;
    for (std::size_t i = 0; i < names.size(); ++i) {
      const std::uint32_t cell = model.script_cells[use.first_cell + i];
      if (names[i].created || names[i].assigned) {
        written[home[cell]] = true;
      } else if (!names[i].name.starts_with('@')) {
        enums.push_back({cell, Wanted::kNumber, node});
      }
    }
    for (const auto& [a, b] : needs.alike)
      unite(model.script_cells[use.first_cell + a], model.script_cells[use.first_cell + b]);
  };
  for (NodeId id = 0; id < model.nodes.size(); ++id) {
    const Node& node = model.nodes[id];
    for (std::uint32_t i = 0; i < node.port_count && node.kind != Kind::kSubTree; ++i) {
      const Binding& binding = model.bindings[node.ports + i];
      if (binding.kind != Binding::Kind::kEntry) continue;
      if (!only_reads(model.manifest(id), binding)) written[home[binding.target]] = true;
      if (const auto wanted = wanted_by(model.manifest(id), binding)) uses.push_back({binding.target, *wanted, id});
    }
    if (node.kind == Kind::kSetBlackboard && node.port_count > 1) {
      const Binding& value = model.bindings[node.ports];
      const Binding& key = model.bindings[node.ports + 1];
      const std::uint32_t target =
          key.kind == Binding::Kind::kLiteral ? model.find_cell(model.scope(id), key.text) : kNone;
      if (target != kNone) written[home[target]] = true;
      if (value.kind == Binding::Kind::kEntry && target != kNone) unite(value.target, target);
    }
    if (node.conditions != kNone) {
      for (std::size_t i = 0; i < Conditions::kCount; ++i) {
        const std::uint32_t use = model.conditions[node.conditions].use[i];
        if (use != kNone) read_script(use, id, i <= Conditions::kWhile);
      }
    }
    const bool has_code = node.kind == Kind::kScript || node.kind == Kind::kScriptCondition;
    if ((has_code || node.kind == Kind::kPrecondition) && node.data != kNone)
      read_script(node.data, id, node.kind != Kind::kScript);
  }
  for (const Constant& one : model.constants) written[home[one.cell]] = true;
  // The name of an enum that only C++ knows looks like an entry that nothing writes. It is a number.
  for (const Use& name : enums) {
    if (!written[home[name.cell]]) uses.push_back(name);
  }
  for (std::uint32_t& group : group_) group = find(group);
  for (const Use& use : uses) {
    NodeId& user = users_.try_emplace(group_[use.cell], unused()).first->second[static_cast<std::size_t>(use.wanted)];
    user = std::min(user, use.node);
  }
}

EntryUses::Users EntryUses::of(NodeId node, std::string_view port) const {
  const Model& model = tree_.model();
  const Node& of = model.nodes[node];
  for (std::uint32_t i = 0; i < of.port_count; ++i) {
    const Binding& binding = model.bindings[of.ports + i];
    if (binding.kind != Binding::Kind::kEntry || model.strings[binding.name] != port) continue;
    const auto found = users_.find(group_[binding.target]);
    return found == users_.end() ? unused() : found->second;
  }
  return unused();
}

}  // namespace sentree::bt
