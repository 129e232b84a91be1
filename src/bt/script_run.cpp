#include "sentree/bt/detail/script_run.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <vector>

#include "sentree/bt/detail/values.h"

namespace sentree::bt {

namespace {

using Op = Instruction::Op;
using Tag = ScriptValue::Tag;

/// Equal within the precision of float, as BehaviorTree.CPP compares.
constexpr double kEqualWithin = std::numeric_limits<float>::epsilon();

/// Strings made during a run; kept, so that a steady script does not allocate.
class Scratch {
 public:
  std::string& next() {
    if (used_ == strings_.size()) strings_.push_back(std::make_unique<std::string>());
    std::string& s = *strings_[used_++];
    s.clear();
    return s;
  }
  void reset() { used_ = 0; }

 private:
  std::vector<std::unique_ptr<std::string>> strings_;
  std::size_t used_ = 0;
};

Scratch& scratch() {
  thread_local Scratch instance;
  return instance;
}

ScriptValue load(const Datum& datum) {
  if (const double* d = datum.value.as_double()) return ScriptValue::of(*d);
  if (const auto* i = datum.value.as_int()) return ScriptValue::of(*i);
  if (const auto* s = datum.value.as_string()) {
    std::string& copy = scratch().next();
    copy = *s;
    return ScriptValue::of(&copy);
  }
  if (const auto* b = datum.value.as_bool()) return ScriptValue::of(static_cast<std::int64_t>(*b));
  ScriptValue other;
  if (!datum.empty()) other.tag = Tag::kOther;
  return other;
}

void store(const ScriptValue& value, Value& into) {
  switch (value.tag) {
    case Tag::kInteger: into = value.integer; return;
    case Tag::kReal: into = value.real; return;
    default: into = *value.string; return;
  }
}

std::optional<std::int64_t> as_integer(const ScriptValue& value) {
  if (value.tag == Tag::kInteger) return value.integer;
  return detail::to_integer(Value(value.real));
}

void append_text(std::string& out, const ScriptValue& value) {
  if (value.tag == Tag::kString) {
    out += *value.string;
  } else {
    out += *detail::to_text(value.tag == Tag::kInteger ? Value(value.integer) : Value(value.real));
  }
}

template <class T>
bool compare(Op op, const T& a, const T& b) {
  switch (op) {
    case Op::kEqual:
      if constexpr (std::is_same_v<T, double>) return std::abs(a - b) <= kEqualWithin;
      return a == b;
    case Op::kNotEqual:
      if constexpr (std::is_same_v<T, double>) return !(std::abs(a - b) <= kEqualWithin);
      return a != b;
    case Op::kLess: return a < b;
    case Op::kLessEqual: return a <= b;
    case Op::kGreater: return a > b;
    default: return a >= b;
  }
}

class Run {
 public:
  Run(const Model& model, Blackboard& blackboard, const Script& script, const std::uint32_t* cells, std::string& error)
      : model_(model), blackboard_(blackboard), script_(script), cells_(cells), error_(error) {}

  bool run(ScriptValue* stack, ScriptValue& result) {
    ScriptValue* top = stack - 1;  // The highest value.
    const Instruction* const code = script_.code.data();
    const std::size_t size = script_.code.size();
    for (std::size_t pc = 0; pc < size; ++pc) {
      const Instruction in = code[pc];
      switch (in.op) {
        case Op::kNumber: *++top = ScriptValue::of(script_.numbers[in.arg]); break;
        case Op::kInteger: *++top = ScriptValue::of(script_.integers[in.arg]); break;
        case Op::kString: *++top = ScriptValue::of(&script_.strings[in.arg]); break;
        case Op::kLoad: {
          const Blackboard::Entry* entry = blackboard_.find(cells_[in.arg]);
          if (entry == nullptr) return unknown(in.arg);
          *++top = load(entry->datum);
          break;
        }
        case Op::kCreate:
        case Op::kAssign:
          if (!assign(in, *top)) return false;
          break;
        case Op::kAddAssign:
        case Op::kSubtractAssign:
        case Op::kMultiplyAssign:
        case Op::kDivideAssign:
          if (!update(in, *top)) return false;
          break;
        case Op::kAdd:
        case Op::kSubtract:
        case Op::kMultiply:
        case Op::kDivide:
        case Op::kConcat:
        case Op::kBitAnd:
        case Op::kBitOr:
        case Op::kBitXor:
        case Op::kLogicAnd:
        case Op::kLogicOr:
          --top;
          if (!arithmetic(in.op, top[0], top[1])) return false;
          break;
        case Op::kNegate:
        case Op::kBitNot:
        case Op::kNot:
          if (!unary(in.op, *top)) return false;
          break;
        case Op::kEqual:
        case Op::kNotEqual:
        case Op::kLess:
        case Op::kLessEqual:
        case Op::kGreater:
        case Op::kGreaterEqual: {
          --top;
          bool holds = false;
          if (!comparison(in.op, top[0], top[1], holds)) return false;
          if (in.arg == 0) {
            *top = ScriptValue::of(holds ? 1.0 : 0.0);
          } else if (holds) {
            *top = top[1];
          } else {
            *top = ScriptValue::of(0.0);
            pc = in.arg - 1;
          }
          break;
        }
        case Op::kJumpIfFalse: {
          bool yes = false;
          if (!condition(*top--, yes)) return false;
          if (!yes) pc = in.arg - 1;
          break;
        }
        case Op::kJump: pc = in.arg - 1; break;
        case Op::kPop: --top; break;
      }
    }
    result = *top;
    return true;
  }

 private:
  bool fail(std::string what) {
    error_ = fmt::format("script \"{}\": {}", script_.text, what);
    return false;
  }
  bool unknown(std::uint32_t name) {
    return fail(fmt::format("no entry \"{}\"; create it with := first", script_.names[name].name));
  }
  bool empty(std::uint32_t name) {
    return fail(fmt::format("entry \"{}\" holds no value yet", script_.names[name].name));
  }
  bool too_long() { return fail(fmt::format("a text longer than {} bytes", kScriptTextMax)); }
  bool operand_empty() { return fail("an operand holds no value yet"); }

  bool assign(const Instruction& in, ScriptValue& value) {
    const std::uint32_t cell = cells_[in.arg];
    Blackboard::Entry* entry = blackboard_.find(cell);
    if (entry == nullptr) {
      if (in.op != Op::kCreate && !is_named(cell)) return unknown(in.arg);
      std::string problem;
      blackboard_.create(cell, nullptr, problem);
      entry = blackboard_.find(cell);
      if (entry == nullptr) return fail(problem);
    }
    if (value.tag == Tag::kEmpty) return operand_empty();
    if (value.tag == Tag::kOther) return fail("a value that is no number and no string cannot be assigned");
    Value& held = entry->datum.value;
    if (entry->datum.empty() && entry->type == nullptr) {
      store(value, held);
    } else if (value.tag == Tag::kReal && held.as_double() != nullptr) {
      held = value.real;
    } else if (value.tag == Tag::kString && held.as_string() == nullptr) {
      // Text for an entry of another type is read as that type.
      std::optional<Value> parsed;
      std::string why;
      if (entry->type != nullptr) parsed = value_of_text(model_, *entry->type, *value.string, &why);
      if (!parsed) return mismatch(in.arg, value, *entry, why);
      entry->datum = Datum{std::move(*parsed), nullptr};
    } else {
      Datum from;
      store(value, from.value);
      if (!copy_into(from, entry->datum)) return mismatch(in.arg, value, *entry);
    }
    blackboard_.written(*entry);
    value = load(entry->datum);
    return true;
  }

  // By a port of a skill, which makes the entry that it names.
  [[nodiscard]] bool is_named(std::uint32_t cell) const {
    return cell < model_.cells.size() &&
           std::binary_search(model_.named.begin(), model_.named.end(), model_.owner(cell));
  }

  bool mismatch(std::uint32_t name, const ScriptValue& value, const Blackboard::Entry& entry,
                const std::string& why = {}) {
    std::string text;
    append_text(text, value);
    const Value& held = entry.datum.value;
    const std::string is = entry.datum.empty() && entry.type != nullptr
                               ? fmt::format("is of type {}{}", entry.type->name, declared_by(cells_[name], entry.type))
                               : fmt::format("holds {} {}", to_string(held.type()), to_json(held));
    return fail(fmt::format("entry \"{}\" {} and cannot take {}{}{}", script_.names[name].name, is, text,
                            why.empty() ? "" : ": ", why));
  }

  // Whose port gives the entry its type: " (port "percent" of BatteryOk)".
  [[nodiscard]] std::string declared_by(std::uint32_t cell, const PortType* type) const {
    const auto owner = [&](std::uint32_t at) {
      while (at < model_.cells.size() && model_.cells[at].parent != kNone) at = model_.cells[at].parent;
      return at;
    };
    for (NodeId id = 0; id < model_.nodes.size(); ++id) {
      const Node& node = model_.nodes[id];
      for (std::uint32_t i = 0; i < node.port_count; ++i) {
        const Binding& b = model_.bindings[node.ports + i];
        if (b.kind == Binding::Kind::kEntry && b.type == type && owner(b.target) == owner(cell))
          return fmt::format(" (port \"{}\" of {})", model_.strings[b.name], model_.name(id));
      }
    }
    return {};
  }

  bool update(const Instruction& in, ScriptValue& value) {
    Blackboard::Entry* entry = blackboard_.find(cells_[in.arg]);
    if (entry == nullptr) return unknown(in.arg);
    if (value.tag == Tag::kEmpty) return operand_empty();
    if (entry->datum.empty()) return empty(in.arg);
    ScriptValue left = load(entry->datum);
    if (value.is_number() && left.tag == Tag::kString) {
      const auto number = detail::parse_real(*left.string);
      if (!number) return mismatch(in.arg, value, *entry);
      left = ScriptValue::of(*number);
    }
    if (value.is_number() && left.is_number()) {
      const double a = left.number();
      const double b = value.number();
      double r = 0;
      switch (in.op) {
        case Op::kAddAssign: r = a + b; break;
        case Op::kSubtractAssign: r = a - b; break;
        case Op::kMultiplyAssign: r = a * b; break;
        default: r = a / b; break;
      }
      Value& held = entry->datum.value;
      if (held.as_double() != nullptr) {
        held = r;
      } else if (!copy_into(Datum{Value(r), nullptr}, entry->datum)) {
        return mismatch(in.arg, ScriptValue::of(r), *entry);
      }
    } else if (value.tag == Tag::kString && left.tag == Tag::kString && in.op == Op::kAddAssign) {
      if (left.string->size() + value.string->size() > kScriptTextMax) return too_long();
      entry->datum.value = *left.string + *value.string;
    } else {
      return fail(fmt::format("the operator does not fit what entry \"{}\" holds", script_.names[in.arg].name));
    }
    blackboard_.written(*entry);
    value = load(entry->datum);
    return true;
  }

  bool arithmetic(Op op, ScriptValue& left, const ScriptValue& right) {
    if (left.tag == Tag::kEmpty || right.tag == Tag::kEmpty) return operand_empty();
    if (op == Op::kConcat) {
      if (left.tag == Tag::kOther || right.tag == Tag::kOther) return fail("'..' joins strings and numbers only");
      std::string& joined = scratch().next();
      append_text(joined, left);
      append_text(joined, right);
      if (joined.size() > kScriptTextMax) return too_long();
      left = ScriptValue::of(&joined);
      return true;
    }
    if (op == Op::kAdd && left.tag == Tag::kString && right.tag == Tag::kString) {
      std::string& joined = scratch().next();
      joined = *left.string;
      joined += *right.string;
      if (joined.size() > kScriptTextMax) return too_long();
      left = ScriptValue::of(&joined);
      return true;
    }
    if (!left.is_number() || !right.is_number()) return fail("the operator needs two numbers");
    const double a = left.number();
    const double b = right.number();
    switch (op) {
      case Op::kAdd: left = ScriptValue::of(a + b); return true;
      case Op::kSubtract: left = ScriptValue::of(a - b); return true;
      case Op::kMultiply: left = ScriptValue::of(a * b); return true;
      case Op::kDivide: left = ScriptValue::of(a / b); return true;
      case Op::kLogicAnd: left = ScriptValue::of(a != 0.0 && b != 0.0 ? 1.0 : 0.0); return true;
      case Op::kLogicOr: left = ScriptValue::of(a != 0.0 || b != 0.0 ? 1.0 : 0.0); return true;
      default: break;
    }
    const auto i = as_integer(left);
    const auto j = as_integer(right);
    if (!i || !j) return fail("'&', '|' and '^' need whole numbers");
    left = ScriptValue::of(static_cast<double>(op == Op::kBitAnd ? *i & *j : op == Op::kBitOr ? *i | *j : *i ^ *j));
    return true;
  }

  bool unary(Op op, ScriptValue& value) {
    if (value.tag == Tag::kEmpty) return operand_empty();
    if (!value.is_number()) return fail("'-', '~' and '!' need a number");
    if (op == Op::kNegate) {
      value = ScriptValue::of(-value.number());
    } else if (op == Op::kNot) {
      value = ScriptValue::of(value.number() != 0.0 ? 0.0 : 1.0);
    } else {
      const auto integer = as_integer(value);
      if (!integer) return fail("'~' needs a whole number");
      value = ScriptValue::of(static_cast<double>(~*integer));
    }
    return true;
  }

  /// The number that a string stands for: an enum's, or its own digits.
  std::optional<double> number_of(const std::string& text) const {
    if (const auto value = model_.enum_value(text)) return static_cast<double>(*value);
    return detail::parse_real(text);
  }

  bool comparison(Op op, const ScriptValue& left, const ScriptValue& right, bool& holds) {
    if (left.tag == Tag::kEmpty || right.tag == Tag::kEmpty) return operand_empty();
    if (left.tag == Tag::kOther || right.tag == Tag::kOther) return fail("only numbers and strings can be compared");
    if (left.tag == Tag::kString && right.tag == Tag::kString) {
      holds = compare(op, *left.string, *right.string);
      return true;
    }
    const auto a = left.is_number() ? std::optional(left.number()) : number_of(*left.string);
    const auto b = right.is_number() ? std::optional(right.number()) : number_of(*right.string);
    if (!a || !b) {
      return fail(fmt::format("\"{}\" is compared with a number and is none", a ? *right.string : *left.string));
    }
    holds = compare(op, *a, *b);
    return true;
  }

  bool condition(const ScriptValue& value, bool& yes) {
    if (value.tag == Tag::kString) {
      yes = !value.string->empty();
      return true;
    }
    if (!value.is_number()) return operand_empty();
    yes = value.number() != 0.0;
    return true;
  }

  const Model& model_;
  Blackboard& blackboard_;
  const Script& script_;
  const std::uint32_t* cells_;
  std::string& error_;
};

}  // namespace

bool run_script(const Model& model, Blackboard& blackboard, const Script& script, const std::uint32_t* cells,
                ScriptValue& result, std::string& error) {
  constexpr std::size_t kSmall = 16;
  scratch().reset();
  Run run(model, blackboard, script, cells, error);
  if (script.stack_max <= kSmall) {
    std::array<ScriptValue, kSmall> stack;
    return run.run(stack.data(), result);
  }
  std::vector<ScriptValue> stack(script.stack_max);
  return run.run(stack.data(), result);
}

ScriptValue keep_text(std::string_view text) {
  std::string& kept = scratch().next();
  kept = text;
  return ScriptValue::of(&kept);
}

bool truth(const ScriptValue& value, bool& result, std::string& error) {
  if (value.is_number()) {
    result = value.number() != 0.0;
    return true;
  }
  if (value.tag == Tag::kString) {
    // "true" is text here, as in BehaviorTree.CPP.
    if (const auto number = detail::parse_real(*value.string)) {
      result = *number != 0.0;
      return true;
    }
    error = fmt::format("the text \"{}\" is neither true nor false; compare it with ==", *value.string);
    return false;
  }
  error = "the script's value is empty: it is neither true nor false";
  return false;
}

}  // namespace sentree::bt
