#pragma once

#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "sentree/bt/context.h"
#include "sentree/bt/detail/blackboard.h"
#include "sentree/bt/script.h"

// The short way of scripts in which nothing but numbers meets: conditions, and one assignment at the end. For the files
// of this library.

namespace sentree::bt {

/// The same script in steps whose operands may be entries and constants; empty where it is more than that.
[[nodiscard]] std::vector<NumberStep> number_steps(const Script& script);

namespace detail {

/// Whole numbers up to here are exact as doubles.
inline constexpr double kExact = 9'007'199'254'740'992.0;

[[nodiscard]] inline bool is_assignment(Instruction::Op op) {
  return op >= Instruction::Op::kCreate && op <= Instruction::Op::kDivideAssign;
}

[[gnu::always_inline]] inline double applied(Instruction::Op op, double a, double b) {
  constexpr double kEqualWithin = std::numeric_limits<float>::epsilon();
  using Op = Instruction::Op;
  switch (op) {
    case Op::kAdd:
    case Op::kAddAssign: return a + b;
    case Op::kSubtract:
    case Op::kSubtractAssign: return a - b;
    case Op::kMultiply:
    case Op::kMultiplyAssign: return a * b;
    case Op::kDivide:
    case Op::kDivideAssign: return a / b;
    case Op::kLogicAnd: return a != 0.0 && b != 0.0 ? 1.0 : 0.0;
    case Op::kLogicOr: return a != 0.0 || b != 0.0 ? 1.0 : 0.0;
    case Op::kEqual: return std::abs(a - b) <= kEqualWithin ? 1.0 : 0.0;
    case Op::kNotEqual: return std::abs(a - b) <= kEqualWithin ? 0.0 : 1.0;
    case Op::kLess: return a < b ? 1.0 : 0.0;
    case Op::kLessEqual: return a <= b ? 1.0 : 0.0;
    case Op::kGreater: return a > b ? 1.0 : 0.0;
    case Op::kGreaterEqual: return a >= b ? 1.0 : 0.0;
    case Op::kNegate: return -b;
    case Op::kNot: return b != 0.0 ? 0.0 : 1.0;
    default: return b;  // :=, =, and what is only read.
  }
}

/// `applied` as a condition; what conditions mostly are comes first.
[[gnu::always_inline]] inline bool holds(Instruction::Op op, double a, double b) {
  using Op = Instruction::Op;
  if (op == Op::kGreater) return a > b;
  if (op == Op::kLess) return a < b;
  return applied(op, a, b) != 0.0;
}

/// Finds a linked entry that holds a number which a double holds too.
[[gnu::always_inline]] inline bool read_number(Blackboard& blackboard, std::uint32_t cell, Blackboard::Entry*& entry,
                                               double& number) {
  entry = blackboard.find_linked(cell);
  if (entry == nullptr) return false;
  const Value& held = entry->datum.value;
  if (const double* real = held.as_double()) {
    number = *real;
  } else if (const std::int64_t* integer = held.as_int()) {
    number = static_cast<double>(*integer);
    return std::abs(number) < kExact;
  } else if (const bool* truth = held.as_bool()) {
    number = *truth ? 1.0 : 0.0;
  } else {
    return false;
  }
  return true;
}

[[gnu::always_inline]] inline bool assign(Blackboard& blackboard, Blackboard::Entry& entry, double number) {
  Value& held = entry.datum.value;
  if (held.as_double() != nullptr) {
    detail::overwrite(held, number);
  } else {
    // An integer stays one; what does not fit is for the long way to say.
    if (held.as_int() == nullptr || !(std::abs(number) < kExact)) return false;
    const auto whole = static_cast<std::int64_t>(number);
    if (static_cast<double>(whole) != number) return false;
    detail::overwrite(held, whole);
  }
  blackboard.written(entry);
  return true;
}

/// `a` and `b` are the operands that are no entries.
[[gnu::always_inline]] inline bool run_step(const NumberStep& step, double a, double b, Blackboard& blackboard,
                                            double& result) {
  Blackboard::Entry* entry = nullptr;
  if (step.right == NumberStep::Source::kEntry && !read_number(blackboard, step.right_name, entry, b)) return false;
  if (step.left != NumberStep::Source::kEntry) {
    result = applied(step.op, a, b);
    return true;
  }
  if (!read_number(blackboard, step.left_name, entry, a)) return false;
  result = applied(step.op, a, b);
  return !is_assignment(step.op) || assign(blackboard, *entry, result);
}

}  // namespace detail

/// `run_numbers` for more than one step.
[[nodiscard]] bool run_more_numbers(const NumberStep* step, std::uint32_t count, Blackboard& blackboard,
                                    double& result);

/// @param step    The first of `count` steps, at least one, whose names are cells.
/// @param result  What the script gives, as a number.
/// @returns False where an entry is not linked yet or holds no number: nothing has happened then, and `run_script`
///          knows what to do or to say.
[[nodiscard, gnu::always_inline]] inline bool run_numbers(const NumberStep* step, std::uint32_t count,
                                                          Blackboard& blackboard, double& result) {
  if (count != 1) return run_more_numbers(step, count, blackboard, result);
  return detail::run_step(*step, step->left_number, step->right_number, blackboard, result);
}

}  // namespace sentree::bt
