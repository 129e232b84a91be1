#pragma once

#include <optional>
#include <string>
#include <utility>

#include "sentree/bt/detail/values.h"
#include "sentree/bt/nodes/node.h"

namespace sentree::bt::nodes {

/// Copies an entry with its type, or writes a literal as text.
struct SetBlackboard : AnyNode {
  static may::Mask may_return(const may::Asked& /*asked*/) { return may::kSuccess; }
  static Manifests manifests() {
    return {both(leaf("SetBlackboard", Category::kAction, {input("value"), inout("output_key")}))};
  }

  static constexpr std::uint32_t kValuePort = 0, kKeyPort = 1;
  static std::optional<may::Failing> always_fails(const may::Given& given) {
    return given.lacks({kValuePort, kKeyPort});
  }

  static Next enter(Machine& m, const Node& n, NodeId id) {
    const auto key = m.read_text(n, kKeyPort);
    if (!key) return lacks(m, n, id, kKeyPort, "needs \"output_key\", the name of an entry");
    const Binding* value = m.binding(n, kValuePort);
    if (value == nullptr) return m.fail(id, "bt.missing-port", "needs \"value\"");
    const std::uint32_t target = m.blackboard().cell(m.model().scope(id), *key);
    if (target == kNone) return m.fail(id, "bt.too-many-entries", Blackboard::too_many(*key));
    if (!m.format3()) return write(m, id, *value, target, *key);
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
    if (entry == nullptr) {
      m.blackboard().create(target, type, error);
      entry = m.blackboard().find(target);
      if (entry == nullptr) return m.fail(id, "bt.entry-type", error);
      entry->datum = copy;
    } else if (!copy_into(copy, entry->datum)) {
      return m.fail(id, "bt.entry-type", "entry \"" + *key + "\" cannot take the value " + to_json(copy.value));
    }
    m.blackboard().written(*entry);
    return Next::done(Status::kSuccess);
  }

 private:
  /// As recorded from BehaviorTree.CPP 4: text is read as what the entry is declared to be. An entry that nobody
  /// declared cannot read it and is left empty, and has been written as something of any type then, which refuses text.
  static Next write(Machine& m, NodeId id, const Binding& value, std::uint32_t target, const std::string& key) {
    Datum out;
    const PortType* type = nullptr;
    std::string error;
    Blackboard::Entry* entry = m.blackboard().find(target);
    if (value.kind == Binding::Kind::kLiteral) {
      out.value = m.model().strings[value.text];
    } else {
      const Blackboard::Entry* const source = m.blackboard().find(value.target);
      if (source == nullptr) {
        return m.fail(id, "bt.no-entry", "no entry " + m.model().strings[value.text] + " to copy");
      }
      out = source->datum;
      type = source->type;
      // A new entry gets the type of the source.
      if (entry == nullptr &&
          (m.blackboard().create(target, type, error) == nullptr || (entry = m.blackboard().find(target)) == nullptr)) {
        return m.fail(id, "bt.entry-type", error);
      }
    }
    if (out.empty()) return Next::done(Status::kFailure);
    type = type_of_datum(out, type);
    const std::string* const text = out.value.as_string();
    if (entry != nullptr && text != nullptr && !(entry->type != nullptr && *entry->type == type_of<std::string>())) {
      std::optional<Value> parsed;
      if (entry->type != nullptr && !(parsed = value_of_text(m.model(), *entry->type, *text))) {
        return m.fail(id, "bt.entry-type", "entry \"" + key + "\" cannot take the value " + to_json(out.value));
      }
      type = entry->type;
      out = Datum{parsed ? std::move(*parsed) : Value(), nullptr};
    }
    if (!m.blackboard().put(target, std::move(out), type, error)) return m.fail(id, "bt.entry-type", error);
    return Next::done(Status::kSuccess);
  }

  /// The type of a value out of an entry of that type: a number in an entry that is text is a number all the same.
  static const PortType* type_of_datum(const Datum& datum, const PortType* type) {
    const bool other = type == nullptr || !type->strong() ||
                       (type->kind == PortType::Class::kString && datum.value.as_string() == nullptr);
    if (!other) return type;
    if (datum.object != nullptr) return &datum.object->type();
    switch (datum.value.type()) {
      case Value::Type::kInt: return &type_of<std::int64_t>();
      case Value::Type::kDouble: return &type_of<double>();
      case Value::Type::kBool: return &type_of<bool>();
      case Value::Type::kString: return &type_of<std::string>();
      default: return nullptr;
    }
  }
};

}  // namespace sentree::bt::nodes
