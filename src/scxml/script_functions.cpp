#include "sentree/scxml/script_functions.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <set>
#include <utility>

#include "sentree/scxml/script_syntax.h"

namespace sentree::scxml {
namespace {

using LossReason = ScriptFunctions::Reason;
constexpr int kPartMax = 10'000;       // tokens and brackets of a statement that is looked into
constexpr std::size_t kNamesMax = 64;  // that one name is made of, one after the other
constexpr std::size_t kNowhere = static_cast<std::size_t>(-1);

template <std::size_t N>
bool is_one_of(std::string_view word, const std::array<std::string_view, N>& words) {
  return std::find(words.begin(), words.end(), word) != words.end();
}

bool is_assigning(std::string_view sign) {
  constexpr std::array<std::string_view, 12> kSigns{
      "=", "+=", "-=", "*=", "/=", "%=", "&=", "<<=", ">>=", ">>>=", "|=", "^="};
  return is_one_of(sign, kSigns);
}

bool is_step(std::string_view sign) { return sign == "++" || sign == "--"; }

// What takes a number, a text or a truth of both sides, so that an object beside it gets no further.
bool takes_primitives(std::string_view sign) {
  constexpr std::array<std::string_view, 21> kSigns{"+",   "-",   "*", "/", "%", "<",  ">",  "<=",  ">=", "==", "!=",
                                                    "===", "!==", "&", "|", "^", "<<", ">>", ">>>", "!",  "~"};
  return is_one_of(sign, kSigns) || sign == "typeof";
}

// Methods that change nothing and give no part of what they are called of.
bool is_harmless_method(std::string_view name) {
  constexpr std::array<std::string_view, 13> kMethods{
      "indexOf",        "lastIndexOf", "join",      "charAt",      "charCodeAt",  "toFixed", "toString",
      "hasOwnProperty", "substr",      "substring", "toUpperCase", "toLowerCase", "call"};
  return is_one_of(name, kMethods);
}

// One that is the same whenever scripts are executed.
bool is_steady_global(std::string_view name) {
  constexpr std::array<std::string_view, 9> kOthers{"Date", "In", "_event",     "_sessionid", "_ioprocessors",
                                                    "this", "_x", "globalThis", "performance"};
  return is_script_global(name) && !is_one_of(name, kOthers);
}

/// What a variable of a function begins with.
enum class VariableBegin : unsigned char {
  kOther,
  kPrimitive,
  kFlat,      // a list or a record of primitives
  kFunction,  // declared
};

struct FunctionText {
  std::size_t outer = kNowhere;  // the function around it; kNowhere: the script
  std::size_t close = 0;         // "}" of its body
  std::map<std::string_view, VariableBegin> own;
};

struct GlobalBinding {
  std::size_t script = 0;
  std::size_t at = 0;  // of the name
  std::size_t begin = 0;
  std::size_t end = 0;       // of what is bound
  bool top = false;          // outside of brackets and conditions
  bool is_function = false;  // one that is written there
};

/// A script as functions inside each other.
class ScriptText {
 public:
  ScriptText(std::size_t index, std::string_view source) : index_(index), source_(source) {
    if (auto read = script_tokens(source)) {
      tokens_ = *std::move(read);
      if (match_brackets()) {
        find_functions();
        if (!unread_) declare();
      }
    } else {
      refuse(0, "cannot be followed");
    }
  }

  [[nodiscard]] const std::optional<LossReason>& unread() const { return unread_; }
  [[nodiscard]] const std::vector<FunctionText>& functions() const { return functions_; }
  [[nodiscard]] std::size_t size() const { return tokens_.size(); }
  [[nodiscard]] std::string_view raw(std::size_t at) const {
    return at < tokens_.size() ? tokens_[at].raw : std::string_view();
  }
  [[nodiscard]] std::string_view before(std::size_t at) const { return at == 0 ? std::string_view() : raw(at - 1); }
  /// The innermost function whose body has it.
  [[nodiscard]] std::size_t function_of(std::size_t at) const { return inside_[at]; }
  [[nodiscard]] int depth(std::size_t at) const {
    int depth = 0;
    for (std::size_t f = inside_[at]; f != kNowhere; f = functions_[f].outer) ++depth;
    return depth;
  }
  [[nodiscard]] std::size_t match(std::size_t at) const { return match_[at]; }
  /// A variable that is named there, and no member, no key and no word of the language.
  [[nodiscard]] bool is_variable(std::size_t at) const {
    if (tokens_[at].kind != ScriptToken::Kind::kName || is_reserved_word(raw(at)) || before(at) == ".") return false;
    return !(raw(at + 1) == ":" && (before(at) == "{" || before(at) == ","));
  }
  /// The function around that token that declares the name; kNowhere: none does.
  [[nodiscard]] std::size_t owner(std::size_t at, std::string_view name) const {
    std::size_t f = inside_[at];
    while (f != kNowhere && functions_[f].own.count(name) == 0) f = functions_[f].outer;
    return f;
  }
  [[nodiscard]] LossReason reason(std::size_t at, std::string what) const {
    const std::size_t offset = at < tokens_.size() ? static_cast<std::size_t>(raw(at).data() - source_.data()) : 0;
    return {std::move(what), index_,
            static_cast<int>(std::count(source_.begin(), source_.begin() + static_cast<std::ptrdiff_t>(offset), '\n'))};
  }
  [[nodiscard]] const std::vector<std::pair<std::string_view, GlobalBinding>>& bindings() const { return bindings_; }

  /// What an inner function may change of one around it.
  [[nodiscard]] std::optional<LossReason> captured_change() const {
    for (std::size_t at = 0; at < tokens_.size(); ++at) {
      if (!is_variable(at) || inside_[at] == kNowhere) continue;
      const std::size_t owner = this->owner(at, raw(at));
      if (owner == kNowhere || owner == inside_[at]) continue;
      if (may_change(at, functions_[owner].own.at(raw(at))))
        return reason(at, fmt::format("may keep \"{}\" from call to call", raw(at)));
    }
    return std::nullopt;
  }

 private:
  void refuse(std::size_t at, std::string what) {
    if (!unread_) unread_ = reason(at, std::move(what));
  }

  bool match_brackets() {
    match_.assign(tokens_.size(), kNowhere);
    around_.assign(tokens_.size(), kNowhere);
    std::vector<std::size_t> open;
    for (std::size_t at = 0; at < tokens_.size(); ++at) {
      if (!open.empty()) around_[at] = open.back();
      const std::string_view sign = tokens_[at].kind == ScriptToken::Kind::kSign ? raw(at) : std::string_view();
      if (sign == "(" || sign == "[" || sign == "{") {
        open.push_back(at);
      } else if (sign == ")" || sign == "]" || sign == "}") {
        const std::string_view wanted = sign == ")" ? "(" : sign == "]" ? "[" : "{";
        if (open.empty() || raw(open.back()) != wanted) return refuse(at, "cannot be followed"), false;
        match_[at] = open.back();
        match_[open.back()] = at;
        open.pop_back();
      }
    }
    if (!open.empty()) refuse(open.back(), "cannot be followed");
    return open.empty();
  }

  [[nodiscard]] bool ends_operand(std::size_t at) const {
    const std::string_view word = raw(at);
    if (tokens_[at].kind == ScriptToken::Kind::kSign) return word == ")" || word == "]" || word == "}";
    return tokens_[at].kind == ScriptToken::Kind::kLiteral || !is_reserved_word(word) || word == "true" ||
           word == "false" || word == "null" || word == "this";
  }
  // Behind an operand a word that is no operator begins another statement.
  [[nodiscard]] bool begins_by_line(std::size_t at) const {
    if (at == 0 || tokens_[at].kind == ScriptToken::Kind::kSign || raw(at) == "in" || raw(at) == "instanceof")
      return false;
    constexpr std::array<std::string_view, 3> kHeads{"if", "for", "while"};
    if (before(at) == ")" && is_one_of(before(match_[at - 1]), kHeads)) return false;
    return ends_operand(at - 1);
  }
  [[nodiscard]] bool begins_statement(std::size_t at) const {
    return at == 0 || before(at) == ";" || before(at) == "{" || before(at) == "}" || begins_by_line(at);
  }
  // Where a part of a list of declarations, or a statement, ends.
  [[nodiscard]] std::size_t end_of_part(std::size_t at) const {
    const std::size_t begin = at;
    for (int steps = 0; at < tokens_.size() && steps < kPartMax; ++at, ++steps) {
      if (at > begin && begins_by_line(at)) return at;
      const std::string_view sign = tokens_[at].kind == ScriptToken::Kind::kSign ? raw(at) : std::string_view();
      if (sign == "," || sign == ";" || sign == ")" || sign == "]" || sign == "}") return at;
      if (match_[at] != kNowhere) at = match_[at];
      // `function name (…) {…}` is one operand.
      if (raw(at) == "function") at = end_of_function(at) - 1;
    }
    return at;
  }
  [[nodiscard]] std::size_t end_of_function(std::size_t at) const {
    const std::size_t open = raw(at + 1) == "(" ? at + 1 : at + 2;
    return open < tokens_.size() && match_[open] != kNowhere && match_[open] + 1 < tokens_.size() &&
                   match_[match_[open] + 1] != kNowhere
               ? match_[match_[open] + 1] + 1
               : at + 1;
  }

  void find_functions() {
    inside_.assign(tokens_.size(), kNowhere);
    for (std::size_t at = 0; at < tokens_.size() && !unread_; ++at) {
      const std::string_view word = raw(at);
      if (before(at) == ".") continue;
      constexpr std::array<std::string_view, 6> kUnread{"eval", "Function", "with", "class", "globalThis", "let"};
      if ((tokens_[at].kind == ScriptToken::Kind::kName && is_one_of(word, kUnread)) ||
          (word == "=" && raw(at + 1) == ">"))
        refuse(at, fmt::format("cannot be told: \"{}\" is not looked into", word));
      if (word == "{" && before(at) == ")") check_block(at);
      if (word == "function") enter(at);
    }
  }

  // Methods and accessors of records have a body too.
  void check_block(std::size_t at) {
    constexpr std::array<std::string_view, 5> kBefore{"if", "for", "while", "switch", "catch"};
    const std::size_t open = match_[at - 1];
    if (is_one_of(before(open), kBefore) || before(open) == "function") return;
    if (open >= 2 && raw(open - 2) == "function") return;
    refuse(at, "cannot be told: methods of that form are not looked into");
  }

  void enter(std::size_t at) {
    const bool named = raw(at + 1) != "(";
    const std::size_t open = at + (named ? 2 : 1);
    if (raw(open) != "(" || raw(match_[open] + 1) != "{") return refuse(at, "cannot be followed");
    FunctionText function{inside_[at], match_[match_[open] + 1], {}};
    if (depth(at) >= kScriptNestingMax) return refuse(at, "cannot be told: functions are nested too deep");
    for (std::size_t parameter = open + 1; parameter < match_[open]; ++parameter) {
      if (raw(parameter) != ",") function.own[raw(parameter)] = VariableBegin::kOther;
    }
    function.own["arguments"] = VariableBegin::kOther;
    if (named && begins_statement(at)) {
      if (function.outer != kNowhere) {
        functions_[function.outer].own[raw(at + 1)] = VariableBegin::kFunction;
      } else {
        bindings_.push_back({raw(at + 1), {index_, at + 1, at, function.close + 1, bracket_free(at), true}});
      }
    } else if (named) {
      function.own.emplace(raw(at + 1), VariableBegin::kFunction);
    }
    // What stands between here and the body belongs to it.
    functions_.push_back(std::move(function));
    std::fill(inside_.begin() + static_cast<std::ptrdiff_t>(at) + 1,
              inside_.begin() + static_cast<std::ptrdiff_t>(functions_.back().close) + 1, functions_.size() - 1);
  }

  [[nodiscard]] bool bracket_free(std::size_t at) const { return around_[at] == kNowhere; }

  [[nodiscard]] VariableBegin begin_of(std::size_t begin, std::size_t end) const {
    const auto is_primitive = [this](std::size_t at) {
      return (tokens_[at].kind == ScriptToken::Kind::kLiteral && raw(at)[0] != '/') || raw(at) == "true" ||
             raw(at) == "false" || raw(at) == "null";
    };
    if (begin < end && raw(begin) == "-") ++begin;
    if (begin + 1 == end && is_primitive(begin)) return VariableBegin::kPrimitive;
    if (begin >= end || match_[begin] != end - 1 || raw(begin) == "(") return VariableBegin::kOther;
    for (std::size_t at = begin + 1; at + 1 < end; ++at) {
      if (!is_primitive(at) && raw(at) != "," && raw(at) != "-" && raw(at) != ":" && raw(at + 1) != ":")
        return VariableBegin::kOther;
    }
    return VariableBegin::kFlat;
  }

  void declare() {
    for (std::size_t at = 0; at < tokens_.size(); ++at) {
      const std::string_view word = raw(at);
      if (before(at) == "." && at >= 2 && raw(at - 2) == "this" && raw(at + 1) == "=")
        bind(at, inside_[at] == kNowhere && bracket_free(at) && begins_statement(at - 2));
      if (before(at) == ".") continue;
      if (word == "var" || word == "const") {
        declare_all(at + 1, inside_[at], bracket_free(at) && begins_statement(at));
      } else if (word == "catch" && raw(at + 1) == "(") {
        if (owner(at, raw(at + 2)) != kNowhere) refuse(at, "cannot be told: a name of \"catch\" hides another one");
        if (inside_[at] != kNowhere) functions_[inside_[at]].own.emplace(raw(at + 2), VariableBegin::kOther);
      } else if (is_variable(at) && owner(at, word) == kNowhere &&
                 (is_assigning(raw(at + 1)) || is_written_by_step(at)) && before(at) != "var" &&
                 before(at) != "const" && !declared_.contains(at)) {
        bind(at, inside_[at] == kNowhere && bracket_free(at) && begins_statement(at) && raw(at + 1) == "=");
      }
    }
  }
  [[nodiscard]] bool is_written_by_step(std::size_t at) const {
    return is_step(raw(at + 1)) || is_step(before(at)) || (raw(at + 1) == "in" && before(at) == "(");
  }
  void bind(std::size_t at, bool top) {
    const std::size_t begin = std::min(at + 2, tokens_.size());
    const std::size_t end = end_of_part(begin);
    const bool function = raw(begin) == "function" && end_of_function(begin) == end;
    bindings_.push_back({raw(at), {index_, at, begin, end, top, function}});
  }
  void declare_all(std::size_t at, std::size_t function, bool top) {
    while (at < tokens_.size() && tokens_[at].kind == ScriptToken::Kind::kName) {
      declared_.insert(at);
      const bool has_value = raw(at + 1) == "=";
      const std::size_t end = end_of_part(has_value ? at + 2 : at + 1);
      if (function != kNowhere) {
        const VariableBegin begin = has_value ? begin_of(at + 2, end) : VariableBegin::kOther;
        auto [own, fresh] = functions_[function].own.emplace(raw(at), begin);
        if (!fresh && own->second != begin) own->second = VariableBegin::kOther;
      } else if (has_value) {
        bind(at, top);
      } else if (raw(at + 1) == "in") {
        bindings_.push_back({raw(at), {index_, at, at, at, false, false}});
      }
      if (raw(end) != ",") return;
      at = end + 1;
    }
  }

  // Whether what an inner function does with a variable of one around it may change that, or give away what can be
  // changed.
  [[nodiscard]] bool may_change(std::size_t at, VariableBegin begin) const {
    const std::string_view left = before(at);
    if (is_assigning(raw(at + 1)) || is_written_by_step(at) || left == "delete") return true;
    if (begin == VariableBegin::kPrimitive) return false;
    std::size_t end = at + 1;  // behind the members that are read of it
    int members = 0;
    std::string_view last;
    while (raw(end) == "." || raw(end) == "[") {
      last = raw(end) == "." ? raw(end + 1) : std::string_view();
      end = raw(end) == "." ? end + 2 : match_[end] + 1;
      ++members;
    }
    const std::string_view right = raw(end);
    if (is_assigning(right) || is_step(right)) return true;
    if (right == "(" && members > 0) return !is_harmless_method(last) || last == "call";
    if (right == "(") return left == "new";
    if (begin == VariableBegin::kFlat && members == 1) return false;
    if (last == "length") return false;
    if (right == "?" || takes_primitives(left) || takes_primitives(right)) return false;
    // An argument of a function of Math.
    const std::size_t open = around_[at];
    return open == kNowhere || raw(open) != "(" || open < 3 || raw(open - 2) != "." || raw(open - 3) != "Math";
  }

  std::size_t index_;
  std::string_view source_;
  std::vector<ScriptToken> tokens_;
  std::vector<std::size_t> match_;   // of brackets
  std::vector<std::size_t> around_;  // the innermost bracket that is open there
  std::vector<std::size_t> inside_;  // the innermost function of each token
  std::vector<FunctionText> functions_;
  std::set<std::size_t> declared_;
  std::vector<std::pair<std::string_view, GlobalBinding>> bindings_;
  std::optional<LossReason> unread_;
};

class Scripts {
 public:
  Scripts(const std::vector<std::string_view>& sources, const std::function<bool(std::string_view)>& is_data)
      : is_data_(is_data) {
    scripts_.reserve(sources.size());
    for (std::size_t i = 0; i < sources.size(); ++i) {
      const ScriptText& script = scripts_.emplace_back(i, sources[i]);
      if (script.unread() && !unread_) unread_ = script.unread();
      if (script.unread()) continue;
      for (const auto& [name, binding] : script.bindings()) bindings_[std::string(name)].push_back(binding);
      if (!changes_) changes_ = script.captured_change();
    }
  }

  ScriptFunctions run(const std::vector<std::string_view>& others) {
    ScriptFunctions functions;
    functions.others = unread_    ? *unread_
                       : changes_ ? *changes_
                                  : LossReason{"is made by what is not looked into", 0, 0};
    for (const auto& [name, bindings] : bindings_) functions.by_name.emplace(name, lost(name, bindings));
    for (const ScriptText& script : scripts_) find_given(script, functions);
    for (const std::string_view other : others) find_given(ScriptText(0, other), functions);
    return functions;
  }

 private:
  std::optional<LossReason> lost(const std::string& name, const std::vector<GlobalBinding>& bindings) {
    if (unread_) return unread_;
    if (std::all_of(bindings.begin(), bindings.end(), [](const GlobalBinding& b) { return b.top && b.is_function; }))
      return std::nullopt;
    if (changes_) return changes_;
    std::set<std::string> open;
    return unsettled(name, open);
  }

  // Why what the scripts bind to that name may depend on data, time or chance.
  std::optional<LossReason> unsettled(const std::string& name, std::set<std::string>& open) {
    if (!open.insert(name).second) return std::nullopt;
    if (open.size() > kNamesMax) return LossReason{"is made of too many others", 0, 0};
    const std::vector<GlobalBinding>& bindings = bindings_.at(name);
    const GlobalBinding& only = bindings.front();
    const ScriptText& script = scripts_[only.script];
    if (bindings.size() > 1 || !only.top) return script.reason(bindings.back().at, "is not always the same function");
    for (std::size_t at = only.begin; at < only.end; ++at) {
      // What is done within functions is done when they are called; here one may be, at once.
      if (script.depth(at) > 1 || !script.is_variable(at) || script.owner(at, script.raw(at)) != kNowhere) continue;
      const std::string word(script.raw(at));
      if (word == name) continue;
      if (word == "Math" && script.raw(at + 1) == "." && script.raw(at + 2) != "random") continue;
      if (word != "Math" && is_steady_global(word) && !is_data_(word)) continue;
      if (is_data_(word) || bindings_.count(word) == 0)
        return script.reason(at, fmt::format("is made of \"{}\", which may be another one later", word));
      if (auto reason = unsettled(word, open)) return reason;
    }
    return std::nullopt;
  }

  // Names with which something else is done than calling them.
  void find_given(const ScriptText& script, ScriptFunctions& functions) const {
    functions.all_given = functions.all_given || script.unread();
    for (std::size_t at = 0; at < script.size() && !functions.all_given; ++at) {
      const std::string_view word = script.raw(at);
      constexpr std::array<std::string_view, 4> kWays{"this", "callee", "constructor", "caller"};
      functions.all_given = is_one_of(word, kWays);
      if (!script.is_variable(at)) continue;
      const std::string_view left = script.before(at);
      if (left == "function" || (script.raw(at + 1) == "(" && left != "new")) continue;
      const std::size_t owner = script.owner(at, word);
      if (owner != kNowhere)  // A function by its own name is one that may be known by another one.
        functions.all_given = functions.all_given || script.functions()[owner].own.at(word) == VariableBegin::kFunction;
      else if (bindings_.count(word) != 0 && !(script.raw(at + 1) == "=" && script.raw(at + 2) == "function"))
        functions.given.emplace(word);
    }
  }

  const std::function<bool(std::string_view)>& is_data_;
  std::vector<ScriptText> scripts_;
  std::map<std::string, std::vector<GlobalBinding>, std::less<>> bindings_;
  std::optional<LossReason> unread_;
  std::optional<LossReason> changes_;
};

}  // namespace

ScriptFunctions look_into_functions(const std::vector<std::string_view>& scripts,
                                    const std::vector<std::string_view>& others,
                                    const std::function<bool(std::string_view)>& is_data) {
  return Scripts(scripts, is_data).run(others);
}

}  // namespace sentree::scxml
