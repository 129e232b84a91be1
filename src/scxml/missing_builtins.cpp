#include "sentree/scxml/detail/missing_builtins.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <set>

#include "sentree/scxml/script_syntax.h"

namespace sentree::scxml {

namespace {

using Token = ScriptToken;
using Tokens = std::vector<Token>;

constexpr std::string_view kOfAny;  // a method, whatever it is called on
constexpr std::string_view kOfLists = "[]";
constexpr std::string_view kGlobal = "global";

struct Builtin {
  std::string_view owner;
  std::string_view name;
  std::string_view instead;
};

// Of what Duktape 2.7 lacks, that which has a counterpart.
constexpr std::array<Builtin, 34> kMissing{{
    {kOfLists, "includes", "xs.indexOf(x) >= 0"},
    {kOfAny, "find", "xs.filter(f)[0]"},
    {kOfAny, "findIndex", "xs.map(f).indexOf(true)"},
    {kOfAny, "findLast", "xs.filter(f).pop()"},
    {kOfAny, "findLastIndex", "xs.map(f).lastIndexOf(true)"},
    {kOfAny, "fill", "a loop"},
    {kOfAny, "flat", "[].concat.apply([], xs)"},
    {kOfAny, "flatMap", "[].concat.apply([], xs.map(f))"},
    {kOfAny, "at", "xs[i], and xs[xs.length - 1] for the last"},
    {kOfAny, "padStart", "('00' + s).slice(-2)"},
    {kOfAny, "padEnd", "(s + '  ').slice(0, 2)"},
    {kOfAny, "trimStart", "s.replace(/^\\s+/, '')"},
    {kOfAny, "trimEnd", "s.replace(/\\s+$/, '')"},
    {kOfAny, "replaceAll", "s.split(a).join(b)"},
    {kOfAny, "matchAll", "a loop with exec() of a regular expression"},
    {"Object", "values", "Object.keys(o).map(function (k) { return o[k]; })"},
    {"Object", "entries", "Object.keys(o).map(function (k) { return [k, o[k]]; })"},
    {"Object", "fromEntries", "a loop"},
    {"Array", "from", "xs.slice() for a copy, a loop for anything else"},
    {"Array", "of", "[a, b]"},
    {"Math", "log1p", "Math.log(1 + x)"},
    {"Math", "expm1", "Math.exp(x) - 1"},
    {"Math", "sinh", "(Math.exp(x) - Math.exp(-x)) / 2"},
    {"Math", "cosh", "(Math.exp(x) + Math.exp(-x)) / 2"},
    {"Math", "tanh", "1 - 2 / (Math.exp(2 * x) + 1)"},
    {kGlobal, "Map", "an object: o[key]"},
    {kGlobal, "WeakMap", "an object: o[key]"},
    {kGlobal, "Set", "a list, and xs.indexOf(x) >= 0"},
    {kGlobal, "WeakSet", "a list, and xs.indexOf(x) >= 0"},
    {kGlobal, "Promise", "<send> with a delay, and a transition for what comes later"},
    {kGlobal, "BigInt", "a number"},
    {kGlobal, "structuredClone", "JSON.parse(JSON.stringify(x))"},
    {kGlobal, "queueMicrotask", "<raise>"},
    {kGlobal, "setImmediate", "<raise>"},
}};

bool is_static(const Builtin& builtin) {
  return builtin.owner != kOfAny && builtin.owner != kOfLists && builtin.owner != kGlobal;
}

std::string as_it_is_called(const Builtin& builtin) {
  if (builtin.owner == kGlobal) return std::string(builtin.name);
  if (is_static(builtin)) return fmt::format("{}.{}", builtin.owner, builtin.name);
  return fmt::format("{}(){}", builtin.name, builtin.owner == kOfLists ? " of lists" : "");
}

std::string_view raw(const Tokens& tokens, std::size_t at) {
  return at < tokens.size() ? tokens[at].raw : std::string_view();
}

// Whether a name is used as if it were there: called, constructed, or asked for a member.
bool is_use(const Tokens& tokens, std::size_t at) {
  const std::string_view before = raw(tokens, at - 1);
  const std::string_view after = raw(tokens, at + 1);
  return before == "new" || (after == "(" && before != "function") || (after == "." && before != ".");
}

// Where the bracket opens that closes at `at`; none: npos.
std::size_t opening(const Tokens& tokens, std::size_t at) {
  int open = 0;
  for (std::size_t i = at + 1; i-- > 0;) {
    const std::string_view sign = tokens[i].raw;
    if (tokens[i].kind != Token::Kind::kSign) continue;
    if (sign == ")" || sign == "]" || sign == "}") ++open;
    if (sign == "(" || sign == "[" || sign == "{") --open;
    if (open == 0) return i;
  }
  return std::string_view::npos;
}

class Finder {
 public:
  explicit Finder(const Model& model) : model_(model) {}

  std::vector<MissingBuiltin> run() {
    tokens_.reserve(model_.expressions.size());
    for (const Expression& expression : model_.expressions) {
      auto tokens = script_tokens(expression.text);
      if (!tokens) return {};  // what it defines cannot be told
      tokens_.push_back(*std::move(tokens));
    }
    for (const Variable& variable : model_.variables) own_.insert(variable.id);
    for (ExpressionId id = 0; id < tokens_.size(); ++id) {
      note_own(tokens_[id]);
      const ExpressionUse use = model_.expressions[id].use;
      if (use == ExpressionUse::kLocation || use == ExpressionUse::kItem) assigned_.insert(raw(tokens_[id], 0));
    }
    std::vector<MissingBuiltin> found;
    for (ExpressionId id = 0; id < tokens_.size(); ++id) {
      std::set<std::string_view> told;
      for (std::size_t i = 0; i < tokens_[id].size(); ++i) {
        const Builtin* const missing = missing_at(tokens_[id], i);
        if (missing == nullptr || !told.insert(missing->name).second) continue;
        found.push_back({id, tokens_[id][i].raw,
                         fmt::format("scripts are ECMAScript 5.1, without {}: write {}", as_it_is_called(*missing),
                                     missing->instead)});
      }
    }
    return found;
  }

 private:
  void note_own(const Tokens& tokens) {
    for (std::size_t i = 0; i < tokens.size(); ++i) {
      const std::string_view text = tokens[i].raw;
      if (tokens[i].kind == Token::Kind::kLiteral && text.size() > 2)
        own_.insert(text.substr(1, text.size() - 2));
      else if (tokens[i].kind == Token::Kind::kName && !is_use(tokens, i))
        (is_of_builtin(tokens, i) ? asked_for_ : own_).insert(text);
      if (raw(tokens, i + 1) == "=" || raw(tokens, i + 1) == "+=") assigned_.insert(text);
    }
  }

  static bool is_of_builtin(const Tokens& tokens, std::size_t at) {
    return raw(tokens, at - 1) == "." && raw(tokens, at - 3) != "." &&
           std::any_of(kMissing.begin(), kMissing.end(), [&](const Builtin& builtin) {
             return is_static(builtin) && builtin.owner == raw(tokens, at - 2);
           });
  }

  [[nodiscard]] const Builtin* missing_at(const Tokens& tokens, std::size_t at) const {
    if (tokens[at].kind != Token::Kind::kName || !is_use(tokens, at)) return nullptr;
    const bool is_member = raw(tokens, at - 1) == ".";
    const bool is_of_it = is_of_builtin(tokens, at);
    if ((is_of_it ? asked_for_ : own_).contains(tokens[at].raw)) return nullptr;
    const auto found = std::find_if(kMissing.begin(), kMissing.end(), [&](const Builtin& builtin) {
      if (builtin.name != tokens[at].raw || is_member == (builtin.owner == kGlobal)) return false;
      if (builtin.owner == kOfLists) return is_list(tokens, at - 2);
      return is_static(builtin) == is_of_it && (!is_of_it || raw(tokens, at - 2) == builtin.owner);
    });
    return found == kMissing.end() ? nullptr : &*found;
  }

  // Whether the operand that ends at `at` is certain to be a list.
  [[nodiscard]] bool is_list(const Tokens& tokens, std::size_t at) const {
    if (raw(tokens, at) == "]") {
      const std::size_t open = opening(tokens, at);
      const std::string_view before = raw(tokens, open - 1);
      const bool is_operand = open > 0 && (before == ")" || before == "]" || before == "}" ||
                                           (tokens[open - 1].kind != Token::Kind::kSign && !is_reserved_word(before)));
      return open != std::string_view::npos && !is_operand;
    }
    if (raw(tokens, at) == ")") {
      const std::size_t open = opening(tokens, at);
      constexpr std::array<std::string_view, 4> kGiveLists{"keys", "split", "map", "filter"};
      return open != std::string_view::npos && open > 1 && raw(tokens, open - 2) == "." &&
             std::find(kGiveLists.begin(), kGiveLists.end(), raw(tokens, open - 1)) != kGiveLists.end();
    }
    if (raw(tokens, at - 1) == "." || assigned_.contains(raw(tokens, at))) return false;
    return std::any_of(model_.variables.begin(), model_.variables.end(), [&](const Variable& variable) {
      if (variable.id != raw(tokens, at)) return false;
      if (variable.expr == kNoExpression) return variable.content && variable.content->as_list() != nullptr;
      const Tokens& made = tokens_[variable.expr];
      return raw(made, made.size() - 1) == "]" && opening(made, made.size() - 1) == 0;
    });
  }

  const Model& model_;
  std::vector<Tokens> tokens_;            // by expression
  std::set<std::string_view> own_;        // names that the chart may have given a meaning
  std::set<std::string_view> asked_for_;  // members of built-ins that it does not just use
  std::set<std::string_view> assigned_;   // names that are written after they were made
};

}  // namespace

std::vector<MissingBuiltin> missing_builtins(const Model& model) { return Finder(model).run(); }

}  // namespace sentree::scxml
