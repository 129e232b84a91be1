#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>

#include "sentree/bt/detail/loader.h"
#include "sentree/bt/nodes/loop.h"
#include "sentree/bt/nodes/set_blackboard.h"

// Findings about trees that load: trees that are never run, names that nobody writes.

namespace sentree::bt {

namespace {

// Ports that may change their entry and need that somebody else has written it: the queue of a Loop, which takes
// elements off it, and SetBlackboard's output_key="{entry}", the name of the entry that is written.
bool needs_other_writer(const Node& node, std::uint32_t port) {
  return (node.kind == Kind::kLoop && port == nodes::Loop::kQueuePort) ||
         (node.kind == Kind::kSetBlackboard && port == nodes::SetBlackboard::kKeyPort);
}

// By "=", which needs no value before as "+=" does.
bool is_assigned(const Script& script, std::size_t name) {
  return script.names[name].assigned &&
         std::any_of(script.code.begin(), script.code.end(),
                     [name](const Instruction& in) { return in.op == Instruction::Op::kAssign && in.arg == name; });
}

}  // namespace

// Trees that the main tree would come to if its definitions were sound.
std::set<std::uint32_t> Loader::named_by_broken() const {
  std::set<std::uint32_t> named;
  if (!has_errors(diagnostics_)) return named;
  std::vector<text::XmlElement> open;
  for (const Definition& definition : definitions_) {
    if (definition.reached) open.push_back(definition.element);
  }
  while (!open.empty()) {
    const text::XmlElement element = open.back();
    open.pop_back();
    for (text::XmlElement child = element.first_child(); child; child = child.next_sibling()) open.push_back(child);
    const std::string_view tag = element.name();
    if (tag == "BehaviorTree") continue;
    const auto found = definition_index_.find(element.attribute("ID").value_or(tag));
    if (found == definition_index_.end() || definitions_[found->second].reached) continue;
    if (named.insert(found->second).second) open.push_back(definitions_[found->second].element);
  }
  return named;
}

// A file without a format is of format 3; of the old ones, most mean the same in both. Told once, at the root element.
void Loader::check_missing_format(std::uint32_t document) {
  const text::XmlElement root = documents_[document]->xml.root();
  if (model_->format != 3 || root.attribute("BTCPP_format")) return;
  struct Given {
    text::XmlElement element;
    std::string_view name, value;
    std::string to;  ///< The port of the BehaviorTree that is named.
  };
  std::vector<Given> given;
  std::map<std::string_view, std::set<std::string>> uses;  // of a text, by ports of BehaviorTrees
  std::set<std::string_view> entries;                      // that others name
  std::optional<Given> only_new;
  std::vector<text::XmlElement> open{root};
  while (!open.empty()) {
    const text::XmlElement element = open.back();
    open.pop_back();
    for (text::XmlElement child = element.first_child(); child; child = child.next_sibling()) open.push_back(child);
    const bool is_subtree = element.name() == "SubTree";
    element.for_each_attribute([&](std::string_view name, std::string_view value) {
      const bool is_condition =
          std::find(std::begin(kConditionNames), std::end(kConditionNames), name) != std::end(kConditionNames);
      if (is_condition || (is_subtree && name == "_autoremap")) only_new = Given{element, name, value, ""};
      for (std::size_t at = value.find('{'); at != std::string_view::npos; at = value.find('{', at + 1))
        entries.insert(value.substr(at + 1, value.substr(at + 1).find('}')));
      if (name == "output_key") entries.insert(value);
      if (!is_subtree || name == "ID" || name == "name" || name.starts_with('_') || name.find(':') != name.npos) return;
      if (value.empty() || value == name || value == "=" || value.front() == '{') return;
      given.push_back({element, name, value, fmt::format("{}.{}", element.attribute("ID").value_or(""), name)});
      uses[value].insert(given.back().to);
    });
  }
  const auto tell = [&](const Given& one, const std::string& what) {
    warn("bt.no-format",
         fmt::format("the file names no format, and so is of format 3, where {}=\"{}\" ({}) {}; write "
                     "BTCPP_format=\"4\" here, or \"3\" if that is meant",
                     one.name, one.value, to_string(one.element.attribute_value_span(one.name)), what),
         root.span());
  };
  if (only_new) return tell(*only_new, "means nothing");
  // An entry that nobody else names, and that does not lead from one SubTree to another, is a text.
  const auto text = std::find_if(given.rbegin(), given.rend(), [&](const Given& one) {
    return !entries.contains(one.value) && uses[one.value].size() == 1;
  });
  if (text != given.rend()) tell(*text, "is the name of an entry and no text");
}

void Loader::check_definitions() {
  lenient_ = true;
  for (std::uint32_t i = 0; i < documents_.size(); ++i) {
    if (!documents_[i]->found) check_missing_format(i);
  }
  const std::set<std::uint32_t> named = named_by_broken();
  // More may come while they are defined.
  for (std::size_t i = 0; i < definitions_.size(); ++i) {
    Definition& definition = definitions_[i];
    // Those that came along with a tree of another file are that file's business.
    if (!definition.reached && !documents_[definition.document]->found) {
      define(definition);
      // Which tree is used cannot be said without a main one, nor where a branch is not run.
      if (model_->scopes.empty() || is_cut_ || named.contains(static_cast<std::uint32_t>(i))) continue;
      warn("bt.unused-tree", fmt::format("BehaviorTree \"{}\" is not part of the main tree", definition.id),
           definition.element.span());
    }
  }
  check_tree_names();
  // All of them are defined now: what a SubTree may give follows from the tree that it names.
  results_.resize(definitions_.size());
  for (std::uint32_t i = 0; i < definitions_.size(); ++i) {
    if (!definitions_[i].nodes.empty()) check_corners(i);
  }
  for (const auto& [id, ports] : subtree_ports_) {
    if (!definition_index_.contains(id) && !options_.partial) {
      warn("bt.unused-model",
           fmt::format("the TreeNodesModel declares SubTree \"{}\", and there is no such BehaviorTree", id),
           ports.span);
    }
  }
}

// Format 3 allows it.
void Loader::check_tree_names() {
  if (model_->format == 3) return;
  std::set<std::string_view> nodes;
  for (const Manifest& used : model_->manifests) {
    if (used.category != Category::kSubTree) nodes.insert(used.id);
  }
  for (const auto& [id, declared] : declared_) nodes.insert(id);
  for (const Definition& definition : definitions_) {
    const std::string& id = definition.id;
    if (id.empty() || documents_[definition.document]->found) continue;
    const bool is_builtin = find_builtin(id, model_->format) != nullptr;
    if (!is_builtin && !nodes.contains(id) && (options_.registry == nullptr || options_.registry->find(id) == nullptr))
      continue;
    warn("bt.tree-named-as-node",
         fmt::format("BehaviorTree \"{}\" has the name of a node{}, which BehaviorTree.CPP 4 refuses to load", id,
                     is_builtin ? " that is built in" : ""),
         definition.element.attribute_value_span("ID"));
  }
}

void Loader::check_entries() {
  if (model_->format == 3) return;
  // By the cell where the entry lives.
  const auto owner = [this](std::uint32_t cell) {
    while (!is_constant(cell) && model_->cells[cell].parent != kNone) cell = model_->cells[cell].parent;
    return cell;
  };
  std::vector<bool> written(model_->cells.size(), false);
  std::vector<bool> open(model_->scopes.size(), false);
  for (const Constant& constant : model_->constants) written[constant.cell] = true;
  for (NodeId id = 0; id < model_->nodes.size(); ++id) {
    const Node& node = model_->nodes[id];
    const Manifest& manifest = model_->manifest(id);
    for (std::uint32_t i = 0; i < node.port_count; ++i) {
      const Binding& b = model_->bindings[node.ports + i];
      if (b.kind == Binding::Kind::kEntry) {
        const bool writes = (b.declared == 0xFFFF || manifest.ports[b.declared].direction != PortDirection::kInput) &&
                            !needs_other_writer(node, i);
        if (writes && node.kind != Kind::kSubTree) written[owner(b.target)] = true;
        // SetBlackboard output_key="{key}": the name comes from an entry, so any name may be written.
        if (node.kind == Kind::kSetBlackboard && i == 1) open[model_->scope(id)] = true;
      } else if (node.kind == Kind::kSetBlackboard && i == 1 && b.kind == Binding::Kind::kLiteral) {
        const std::uint32_t target = owner(cell(model_->scope(id), b.text));
        written.resize(model_->cells.size(), false);
        written[target] = true;
      }
    }
  }
  // Entries that are there before anybody writes them, since a port names them: "=" will do.
  std::vector<bool> made(model_->cells.size(), false);
  for (const DeclaredEntry& entry : model_->declared) made[owner(entry.cell)] = true;
  for (const std::uint32_t cell : model_->named) made[cell] = true;
  for (const ScriptUse& use : model_->uses) {
    const Script& script = model_->scripts[use.script];
    for (std::size_t i = 0; i < script.names.size(); ++i) {
      const std::uint32_t home = owner(model_->script_cells[use.first_cell + i]);
      if (script.names[i].created || (made[home] && is_assigned(script, i))) written[home] = true;
    }
  }
  find_unwritten(written, open, owner);
  check_literal_outputs();
  if (model_->uses.empty()) return;
  const std::vector<ScriptType> types = entry_types(owner);
  std::set<std::pair<std::uint32_t, std::string>> told;
  std::vector<ScriptType> own;
  const std::function<bool(std::string_view)> is_number = [this](std::string_view text) {
    return model_->enum_value(text) || detail::parse_real(text);
  };
  std::vector<bool> sound(model_->uses.size());  // Nothing is to be said about it, wherever it stands.
  const auto check = [&](std::uint32_t index, NodeId id, std::string_view attribute) {
    if (sound[index]) return;
    bool says_nothing = true;
    const ScriptUse& use = model_->uses[index];
    const Script& script = model_->scripts[use.script];
    own.clear();
    for (std::size_t i = 0; i < script.names.size(); ++i) {
      const NameUse& name = script.names[i];
      const std::uint32_t home = owner(model_->script_cells[use.first_cell + i]);
      own.push_back(open[model_->cells[home].scope] ? ScriptType::kUnknown : types[home]);
      if (name.created || written[home] || open[model_->cells[home].scope]) continue;
      says_nothing = false;
      if (!told.emplace(model_->infos[id].offset, name.name).second) continue;
      warn("bt.unknown-entry",
           fmt::format("{} uses entry \"{}\", which nothing in the tree creates", attribute, name.name), span_of(id));
    }
    for (const std::string& mistake : type_mistakes(script, own, is_number)) {
      says_nothing = false;
      if (!told.emplace(model_->infos[id].offset, mistake).second) continue;
      warn("bt.script-type", fmt::format("{}: script \"{}\": {}", attribute, script.text, mistake), span_of(id));
    }
    sound[index] = says_nothing;
  };
  for (NodeId id = 0; id < model_->nodes.size(); ++id) {
    const Node& node = model_->nodes[id];
    if (node.conditions != kNone) {
      for (std::size_t i = 0; i < Conditions::kCount; ++i) {
        const std::uint32_t use = model_->conditions[node.conditions].use[i];
        if (use != kNone) check(use, id, kConditionNames[i]);
      }
    }
    const bool script = node.kind == Kind::kScript || node.kind == Kind::kScriptCondition;
    if ((script || node.kind == Kind::kPrecondition) && node.data != kNone) {
      check(node.data, id, script ? "code" : "if");
    }
  }
}

void Loader::find_unwritten(const std::vector<bool>& written, const std::vector<bool>& open,
                            const std::function<std::uint32_t(std::uint32_t)>& owner) {
  // Whose key comes from an entry, writes any; another one may write that entry.
  std::size_t open_keys = 0;
  for (const Node& node : model_->nodes) {
    const bool has_key = node.kind == Kind::kSetBlackboard && node.port_count > nodes::SetBlackboard::kKeyPort;
    if (has_key && model_->bindings[node.ports + nodes::SetBlackboard::kKeyPort].kind == Binding::Kind::kEntry)
      ++open_keys;
  }
  for (NodeId id = 0; id < model_->nodes.size(); ++id) {
    const Node& node = model_->nodes[id];
    if (node.kind == Kind::kSubTree) continue;
    const Manifest& manifest = model_->manifest(id);
    for (std::uint32_t i = 0; i < node.port_count; ++i) {
      const Binding& b = model_->bindings[node.ports + i];
      if (b.kind != Binding::Kind::kEntry || b.declared == 0xFFFF) continue;
      if (manifest.ports[b.declared].direction != PortDirection::kInput && !needs_other_writer(node, i)) continue;
      const std::uint32_t home = owner(b.target);
      // A name beginning with '@' lives in the root's blackboard, which others may share.
      const std::string& name = model_->strings[model_->cells[home].name];
      const bool may_be_written = open[model_->cells[home].scope] &&
                                  !(open_keys == 1 && node.kind == Kind::kSetBlackboard && needs_other_writer(node, i));
      if (written[home] || may_be_written || name.starts_with('@')) continue;
      model_->unwritten.push_back({id, model_->strings[b.name], name});
    }
  }
}

// An output that names no entry: whatever the node gives back cannot be written.
void Loader::check_literal_outputs() {
  for (NodeId id = 0; id < model_->nodes.size(); ++id) {
    const Node& node = model_->nodes[id];
    const Manifest& manifest = model_->manifest(id);
    for (std::uint32_t i = 0; i < node.port_count && node.kind != Kind::kSubTree; ++i) {
      const Binding& b = model_->bindings[node.ports + i];
      if (b.kind != Binding::Kind::kLiteral || b.from_default || b.declared == 0xFFFF) continue;
      if (manifest.ports[b.declared].direction != PortDirection::kOutput) continue;
      const std::string& text = model_->strings[b.text];
      if (text == "{}") continue;  // `sentree check` says what that is
      warn("bt.not-an-entry",
           fmt::format("output port \"{0}\" of {1} is \"{2}\", which is no entry to write to; write {0}=\"{{name}}\"",
                       model_->strings[b.name], manifest.id, text),
           span_of(id));
    }
  }
}

std::vector<ScriptType> Loader::entry_types(const std::function<std::uint32_t(std::uint32_t)>& owner) const {
  std::vector<ScriptType> types(model_->cells.size(), ScriptType::kUnknown);
  std::vector<bool> seen(model_->cells.size(), false);
  // Where two writers disagree, the type is open.
  const auto note = [&](std::uint32_t cell, ScriptType type) {
    types[cell] = seen[cell] && types[cell] != type ? ScriptType::kUnknown : type;
    seen[cell] = true;
  };
  for (const Constant& constant : model_->constants) {
    note(constant.cell, constant.datum.value.as_string() != nullptr ? ScriptType::kText : ScriptType::kNumber);
  }
  for (NodeId id = 0; id < model_->nodes.size(); ++id) {
    const Node& node = model_->nodes[id];
    const Manifest& manifest = model_->manifest(id);
    for (std::uint32_t i = 0; i < node.port_count && node.kind != Kind::kSubTree; ++i) {
      const Binding& b = model_->bindings[node.ports + i];
      if (node.kind == Kind::kSetBlackboard && i == 1 && b.kind == Binding::Kind::kLiteral) {
        const std::uint32_t key = model_->find_cell(model_->scope(id), b.text);
        if (key != kNone) note(owner(key), ScriptType::kUnknown);
      }
      if (b.kind != Binding::Kind::kEntry) continue;
      if (b.declared != 0xFFFF && manifest.ports[b.declared].direction == PortDirection::kInput) continue;
      const auto kind = b.type != nullptr ? b.type->kind : PortType::Class::kAny;
      const bool number =
          kind == PortType::Class::kBool || kind == PortType::Class::kInteger || kind == PortType::Class::kReal;
      note(owner(b.target), number                             ? ScriptType::kNumber
                            : kind == PortType::Class::kString ? ScriptType::kText
                                                               : ScriptType::kUnknown);
    }
  }
  // An entry that a port declares as a number holds one, whoever is the first to write it.
  for (const DeclaredEntry& entry : model_->declared) {
    const std::uint32_t home = owner(entry.cell);
    const auto kind = entry.type != nullptr ? entry.type->kind : PortType::Class::kAny;
    const bool number = kind == PortType::Class::kInteger || kind == PortType::Class::kReal;
    if (number && !seen[home]) note(home, ScriptType::kNumber);
  }
  const std::vector<ScriptType> before = types;
  std::vector<ScriptType> own;
  for (const ScriptUse& use : model_->uses) {
    const Script& script = model_->scripts[use.script];
    own.clear();
    for (std::size_t i = 0; i < script.names.size(); ++i) {
      own.push_back(before[owner(model_->script_cells[use.first_cell + i])]);
    }
    const std::vector<ScriptType> assigned = assigned_types(script, own);
    for (std::size_t i = 0; i < script.names.size(); ++i) {
      if (script.names[i].created) note(owner(model_->script_cells[use.first_cell + i]), assigned[i]);
    }
  }
  return types;
}

}  // namespace sentree::bt
