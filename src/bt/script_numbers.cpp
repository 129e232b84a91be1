#include "sentree/bt/script_numbers.h"

#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include "sentree/bt/context.h"

namespace sentree::bt {

namespace {

using Op = Instruction::Op;
using Source = NumberStep::Source;

/// Whole numbers up to here are exact as doubles.
constexpr double kExact = 9'007'199'254'740'992.0;
constexpr std::size_t kDepth = 8;

bool is_assignment(Op op) { return op >= Op::kCreate && op <= Op::kDivideAssign; }
bool is_binary(Op op) {
  return (op >= Op::kAdd && op <= Op::kDivide) || op == Op::kLogicAnd || op == Op::kLogicOr ||
         (op >= Op::kEqual && op <= Op::kGreaterEqual);
}

[[gnu::always_inline]] inline double applied(Op op, double a, double b) {
  constexpr double kEqualWithin = std::numeric_limits<float>::epsilon();
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

/// The entry of a linked cell that holds a number which a double holds too.
[[gnu::always_inline]] inline Blackboard::Entry* number_entry(Blackboard& blackboard, std::uint32_t cell,
                                                              double& number) {
  Blackboard::Entry* const entry = blackboard.find_linked(cell);
  if (entry == nullptr) return nullptr;
  const Value& held = entry->datum.value;
  if (const double* real = held.as_double()) {
    number = *real;
  } else if (const std::int64_t* integer = held.as_int()) {
    number = static_cast<double>(*integer);
    if (!(std::abs(number) < kExact)) return nullptr;
  } else if (const bool* truth = held.as_bool()) {
    number = *truth ? 1.0 : 0.0;
  } else {
    return nullptr;
  }
  return entry;
}

bool assign(Blackboard& blackboard, Blackboard::Entry& entry, double number) {
  Value& held = entry.datum.value;
  if (held.as_double() != nullptr) {
    detail::overwrite(held, number);
  } else {
    // An integer stays one; what does not fit is for the long way to say.
    if (held.as_int() == nullptr || !(std::abs(number) < kExact) || number != std::trunc(number)) return false;
    detail::overwrite(held, static_cast<std::int64_t>(number));
  }
  blackboard.written(entry);
  return true;
}

}  // namespace

std::vector<NumberStep> number_steps(const Script& script) {
  struct Operand {
    Source source;
    std::uint32_t name;
    double number;
  };
  std::vector<NumberStep> steps;
  std::vector<Operand> stack;
  std::size_t on_stack = 0;
  for (std::size_t i = 0; i < script.code.size(); ++i) {
    const Instruction& in = script.code[i];
    const bool is_last = i + 1 == script.code.size();
    const auto operand = [&] {
      const Operand top = stack.back();
      stack.pop_back();
      if (top.source == Source::kStack) --on_stack;
      return top;
    };
    const auto emit = [&](Op op, const Operand& left, const Operand& right) {
      steps.push_back({op, left.source, right.source, left.name, right.name, left.number, right.number});
      stack.push_back({Source::kStack, 0, 0});
      ++on_stack;
    };
    if (in.op == Op::kNumber) {
      stack.push_back({Source::kNumber, 0, script.numbers[in.arg]});
    } else if (in.op == Op::kInteger) {
      const auto number = static_cast<double>(script.integers[in.arg]);
      if (!(std::abs(number) < kExact)) return {};
      stack.push_back({Source::kNumber, 0, number});
    } else if (in.op == Op::kLoad) {
      stack.push_back({Source::kEntry, in.arg, 0});
    } else if (is_assignment(in.op) && is_last) {
      const Operand right = operand();
      emit(in.op, {Source::kEntry, in.arg, 0}, right);
    } else if (is_binary(in.op) && in.arg == 0) {
      const Operand right = operand();
      const Operand left = operand();
      emit(in.op, left, right);
    } else if (in.op == Op::kNegate || in.op == Op::kNot) {
      const Operand right = operand();
      emit(in.op, {Source::kNumber, 0, 0}, right);
    } else {
      return {};
    }
    if (on_stack > kDepth) return {};
  }
  if (steps.empty() && stack.size() == 1) {
    const Operand& one = stack.back();
    steps.push_back({Op::kLoad, Source::kNumber, one.source, 0, one.name, 0, one.number});
  }
  return steps;
}

bool run_numbers(const NumberStep* step, std::uint32_t count, Blackboard& blackboard, double& result) {
  std::array<double, kDepth> stack;
  double* top = stack.data();
  for (const NumberStep* const last = step + count - 1;; ++step) {
    double a = step->left_number;
    double b = step->right_number;
    Blackboard::Entry* entry = nullptr;
    if (step->right == Source::kEntry) {
      if (number_entry(blackboard, step->right_name, b) == nullptr) return false;
    } else if (step->right == Source::kStack) {
      b = *--top;
    }
    if (step->left == Source::kEntry) {
      entry = number_entry(blackboard, step->left_name, a);
      if (entry == nullptr) return false;
    } else if (step->left == Source::kStack) {
      a = *--top;
    }
    const double value = applied(step->op, a, b);
    if (step == last) {
      result = value;
      return !is_assignment(step->op) || assign(blackboard, *entry, value);
    }
    *top++ = value;
  }
}

}  // namespace sentree::bt
