#include "sentree/monitor/detail/requirement_parser.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace sentree::monitor {

namespace {

using Kind = Condition::Kind;
using TokenKind = RequirementToken::Kind;
using Role = RequirementPart::Role;

const std::vector<std::string>& keywords() {
  static const std::vector<std::string> kWords{
      "after",    "always", "and",     "assuming",    "at",       "before",      "between", "by",
      "error",    "event",  "events",  "eventually",  "falls",    "false",       "for",     "from",
      "globally", "holds",  "implies", "immediately", "in",       "keep",        "late",    "least",
      "let",      "most",   "never",   "node",        "not",      "observation", "or",      "per",
      "precedes", "reply",  "request", "rises",       "shall",    "then",        "ticks",   "times",
      "true",     "until",  "updated", "where",       "whenever", "while",       "within"};
  return kWords;
}

// "at", "every", "once" and "least" are words of the language only where it expects them.
bool is_reserved(std::string_view name) {
  if (name == "at") return false;
  return std::find(keywords().begin(), keywords().end(), name) != keywords().end();
}

// Words that begin a condition only before "(", and one that members of observations are called too.
bool is_also_a_name(std::string_view name) {
  constexpr std::array<std::string_view, 8> kNames{"error", "event",       "from",  "late",
                                                   "node",  "observation", "reply", "request"};
  return std::find(kNames.begin(), kNames.end(), name) != kNames.end();
}

bool compares(const RequirementToken& token) {
  constexpr std::array<std::string_view, 6> kSigns{"=", "!=", "<", "<=", ">", ">="};
  return token.kind == TokenKind::kSymbol && std::find(kSigns.begin(), kSigns.end(), token.text) != kSigns.end();
}

// To the word that is meant by one that is none of the language. Short English words are near to many.
std::string to_word(std::string_view word) {
  using Word = std::pair<std::string_view, std::string_view>;
  constexpr std::array<Word, 7> kMeant{{{"if", "whenever"},
                                        {"when", "whenever"},
                                        {"must", "shall"},
                                        {"should", "shall"},
                                        {"will", "shall"},
                                        {"equals", "="},
                                        {"during", "while"}}};
  constexpr std::array<std::string_view, 13> kCommon{"the", "a",  "an", "is",   "are",  "be",  "of",
                                                     "it",  "to", "on", "this", "that", "than"};
  const auto meant = std::find_if(kMeant.begin(), kMeant.end(), [&](const Word& one) { return one.first == word; });
  if (meant != kMeant.end()) return fmt::format("; write \"{}\"", meant->second);
  if (std::find(kCommon.begin(), kCommon.end(), word) != kCommon.end()) return "";
  return did_you_mean(word, keywords());
}

std::string shown(const RequirementToken& token) {
  if (token.kind == TokenKind::kEnd) return "the end of the file";
  if (token.kind == TokenKind::kStop) return "\".\"";
  return fmt::format("\"{}\"", token.text);
}

}  // namespace

const RequirementToken& RequirementParser::peek(std::size_t ahead) const {
  return tokens_[std::min(at_ + ahead, tokens_.size() - 1)];
}

const RequirementToken& RequirementParser::take() {
  const Token& token = peek();
  if (at_ + 1 < tokens_.size()) ++at_;
  return token;
}

bool RequirementParser::is_word(std::string_view word) const {
  return peek().kind == TokenKind::kName && peek().text == word;
}
bool RequirementParser::is_symbol(std::string_view symbol) const {
  return peek().kind == TokenKind::kSymbol && peek().text == symbol;
}
bool RequirementParser::accept_word(std::string_view word) {
  if (failed_ || !is_word(word)) return false;
  take();
  return true;
}
bool RequirementParser::accept_symbol(std::string_view symbol) {
  if (failed_ || !is_symbol(symbol)) return false;
  take();
  return true;
}

void RequirementParser::error_at(const SourceSpan& span, std::string code, std::string message) {
  if (!failed_) diagnostics_.push_back({Severity::kError, std::move(code), std::move(message), span});
  failed_ = true;
}
void RequirementParser::error(std::string message) { error_at(peek().span, "requirement.syntax", std::move(message)); }

void RequirementParser::expect_word(std::string_view word) {
  if (accept_word(word) || failed_) return;
  const std::vector<std::string> wanted{std::string(word)};
  const std::string hint = peek().kind == TokenKind::kName ? did_you_mean(peek().text, wanted) : "";
  error(fmt::format("expected \"{}\", got {}{}", word, shown(peek()), hint));
}
void RequirementParser::expect_symbol(std::string_view symbol, std::string_view what) {
  if (accept_symbol(symbol) || failed_) return;
  error(fmt::format("expected \"{}\" {}, got {}", symbol, what, shown(peek())));
}
std::string RequirementParser::expect_name(std::string_view what) {
  if (failed_) return {};
  if (peek().kind != TokenKind::kName && peek().kind != TokenKind::kString) {
    error(fmt::format("expected {}, got {}", what, shown(peek())));
    return {};
  }
  return take().text;
}

// To the word that is meant here.
std::string RequirementParser::word_hint() const {
  if (peek().kind != TokenKind::kName) return "";
  if (peek().text != "is") return to_word(peek().text);
  const bool is_bound = peek(1).text == "at" && (peek(2).text == "most" || peek(2).text == "least");
  return fmt::format("; write \"{}\"", !is_bound ? "=" : peek(2).text == "most" ? "<=" : ">=");
}

// ---- Statements ----

void RequirementParser::run(RequirementFile& file) {
  while (peek().kind != TokenKind::kEnd) {
    failed_ = false;
    const std::size_t before = at_;
    if (is_word("let") || is_word("event")) {
      definition(file);
    } else if (peek().kind == TokenKind::kName && !is_reserved(peek().text)) {
      requirement(file);
    } else {
      error("expected let NAME = …, event NAME = … or a requirement NAME: …, got " + shown(peek()));
    }
    if (failed_) {
      if (at_ == before) take();
      recover();
    }
    if (file.requirements.size() > kRequirementsMax) {
      failed_ = false;
      error_at(file.requirements.back().span, "requirement.too-large",
               fmt::format("a file may hold {} requirements; split it", kRequirementsMax));
      return;
    }
  }
}

// Goes on at the next line that begins like a statement, so that one slip gives one message.
void RequirementParser::recover() {
  for (; peek().kind != TokenKind::kEnd; take()) {
    if (!peek().starts_line || peek().kind != TokenKind::kName) continue;
    const Token& next = peek(1);
    if (peek().text == "let" || peek().text == "event") return;
    if (is_reserved(peek().text)) continue;
    const bool header = next.kind == TokenKind::kString ||
                        (next.kind == TokenKind::kSymbol && (next.text == ":" || (next.text == "(" && !next.adjacent)));
    if (header) return;
  }
}

void RequirementParser::definition(RequirementFile& file) {
  Definition definition;
  definition.is_event = take().text == "event";
  definition.span = peek().span;
  if (peek().kind == TokenKind::kName && is_reserved(peek().text))
    return error(fmt::format("\"{}\" is a word of the language; choose another name", peek().text));
  definition.name = expect_name("a name");
  if (is_symbol("(") && peek().adjacent) {
    take();
    do definition.parameters.push_back(expect_name("a parameter's name"));
    while (accept_symbol(","));
    expect_symbol(")", "after the parameters");
  }
  if (accept_symbol("[")) {
    definition.unit = unit();
    if (!failed_ && definition.unit.empty()) {
      return error(fmt::format("{} is no unit that is known; there are {}", shown(peek()), fmt::join(units(), ", ")));
    }
    expect_symbol("]", "after the unit");
  }
  expect_symbol("=", "after the name");
  if (failed_) return;
  ConditionPtr content = condition();
  if (failed_) return;
  if (peek().kind == TokenKind::kStop) take();
  const bool begins = peek().kind == TokenKind::kEnd || peek().starts_line;
  if (!begins) return error("expected an operator or the next statement on a new line, got " + shown(peek()));
  if (definition.is_event && content->kind == Kind::kValue && content->path.empty()) {
    Condition event = *content;
    event.kind = Kind::kEvent;
    content = std::make_shared<const Condition>(std::move(event));
  }
  definition.content = std::move(content);
  if (const auto [other, is_new] = defined_.try_emplace({definition.is_event, definition.name}, definition.span.line);
      !is_new) {
    return error_at(definition.span, "requirement.duplicate",
                    fmt::format("\"{}\" is defined twice, first in line {}", definition.name, other->second));
  }
  file.definitions.push_back(std::move(definition));
}

void RequirementParser::mark(RequirementPart::Role role, std::size_t from) {
  if (!failed_ && at_ > from) marked_.push_back({role, tokens_[from].span, tokens_[at_ - 1].span});
}

ConditionPtr RequirementParser::part(RequirementPart::Role role, int precedence) {
  const std::size_t from = at_;
  ConditionPtr read = binary(precedence);
  mark(role, from);
  return read;
}

Bound RequirementParser::bound_part() {
  const std::size_t from = at_;
  Bound read = bound();
  mark(Role::kBound, from);
  return read;
}

void RequirementParser::requirement(RequirementFile& file) {
  marked_.clear();
  Requirement requirement;
  requirement.span = peek().span;
  requirement.name = take().text;
  if (accept_symbol("(")) attributes(requirement);
  if (!failed_ && peek().kind == TokenKind::kString) requirement.prose = take().text;
  expect_symbol(":", "after the name of a requirement");
  scope(requirement);
  const std::size_t from = at_;
  body(requirement);
  mark(Role::kBody, from);
  if (accept_word("assuming")) requirement.assuming = part(Role::kAssuming);
  if (failed_) return;
  if (peek().kind != TokenKind::kStop) {
    const std::string hint = word_hint();
    return error(
        fmt::format("expected \".\" at the end of requirement {}, got {}{}", requirement.name, shown(peek()), hint));
  }
  take();
  for (const Requirement& other : file.requirements) {
    if (other.name != requirement.name) continue;
    return error_at(requirement.span, "requirement.duplicate",
                    fmt::format("requirement \"{}\" exists already, in line {}", requirement.name, other.span.line));
  }
  file.requirements.push_back(std::move(requirement));
  parts_.push_back(std::move(marked_));
}

void RequirementParser::attributes(Requirement& requirement) {
  do {
    if (accept_word("re-arming")) {
      requirement.re_arming = true;
      continue;
    }
    static const std::vector<std::string> kWords{"info", "minor", "major", "critical", "re-arming"};
    const auto word = std::find(kWords.begin(), kWords.end() - 1, peek().text);
    if (peek().kind != TokenKind::kName || word == kWords.end() - 1) {
      return error(fmt::format("expected info, minor, major, critical or re-arming, got {}{}", shown(peek()),
                               did_you_mean(peek().text, kWords)));
    }
    requirement.importance = static_cast<Importance>(word - kWords.begin());
    take();
  } while (accept_symbol(","));
  expect_symbol(")", "after the severity");
}

void RequirementParser::scope(Requirement& requirement) {
  if (failed_) return;
  Scope& scope = requirement.scope;
  const std::size_t from = at_;
  if (accept_word("globally")) {
    mark(Role::kScope, from);
    accept_symbol(",");
    return;
  }
  if (accept_word("before")) {
    scope.kind = Scope::Kind::kBefore;
    scope.close = part(Role::kClose);
  } else if (accept_word("after")) {
    scope.kind = Scope::Kind::kAfter;
    scope.open = part(Role::kOpen);
    if (accept_word("until")) {
      scope.kind = Scope::Kind::kAfterUntil;
      scope.close = part(Role::kClose);
    }
  } else if (accept_word("between")) {
    scope.kind = Scope::Kind::kBetween;
    scope.open = part(Role::kOpen, 4);  // above "and"
    expect_word("and");
    if (!failed_) scope.close = part(Role::kClose);
  } else if (accept_word("while")) {
    scope.kind = Scope::Kind::kWhile;
    scope.open = part(Role::kOpen);
  } else {
    return;
  }
  mark(Role::kScope, from);
  expect_symbol(",", "after the scope");
}

void RequirementParser::body(Requirement& requirement) {
  if (failed_) return;
  if (accept_word("always") || is_word("never")) {
    requirement.pattern = accept_word("never") ? Pattern::kNever : Pattern::kAlways;
    requirement.p = part(Role::kP);
  } else if (accept_word("eventually")) {
    requirement.pattern = Pattern::kEventually;
    requirement.p = part(Role::kP);
    if (accept_word("within")) requirement.bound = bound_part();
  } else if (accept_word("whenever") || accept_word("once")) {
    whenever(requirement);
  } else {
    requirement.p = part(Role::kP);
    after_condition(requirement);
  }
}

void RequirementParser::after_condition(Requirement& requirement) {
  if (failed_) return;
  if (accept_word("precedes")) {
    requirement.pattern = Pattern::kPrecedes;
    requirement.q = part(Role::kQ);
    if (accept_word("by")) {
      expect_word("at");
      expect_word("most");
      requirement.bound = bound_part();
    }
  } else if (accept_word("holds")) {
    requirement.pattern = Pattern::kHoldsFor;
    expect_word("for");
    expect_word("at");
    expect_word("least");
    requirement.bound = bound_part();
  } else if (accept_word("at")) {
    if (accept_word("least")) {
      requirement.pattern = Pattern::kAtLeastEvery;
      expect_word("every");
      requirement.bound = bound_part();
      return;
    }
    expect_word("most");
    requirement.pattern = Pattern::kAtMost;
    if (failed_) return;
    const Token& token = peek();
    if (token.kind != TokenKind::kNumber || token.number < 0 || token.number != std::floor(token.number) ||
        token.number > static_cast<double>(kTimesMax)) {
      return error(fmt::format("expected a whole number up to {} after \"at most\", got {}", kTimesMax, shown(token)));
    }
    const std::size_t from = at_;
    requirement.times = static_cast<std::int64_t>(take().number);
    mark(Role::kTimes, from);
    expect_word("times");
    if (accept_word("per")) requirement.bound = bound_part();
  } else {
    // "if ok …" begins with a name; in "level is …" what follows it is no word.
    const bool is_begin = requirement.p->kind == Kind::kName && !is_word("is") && !is_word("equals");
    const std::string hint = is_begin ? to_word(requirement.p->text) : word_hint();
    error_at(hint.empty() || !is_begin ? peek().span : requirement.p->span, "requirement.syntax",
             "a requirement begins with always, never, eventually or whenever, or goes on after a condition with "
             "precedes, holds for at least, at least every or at most" +
                 hint);
  }
}

void RequirementParser::whenever(Requirement& requirement) {
  requirement.p = part(Role::kP);
  if (failed_) return;
  const bool separated = accept_symbol(",");
  if (!accept_word("then") && !separated)
    return error(fmt::format("expected \",\" or \"then\" after the trigger, got {}{}", shown(peek()), word_hint()));
  // "robot shall": who has to; for the reader.
  if (peek().kind == TokenKind::kName && peek(1).kind == TokenKind::kName && peek(1).text == "shall") {
    take();
    take();
  } else if (peek().kind == TokenKind::kName && peek(1).kind == TokenKind::kName &&
             to_word(peek(1).text) == to_word("must")) {
    take();
    return error(fmt::format("expected \"shall\", got {}{}", shown(peek()), word_hint()));
  }
  if (accept_word("keep")) {
    requirement.q = part(Role::kQ);
    if (accept_word("until")) {
      requirement.pattern = Pattern::kKeepUntil;
      requirement.r = part(Role::kR);
      return;
    }
    requirement.pattern = Pattern::kKeepFor;
    expect_word("for");
    requirement.bound = bound_part();
    return;
  }
  const std::size_t from = at_;
  requirement.q = part(Role::kQ);
  if (failed_) return;
  if (accept_word("within")) {
    requirement.pattern = Pattern::kRespond;
    requirement.bound = bound_part();
  } else if (accept_word("immediately")) {
    requirement.pattern = Pattern::kImmediately;
  } else if (accept_word("eventually")) {
    requirement.pattern = Pattern::kRespond;
  } else if (is_word("for") && requirement.q->kind == Kind::kNot) {
    take();
    requirement.pattern = Pattern::kNotFor;
    requirement.q = requirement.q->operands[0];
    marked_.back().first = tokens_[from + 1].span;
    requirement.bound = bound_part();
  } else if (is_word("for")) {
    error("\"for\" follows \"keep P\" or \"not P\"; put keep before the condition, or parentheses after not");
  } else {
    error(fmt::format("expected within, immediately or eventually after the response, got {}{}", shown(peek()),
                      word_hint()));
  }
}

Bound RequirementParser::bound() {
  Bound bound;
  if (failed_) return bound;
  bound.span = peek().span;
  if (peek().kind != TokenKind::kNumber) {
    error("expected a bound such as 500 ms, 2 s, 5 min, 10 ticks or 3 events, got " + shown(peek()));
    return bound;
  }
  const double number = take().number;
  struct Unit {
    std::string_view name;
    double ns;  // 0: counted
  };
  constexpr std::array<Unit, 8> kUnits{
      {{"ns", 1}, {"us", 1e3}, {"ms", 1e6}, {"s", 1e9}, {"min", 60e9}, {"h", 3600e9}, {"ticks", 0}, {"events", 0}}};
  static const std::vector<std::string> kNames{"ms", "s", "min", "h", "us", "ns", "ticks", "events"};
  std::string name = peek().text;
  if (name == "tick" || name == "event") name += "s";
  const auto unit = std::find_if(kUnits.begin(), kUnits.end(), [&](const Unit& u) { return u.name == name; });
  if (peek().kind != TokenKind::kName || unit == kUnits.end()) {
    error(fmt::format("expected a unit of the bound (ms, s, min, h, ticks, events), got {}{}", shown(peek()),
                      did_you_mean(name, kNames)));
    return bound;
  }
  take();
  if (unit->ns == 0) {
    bound.unit = name == "ticks" ? Bound::Unit::kTicks : Bound::Unit::kEvents;
    if (number < 1 || number != std::floor(number) || number > static_cast<double>(kCountMax)) {
      error_at(bound.span, "requirement.bound",
               fmt::format("a bound in {} is a whole number from 1 to {}", name, kCountMax));
      return bound;
    }
    bound.count = static_cast<std::int64_t>(number);
    return bound;
  }
  const double ns = std::round(number * unit->ns);
  if (ns < 1 || ns > static_cast<double>(kBoundMax.count())) {
    error_at(bound.span, "requirement.bound", "a bound in time is from 1 ns to 10 years");
    return bound;
  }
  bound.time = Duration(static_cast<std::int64_t>(ns));
  return bound;
}

// ---- Conditions ----

ConditionPtr RequirementParser::make(Condition::Kind kind, const SourceSpan& span, std::vector<ConditionPtr> operands) {
  auto made = std::make_shared<Condition>();
  made->kind = kind;
  made->span = span;
  made->operands = std::move(operands);
  return made;
}

ConditionPtr RequirementParser::binary(int precedence) {
  struct Operator {
    std::string_view text;
    Condition::Kind kind;
    int precedence;
  };
  constexpr std::array<Operator, 13> kOperators{{{"implies", Kind::kImplies, 1},
                                                 {"or", Kind::kOr, 2},
                                                 {"and", Kind::kAnd, 3},
                                                 {"=", Kind::kEqual, 5},
                                                 {"!=", Kind::kNotEqual, 5},
                                                 {"<", Kind::kLess, 5},
                                                 {"<=", Kind::kLessEqual, 5},
                                                 {">", Kind::kGreater, 5},
                                                 {">=", Kind::kGreaterEqual, 5},
                                                 {"+", Kind::kAdd, 6},
                                                 {"-", Kind::kSubtract, 6},
                                                 {"*", Kind::kMultiply, 7},
                                                 {"/", Kind::kDivide, 7}}};
  ConditionPtr left = unary();
  for (int chain = 0; !failed_; ++chain) {
    const Token& token = peek();
    const auto op = std::find_if(kOperators.begin(), kOperators.end(), [&](const Operator& candidate) {
      return (token.kind == TokenKind::kSymbol || token.kind == TokenKind::kName) && candidate.text == token.text;
    });
    if (op == kOperators.end() || op->precedence < precedence) break;
    if (chain > kConditionNestingMax) {
      error_at(token.span, "requirement.too-deep", "the condition is too long; use definitions (let NAME = …)");
      break;
    }
    const SourceSpan span = take().span;
    ConditionPtr right = binary(op->kind == Kind::kImplies ? op->precedence : op->precedence + 1);
    if (failed_) break;
    left = make(op->kind, span, {std::move(left), std::move(right)});
  }
  return left;
}

ConditionPtr RequirementParser::unary() {
  if (failed_) return make(Kind::kTruth, {});
  if (depth_ >= kConditionNestingMax) {
    error_at(peek().span, "requirement.too-deep", "the condition is nested too deeply; use definitions (let NAME = …)");
    return make(Kind::kTruth, {});
  }
  ++depth_;
  ConditionPtr result;
  if (is_word("not")) {
    const SourceSpan span = take().span;
    result = make(Kind::kNot, span, {binary(5)});
  } else if (is_symbol("-")) {
    const SourceSpan span = take().span;
    result = make(Kind::kNegate, span, {unary()});
  } else {
    result = postfix();
  }
  --depth_;
  return result;
}

ConditionPtr RequirementParser::postfix() {
  ConditionPtr result = primary();
  if (!failed_ && is_word("updated")) result = make(Kind::kUpdated, take().span, {std::move(result)});
  return result;
}

ConditionPtr RequirementParser::number() {
  auto made = std::make_shared<Condition>();
  made->kind = Kind::kNumber;
  made->span = peek().span;
  made->number = take().number;
  if (!peek().starts_line) made->unit = unit();
  return made;
}

std::string RequirementParser::unit() {
  const Token& token = peek();
  if (token.kind != TokenKind::kName && token.kind != TokenKind::kSymbol) return {};
  // "m/s" is three words.
  std::string ratio = fmt::format("{}/{}", token.text, peek(2).text);
  if (peek(1).text == "/" && peek(1).adjacent && peek(2).adjacent && is_unit(ratio)) {
    take();
    take();
    take();
    return ratio;
  }
  // A ratio of units that is none: its second one would be taken for a name, or the number for a length alone.
  if (is_unit(token.text) && peek(1).text == "/" && peek(1).adjacent && peek(2).adjacent && is_unit(peek(2).text)) {
    error(fmt::format("\"{}\" is no unit here; of ratios there are m/s and rad/s: write the number in one of these",
                      ratio));
    return {};
  }
  return is_unit(token.text) ? take().text : std::string();
}

ConditionPtr RequirementParser::primary() {
  const Token& token = peek();
  if (token.kind == TokenKind::kNumber) return number();
  if (token.kind == TokenKind::kString) {
    auto made = std::make_shared<Condition>();
    made->kind = Kind::kText;
    made->span = token.span;
    made->text = take().text;
    return made;
  }
  if (accept_symbol("(")) {
    ConditionPtr inner = condition();
    expect_symbol(")", "to close the parenthesis");
    return inner;
  }
  if (is_word("true") || is_word("false")) {
    auto made = std::make_shared<Condition>();
    made->kind = Kind::kTruth;
    made->span = token.span;
    made->number = take().text == "true" ? 1 : 0;
    return made;
  }
  const bool is_operand = compares(peek(1)) || (at_ > 0 && compares(tokens_[at_ - 1]) && peek(1).text != "(");
  if (token.kind == TokenKind::kName && is_operand && is_also_a_name(token.text)) return named(take());
  if (is_word("event")) return event();
  if (is_word("rises") || is_word("falls")) {
    const Token& name = take();
    expect_symbol("(", "after " + name.text);
    ConditionPtr inner = condition();
    expect_symbol(")", "after the condition");
    return make(name.text == "rises" ? Kind::kRises : Kind::kFalls, name.span, {std::move(inner)});
  }
  if (at_source()) {
    auto made = std::make_shared<Condition>();
    made->kind = Kind::kValue;
    made->span = token.span;
    made->source = source();
    if (made->source->kind == Source::Kind::kNode) {
      expect_word("in");
      made->path = {"to"};
      auto status = std::make_shared<Condition>();
      status->kind = Kind::kText;
      status->is_word = true;
      status->span = peek().span;
      status->text = expect_name("a status (IDLE, RUNNING, SUCCESS, FAILURE, SKIPPED)");
      return make(Kind::kEqual, token.span, {std::move(made), std::move(status)});
    }
    if (accept_symbol(".")) {
      const std::string path = expect_name("a member");
      for (std::size_t begin = 0; begin <= path.size();) {
        const std::size_t dot = std::min(path.find('.', begin), path.size());
        made->path.push_back(path.substr(begin, dot - begin));
        begin = dot + 1;
      }
    }
    return made;
  }
  if (token.kind == TokenKind::kName && !is_reserved(token.text)) return named(take());
  const bool is_keyword = token.kind == TokenKind::kName;
  error(fmt::format("expected a condition, got {}{}", shown(token), is_keyword ? ", a word of the language" : ""));
  return make(Kind::kTruth, token.span);
}

ConditionPtr RequirementParser::named(const Token& name) {
  auto made = std::make_shared<Condition>();
  made->kind = Kind::kName;
  made->span = name.span;
  made->text = name.text;
  if (!is_symbol("(") || !peek().adjacent) return made;
  take();
  do made->operands.push_back(condition());
  while (accept_symbol(","));
  expect_symbol(")", "after the arguments");
  return made;
}

bool RequirementParser::at_source() const {
  return peek(1).kind == TokenKind::kSymbol && peek(1).text == "(" &&
         (is_word("request") || is_word("reply") || is_word("error") || is_word("late") || is_word("node") ||
          is_word("observation"));
}

Source RequirementParser::source() {
  Source source;
  const std::string word = take().text;
  expect_symbol("(", "after " + word);
  source.span = peek().span;
  const std::string name = expect_name(word == "node" ? "a node's name" : "SERVICE.METHOD");
  if (failed_) return source;
  if (word == "node") {
    source.kind = Source::Kind::kNode;
    source.observation = "node.status";
    source.from = name;
    source.from_span = source.span;
  } else if (word == "observation") {
    source.observation = name;
  } else {
    source.kind = word == "request" ? Source::Kind::kRequest
                  : word == "reply" ? Source::Kind::kReply
                  : word == "error" ? Source::Kind::kError
                                    : Source::Kind::kLate;
    const std::size_t dot = name.rfind('.');
    if (dot == std::string::npos) {
      error_at(
          source.span, "requirement.syntax",
          fmt::format("{}(…) takes SERVICE.METHOD, e.g. {}(battery.getBatteryState), got \"{}\"", word, word, name));
      return source;
    }
    source.service = name.substr(0, dot);
    source.method = name.substr(dot + 1);
    source.observation = fmt::format("{}.{}", name, word);
  }
  if (source.kind != Source::Kind::kNode && accept_word("from")) {
    source.from_span = peek().span;
    source.from = expect_name("a leaf");
  }
  if (accept_word("where")) source.where = condition();
  expect_symbol(")", fmt::format("to close {}(", word));
  return source;
}

ConditionPtr RequirementParser::event() {
  const SourceSpan span = take().span;
  expect_symbol("(", "after event");
  if (failed_) return make(Kind::kTruth, span);
  auto made = std::make_shared<Condition>();
  made->kind = Kind::kEvent;
  made->span = peek().span;
  if (at_source()) {
    if (is_word("node")) {
      error("node(NAME) in STATUS is a condition; its event is rises(node(NAME) in STATUS)");
      return made;
    }
    made->source = source();
  } else {
    made->kind = Kind::kName;
    made->text = expect_name("an event's name or an observation");
    made->unit = "event";  // told apart from values until it is resolved
    if (is_symbol("(")) {
      take();
      do made->operands.push_back(condition());
      while (accept_symbol(","));
      expect_symbol(")", "after the arguments");
    }
  }
  expect_symbol(")", "to close event(");
  return made;
}

}  // namespace sentree::monitor
