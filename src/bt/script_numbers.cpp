#include "sentree/bt/detail/script_numbers.h"

#include <array>
#include <cmath>
#include <optional>

#include "sentree/bt/context.h"

namespace sentree::bt {

namespace {

using Op = Instruction::Op;
using Source = NumberStep::Source;

constexpr std::size_t kDepth = 8;

bool is_binary(Op op) {
  return (op >= Op::kAdd && op <= Op::kDivide) || op == Op::kLogicAnd || op == Op::kLogicOr ||
         (op >= Op::kEqual && op <= Op::kGreaterEqual);
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
      if (!(std::abs(number) < detail::kExact)) return {};
      stack.push_back({Source::kNumber, 0, number});
    } else if (in.op == Op::kLoad) {
      stack.push_back({Source::kEntry, in.arg, 0});
    } else if (detail::is_assignment(in.op) && is_last) {
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

bool run_more_numbers(const NumberStep* step, std::uint32_t count, Blackboard& blackboard, double& result) {
  std::array<double, kDepth> stack;
  double* top = stack.data();
  for (const NumberStep* const last = step + count - 1;; ++step) {
    double a = step->left_number;
    double b = step->right_number;
    if (step->right == Source::kStack) b = *--top;
    if (step->left == Source::kStack) a = *--top;
    if (!detail::run_step(*step, a, b, blackboard, result)) return false;
    if (step == last) return true;
    *top++ = result;
  }
}

}  // namespace sentree::bt
