#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "sentree/base/value.h"
#include "sentree/scxml/event.h"

namespace sentree::scxml {

/// The part of ECMAScript that is evaluated without an interpreter: literals, those of objects too, variables of
/// <data>, members of them and of `_event`, In('id'), arithmetic, comparison, logic, `Math`, functions of the embedding
/// program. It is free of side effects but for those of such functions, so that whatever it cannot decide (an object
/// where a primitive is needed, an error to be raised) can be evaluated again by the interpreter, which is given what
/// such functions have given.
struct NativeCode {
  enum class Op : std::uint8_t {
    kUndefined,
    kNull,
    kTrue,
    kFalse,
    kNumber,
    kString,      // literals
    kVariable,    // a: slot
    kEventField,  // a: EventField
    kSystem,      // a: SystemVariable
    kIn,          // a: string
    kMember,
    kIndex,  // a: object, b: string / node
    kNot,
    kNegate,
    kPlus,
    kTypeof,  // a
    kAdd,
    kSubtract,
    kMultiply,
    kDivide,
    kModulo,  // a, b
    kLess,
    kLessEqual,
    kGreater,
    kGreaterEqual,
    kEqual,
    kNotEqual,
    kStrictEqual,
    kStrictNotEqual,
    kAnd,
    kOr,
    kConditional,  // a ? b : c
    kMath,         // a: MathFunction; b: node, and c: another one for kMin and kMax
    kCall,         // a: string, a function of the embedding program; b: its first argument in `arguments`, c: how many
    kObject,       // without members
    kWith,         // a: object that this makes, b: string, c: node: one member more
  };
  struct Node {
    Op op = Op::kUndefined;
    std::uint32_t a = 0;
    std::uint32_t b = 0;
    std::uint32_t c = 0;
    double number = 0;
  };
  std::vector<Node> nodes;  ///< Operands before operators; the last is the result. Empty: not native.
  std::vector<std::string> strings;
  std::vector<std::uint32_t> arguments;  ///< Nodes.

  [[nodiscard]] bool empty() const { return nodes.empty(); }
};

enum class EventField : std::uint32_t { kName, kType, kSendid, kOrigin, kOrigintype, kInvokeid, kData };
enum class SystemVariable : std::uint32_t { kSessionId, kName };
enum class MathFunction : std::uint32_t { kAbs, kCeil, kFloor, kRound, kSign, kSqrt, kMin, kMax };

/// Nesting of an expression beyond which it is left to the interpreter.
inline constexpr int kNativeNestingMax = 64;

/// Characters of a decimal number that everybody reads as the same double; longer ones are left to the interpreter.
inline constexpr std::size_t kExactDigitsMax = 15;

/// The slot of a variable of that name, or nothing.
using SlotLookup = std::function<std::optional<std::uint32_t>(std::string_view name)>;

/// Whether a name is what every script finds under it: `Math`, or a function of the embedding program.
using IsGlobal = std::function<bool(std::string_view name)>;

/// Empty code if `source` is outside the native part, or is no expression.
/// @param is_global  Asked of `Math` and of what is called; empty: no.
[[nodiscard]] NativeCode compile_native(std::string_view source, const SlotLookup& slots,
                                        const IsGlobal& is_global = {});

/// The null data model's only expression (SCXML B.1): In(id), with or without quotes.
[[nodiscard]] NativeCode compile_null(std::string_view source);

/// If `source` is nothing but a variable's name: its slot.
[[nodiscard]] std::optional<std::uint32_t> as_variable(std::string_view source, const SlotLookup& slots);

/// A value of a script while it is being evaluated. Strings and objects are borrowed.
struct ScriptValue {
  enum class Kind : std::uint8_t { kUndefined, kNull, kBool, kNumber, kString, kObject };
  Kind kind = Kind::kUndefined;
  bool boolean = false;
  double number = 0;
  std::string_view string;
  const Value* object = nullptr;

  static ScriptValue of(bool v) { return {.kind = Kind::kBool, .boolean = v, .string = {}}; }
  static ScriptValue of(double v) { return {.kind = Kind::kNumber, .number = v, .string = {}}; }
  static ScriptValue of(std::string_view v) { return {.kind = Kind::kString, .string = v}; }
  static ScriptValue of(const Value& v);
  static ScriptValue null() { return {.kind = Kind::kNull, .string = {}}; }
  [[nodiscard]] bool truthy() const;
  /// Nothing: undefined. Objects are copied.
  [[nodiscard]] std::optional<Value> to_value() const;
};

/// What native code can read.
class NativeScope {
 public:
  virtual ~NativeScope() = default;
  /// False: its value is not known here; the interpreter must evaluate.
  virtual bool variable(std::uint32_t slot, ScriptValue& value) = 0;
  virtual const Event* event() = 0;
  virtual std::string_view system(SystemVariable variable) = 0;
  virtual bool in(std::string_view state_id) = 0;
  /// Calls a function of the embedding program. False: the interpreter must evaluate.
  virtual bool call(std::string_view /*function*/, List&& /*arguments*/, Value& /*result*/) { return false; }
};

/// False: the interpreter must evaluate. `text` receives strings made on the way, which `result` may borrow; objects
/// that are made live until this thread evaluates again.
[[nodiscard]] bool evaluate_native(const NativeCode& code, NativeScope& scope, std::vector<std::string>& text,
                                   ScriptValue& result);

/// Its value, as `to_value`; an object that was made in the last evaluation of this thread is moved out of it.
[[nodiscard]] std::optional<Value> take_value(const ScriptValue& value);

/// The value of an expression that is a literal or is computed from literals only; nothing if it is not (or undefined).
[[nodiscard]] std::optional<Value> constant_value(std::string_view source);

/// As scripts print numbers (ECMAScript 5.1, 9.8.1).
[[nodiscard]] std::string number_to_string(double number);
/// A number as data keep it: an int if that is exact and within 2^53, else a double.
[[nodiscard]] Value number_value(double number);

}  // namespace sentree::scxml
