#include "sentree/bt/script_needs.h"

#include <map>
#include <optional>

// Read off the instructions, as `script_types.cpp` does it: jumps go forward only, so one pass is enough.

namespace sentree::bt {

namespace {

/// A value on the stack: what it is, or of whom it comes.
struct Operand {
  std::optional<Wanted> is;
  std::uint32_t name = kNobody;

  static constexpr std::uint32_t kNobody = 0xFFFFFFFFU;
  friend bool operator==(const Operand&, const Operand&) = default;
};

class NeedsWalk {
 public:
  using Op = Instruction::Op;

  NeedsWalk(const Script& script, const std::function<bool(std::string_view)>& is_number)
      : script_(script), is_number_(is_number) {}

  ScriptNeeds run(bool is_condition) {
    std::map<std::size_t, std::vector<Operand>> pending;
    bool alive = true;
    const auto arrive = [&](std::size_t pc) {
      const auto join = pending.find(pc);
      if (join == pending.end()) return;
      if (!alive) stack_ = join->second;
      for (std::size_t i = 0; i < stack_.size() && i < join->second.size(); ++i) {
        if (!(stack_[i] == join->second[i])) stack_[i] = {};
      }
      alive = true;
    };
    for (std::size_t pc = 0; pc < script_.code.size(); ++pc) {
      arrive(pc);
      if (!alive) continue;
      const Instruction in = script_.code[pc];
      switch (in.op) {
        case Op::kJump:
          pending.emplace(in.arg, stack_);
          alive = false;
          break;
        case Op::kJumpIfFalse:
          want(pop(), Wanted::kTruth);
          pending.emplace(in.arg, stack_);
          break;
        case Op::kPop: pop(); break;
        default: step(in); break;
      }
    }
    arrive(script_.code.size());
    if (is_condition && !stack_.empty()) want(stack_.back(), Wanted::kTruth);
    return std::move(found_);
  }

 private:
  Operand pop() {
    if (stack_.empty()) return {};
    const Operand top = stack_.back();
    stack_.pop_back();
    return top;
  }
  void want(const Operand& operand, Wanted what) {
    if (operand.name != Operand::kNobody) found_.needs.emplace_back(operand.name, what);
  }
  /// Two that meet where both must be of one type.
  void meet(const Operand& left, const Operand& right) {
    if (left.name != Operand::kNobody && right.name != Operand::kNobody)
      found_.alike.emplace_back(left.name, right.name);
    if (right.is) want(left, *right.is);
    if (left.is) want(right, *left.is);
  }

  void step(const Instruction& in) {
    switch (in.op) {
      case Op::kNumber:
      case Op::kInteger: stack_.push_back({Wanted::kNumber}); return;
      case Op::kString:
        stack_.push_back(is_number_(script_.strings[in.arg]) ? Operand() : Operand{Wanted::kText});
        return;
      case Op::kLoad: stack_.push_back({std::nullopt, in.arg}); return;
      case Op::kCreate:
      case Op::kAssign:
      case Op::kAddAssign: {
        const Operand held{std::nullopt, in.arg};
        meet(held, pop());
        stack_.push_back(held);
        return;
      }
      case Op::kSubtractAssign:
      case Op::kMultiplyAssign:
      case Op::kDivideAssign:
        want(pop(), Wanted::kNumber);
        want({std::nullopt, in.arg}, Wanted::kNumber);
        stack_.push_back({Wanted::kNumber});
        return;
      case Op::kNot:
        want(pop(), Wanted::kTruth);
        stack_.push_back({Wanted::kTruth});
        return;
      case Op::kNegate:
      case Op::kBitNot:
        want(pop(), Wanted::kNumber);
        stack_.push_back({Wanted::kNumber});
        return;
      default: break;
    }
    const Operand right = pop();
    const Operand left = pop();
    switch (in.op) {
      case Op::kConcat: stack_.push_back({Wanted::kText}); return;
      case Op::kLogicAnd:
      case Op::kLogicOr:
        want(left, Wanted::kTruth);
        want(right, Wanted::kTruth);
        stack_.push_back({Wanted::kTruth});
        return;
      case Op::kAdd: {
        meet(left, right);
        stack_.push_back(left.is ? left : right.is ? right : left.name != Operand::kNobody ? left : right);
        return;
      }
      case Op::kEqual:
      case Op::kNotEqual:
      case Op::kLess:
      case Op::kLessEqual:
      case Op::kGreater:
      case Op::kGreaterEqual:
        meet(left, right);
        // Part of a chain: what is compared next is the right operand.
        stack_.push_back(in.arg == 0 ? Operand{Wanted::kTruth} : right);
        return;
      default:
        want(left, Wanted::kNumber);
        want(right, Wanted::kNumber);
        stack_.push_back({Wanted::kNumber});
        return;
    }
  }

  const Script& script_;
  const std::function<bool(std::string_view)>& is_number_;
  std::vector<Operand> stack_;
  ScriptNeeds found_;
};

}  // namespace

ScriptNeeds needs_of(const Script& script, bool is_condition, const std::function<bool(std::string_view)>& is_number) {
  return NeedsWalk(script, is_number).run(is_condition);
}

}  // namespace sentree::bt
