#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <limits>
#include <memory>
#include <utility>
#include <vector>

#include "sentree/base/assert.h"
#include "sentree/scxml/expression.h"

namespace sentree::scxml {
namespace {

/// Longer texts are made by the interpreter, whose memory is bounded.
constexpr std::size_t kNativeTextMax = 256U << 10U;
/// Numbers from here on are whole.
constexpr double kWholeFrom = 0x1p52;

using Op = NativeCode::Op;
using Node = NativeCode::Node;
using ValueKind = ScriptValue::Kind;

// Members that objects inherit: their absence from a map does not make them undefined.
bool is_inherited(std::string_view name) {
  for (const std::string_view inherited :
       {"constructor", "hasOwnProperty", "isPrototypeOf", "propertyIsEnumerable", "toLocaleString", "toString",
        "valueOf", "__proto__", "__defineGetter__", "__defineSetter__", "__lookupGetter__", "__lookupSetter__"}) {
    if (name == inherited) return true;
  }
  return false;
}

// Values that scripts see as something else than a plain object: XML, dates, octets.
bool is_opaque(const Value& value) {
  if (value.as_bytes()) return true;
  const Map* map = value.as_map();
  return map && map->size() == 1 && map->begin()->first.starts_with('$');
}

bool is_ascii(std::string_view text) {
  for (const char c : text) {
    if (static_cast<unsigned char>(c) >= 0x80) return false;
  }
  return true;
}

// Objects made while an expression is evaluated.
std::vector<std::unique_ptr<Value>>& made_objects() {
  thread_local std::vector<std::unique_ptr<Value>> made;
  return made;
}

// ToNumber of a string, for the forms that need no doubt: white space, decimal. False: ask the interpreter.
bool decimal(std::string_view text, double& number) {
  constexpr std::string_view kSpace = " \t\n\r";
  while (!text.empty() && kSpace.find(text.front()) != std::string_view::npos) text.remove_prefix(1);
  while (!text.empty() && kSpace.find(text.back()) != std::string_view::npos) text.remove_suffix(1);
  number = 0;
  if (text.empty()) return true;
  if (text.find_first_not_of("0123456789.") != std::string_view::npos || text == ".") return false;
  if (text.size() > kExactDigitsMax) return false;
  const auto [end, failure] = std::from_chars(text.data(), text.data() + text.size(), number);
  return failure == std::errc() && end == text.data() + text.size();
}

class Evaluator {
 public:
  Evaluator(const NativeCode& code, NativeScope& scope, std::vector<std::string>& text)
      : code_(code), scope_(scope), text_(text) {}

  bool evaluate(std::uint32_t index, ScriptValue& out) {
    const Node& node = code_.nodes[index];
    switch (node.op) {
      case Op::kUndefined: out = {}; return true;
      case Op::kNull: out = ScriptValue::null(); return true;
      case Op::kTrue: out = ScriptValue::of(true); return true;
      case Op::kFalse: out = ScriptValue::of(false); return true;
      case Op::kNumber: out = ScriptValue::of(node.number); return true;
      case Op::kString: out = ScriptValue::of(std::string_view(code_.strings[node.a])); return true;
      case Op::kVariable:
        return scope_.variable(node.a, out) && !(out.kind == ValueKind::kObject && is_opaque(*out.object));
      case Op::kEventField: return event_field(static_cast<EventField>(node.a), out);
      case Op::kSystem: out = ScriptValue::of(scope_.system(static_cast<SystemVariable>(node.a))); return true;
      case Op::kIn: out = ScriptValue::of(scope_.in(code_.strings[node.a])); return true;
      case Op::kMember: return evaluate(node.a, out) && member(code_.strings[node.b], out);
      case Op::kIndex: return index_into(node, out);
      case Op::kNot:
        if (!evaluate(node.a, out)) return false;
        out = ScriptValue::of(!out.truthy());
        return true;
      case Op::kNegate:
      case Op::kPlus: {
        double number = 0;
        if (!evaluate(node.a, out) || !to_number(out, number)) return false;
        out = ScriptValue::of(node.op == Op::kNegate ? -number : number);
        return true;
      }
      case Op::kTypeof: return type_of(node, out);
      case Op::kMath: return of_math(node, out);
      case Op::kCall: return call(node, out);
      case Op::kAnd: return evaluate(node.a, out) && (!out.truthy() || evaluate(node.b, out));
      case Op::kOr: return evaluate(node.a, out) && (out.truthy() || evaluate(node.b, out));
      case Op::kObject: out = new_object(0); return true;
      case Op::kWith: return with_member(node, 1, out);
      case Op::kConditional: return evaluate(node.a, out) && evaluate(out.truthy() ? node.b : node.c, out);
      default: break;
    }
    ScriptValue right;
    return evaluate(node.a, out) && evaluate(node.b, right) && binary(node.op, out, right, out);
  }

 private:
  bool of_math(const Node& node, ScriptValue& out) {
    double x = 0;
    if (!evaluate(node.b, out) || !to_number(out, x)) return false;
    const auto function = static_cast<MathFunction>(node.a);
    double y = 0;
    if (function == MathFunction::kMin || function == MathFunction::kMax) {
      ScriptValue other;
      if (!evaluate(node.c, other) || !to_number(other, y)) return false;
    }
    // Half of what is next to it is no number there any more, and everybody rounds it in a way of their own.
    if (function == MathFunction::kRound && std::fabs(x) >= kWholeFrom && !std::isinf(x)) return false;
    out = ScriptValue::of(of_math(function, x, y));
    return true;
  }
  static double of_math(MathFunction function, double x, double y) {
    switch (function) {
      case MathFunction::kAbs: return std::fabs(x);
      case MathFunction::kCeil: return std::ceil(x);
      case MathFunction::kFloor: return std::floor(x);
      case MathFunction::kRound: {
        // Halves go up.
        const double below = std::floor(x);
        return std::copysign(x - below >= 0.5 ? below + 1 : below, x);
      }
      case MathFunction::kSign: return x > 0 ? 1.0 : x < 0 ? -1.0 : x;
      case MathFunction::kSqrt: return std::sqrt(x);
      case MathFunction::kMin:
      case MathFunction::kMax: break;
    }
    if (std::isnan(x) || std::isnan(y)) return std::numeric_limits<double>::quiet_NaN();
    const bool first = x != y ? x < y : std::signbit(x);  // -0 is less than 0
    return first == (function == MathFunction::kMin) ? x : y;
  }

  bool call(const Node& node, ScriptValue& out) {
    List arguments;
    arguments.reserve(node.c);
    for (std::uint32_t i = 0; i < node.c; ++i) {
      if (!evaluate(code_.arguments[node.b + i], out)) return false;
      arguments.push_back(out.to_value().value_or(Value(Map{{"$undefined", true}})));
    }
    Value result;
    if (!scope_.call(code_.strings[node.a], std::move(arguments), result)) return false;
    out = ScriptValue::of(*made_objects().emplace_back(std::make_unique<Value>(std::move(result))));
    return true;
  }

  static ScriptValue new_object(std::size_t members) {
    Map map;
    map.reserve(members);
    return ScriptValue::of(*made_objects().emplace_back(std::make_unique<Value>(std::move(map))));
  }

  // An object that has been made is nobody else's yet.
  // @param last  Members that it has from this one on.
  bool with_member(const Node& node, std::size_t last, ScriptValue& out) {
    ScriptValue value;
    const Node& before = code_.nodes[node.a];
    if (before.op == Op::kObject)
      out = new_object(last);
    else if (!with_member(before, last + 1, out))
      return false;
    Map& members = *const_cast<Value*>(out.object)->as_map();
    if (!evaluate(node.c, value)) return false;
    // What scripts share, and may have changed, is left to the interpreter.
    const Op made_by = code_.nodes[node.c].op;
    if (value.kind == ValueKind::kObject && made_by != Op::kObject && made_by != Op::kWith) return false;
    // One that is undefined is no member of data.
    if (auto member = take_value(value)) members.append(code_.strings[node.b], *std::move(member));
    return true;
  }

  bool event_field(EventField field, ScriptValue& out) {
    const Event* event = scope_.event();
    if (!event) return false;  // a member of undefined: an error for the interpreter to raise
    const auto text = [&](const std::string& value) {
      out = value.empty() ? ScriptValue() : ScriptValue::of(std::string_view(value));
      return true;
    };
    switch (field) {
      case EventField::kName: out = ScriptValue::of(std::string_view(event->name)); return true;
      case EventField::kType: out = ScriptValue::of(to_string(event->type)); return true;
      case EventField::kSendid: return text(event->sendid);
      case EventField::kOrigin: return text(event->origin);
      case EventField::kOrigintype: return text(event->origintype);
      case EventField::kInvokeid: return text(event->invokeid);
      case EventField::kData:
        if (!event->data) {
          out = {};
          return true;
        }
        if (is_opaque(*event->data)) return false;
        out = ScriptValue::of(*event->data);
        return true;
    }
    return false;
  }

  bool member(std::string_view name, ScriptValue& out) {
    if (out.kind != ValueKind::kObject) return false;
    if (const List* list = out.object->as_list()) {
      if (name != "length") return false;
      out = ScriptValue::of(static_cast<double>(list->size()));
      return true;
    }
    const Value* value = out.object->find(name);
    if (!value) {
      if (!out.object->as_map() || is_inherited(name)) return false;
      out = {};
      return true;
    }
    if (is_opaque(*value)) return false;
    out = ScriptValue::of(*value);
    return true;
  }

  bool index_into(const Node& node, ScriptValue& out) {
    ScriptValue key;
    if (!evaluate(node.a, out) || !evaluate(node.b, key)) return false;
    if (key.kind == ValueKind::kString) {
      // A list's items can be named by strings too ("0"); that is left to the interpreter.
      return out.kind == ValueKind::kObject && out.object->as_map() && member(key.string, out);
    }
    const List* list = out.kind == ValueKind::kObject ? out.object->as_list() : nullptr;
    if (!list || key.kind != ValueKind::kNumber || !(key.number >= 0) ||
        key.number >= static_cast<double>(list->size()))
      return false;
    const auto position = static_cast<std::size_t>(key.number);
    if (static_cast<double>(position) != key.number || is_opaque((*list)[position])) return false;
    out = ScriptValue::of((*list)[position]);
    return true;
  }

  bool type_of(const Node& node, ScriptValue& out) {
    if (!evaluate(node.a, out)) return false;
    switch (out.kind) {
      case ValueKind::kUndefined: out = ScriptValue::of(std::string_view("undefined")); break;
      case ValueKind::kNull:
      case ValueKind::kObject: out = ScriptValue::of(std::string_view("object")); break;
      case ValueKind::kBool: out = ScriptValue::of(std::string_view("boolean")); break;
      case ValueKind::kNumber: out = ScriptValue::of(std::string_view("number")); break;
      case ValueKind::kString: out = ScriptValue::of(std::string_view("string")); break;
    }
    return true;
  }

  static bool to_number(const ScriptValue& value, double& number) {
    switch (value.kind) {
      case ValueKind::kUndefined: number = std::numeric_limits<double>::quiet_NaN(); return true;
      case ValueKind::kNull: number = 0; return true;
      case ValueKind::kBool: number = value.boolean ? 1 : 0; return true;
      case ValueKind::kNumber: number = value.number; return true;
      case ValueKind::kString: return decimal(value.string, number);
      case ValueKind::kObject: return false;
    }
    return false;
  }

  static bool append_string(const ScriptValue& value, std::string& text) {
    switch (value.kind) {
      case ValueKind::kUndefined: text += "undefined"; return true;
      case ValueKind::kNull: text += "null"; return true;
      case ValueKind::kBool: text += value.boolean ? "true" : "false"; return true;
      case ValueKind::kNumber: text += number_to_string(value.number); return true;
      case ValueKind::kString: text += value.string; return true;
      case ValueKind::kObject: return false;
    }
    return false;
  }

  bool binary(Op op, const ScriptValue& a, const ScriptValue& b, ScriptValue& out) {
    switch (op) {
      case Op::kStrictEqual:
      case Op::kStrictNotEqual: {
        bool equal = false;
        if (!strictly_equal(a, b, equal)) return false;
        out = ScriptValue::of(equal == (op == Op::kStrictEqual));
        return true;
      }
      case Op::kEqual:
      case Op::kNotEqual: {
        bool equal = false;
        if (!loosely_equal(a, b, equal)) return false;
        out = ScriptValue::of(equal == (op == Op::kEqual));
        return true;
      }
      case Op::kAdd:
        if (a.kind == ValueKind::kString || b.kind == ValueKind::kString) {
          std::string text;
          if (!append_string(a, text) || !append_string(b, text)) return false;
          if (text.size() > kNativeTextMax) return false;
          out = keep(std::move(text));
          return true;
        }
        break;
      case Op::kLess:
      case Op::kLessEqual:
      case Op::kGreater:
      case Op::kGreaterEqual:
        if (a.kind == ValueKind::kString && b.kind == ValueKind::kString) {
          // Scripts compare UTF-16 units, which bytes agree with for ASCII.
          if (!is_ascii(a.string) || !is_ascii(b.string)) return false;
          const int order = a.string.compare(b.string);
          out = ScriptValue::of(op == Op::kLess        ? order < 0
                                : op == Op::kLessEqual ? order <= 0
                                : op == Op::kGreater   ? order > 0
                                                       : order >= 0);
          return true;
        }
        break;
      default: break;
    }
    double x = 0;
    double y = 0;
    if (!to_number(a, x) || !to_number(b, y)) return false;
    switch (op) {
      case Op::kAdd: out = ScriptValue::of(x + y); return true;
      case Op::kSubtract: out = ScriptValue::of(x - y); return true;
      case Op::kMultiply: out = ScriptValue::of(x * y); return true;
      case Op::kDivide: out = ScriptValue::of(x / y); return true;
      case Op::kModulo: out = ScriptValue::of(std::fmod(x, y)); return true;
      case Op::kLess: out = ScriptValue::of(x < y); return true;
      case Op::kLessEqual: out = ScriptValue::of(x <= y); return true;
      case Op::kGreater: out = ScriptValue::of(x > y); return true;
      case Op::kGreaterEqual: out = ScriptValue::of(x >= y); return true;
      default: return false;
    }
  }

  static bool strictly_equal(const ScriptValue& a, const ScriptValue& b, bool& equal) {
    equal = false;
    if (a.kind != b.kind) return true;
    switch (a.kind) {
      case ValueKind::kUndefined:
      case ValueKind::kNull: equal = true; return true;
      case ValueKind::kBool: equal = a.boolean == b.boolean; return true;
      case ValueKind::kNumber: equal = a.number == b.number; return true;
      case ValueKind::kString: equal = a.string == b.string; return true;
      case ValueKind::kObject: return false;  // identity is known to the interpreter only
    }
    return false;
  }

  static bool loosely_equal(const ScriptValue& a, const ScriptValue& b, bool& equal) {
    if (a.kind == b.kind) return strictly_equal(a, b, equal);
    const auto absent = [](const ScriptValue& v) {
      return v.kind == ValueKind::kUndefined || v.kind == ValueKind::kNull;
    };
    if (absent(a) || absent(b)) {
      equal = absent(a) && absent(b);
      return true;
    }
    double x = 0;
    double y = 0;
    if (!to_number(a, x) || !to_number(b, y)) return false;
    equal = x == y;
    return true;
  }

  ScriptValue keep(std::string text) {
    // Reserved by the caller: growth would move short texts away from under their views.
    SENTREE_ASSERT(text_.size() < text_.capacity());
    text_.push_back(std::move(text));
    return ScriptValue::of(std::string_view(text_.back()));
  }

  const NativeCode& code_;
  NativeScope& scope_;
  std::vector<std::string>& text_;
};

}  // namespace

ScriptValue ScriptValue::of(const Value& v) {
  switch (v.type()) {
    case Value::Type::kNull: return null();
    case Value::Type::kBool: return of(*v.as_bool());
    case Value::Type::kInt: return of(static_cast<double>(*v.as_int()));
    case Value::Type::kDouble: return of(*v.as_double());
    case Value::Type::kString: return of(std::string_view(*v.as_string()));
    default: return {.kind = ValueKind::kObject, .string = {}, .object = &v};
  }
}

bool ScriptValue::truthy() const {
  switch (kind) {
    case ValueKind::kUndefined:
    case ValueKind::kNull: return false;
    case ValueKind::kBool: return boolean;
    case ValueKind::kNumber: return number != 0 && !std::isnan(number);
    case ValueKind::kString: return !string.empty();
    case ValueKind::kObject: return true;
  }
  return false;
}

std::optional<Value> ScriptValue::to_value() const {
  switch (kind) {
    case ValueKind::kUndefined: return std::nullopt;
    case ValueKind::kNull: return Value();
    case ValueKind::kBool: return Value(boolean);
    case ValueKind::kNumber: return number_value(number);
    case ValueKind::kString: return Value(string);
    case ValueKind::kObject: return *object;
  }
  return std::nullopt;
}

std::optional<Value> take_value(const ScriptValue& value) {
  if (value.kind != ValueKind::kObject) return value.to_value();
  for (const std::unique_ptr<Value>& made : made_objects()) {
    if (made.get() == value.object) return std::move(*made);
  }
  return *value.object;
}

bool evaluate_native(const NativeCode& code, NativeScope& scope, std::vector<std::string>& text, ScriptValue& result) {
  text.clear();
  made_objects().clear();
  if (text.capacity() < code.nodes.size()) text.reserve(code.nodes.size());
  return Evaluator(code, scope, text).evaluate(static_cast<std::uint32_t>(code.nodes.size() - 1), result);
}

Value number_value(double number) {
  if (std::isnan(number))
    return std::numeric_limits<double>::quiet_NaN();  // scripts know one NaN; its sign is an accident
  constexpr double kExactMax = 9007199254740992.0;
  if (number >= -kExactMax && number <= kExactMax) {
    const auto integer = static_cast<std::int64_t>(number);
    if (static_cast<double>(integer) == number && !(integer == 0 && std::signbit(number))) return integer;
  }
  return number;
}

std::string number_to_string(double number) {
  if (std::isnan(number)) return "NaN";
  if (std::isinf(number)) return number > 0 ? "Infinity" : "-Infinity";
  if (number == 0) return "0";
  char buffer[40];
  const double magnitude = std::fabs(number);
  const auto end = std::to_chars(buffer, buffer + sizeof buffer, magnitude, std::chars_format::scientific).ptr;
  const std::string_view scientific(buffer, static_cast<std::size_t>(end - buffer));
  const std::size_t e = scientific.find('e');
  std::string digits(1, scientific[0]);
  if (e > 2) digits += scientific.substr(2, e - 2);
  int exponent = 0;
  const std::string_view exponent_text = scientific.substr(scientific[e + 1] == '+' ? e + 2 : e + 1);
  std::from_chars(exponent_text.data(), exponent_text.data() + exponent_text.size(), exponent);
  const int n = exponent + 1;  // the decimal point comes after n digits
  const int k = static_cast<int>(digits.size());
  std::string text = number < 0 ? "-" : "";
  if (k <= n && n <= 21) return text + digits + std::string(static_cast<std::size_t>(n - k), '0');
  if (0 < n && n <= 21)
    return fmt::format("{}{}.{}", text, digits.substr(0, static_cast<std::size_t>(n)),
                       digits.substr(static_cast<std::size_t>(n)));
  if (-6 < n && n <= 0) return fmt::format("{}0.{}{}", text, std::string(static_cast<std::size_t>(-n), '0'), digits);
  text += digits[0];
  if (k > 1) text += "." + digits.substr(1);
  return fmt::format("{}e{}{}", text, n - 1 < 0 ? "-" : "+", n - 1 < 0 ? 1 - n : n - 1);
}

}  // namespace sentree::scxml
