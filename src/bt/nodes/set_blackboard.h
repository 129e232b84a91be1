#pragma once

#include <string>

#include "sentree/bt/nodes/node.h"

namespace sentree::bt::nodes {

/// Copies an entry with its type, or writes a literal as text.
struct SetBlackboard : AnyNode {
  static may::Mask may_return(const may::Asked& /*asked*/) { return may::kSuccess; }
  static Manifests manifests() {
    return {both(leaf("SetBlackboard", Category::kAction, {input("value"), inout("output_key")}))};
  }

  static constexpr std::uint32_t kValuePort = 0, kKeyPort = 1;

  static Next enter(Machine& m, const Node& n, NodeId id) {
    const auto key = m.read_text(n, kKeyPort);
    if (!key) return m.fail(id, "bt.missing-port", "needs \"output_key\", the name of an entry");
    const Binding* value = m.binding(n, kValuePort);
    if (value == nullptr) return m.fail(id, "bt.missing-port", "needs \"value\"");
    const std::uint32_t target = m.blackboard().cell(m.model().scope(id), *key);
    if (target == kNone) return m.fail(id, "bt.too-many-entries", Blackboard::too_many(*key));
    std::string error;
    if (value->kind == Binding::Kind::kLiteral) {
      const std::string& text = m.model().strings[value->text];
      // Format 3's entries take the text and become strings, whatever they were.
      if (!m.blackboard().set(target, Datum{Value(text), nullptr}, &type_of<std::string>(), error)) {
        return m.fail(id, "bt.entry-type", error);
      }
      return Next::done(Status::kSuccess);
    }
    const Blackboard::Entry* source = m.blackboard().find(value->target);
    if (source == nullptr) {
      return m.fail(id, "bt.no-entry", "no entry " + m.model().strings[value->text] + " to copy");
    }
    const Datum copy = source->datum;
    const PortType* type = source->type;
    Blackboard::Entry* entry = m.blackboard().find(target);
    const bool text = copy.value.as_string() != nullptr;
    if (entry == nullptr) {
      // The new entry gets the type of the source; a number in an entry declared as text does not fit its own type.
      if (type != nullptr && type->kind == PortType::Class::kString && copy.value.is_number() && !m.format3()) {
        return m.fail(id, "bt.entry-type",
                      "entry \"" + *key + "\" would be text and cannot take the number " + to_json(copy.value));
      }
      m.blackboard().create(target, type, error);
      entry = m.blackboard().find(target);
      if (entry == nullptr) return m.fail(id, "bt.entry-type", error);
      // As recorded from BehaviorTree.CPP: text copied to an entry that did not exist leaves it empty.
      if (!text || m.format3()) entry->datum = copy;
    } else if ((text && !m.format3() && entry->datum.empty()) || !copy_into(copy, entry->datum)) {
      return m.fail(id, "bt.entry-type", "entry \"" + *key + "\" cannot take the value " + to_json(copy.value));
    }
    m.blackboard().written(*entry);
    return Next::done(Status::kSuccess);
  }
};

}  // namespace sentree::bt::nodes
