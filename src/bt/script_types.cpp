#include <fmt/format.h>

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "sentree/bt/script.h"

// What a script does, told from the types of its values alone. Jumps go forward only, so one pass is enough.

namespace sentree::bt {

namespace {

using Op = Instruction::Op;
using Type = ScriptType;

/// A value: its type, and the literal that it is, if it is one.
struct Known {
  Type type = Type::kUnknown;
  const std::string* text = nullptr;
};

class Walk {
 public:
  Walk(const Script& script, std::span<const Type> types, const std::function<bool(std::string_view)>* is_number)
      : script_(script), held_(types.begin(), types.end()), is_number_(is_number) {
    assigned_.assign(script.names.size(), Type::kUnknown);
    seen_.assign(script.names.size(), false);
  }

  void run() {
    std::map<std::size_t, std::vector<Known>> pending;
    std::vector<Known> stack;
    bool alive = true;
    for (std::size_t pc = 0; pc < script_.code.size(); ++pc) {
      if (const auto join = pending.find(pc); join != pending.end()) {
        stack = alive ? merged(stack, join->second) : join->second;
        alive = true;
      }
      if (!alive) continue;
      const Instruction in = script_.code[pc];
      const auto jump = [&] {
        const auto [place, fresh] = pending.try_emplace(in.arg, stack);
        if (!fresh) place->second = merged(place->second, stack);
      };
      switch (in.op) {
        case Op::kJump:
          jump();
          alive = false;
          break;
        case Op::kJumpIfFalse:
          stack.pop_back();
          jump();
          break;
        case Op::kPop: stack.pop_back(); break;
        default: value(in, stack, jump); break;
      }
    }
  }

  std::vector<Type> assigned_;
  std::vector<std::string> mistakes_;

 private:
  static std::vector<Known> merged(const std::vector<Known>& a, const std::vector<Known>& b) {
    std::vector<Known> out = a.size() < b.size() ? a : b;
    for (std::size_t i = 0; i < out.size(); ++i) {
      if (a[i].type != b[i].type) out[i] = {};
      if (a[i].text != b[i].text) out[i].text = nullptr;
    }
    return out;
  }

  template <class Jump>
  void value(const Instruction& in, std::vector<Known>& stack, const Jump& jump) {
    switch (in.op) {
      case Op::kNumber:
      case Op::kInteger: stack.push_back({Type::kNumber}); return;
      case Op::kString: stack.push_back({Type::kText, &script_.strings[in.arg]}); return;
      case Op::kLoad: stack.push_back({held_[in.arg]}); return;
      case Op::kCreate:
      case Op::kAssign: assign(in.arg, stack.back()); return;
      case Op::kAddAssign: update(in.arg, stack.back(), true); return;
      case Op::kSubtractAssign:
      case Op::kMultiplyAssign:
      case Op::kDivideAssign: update(in.arg, stack.back(), false); return;
      case Op::kNegate:
      case Op::kBitNot:
      case Op::kNot:
        if (stack.back().type == Type::kText) mistake("'-', '~' and '!' need a number and get text", stack.back());
        stack.back() = {Type::kNumber};
        return;
      default: break;
    }
    const Known right = stack.back();
    stack.pop_back();
    const Known left = stack.back();
    switch (in.op) {
      case Op::kConcat: stack.back() = {Type::kText}; return;
      case Op::kEqual:
      case Op::kNotEqual:
      case Op::kLess:
      case Op::kLessEqual:
      case Op::kGreater:
      case Op::kGreaterEqual:
        compare(left, right);
        stack.back() = {Type::kNumber};
        if (in.arg != 0) {
          jump();
          stack.back() = right;
        }
        return;
      default: break;
    }
    const bool joins = in.op == Op::kAdd && left.type != Type::kNumber && right.type != Type::kNumber;
    if (!joins && (left.type == Type::kText || right.type == Type::kText)) {
      mistake("an arithmetic or logical operator gets text", left.type == Type::kText ? left : right);
    }
    stack.back() = {!joins                                                  ? Type::kNumber
                    : left.type == Type::kText && right.type == Type::kText ? Type::kText
                                                                            : Type::kUnknown};
  }

  void compare(const Known& left, const Known& right) {
    if (left.type == right.type || left.type == Type::kUnknown || right.type == Type::kUnknown) return;
    const Known& text = left.type == Type::kText ? left : right;
    if (text.text != nullptr && is_number_ != nullptr && (*is_number_)(*text.text)) return;
    mistake("text is compared with a number", text);
  }

  void assign(std::uint32_t name, const Known& value) {
    // An entry keeps the type of its first value; text for a number's entry is read as a number.
    const Type type = held_[name] != Type::kUnknown ? held_[name] : value.type;
    if (held_[name] == Type::kNumber && value.text != nullptr && is_number_ != nullptr && !(*is_number_)(*value.text)) {
      mistake(fmt::format("\"{}\" holds a number and cannot take text", script_.names[name].name), value);
    }
    note(name, type);
    held_[name] = type;
  }

  void update(std::uint32_t name, Known& value, bool add) {
    const Type held = held_[name];
    const bool joins = add && held != Type::kNumber && value.type != Type::kNumber;
    if (!joins && value.type == Type::kText) {
      mistake(fmt::format("the right side is text, and \"{}\" is to be changed as a number", script_.names[name].name),
              value);
    }
    if (held == Type::kText && value.type == Type::kNumber) {
      mistake(fmt::format("\"{}\" holds text and is to be changed as a number", script_.names[name].name), {});
    }
    value = {held};
  }

  void note(std::uint32_t name, Type type) {
    assigned_[name] = seen_[name] && assigned_[name] != type ? Type::kUnknown : type;
    seen_[name] = true;
  }

  void mistake(const std::string& what, const Known& text) {
    if (is_number_ == nullptr) return;
    mistakes_.push_back(text.text != nullptr ? fmt::format("{}, '{}'", what, *text.text) : what);
  }

  const Script& script_;
  std::vector<Type> held_;
  const std::function<bool(std::string_view)>* is_number_;
  std::vector<bool> seen_;
};

}  // namespace

std::vector<ScriptType> assigned_types(const Script& script, std::span<const ScriptType> types) {
  Walk walk(script, types, nullptr);
  walk.run();
  return std::move(walk.assigned_);
}

std::vector<std::string> type_mistakes(const Script& script, std::span<const ScriptType> types,
                                       const std::function<bool(std::string_view)>& is_number) {
  Walk walk(script, types, &is_number);
  walk.run();
  return std::move(walk.mistakes_);
}

}  // namespace sentree::bt
