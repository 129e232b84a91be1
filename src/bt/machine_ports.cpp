#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "sentree/bt/detail/machine.h"
#include "sentree/bt/detail/values.h"

// Values in and out of nodes: ports and scripts.

namespace sentree::bt {

const Binding* Machine::binding_by_name(const Node& n, const PortName& port) const {
  const Binding* b = bindings_ + n.ports;
  for (const Binding* const end = b + n.port_count; b != end; ++b) {
    if (b->key != port.key || model_.strings[b->name] != port.text) continue;
    return b->kind == Binding::Kind::kAbsent ? nullptr : b;
  }
  return nullptr;
}

const Datum* Machine::read(const Binding& binding, const PortType* wanted, Datum& scratch) {
  const Datum* datum = nullptr;
  if (binding.kind == Binding::Kind::kLiteral) {
    datum = &model_.literals[binding.target];
  } else {
    const Blackboard::Entry* entry = blackboard_.find(binding.target);
    if (entry == nullptr || entry->datum.empty()) return nullptr;
    datum = &entry->datum;
  }
  if (wanted == nullptr || fits(*wanted, *datum)) return datum;
  return convert(model_, *wanted, *datum, scratch) ? &scratch : nullptr;
}

Diagnostic Machine::read_error(const Binding& binding, const PortType* wanted) {
  const std::string port = fmt::format("port \"{}\": ", model_.strings[binding.name]);
  const Datum* datum = nullptr;
  if (binding.kind == Binding::Kind::kLiteral) {
    datum = &model_.literals[binding.target];
  } else {
    const Blackboard::Entry* entry = blackboard_.find(binding.target);
    const std::string& shown = model_.strings[binding.text];
    if (entry == nullptr)
      return {Severity::kError, "bt.no-entry", fmt::format("{}there is no entry {}", port, shown), {}};
    if (entry->datum.empty()) {
      return {Severity::kError, "bt.empty-entry", fmt::format("{}entry {} holds no value yet", port, shown), {}};
    }
    datum = &entry->datum;
  }
  std::string why;
  if (const auto* text = datum->value.as_string();
      text != nullptr && wanted != nullptr && wanted->kind != PortType::Class::kString) {
    static_cast<void>(value_of_text(model_, *wanted, *text, &why));
    if (!why.empty()) why.insert(0, ": ");
  }
  return {Severity::kError,
          "bt.conversion",
          fmt::format("{}{} is no {}{}", port, shown(*datum), wanted != nullptr ? wanted->name : "value", why),
          {}};
}

std::optional<std::int64_t> Machine::read_integer(const Node& n, std::uint32_t port) {
  const Binding* b = binding(n, port);
  if (b == nullptr) return std::nullopt;
  if (b->kind == Binding::Kind::kLiteral) {
    if (const auto* value = model_.literals[b->target].value.as_int()) return *value;
  }
  Datum scratch;
  const Datum* datum = read(*b, &type_of<std::int64_t>(), scratch);
  return datum != nullptr ? std::optional(*datum->value.as_int()) : std::nullopt;
}

std::optional<std::string_view> Machine::read_view(const Node& n, std::uint32_t port, Datum& scratch) {
  const Binding* b = binding(n, port);
  if (b == nullptr) return std::nullopt;
  if (b->kind == Binding::Kind::kLiteral) {
    if (const std::string* text = model_.literals[b->target].value.as_string()) return *text;
  } else if (const Blackboard::Entry* entry = blackboard_.find_linked(b->target)) {
    if (const std::string* text = entry->datum.value.as_string()) return *text;
  }
  const Datum* datum = read(*b, &type_of<std::string>(), scratch);
  return datum != nullptr ? std::optional(datum->value.text()) : std::nullopt;
}

const std::string* Machine::held_text(const Node& n, std::uint32_t port) {
  const Datum* const datum = held(binding(n, port));
  return datum != nullptr ? datum->value.as_string() : nullptr;
}

std::optional<std::string> Machine::read_text(const Node& n, std::uint32_t port) {
  Datum scratch;
  const auto text = read_view(n, port, scratch);
  return text ? std::optional(std::string(*text)) : std::nullopt;
}

bool Machine::read_bool(const Node& n, std::uint32_t port, bool otherwise) {
  const Binding* b = binding(n, port);
  if (b == nullptr) return otherwise;
  Datum scratch;
  const Datum* datum = read(*b, &type_of<bool>(), scratch);
  return datum != nullptr ? *datum->value.as_bool() : otherwise;
}

std::optional<Status> Machine::read_status(const Node& n, std::uint32_t port) {
  const auto text = read_text(n, port);
  return text ? parse_status(*text) : std::nullopt;
}

bool Machine::write(const Binding& binding, Datum&& datum, const PortType* type, std::string& error) {
  if (binding.kind != Binding::Kind::kEntry) {
    error = fmt::format("port \"{}\" is \"{}\", which is no entry to write to; write \"{{{}}}\"",
                        model_.strings[binding.name], model_.strings[binding.text], model_.strings[binding.text]);
    return false;
  }
  const PortType* const declared = binding.type;
  if (declared == nullptr || !declared->strong()) return blackboard_.set(binding.target, std::move(datum), type, error);
  // What a script does with the entry must not depend on which number came first: 1 or 1.5.
  const bool as_declared =
      type != nullptr && declared->kind != PortType::Class::kInteger && *type == *declared;  // of uint64, some is none
  if (!as_declared && !datum.empty() && !fits(*declared, datum)) {
    Datum converted;
    if (convert(model_, *declared, datum, converted)) {
      datum = std::move(converted);
    } else if (declared->kind != PortType::Class::kOther || !accepts_value(*declared, datum.value)) {
      error = fmt::format("{} is no {}", shown(datum), declared->name);
      return false;
    }
  }
  return blackboard_.set(binding.target, std::move(datum), declared, error);
}

bool Machine::run_long(NodeId id, const ScriptUse& use, ScriptValue& result) {
  std::string error;
  const std::uint32_t* const cells = model_.script_cells.data() + use.first_cell;
  if (run_script(model_, blackboard_, model_.scripts[use.script], cells, result, error)) return true;
  fail(id, "bt.script", std::move(error));
  return false;
}

bool Machine::run_long(NodeId id, const ScriptUse& use) {
  ScriptValue ignored;
  return run_long(id, use, ignored);
}

bool Machine::run_long_condition(NodeId id, const ScriptUse& use, bool& result) {
  ScriptValue value;
  if (!run_long(id, use, value)) return false;
  std::string error;
  if (truth(value, result, error)) return true;
  fail(id, "bt.script", fmt::format("script \"{}\": {}", model_.scripts[use.script].text, error));
  return false;
}

bool Machine::run_text(NodeId id, const std::string& text, ScriptValue& result) {
  const auto script = compile_script(text, [this](std::string_view name) { return model_.enum_value(name); });
  if (!script) {
    fail(id, script.error().code, script.error().message);
    return false;
  }
  std::vector<std::uint32_t> cells;
  for (const NameUse& use : script->names) {
    cells.push_back(blackboard_.cell(model_.scope(id), use.name));
    if (cells.back() != kNone) continue;
    fail(id, "bt.too-many-entries", Blackboard::too_many(use.name));
    return false;
  }
  std::string error;
  if (run_script(model_, blackboard_, *script, cells.data(), result, error)) {
    if (result.tag == ScriptValue::Tag::kString) {
      // The constants of this script end with it.
      result = keep_text(*result.string);
    }
    return true;
  }
  fail(id, "bt.script", std::move(error));
  return false;
}

// --- Context: what C++ nodes see ------------------------------------------------------------------------------------

std::string_view Context::name() const { return machine_.model().name(node_); }
std::string Context::path() const { return machine_.tree().path(node_); }
const Tree& Context::tree() const { return machine_.tree(); }
TimePoint Context::now() const {
  *machine_.memory(machine_.model().nodes[node_]) = 1;
  return machine_.now();
}
bool Context::failed() const { return machine_.failed(); }
void Context::wake() { machine_.wake(); }
std::function<void()> Context::waker() const {
  const std::function<void()>& waker = machine_.effects().waker;
  return waker ? waker : [] {};
}
void Context::fail(std::string message) { machine_.fail(node_, "bt.node-failed", std::move(message)); }
std::size_t Context::child_count() const { return machine_.node(node_).child_count; }

namespace {

/// False, and the tick is given up: the node has no such child.
bool has_child(Machine& m, NodeId id, std::size_t child) {
  const std::size_t count = m.node(id).child_count;
  if (child < count) return true;
  m.fail(id, "bt.child-count", fmt::format("asks for child {} and has {}", child, count));
  return false;
}

}  // namespace

Status Context::child_status(std::size_t child) const {
  if (!has_child(machine_, node_, child)) return Status::kIdle;
  return machine_.status(machine_.child(machine_.node(node_), static_cast<std::uint32_t>(child)));
}
void Context::reset_child(std::size_t child) {
  if (!has_child(machine_, node_, child)) return;
  machine_.reset(machine_.child(machine_.node(node_), static_cast<std::uint32_t>(child)));
}
void Context::reset_children() { machine_.reset_children(machine_.node(node_)); }

std::string_view Context::raw(const PortName& port) const {
  const Binding* b = machine_.binding(machine_.node(node_), port);
  return b != nullptr ? std::string_view(machine_.model().strings[b->text]) : std::string_view();
}

std::uint64_t Context::sequence(const PortName& port) const {
  const Binding* b = machine_.binding(machine_.node(node_), port);
  if (b == nullptr || b->kind != Binding::Kind::kEntry) return 0;
  const Blackboard::Entry* entry = machine_.blackboard().find(b->target);
  return entry != nullptr ? entry->sequence : 0;
}

TimePoint Context::stamp(const PortName& port) const {
  const Binding* b = machine_.binding(machine_.node(node_), port);
  if (b == nullptr || b->kind != Binding::Kind::kEntry) return TimePoint{};
  const Blackboard::Entry* entry = machine_.blackboard().find(b->target);
  return entry != nullptr ? entry->stamp : TimePoint{};
}

// Both are asked at each tick of most leaves: what they seldom need is behind calls that end them.

const Datum* Context::peek(const PortName& port) const {
  return port.is_short() ? machine_.held(machine_.binding_by_key(machine_.node(node_), port.key)) : peek_long(port);
}

const Datum* Context::peek_long(const PortName& port) const {
  return machine_.held(machine_.binding_by_name(machine_.node(node_), port));
}

Value* Context::writable(const PortName& port, const PortType& type, Value::Type held) {
  if (!port.is_short()) return writable_long(port, type, held);
  return machine_.writable(machine_.binding_by_key(machine_.node(node_), port.key), type, held);
}

Value* Context::writable_long(const PortName& port, const PortType& type, Value::Type held) {
  return machine_.writable(machine_.binding_by_name(machine_.node(node_), port), type, held);
}

const Datum* Context::read(const PortName& port, const PortType& wanted, Datum& scratch) const {
  const Binding* b = machine_.binding(machine_.node(node_), port);
  return b != nullptr ? machine_.read(*b, &wanted, scratch) : nullptr;
}

Diagnostic Context::read_error(const PortName& port, const PortType& wanted) const {
  const Binding* b = machine_.binding(machine_.node(node_), port);
  if (b == nullptr) {
    return {Severity::kError, "bt.no-port", fmt::format("node \"{}\" has no value for port \"{}\"", path(), port.text),
            machine_.tree().span(node_)};
  }
  Diagnostic error = machine_.read_error(*b, &wanted);
  error.message = fmt::format("node \"{}\", {}", path(), error.message);
  error.span = machine_.tree().span(node_);
  return error;
}

Result<void> Context::write(const PortName& port, Datum&& datum, const PortType& type) {
  const Binding* b = machine_.binding(machine_.node(node_), port);
  std::string error;
  // A port that nobody has given an entry is one that nobody asks for; one that the node does not have is a slip in it.
  bool is_slip = b != nullptr;
  if (b == nullptr) {
    const Ports& ports = machine_.model().manifest(node_).ports;
    is_slip = std::none_of(ports.begin(), ports.end(), [&](const PortInfo& info) { return info.name == port.text; });
    if (is_slip) {
      std::vector<std::string> names;
      for (const PortInfo& info : ports) names.push_back(info.name);
      error = fmt::format("{} declares no output port \"{}\"{}", machine_.model().manifest(node_).id, port.text,
                          did_you_mean(std::string(port.text), names));
    } else {
      error = fmt::format("there is no entry for output port \"{}\"", port.text);
    }
  } else if (machine_.write(*b, std::move(datum), &type, error)) {
    return {};
  } else if (b->kind == Binding::Kind::kEntry) {
    error = fmt::format("port \"{}\": {}", port.text, error);
  }
  const std::string code = b == nullptr                       ? "bt.no-port"
                           : b->kind == Binding::Kind::kEntry ? "bt.entry-type"
                                                              : "bt.not-an-entry";
  if (is_slip) machine_.fail(node_, code, error);
  return sentree::fail(code, fmt::format("node \"{}\": {}", path(), error));
}

}  // namespace sentree::bt
