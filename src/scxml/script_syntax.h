#pragma once

#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

namespace sentree::scxml {

/// Nesting of an expression beyond which it is not read.
inline constexpr int kScriptNestingMax = 64;

/// Reserved words of ECMAScript 5.1 and later: none of them is a variable.
[[nodiscard]] bool is_reserved_word(std::string_view name);

/// A part of an expression.
struct ScriptNode {
  enum class Kind : std::uint8_t {
    kNumber,
    kText,
    kTruth,        ///< `number` is 0 or 1.
    kNothing,      ///< null, undefined; `text` is "hole" where a list says nothing between two commas.
    kName,         ///< `text`: an identifier.
    kMember,       ///< Member `text` of operand 0.
    kIndex,        ///< Operand 0 [operand 1].
    kCall,         ///< Operand 0 called with the others; also `new`.
    kList,         ///< [a, b].
    kRecord,       ///< {name: value}; `names` are those of the operands.
    kUnary,        ///< `text` is the operator; ++ and -- too.
    kBinary,       ///< `text` is the operator; && and || and the comma too.
    kConditional,  ///< a ? b : c
    kAssignment,   ///< `text` is the operator.
    kOpaque,       ///< A function or a regular expression: not looked into.
  };
  Kind kind = Kind::kNothing;
  std::string text;
  double number = 0;
  std::vector<std::uint32_t> operands;
  std::vector<std::string> names;
};

/// An expression as a tree.
struct ScriptTree {
  std::vector<ScriptNode> nodes;  ///< Operands before operators; the last is the whole.

  [[nodiscard]] const ScriptNode& at(std::uint32_t node) const { return nodes[node]; }
  [[nodiscard]] std::uint32_t root() const { return static_cast<std::uint32_t>(nodes.size() - 1); }
  /// As it can be shown: "_event.data.result"; of what is no path of members, empty.
  [[nodiscard]] std::string path(std::uint32_t node) const;
};

/// Reads an expression of ECMAScript 5.1, for checks that look at what it names. Nothing: it is none, or too deep, or
/// uses what is not read here (templates, arrows and whatever came later); then it cannot be told what it means.
/// Cost: O(size).
[[nodiscard]] std::optional<ScriptTree> parse_script_expression(std::string_view source);

/// A word, a sign or a literal of a script.
struct ScriptToken {
  enum class Kind : std::uint8_t {
    kName,     ///< A word of the language too.
    kLiteral,  ///< A number, a text, a regular expression.
    kSign,
  };
  Kind kind = Kind::kSign;
  std::string_view raw;  ///< In the source.
};
/// The tokens of a script; nothing: something in it is none. Cost: O(size).
[[nodiscard]] std::optional<std::vector<ScriptToken>> script_tokens(std::string_view source);

/// Every identifier that a script mentions, members and words of the language included; not those in its texts and
/// comments.
[[nodiscard]] std::set<std::string> names_in_script(std::string_view source);

/// The ids that a script asks about by In('ID'): what is between the quotes, as written, in order. `bare`: without
/// quotes too, as the null data model has it.
[[nodiscard]] std::vector<std::string_view> states_asked_for(std::string_view source, bool bare = false);

/// What a name may be in, in a script, without being found by `states_asked_for`: a text, or an `In` that asks for a
/// state by an expression.
struct ScriptMention {
  std::string_view text;  ///< Between the quotes, as written; `In` itself.
  bool is_computed_state = false;
};
/// Every one of a script, in order. `bare` as there.
[[nodiscard]] std::vector<ScriptMention> texts_in_script(std::string_view source, bool bare = false);

/// Whether every heap has a global of that name: `Math`, `parseInt`, …
[[nodiscard]] bool is_script_global(std::string_view name);

}  // namespace sentree::scxml
