#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "sentree/base/result.h"
#include "sentree/base/value.h"

namespace sentree::bt {

/// Bounds of one script; beyond them it is refused with bt.script-too-large.
inline constexpr std::size_t kScriptBytesMax = 64U << 10U;
inline constexpr int kScriptNestingMax = 200;
/// Text that a script may make; a longer one gives the tick up.
inline constexpr std::size_t kScriptTextMax = 1U << 20U;

/// One instruction of a stack machine.
struct Instruction {
  enum class Op : std::uint8_t {
    kNumber,   ///< push numbers[arg] (double)
    kInteger,  ///< push integers[arg]
    kString,   ///< push strings[arg]
    kLoad,     ///< push the entry of names[arg]
    kCreate,   ///< pop, names[arg] := value, push what the entry now holds
    kAssign,
    kAddAssign,
    kSubtractAssign,
    kMultiplyAssign,
    kDivideAssign,
    kAdd,
    kSubtract,
    kMultiply,
    kDivide,
    kConcat,
    kBitAnd,
    kBitOr,
    kBitXor,
    kLogicAnd,
    kLogicOr,
    kNegate,
    kBitNot,
    kNot,
    // arg 0: push 1 or 0. Else part of a chain: false pushes 0 and jumps to arg, true keeps the right operand.
    kEqual,
    kNotEqual,
    kLess,
    kLessEqual,
    kGreater,
    kGreaterEqual,
    kJumpIfFalse,  ///< pop; jump to arg if it is false
    kJump,         ///< jump to arg
    kPop,
  };
  Op op;
  std::uint32_t arg = 0;
};

/// An operator with its operands, of a script in which nothing but numbers meets; see `number_steps`.
struct NumberStep {
  enum class Source : std::uint8_t { kNumber, kEntry, kStack };
  Instruction::Op op;
  Source left, right;  ///< Assignments: the entry is on the left. Operators of one operand: it is on the right.
  std::uint32_t left_name, right_name;  ///< In `Script::names`; of a script that is used somewhere, cells.
  double left_number, right_number;
};

/// How a name is used, for static checks.
struct NameUse {
  std::string name;
  bool created = false;   ///< Assigned by ':='.
  bool assigned = false;  ///< Assigned by '=' or '+=' and the like: must exist.
  bool read = false;
};

/// Something that runs, and is probably not meant.
struct ScriptWarning {
  std::size_t offset;  ///< Byte of the script.
  std::string code;    ///< bt.script-…
  std::string message;
};

/// A compiled script. Immutable; names are resolved by whoever runs it.
struct Script {
  std::string text;
  std::vector<Instruction> code;
  std::vector<NumberStep> steps;  ///< The same, if numbers are all that it needs.
  std::vector<double> numbers;
  std::vector<std::int64_t> integers;
  std::vector<std::string> strings;
  std::vector<NameUse> names;
  std::uint32_t stack_max = 0;  ///< Values on the stack at most.
  std::vector<ScriptWarning> warnings;
};

/// What is known about a value before a script runs.
enum class ScriptType : std::uint8_t { kUnknown, kNumber, kText };

/// What the script may assign to each of its names, `types` being what they hold before. kUnknown where it depends.
[[nodiscard]] std::vector<ScriptType> assigned_types(const Script& script, std::span<const ScriptType> types);

/// Operators that must fail on values of these types: text compared with a number that it is not, arithmetic on text …
/// Each as a message. `is_number` says whether a text stands for one (an enum, or digits).
[[nodiscard]] std::vector<std::string> type_mistakes(const Script& script, std::span<const ScriptType> types,
                                                     const std::function<bool(std::string_view)>& is_number);

/// Looks up a script enum; nothing if the name is none.
using EnumLookup = std::function<std::optional<std::int64_t>(std::string_view)>;

/// Compiles statements separated by ';' (optional, as in BehaviorTree.CPP).
///
/// Errors: bt.script-syntax, with the column inside the script in message and span; bt.script-too-large.
[[nodiscard]] Result<Script> compile_script(std::string_view text, const EnumLookup& enums = {});

}  // namespace sentree::bt
