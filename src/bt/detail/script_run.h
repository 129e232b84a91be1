#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "sentree/bt/detail/blackboard.h"
#include "sentree/bt/model.h"

namespace sentree::bt {

/// A value on the stack of a running script. Strings are in the scratch of the run, or constants of the script.
struct ScriptValue {
  enum class Tag : std::uint8_t { kEmpty, kInteger, kReal, kString, kOther };
  Tag tag = Tag::kEmpty;
  union {
    std::int64_t integer;
    double real;
    const std::string* string;
  };
  ScriptValue() : integer(0) {}
  static ScriptValue of(double v) {
    ScriptValue s;
    s.tag = Tag::kReal;
    s.real = v;
    return s;
  }
  static ScriptValue of(std::int64_t v) {
    ScriptValue s;
    s.tag = Tag::kInteger;
    s.integer = v;
    return s;
  }
  static ScriptValue of(const std::string* v) {
    ScriptValue s;
    s.tag = Tag::kString;
    s.string = v;
    return s;
  }
  [[nodiscard]] bool is_number() const { return tag == Tag::kInteger || tag == Tag::kReal; }
  [[nodiscard]] double number() const { return tag == Tag::kInteger ? static_cast<double>(integer) : real; }
};

/// Runs a compiled script on a blackboard. Integers and doubles are told apart; arithmetic gives doubles;
/// '&&' and '||' evaluate both sides; '?:' and chains of comparisons do not (BehaviorTree.CPP 4).
///
/// @param cells  One cell per name of the script.
/// @returns False, with `error` set, where a name has no entry, an operator does not fit its operands, or an entry
///          cannot take a value. Entries written before stay written.
/// The result's string lives until the next run on this thread.
[[nodiscard]] bool run_script(const Model& model, Blackboard& blackboard, const Script& script,
                              const std::uint32_t* cells, ScriptValue& result, std::string& error);

/// A text of a script that ends before its result is looked at: one that lives as long as those made during a run.
[[nodiscard]] ScriptValue keep_text(std::string_view text);

/// The result as a condition. False, with `error` set, if it has no truth value.
[[nodiscard]] bool truth(const ScriptValue& value, bool& result, std::string& error);

}  // namespace sentree::bt
