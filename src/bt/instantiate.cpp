#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <utility>

#include "sentree/base/flat_map.h"
#include "sentree/bt/detail/loader.h"
#include "sentree/bt/detail/script_numbers.h"
#include "sentree/bt/detail/values.h"
#include "sentree/bt/nodes/parallel.h"
#include "sentree/bt/nodes/switch.h"

// Definitions to the compiled model: every SubTree instance gets nodes, a blackboard and resolved names of its own.

namespace sentree::bt {

using text::XmlElement;

namespace {

std::size_t hash_of_cell(std::uint32_t scope, std::uint32_t name) {
  return WordHash()(std::uint64_t{scope} << 32U | name);
}

}  // namespace

std::uint32_t Model::find_string(std::string_view string) const {
  return string_index.find(std::hash<std::string_view>()(string),
                           [&](std::uint32_t one) { return strings[one] == string; });
}

std::uint32_t Model::find_cell(std::uint32_t of, std::uint32_t string) const {
  return cell_index.find(hash_of_cell(of, string),
                         [&](std::uint32_t one) { return cells[one].scope == of && cells[one].name == string; });
}

std::uint32_t Loader::cell(std::uint32_t scope, std::uint32_t name) {
  const std::string& text = model_->strings[name];
  if (text.starts_with('@')) {
    // The root's entry, from any depth.
    return cell(0, string(std::string_view(text).substr(1)));
  }
  if (const std::uint32_t known = model_->find_cell(scope, name); known != kNone) return known;
  std::uint32_t parent = kNone;
  const std::uint32_t parent_scope = model_->scopes[scope].parent;
  if (parent_scope != kNone) {
    const auto& remaps = model_->scopes[scope].remaps;
    const auto remap = std::find_if(remaps.begin(), remaps.end(), [name](const auto& r) { return r.first == name; });
    if (remap != remaps.end()) {
      parent = cell(parent_scope, remap->second);
    } else if (model_->scopes[scope].shared || (model_->scopes[scope].autoremap && !text.starts_with('_'))) {
      parent = cell(parent_scope, name);
    }
  }
  const auto index = static_cast<std::uint32_t>(model_->cells.size());
  model_->cells.push_back({scope, name, parent, parent == kNone ? model_->homes++ : kNone});
  model_->cell_index.add(
      index, [this](std::uint32_t one) { return hash_of_cell(model_->cells[one].scope, model_->cells[one].name); });
  model_->scopes[scope].first_mention.push_back(index);
  return index;
}

std::uint32_t Loader::open_scope(const Definition& definition, const DefinedNode& defined, NodeId id,
                                 std::uint32_t parent) {
  const auto scope = static_cast<std::uint32_t>(model_->scopes.size());
  Scope fresh;
  fresh.parent = parent;
  fresh.subtree = id;
  fresh.autoremap = defined.autoremap;
  fresh.shared = defined.shared;
  for (std::uint32_t i = 0; i < defined.port_count; ++i) {
    const DefinedPort& port = definition.ports[defined.first_port + i];
    if (port.kind == Binding::Kind::kEntry) fresh.remaps.emplace_back(port.name, port.target);
  }
  model_->scopes.push_back(std::move(fresh));
  for (std::uint32_t i = 0; i < defined.port_count; ++i) {
    const DefinedPort& port = definition.ports[defined.first_port + i];
    if (port.kind == Binding::Kind::kEntry) {
      cell(scope, port.name);
      continue;
    }
    if (port.kind != Binding::Kind::kLiteral) continue;
    // A constant lives in the SubTree's own blackboard; it looks like a number if it is one.
    const std::uint32_t own = cell(scope, port.name);
    if (model_->cells[own].home == kNone) model_->cells[own].home = model_->homes++;
    const std::string_view text = model_->strings[port.text];
    Constant constant{own, Datum{Value(text), nullptr}, nullptr, port.text};
    if (model_->format != 3) {
      if (const auto integer = detail::parse_integer(text)) {
        constant.datum.value = *integer;
        constant.type = std::in_range<std::int32_t>(*integer) ? &type_of<std::int32_t>() : &type_of<std::int64_t>();
      } else if (const auto real = detail::parse_real(text)) {
        constant.datum.value = *real;
        constant.type = &type_of<double>();
      }
    }
    EntryUse& use = entry_use(own);
    use.type = use.strong = constant.type;
    use.constant = static_cast<std::uint32_t>(model_->constants.size());
    model_->constants.push_back(std::move(constant));
    constant_elements_.push_back(defined.element);
  }
  return scope;
}

namespace {

// "an int", "a double".
std::string with_article(std::string_view type) {
  const bool is_vowel = type.starts_with("unsigned") ||
                        (!type.empty() && std::string_view("aeio").find(type[0]) != std::string_view::npos);
  return fmt::format("{} {}", is_vowel ? "an" : "a", type);
}

}  // namespace

std::string Loader::constant_of(const EntryUse& use) const {
  const XmlElement& subtree = constant_elements_[use.constant];
  const std::string_view id = subtree.attribute("ID").value_or(subtree.name());
  return fmt::format("SubTree \"{}\"", subtree.attribute("name").value_or(id));
}

SourceSpan Loader::place_of_constant(const EntryUse& use) const {
  const std::uint32_t name = model_->cells[model_->constants[use.constant].cell].name;
  return constant_elements_[use.constant].attribute_value_span(model_->strings[name]);
}

std::string Loader::declared_by(const EntryUse& use) const {
  if (use.constant != kNone) return fmt::format("the constant of {}", constant_of(use));
  return fmt::format("port \"{}\" of {}", model_->strings[use.port], model_->manifests[use.manifest].id);
}

void Loader::declare_entry(std::uint32_t cell, const DefinedNode& defined, const DefinedPort& port) {
  const PortType* const type = port.type;
  if (EntryUse& own = entry_use(cell); !own.declared) {
    own.declared = true;
    model_->declared.push_back({cell, type});
  }
  // Where the entry lives: up the remapping, but not past a constant.
  std::uint32_t owner = cell;
  while (!is_constant(owner) && model_->cells[owner].parent != kNone) owner = model_->cells[owner].parent;
  EntryUse& use = entry_use(owner);
  const bool strong = type != nullptr && type->strong();
  if (use.constant != kNone && model_->constants[use.constant].type == nullptr && model_->format != 3) {
    // Text, of which each port makes what it means to it.
    if (strong) check_constant(use, defined, port);
    return;
  }
  if (use.manifest == kNone && use.constant == kNone) {
    use.type = type;
    use.strong = strong ? type : nullptr;
    use.manifest = defined.manifest;
    use.port = port.name;
    return;
  }
  if (!strong || use.type == type) return;
  if (use.strong == nullptr) {
    use.strong = type;
    use.manifest = defined.manifest;
    use.port = port.name;
    return;
  }
  if (*use.strong == *type || use.strong->kind == PortType::Class::kString) return;
  const Manifest& manifest = model_->manifests[defined.manifest];
  const bool writes_back = port.declared != 0xFFFF && manifest.ports[port.declared].direction == PortDirection::kInOut;
  const bool castable_either = castable(*model_, *use.strong, *type) || castable(*model_, *type, *use.strong);
  // What a port gives back, of whatever kind, may not be what the entry is.
  if (castable_either && !writes_back) return;
  const auto about = [&] {
    return fmt::format("entry \"{}\" is {} for {} and ", model_->strings[model_->cells[cell].name],
                       with_article(use.strong->name), declared_by(use));
  };
  const std::string self = fmt::format("port \"{}\" of {}", model_->strings[port.name], manifest.id);
  if (type->kind == PortType::Class::kString && use.constant != kNone) {
    // It only looked like a number; BehaviorTree.CPP takes it for one and refuses the text.
    warn("bt.text-of-number", fmt::format("{}text for {}; BehaviorTree.CPP refuses that", about(), self),
         defined.element.span());
    if (use.manifest != kNone) return;
    Constant& constant = model_->constants[use.constant];
    constant.datum.value = Value(model_->strings[constant.text]);
    constant.type = use.type = nullptr;
    use.strong = type;
    use.manifest = defined.manifest;
    use.port = port.name;
    return;
  }
  if (type->kind == PortType::Class::kString) {
    // BehaviorTree.CPP accepts this in the other order only; the order of nodes should not matter.
    if (use.type == nullptr || !use.type->strong()) return;
    warn("bt.text-of-number", fmt::format("{}text for {}; BehaviorTree.CPP refuses this order of nodes", about(), self),
         defined.element.span());
    return;
  }
  const bool hidden = use.type == nullptr || !use.type->strong();
  // BehaviorTree.CPP does not see the clash where an untyped port comes first in the file.
  // Whoever only looks has nobody's types but those of a palette.
  report(hidden || options_.partial ? Severity::kWarning : Severity::kError, "bt.type-clash",
         fmt::format("{}{} for {}{}{}", about(), with_article(type->name), self,
                     castable_either ? ", which writes it, too" : "",
                     use.constant != kNone ? way_to_type(use, *type) : ""),
         use.constant != kNone ? place_of_constant(use) : defined.element.span());
}

void Loader::check_constant(const EntryUse& use, const DefinedNode& defined, const DefinedPort& port) {
  const std::string& text = model_->strings[model_->constants[use.constant].text];
  const bool is_output = port.declared != 0xFFFF &&
                         model_->manifests[defined.manifest].ports[port.declared].direction == PortDirection::kOutput;
  if (is_output || port.type->kind == PortType::Class::kString || value_of_text(*model_, *port.type, text)) return;
  warn("bt.bad-value",
       fmt::format("{} gives \"{}\" to port \"{}\", which is {}: what reads it fails", constant_of(use), text,
                   model_->strings[port.name], with_article(port.type->name)),
       place_of_constant(use));
}

std::string Loader::way_to_type(const EntryUse& use, const PortType& type) const {
  const Constant& constant = model_->constants[use.constant];
  const std::string& text = model_->strings[constant.text];
  const auto* const whole = constant.datum.value.as_int();
  if (type == type_of<double>() && whole != nullptr) return fmt::format("; write it with a point: \"{}.0\"", *whole);
  if (type == type_of<bool>())
    return fmt::format("; write \"{}\"", constant.datum.value.number() == 0 ? "false" : "true");
  Datum converted;
  if (!convert(*model_, type, constant.datum, converted)) return {};
  const auto* const integer = converted.value.as_int();
  if (type == type_of<std::int32_t>() && integer != nullptr)
    return fmt::format("; write it without a point: \"{}\"", *integer);
  const std::string& entry = model_->strings[model_->cells[constant.cell].name];
  return fmt::format("; let a Script before the SubTree say {0} := {1}, and write {0}=\"{{{0}}}\"", entry, text);
}

std::uint32_t Loader::bind_script(std::uint32_t script, std::uint32_t scope) {
  if (script == kNone) return kNone;
  const auto [known, is_new] =
      use_of_.try_emplace(std::uint64_t{script} << 32U | scope, static_cast<std::uint32_t>(model_->uses.size()));
  if (!is_new) return known->second;
  ScriptUse use;
  use.script = script;
  use.scope = scope;
  use.first_cell = static_cast<std::uint32_t>(model_->script_cells.size());
  const std::size_t count = model_->scripts[script].names.size();
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint32_t name = string(model_->scripts[script].names[i].name);
    model_->script_cells.push_back(cell(scope, name));
  }
  use.first_step = static_cast<std::uint32_t>(model_->steps.size());
  use.steps = static_cast<std::uint32_t>(model_->scripts[script].steps.size());
  for (NumberStep step : model_->scripts[script].steps) {
    const std::uint32_t* const cells = model_->script_cells.data() + use.first_cell;
    if (step.left == NumberStep::Source::kEntry) step.left_name = cells[step.left_name];
    if (step.right == NumberStep::Source::kEntry) step.right_name = cells[step.right_name];
    model_->steps.push_back(step);
  }
  model_->uses.push_back(use);
  return static_cast<std::uint32_t>(model_->uses.size() - 1);
}

void Loader::bind_ports(const Definition& definition, const DefinedNode& defined, NodeId id, std::uint32_t scope) {
  const bool subtree = model_->manifests[defined.manifest].kind == Kind::kSubTree;
  // Of a port of a skill whose type is not known nobody can say that it is of any type: it does not make the entry so.
  const bool external = model_->manifests[defined.manifest].external;
  model_->nodes[id].ports = static_cast<std::uint32_t>(model_->bindings.size());
  model_->nodes[id].port_count = defined.port_count;
  for (std::uint32_t i = 0; i < defined.port_count; ++i) {
    const DefinedPort& port = definition.ports[defined.first_port + i];
    Binding binding;
    binding.kind = port.kind;
    binding.declared = port.declared;
    binding.from_default = port.from_default;
    binding.name = port.name;
    binding.key = PortName::key_of(model_->strings[port.name]);
    binding.text = port.text;
    binding.type = port.type;
    binding.target = port.target;
    if (port.kind == Binding::Kind::kEntry) {
      binding.target = cell(scope, port.target);
      const bool is_typed = port.type != nullptr && port.type->strong();
      if (!subtree && (is_typed || !external)) declare_entry(binding.target, defined, port);
      if (!subtree && !is_typed && external) model_->named.push_back(model_->owner(binding.target));
    }
    model_->bindings.push_back(binding);
  }
}

void Loader::bind_thresholds(Node& node) {
  const auto literal = [&](std::uint32_t port) -> const std::int64_t* {
    const Binding& b = model_->bindings[node.ports + port];
    return b.kind == Binding::Kind::kLiteral && b.target != kNone ? model_->literals[b.target].value.as_int() : nullptr;
  };
  const std::int64_t* const success = literal(nodes::Parallel::kSuccessPort);
  const std::int64_t* const failure = literal(nodes::Parallel::kFailurePort);
  if (success == nullptr || failure == nullptr) return;
  const ParallelLimits limits{nodes::threshold(*success, node.child_count),
                              nodes::threshold(*failure, node.child_count), *success < 0};
  // Those that cannot be are refused when the node is ticked.
  if (!nodes::Parallel::possible(limits.success, limits.failure, node.child_count)) return;
  node.data = static_cast<std::uint32_t>(model_->parallels.size());
  model_->parallels.push_back(limits);
}

void Loader::bind_cases(Node& node) {
  const auto first = static_cast<std::uint32_t>(model_->cases.size());
  bool numbers = false;
  for (std::uint32_t i = 1; i < node.port_count; ++i) {
    const Binding& b = model_->bindings[node.ports + i];
    const bool literal = b.kind == Binding::Kind::kLiteral && b.target != kNone;
    const std::string* const text = literal ? model_->literals[b.target].value.as_string() : nullptr;
    if (text == nullptr) {
      model_->cases.resize(first);
      return;
    }
    const nodes::Switch::Compared compared(*model_, *text);
    model_->cases.push_back({*text, compared.integer, compared.real});
    numbers = numbers || compared.is_number();
  }
  node.data = static_cast<std::uint32_t>(model_->switches.size());
  model_->switches.push_back({first, numbers});
}

void Loader::note_ticks() {
  constexpr std::uint8_t kNever = 255;
  std::vector<std::uint8_t> levels(model_->nodes.size(), 0);  // Above the lowest leaf.
  // Children come behind their parent.
  for (auto id = static_cast<NodeId>(model_->nodes.size()); id-- > 0;) {
    Node& node = model_->nodes[id];
    // In document order, children without children of their own have ids that follow each other.
    if (node.child_count != 0 && model_->children[node.first_child + node.child_count - 1] - id == node.child_count &&
        model_->nodes[id + node.child_count].child_count == 0) {
      node.flags |= Node::kLeafChildren;
    }
    const bool suspends = node.kind == Kind::kExternalAction || node.kind == Kind::kExternalCondition;
    const bool called = !suspends && levels[id] <= Node::kCalledLevels;
    if (node.parent != kNoNode) {
      std::uint8_t& above = levels[node.parent];
      above = std::max<std::uint8_t>(above, called ? levels[id] + 1 : kNever);
    }
    if (!called) continue;
    const bool plain = node.kind == Kind::kUser && node.child_count == 0 && (node.flags & Node::kHasPost) == 0;
    const auto by_kind = static_cast<std::uint8_t>(Node::kByKind + static_cast<std::uint8_t>(node.kind));
    node.tick = (node.flags & Node::kHasPre) != 0 ? std::uint8_t{Node::kConditional}
                : plain                           ? std::uint8_t{Node::kPlain}
                                                  : by_kind;
  }
}

void Loader::bind_special(const DefinedNode& defined, NodeId id, std::uint32_t scope) {
  Node& node = model_->nodes[id];
  const Manifest& manifest = model_->manifests[defined.manifest];
  switch (node.kind) {
    case Kind::kScript:
    case Kind::kScriptCondition:
    case Kind::kPrecondition: node.data = bind_script(defined.data, scope); break;
    case Kind::kLoop:
    case Kind::kUnknown: node.data = defined.data; break;
    case Kind::kParallel: bind_thresholds(node); break;
    case Kind::kSwitch: bind_cases(node); break;
    case Kind::kSkipUnlessUpdated:
    case Kind::kWaitValueUpdate:
    case Kind::kWasEntryUpdated: {
      const Binding& entry = model_->bindings[node.ports];
      if (entry.kind == Binding::Kind::kAbsent) {
        error("bt.missing-port", manifest.id + " needs \"entry\"", defined.element.span());
        node.data = 0;
        break;
      }
      node.data = entry.kind == Binding::Kind::kEntry ? entry.target : cell(scope, entry.text);
      break;
    }
    case Kind::kSetBlackboard:
    case Kind::kUnsetBlackboard: {
      // The entry that a literal key names is known now.
      const Binding& key = model_->bindings[node.ports + (node.kind == Kind::kSetBlackboard ? 1 : 0)];
      if (key.kind == Binding::Kind::kLiteral) cell(scope, key.text);
      if (node.kind == Kind::kUnsetBlackboard) model_->unsets = true;
      break;
    }
    case Kind::kUser: {
      node.data = static_cast<std::uint32_t>(model_->users.size());
      bool remembers = true;
      try {
        remembers = manifest.behaviour->make_memory() != nullptr;
      } catch (...) {  // told at its first tick
      }
      model_->users.push_back(
          {manifest.behaviour.get(), manifest.behaviour->function(), remembers ? model_->objects++ : kNone});
      break;
    }
    case Kind::kExternalAction:
    case Kind::kExternalCondition: model_->externals.push_back(id); break;
    default: break;
  }
}

NodeId Loader::add_node(const Definition& definition, const DefinedNode& defined, NodeId parent, std::uint32_t tree) {
  const auto id = static_cast<NodeId>(model_->nodes.size());
  const Manifest& manifest = model_->manifests[defined.manifest];
  Node node;
  node.kind = manifest.kind;
  node.parent = parent;
  node.child_count = manifest.kind == Kind::kSubTree ? 1 : defined.child_count & 0xFF'FFFFU;  // at most kNodesMax
  node.first_child = static_cast<std::uint32_t>(model_->children.size());
  node.memory = model_->memory_words;
  if (manifest.category == Category::kDecorator || manifest.kind == Kind::kSubTree) node.flags |= Node::kDecorator;
  if (manifest.synchronous) node.flags |= Node::kSynchronous;
  model_->memory_words += memory_words(node.kind, node.child_count);
  const auto dies = [](const Word& word) { return word.lives != Word::Lives::kAlways; };
  const auto all = words(node.kind);
  if (std::any_of(all.begin(), all.end(), dies) || node.kind == Kind::kUser || waits_for_writes(node.kind))
    model_->changing.push_back(id);
  model_->children.resize(model_->children.size() + node.child_count, kNoNode);
  model_->nodes.push_back(node);
  model_->infos.push_back({defined.name_offset, defined.name_length, defined.manifest, tree,
                           static_cast<std::uint32_t>(defined.element.offset()),
                           documents_[definition.document]->file});
  return id;
}

namespace {

/// '*' and '?' as in a shell; without recursion. O(pattern · text).
bool matches(std::string_view pattern, std::string_view text) {
  std::size_t p = 0, t = 0, star = std::string_view::npos, mark = 0;
  while (t < text.size()) {
    if (p < pattern.size() && (pattern[p] == '?' || pattern[p] == text[t])) {
      ++p;
      ++t;
    } else if (p < pattern.size() && pattern[p] == '*') {
      star = p++;
      mark = t;
    } else if (star != std::string_view::npos) {
      p = star + 1;
      t = ++mark;
    } else {
      return false;
    }
  }
  while (p < pattern.size() && pattern[p] == '*') ++p;
  return p == pattern.size();
}

}  // namespace

std::uint32_t Loader::add_test_node(const Substitution::TestNode& test, const XmlElement& element,
                                    std::uint32_t scope) {
  const auto script = [&](const std::string& text) -> std::uint32_t {
    if (text.empty()) return kNone;
    // The statuses are enums in these scripts: SUCCESS, FAILURE, SKIPPED, RUNNING.
    auto compiled = compile_script(text, [this](std::string_view name) -> std::optional<std::int64_t> {
      if (const auto status = parse_status(name)) return static_cast<std::int64_t>(*status);
      return model_->enum_value(name);
    });
    if (!compiled) {
      error(compiled.error().code, "substitution: " + compiled.error().message, element.span());
      return kNone;
    }
    model_->scripts.push_back(std::move(*compiled));
    return bind_script(static_cast<std::uint32_t>(model_->scripts.size() - 1), scope);
  };
  TestNodeData data;
  data.status = test.return_status;
  data.status_use = script(test.return_status_script);
  data.success_use = script(test.success_script);
  data.failure_use = script(test.failure_script);
  data.post_use = script(test.post_script);
  data.delay = test.async_delay;
  data.complete = test.complete;
  model_->tests.push_back(std::move(data));
  return static_cast<std::uint32_t>(model_->tests.size() - 1);
}

bool Loader::substitute(DefinedNode& defined, NodeId subtree, std::uint32_t scope, std::uint32_t& test) {
  const Manifest original = model_->manifests[defined.manifest];
  const std::string_view name = defined.name_length == 0
                                    ? std::string_view(original.id)
                                    : std::string_view(model_->text).substr(defined.name_offset, defined.name_length);
  std::string path(name);
  for (NodeId at = subtree; at != kNoNode; at = model_->trees[model_->infos[at].tree].subtree) {
    path = fmt::format("{}.{}", model_->name(at), path);
  }
  std::string slashes = path;
  std::replace(slashes.begin(), slashes.end(), '.', '/');
  const auto means = [&](const Substitution& rule) {
    return matches(rule.filter, path) || matches(rule.filter, slashes) || matches(rule.filter, original.id);
  };
  rules_used_.resize(options_.substitutions.size());
  const Substitution* taken = nullptr;
  for (std::size_t i = 0; i < options_.substitutions.size(); ++i) {
    if (!means(options_.substitutions[i])) continue;
    rules_used_[i] = true;
    if (taken == nullptr) taken = &options_.substitutions[i];
  }
  if (taken != nullptr) {
    const Substitution& rule = *taken;
    Manifest replacement;
    if (rule.id.empty()) {
      replacement.id = "TestNode";
      replacement.kind = Kind::kTestNode;
      test = add_test_node(rule.test, defined.element, scope);
    } else if (const Manifest* builtin = find_builtin(rule.id, model_->format);
               builtin != nullptr && builtin->children_max == 0) {
      replacement = *builtin;
    } else if (const Registry::Entry* entry = options_.registry != nullptr ? options_.registry->find(rule.id) : nullptr;
               entry != nullptr && (entry->category == Category::kAction || entry->category == Category::kCondition)) {
      replacement.id = entry->id;
      replacement.category = entry->category;
      replacement.synchronous = entry->synchronous;
      replacement.behaviour = entry->behaviour;
    } else {
      error("bt.bad-substitution",
            fmt::format("\"{}\" is to be replaced by \"{}\", which is no leaf{}", path, rule.id,
                        hint(rule.id, known_ids())),
            defined.element.span());
      return false;
    }
    // It takes the ports of the node that it stands for; of a whole branch only the root is one.
    if (original.kind == Kind::kSubTree) {
      defined.port_count = 0;
      defined.data = kNone;
    } else {
      replacement.ports = original.ports;
    }
    is_cut_ = is_cut_ || defined.child_count != 0 || original.kind == Kind::kSubTree;
    defined.child_count = 0;
    defined.manifest = add_manifest(replacement);
  }
  return true;
}

void Loader::check_substitutions(const XmlElement& root) {
  rules_used_.resize(options_.substitutions.size());
  for (std::size_t i = 0; i < rules_used_.size(); ++i) {
    if (rules_used_[i]) continue;
    warn("bt.unused-substitution",
         fmt::format("the substitution of \"{}\" means no node: there is none of that path or ID",
                     options_.substitutions[i].filter),
         root.span());
  }
}

namespace {

/// Makes room for `more` elements at once; still by doubling, so that many small trees cost linear time.
template <class T>
void grow(std::vector<T>& vector, std::size_t more) {
  if (vector.size() + more > vector.capacity()) vector.reserve(std::max(vector.size() + more, 2 * vector.capacity()));
}

}  // namespace

bool Loader::instantiate(std::uint32_t index, NodeId subtree, std::uint32_t scope, std::size_t depth) {
  Definition& definition = definitions_[index];
  if (definition.expanding) {
    error("bt.recursive-tree", fmt::format("BehaviorTree \"{}\" contains itself", definition.id),
          model_->nodes.empty() ? definition.element.span() : span_of(subtree));
    return false;
  }
  definition.reached = true;
  define(definition);
  if (definition.nodes.empty()) return false;
  definition.expanding = true;
  const auto tree = static_cast<std::uint32_t>(model_->trees.size());
  model_->trees.push_back({subtree, scope, string(definition.id)});

  bool complete = true;
  grow(model_->nodes, definition.nodes.size());
  grow(model_->infos, definition.nodes.size());
  grow(model_->children, definition.nodes.size());
  grow(model_->bindings, definition.ports.size());
  std::vector<NodeId> ids(definition.nodes.size());
  std::vector<std::uint32_t> next_child(definition.nodes.size());
  std::vector<std::size_t> depths(definition.nodes.size());
  std::vector<bool> cut(options_.substitutions.empty() ? 0 : definition.nodes.size(),
                        false);  // has no children any more
  for (std::uint32_t i = 0; i < definition.nodes.size() && complete; ++i) {
    DefinedNode defined = definition.nodes[i];
    if (!cut.empty() && defined.parent != kNone && cut[defined.parent]) {
      cut[i] = true;
      continue;
    }
    if (model_->nodes.size() >= kNodesMax) {
      error("bt.too-large", fmt::format("the tree has more than {} nodes", kNodesMax), defined.element.span());
      complete = false;
      break;
    }
    std::uint32_t test = kNone;
    if (!cut.empty()) {
      if (!substitute(defined, subtree, scope, test)) complete = false;
      cut[i] = defined.manifest != definition.nodes[i].manifest;
    }
    depths[i] = defined.parent == kNone ? depth : depths[defined.parent] + 1;
    if (depths[i] > kDepthMax) {
      error("bt.too-deep", fmt::format("nodes are nested deeper than {} levels", kDepthMax), defined.element.span());
      complete = false;
      break;
    }
    const NodeId parent = defined.parent == kNone ? subtree : ids[defined.parent];
    const NodeId id = add_node(definition, defined, parent, tree);
    ids[i] = id;
    next_child[i] = model_->nodes[id].first_child;
    if (defined.parent != kNone) {
      model_->children[next_child[defined.parent]++] = id;
    } else if (subtree != kNoNode) {
      model_->children[model_->nodes[subtree].first_child] = id;
    }
    if (defined.port_count != 0) bind_ports(definition, defined, id, scope);
    bind_special(defined, id, scope);
    if (model_->nodes[id].kind == Kind::kTestNode) model_->nodes[id].data = test;
    if (defined.conditions != kNone) bind_conditions(definition.conditions[defined.conditions], id, scope);
    if (model_->nodes[id].kind == Kind::kSubTree) {
      if (defined.data == kNone) {
        complete = false;
        continue;
      }
      const std::uint32_t inner = open_scope(definition, defined, id, scope);
      complete = instantiate(defined.data, id, inner, depths[i] + 1) && complete;
    }
  }
  definition.expanding = false;
  return complete;
}

void Loader::bind_test(Conditions& conditions, const NumberStep& step) {
  using Source = NumberStep::Source;
  using Op = Instruction::Op;
  if (step.left == Source::kEntry && step.right == Source::kNumber && !detail::is_assignment(step.op)) {
    conditions.test = step.op;
    conditions.test_cell = step.left_name;
    conditions.test_number = step.right_number;
  } else if (step.right == Source::kEntry && (step.op == Op::kLoad || step.op == Op::kNot)) {
    // "flag && true".
    conditions.test = Op::kLogicAnd;
    conditions.test_cell = step.right_name;
    conditions.test_number = 1;
    if (step.op == Op::kNot) conditions.when = !conditions.when;
  }
}

void Loader::bind_conditions(const Conditions& scripts, NodeId id, std::uint32_t scope) {
  Conditions uses;
  Node& node = model_->nodes[id];
  for (std::size_t i = 0; i < Conditions::kCount; ++i) {
    uses.use[i] = bind_script(scripts.use[i], scope);
    if (uses.use[i] == kNone) continue;
    if (i <= Conditions::kWhile) {
      node.flags |= Node::kHasPre;
      uses.before |= 1U << i;
    }
    if (i >= Conditions::kOnFailure) node.flags |= Node::kHasPost;
  }
  if (std::has_single_bit(uses.before)) {
    static constexpr Status kVerdicts[] = {Status::kFailure, Status::kSuccess, Status::kSkipped, Status::kSkipped};
    const auto only = static_cast<std::size_t>(std::countr_zero(uses.before));
    const ScriptUse& use = model_->uses[uses.use[only]];
    uses.verdict = kVerdicts[only];
    uses.when = only != Conditions::kWhile;
    if (use.steps == 1) bind_test(uses, model_->steps[use.first_step]);
  }
  node.conditions = static_cast<std::uint32_t>(model_->conditions.size());
  model_->conditions.push_back(uses);
}

SourceSpan Loader::span_of(NodeId id) const {
  const NodeInfo& info = model_->infos[id];
  const auto [line, column] = model_->lines[info.file].position(info.offset);
  return {model_->files[info.file], line, column, 0};
}

std::string Loader::path_of(NodeId id, bool numbered) const {
  std::vector<std::string> parts;  // from below
  std::size_t size = 0;
  for (NodeId at = id; at != kNoNode; at = model_->trees[model_->infos[at].tree].subtree) {
    const std::string& kind = model_->manifest(at).id;
    std::string part(model_->name(at));
    if (numbered && part == kind) {
      // A SubTree's ID is that of its BehaviorTree.
      const NodeId child =
          model_->nodes[at].child_count > 0 ? model_->children[model_->nodes[at].first_child] : kNoNode;
      if (model_->nodes[at].kind == Kind::kSubTree) part = model_->strings[model_->trees[model_->infos[child].tree].id];
      part += fmt::format("::{}", at + 1);
    }
    size += part.size() + 1;
    parts.push_back(std::move(part));
  }
  std::string path;
  path.reserve(size);
  for (auto part = parts.rbegin(); part != parts.rend(); ++part) {
    if (!path.empty()) path += '.';
    path += *part;
  }
  return path;
}

void Loader::check_leaf_names() {
  std::unordered_map<std::string, std::size_t> uses;
  for (const NodeId id : model_->externals) ++uses[event_name(path_of(id, false))];
  std::unordered_map<std::string, NodeId> seen;
  std::vector<std::pair<NodeId, NodeId>> alike;  // each with the first of its name
  for (const NodeId id : model_->externals) {
    std::string path = path_of(id, false);
    const std::string& kind = model_->manifest(id).id;
    if (options_.has_skill && !options_.has_skill(kind, model_->name(id))) {
      error("bt.unknown-node",
            fmt::format("leaf \"{}\": there is no skill \"{}\"{}", path, kind, hint(kind, known_skills())),
            span_of(id));
    }
    if (uses[event_name(path)] > 1) {
      std::string numbered = path_of(id, true);
      if (numbered != path) path = model_->numbered[id] = std::move(numbered);
    }
    const auto [place, fresh] = seen.try_emplace(event_name(path), id);
    if (!fresh) alike.emplace_back(id, place->second);
  }
  // Names of their own do not tell these apart; numbers do, as those of leaves without a name.
  std::unordered_set<NodeId> are_numbered;
  const auto number = [&](NodeId id) {
    const auto known = model_->numbered.find(id);
    std::string path = known != model_->numbered.end() ? known->second : path_of(id, false);
    if (are_numbered.insert(id).second) {
      do path += fmt::format("::{}", id + 1);
      while (!seen.try_emplace(event_name(path), id).second);
      model_->numbered[id] = path;
    }
    return event_name(path);
  };
  for (const auto& [id, first] : alike) {
    const std::string name = event_name(path_of(id, false));
    const std::string of_first = number(first);
    const std::string own = number(id);
    // One leaf of a BehaviorTree that is there twice: their SubTrees are what differs.
    NodeId one = id;
    NodeId other = first;
    const auto is_one_element = [&] { return to_string(span_of(one)) == to_string(span_of(other)); };
    while (is_one_element()) {
      const NodeId above = model_->trees[model_->infos[one].tree].subtree;
      const NodeId above_other = model_->trees[model_->infos[other].tree].subtree;
      if (above == kNoNode || above_other == kNoNode || above == above_other) break;
      one = above;
      other = above_other;
    }
    const std::string place = to_string(span_of(other));
    warn("bt.duplicate-leaf",
         one == id ? fmt::format("two leaves are called \"{}\", this one and that at {}; in messages they are \"{}\" "
                                 "and \"{}\". Give one of them another name",
                                 name, place, own, of_first)
                   : fmt::format("two SubTrees have one name, this one and that at {}, which BehaviorTree.CPP 4.10 "
                                 "refuses; in messages their leaf \"{}\" is \"{}\" and \"{}\". Give one of them "
                                 "another name",
                                 place, name, own, of_first),
         span_of(one));
  }
}

// SubTrees without a name of their own have one path; their blackboards are told apart as BehaviorTree.CPP does it.
void Loader::name_scopes() {
  std::unordered_map<std::string, std::size_t> uses;
  for (Scope& scope : model_->scopes) {
    if (scope.subtree == kNoNode) continue;
    scope.path = path_of(scope.subtree, false);
    ++uses[scope.path];
  }
  std::unordered_set<std::string> taken;
  std::vector<bool> is_numbered(model_->scopes.size(), false);  // as what is below it is, too
  for (std::size_t i = 0; i < model_->scopes.size(); ++i) {
    Scope& scope = model_->scopes[i];
    if (scope.subtree == kNoNode) continue;
    is_numbered[i] = uses[scope.path] > 1 || is_numbered[scope.parent];
    if (is_numbered[i]) scope.path = path_of(scope.subtree, true);
    while (!taken.insert(scope.path).second) scope.path += fmt::format("::{}", scope.subtree + 1);
  }
}

}  // namespace sentree::bt
