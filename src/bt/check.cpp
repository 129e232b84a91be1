#include <algorithm>
#include <utility>

#include "sentree/bt/loader.h"

// Findings about trees that load: parts that are never run, names that nobody writes, corners of the semantics.

namespace sentree::bt {

void Loader::check_definitions() {
  lenient_ = true;
  for (Definition& definition : definitions_) {
    if (!definition.reached) {
      define(definition);
      warn("bt.unused-tree", "BehaviorTree \"" + definition.id + "\" is not part of the main tree",
           definition.element.span());
    }
    if (!definition.nodes.empty()) check_corners(definition);
  }
  for (const auto& [id, ports] : subtree_ports_) {
    if (!definition_index_.contains(id)) {
      warn("bt.unused-model", "the TreeNodesModel declares SubTree \"" + id + "\", and there is no such BehaviorTree",
           ports.span);
    }
  }
}

void Loader::check_corners(const Definition& definition) {
  const auto manifest = [&](const DefinedNode& node) -> const Manifest& { return model_->manifests[node.manifest]; };
  const auto parent_kind = [&](const DefinedNode& node) {
    return node.parent == kNone ? Kind::kUser : manifest(definition.nodes[node.parent]).kind;
  };
  // A child behind one that always ends its parent is never reached.
  std::vector<const DefinedNode*> ends(definition.nodes.size(), nullptr);
  std::vector<std::uint32_t> position(definition.nodes.size(), 0);
  for (const DefinedNode& node : definition.nodes) {
    const Manifest& own = manifest(node);
    const bool has_conditions = node.conditions != kNone;
    const Kind above = parent_kind(node);
    std::uint32_t place = 0;
    if (node.parent != kNone) {
      place = position[node.parent]++;
      if (ends[node.parent] != nullptr) {
        warn("bt.unreachable-child",
             own.id + " is never reached: " + manifest(*ends[node.parent]).id + " before it always ends its parent",
             node.element.span());
        ends[node.parent] = nullptr;
      }
      const bool sequence = above == Kind::kSequence || above == Kind::kReactiveSequence ||
                            above == Kind::kAsyncSequence || above == Kind::kSequenceWithMemory;
      const bool fallback =
          above == Kind::kFallback || above == Kind::kReactiveFallback || above == Kind::kAsyncFallback;
      const bool fails = own.kind == Kind::kAlwaysFailure || own.kind == Kind::kForceFailure;
      const bool succeeds = own.kind == Kind::kAlwaysSuccess || own.kind == Kind::kForceSuccess;
      if (!has_conditions && ((sequence && fails && own.kind == Kind::kAlwaysFailure) ||
                              (fallback && succeeds && own.kind == Kind::kAlwaysSuccess))) {
        ends[node.parent] = &node;
      }
    }
    if (own.kind == Kind::kIfThenElse || own.kind == Kind::kWhileDoElse) {
      const std::uint32_t least = own.kind == Kind::kWhileDoElse && model_->format == 3 ? 3 : 2;
      if (node.child_count < least || node.child_count > 3) {
        warn("bt.child-count",
             own.id + " has " + std::to_string(node.child_count) + " children; with other than " +
                 (least == 3 ? "3" : "2 or 3") + " every tick of it fails",
             node.element.span());
      }
    }
    if (own.kind == Kind::kSwitch && node.child_count != own.ports.size()) {
      warn("bt.child-count",
           own.id + " has " + std::to_string(node.child_count) + " children; it needs one per case and the default, " +
               std::to_string(own.ports.size()) + ", or every tick of it fails",
           node.element.span());
    }
    const bool may_skip =
        own.kind == Kind::kRunOnce || own.kind == Kind::kSkipUnlessUpdated ||
        (has_conditions && (definition.conditions[node.conditions].use[Conditions::kSkipIf] != kNone ||
                            definition.conditions[node.conditions].use[Conditions::kWhile] != kNone));
    if (may_skip && place == 0 && (above == Kind::kIfThenElse || above == Kind::kWhileDoElse)) {
      warn("bt.skipped-condition",
           "the condition of " + manifest(definition.nodes[node.parent]).id + " may be SKIPPED; that gives the tick up",
           node.element.span());
    }
    if (has_conditions && definition.conditions[node.conditions].use[Conditions::kOnHalted] != kNone) {
      warn("bt.on-halted",
           "_onHalted also runs for nodes that never ran when the whole tree is halted, and twice for those that run",
           node.element.attribute_span("_onHalted"));
    }
    if (own.kind == Kind::kPrecondition && (above == Kind::kReactiveSequence || above == Kind::kReactiveFallback)) {
      warn("bt.precondition-once",
           "Precondition does not check \"if\" again once its child has started, not even after a halt; "
           "_while and ScriptCondition do",
           node.element.span());
    }
    const std::string_view tag = node.element.name();
    if (above == Kind::kReactiveSequence &&
        (tag == "Action" || tag == "Condition" || tag == "Control" || tag == "Decorator")) {
      warn("bt.explicit-in-reactive",
           "BehaviorTree.CPP 4.10 refuses <" + std::string(tag) + " ID=…> under ReactiveSequence; <" + own.id +
               "> works in both",
           node.element.span());
    }
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
  for (const InitialEntry& initial : model_->initial) {
    if (initial.local) written[initial.cell] = true;
  }
  for (NodeId id = 0; id < model_->nodes.size(); ++id) {
    const Node& node = model_->nodes[id];
    const Manifest& manifest = model_->manifest(id);
    for (std::uint32_t i = 0; i < node.port_count; ++i) {
      const Binding& b = model_->bindings[node.ports + i];
      if (b.kind == Binding::Kind::kEntry) {
        const bool writes = b.declared == 0xFFFF || manifest.ports[b.declared].direction != PortDirection::kInput;
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
  for (const ScriptUse& use : model_->uses) {
    const Script& script = model_->scripts[use.script];
    for (std::size_t i = 0; i < script.names.size(); ++i) {
      if (script.names[i].created) written[owner(model_->script_cells[use.first_cell + i])] = true;
    }
  }
  std::set<std::pair<std::uint32_t, std::string>> told;
  const auto check = [&](const ScriptUse& use, NodeId id, std::string_view attribute) {
    const Script& script = model_->scripts[use.script];
    for (std::size_t i = 0; i < script.names.size(); ++i) {
      const NameUse& name = script.names[i];
      const std::uint32_t home = owner(model_->script_cells[use.first_cell + i]);
      if (name.created || written[home] || open[model_->cells[home].scope]) continue;
      if (!told.emplace(model_->infos[id].offset, name.name).second) continue;
      warn("bt.unknown-entry",
           std::string(attribute) + " uses entry \"" + name.name + "\", which nothing in the tree creates",
           span_of(id));
    }
  };
  for (NodeId id = 0; id < model_->nodes.size(); ++id) {
    const Node& node = model_->nodes[id];
    if (node.conditions != kNone) {
      for (std::size_t i = 0; i < Conditions::kCount; ++i) {
        const std::uint32_t use = model_->conditions[node.conditions].use[i];
        if (use != kNone) check(model_->uses[use], id, kConditionNames[i]);
      }
    }
    const bool script = node.kind == Kind::kScript || node.kind == Kind::kScriptCondition;
    if ((script || node.kind == Kind::kPrecondition) && node.data != kNone) {
      check(model_->uses[node.data], id, script ? "code" : "if");
    }
  }
}

}  // namespace sentree::bt
