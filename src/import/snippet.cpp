#include "sentree/import/detail/snippet.h"

#include <algorithm>
#include <array>
#include <map>

#include <fmt/format.h>

#include "sentree/text/xml.h"

namespace sentree::import {

namespace {

using text::xml_attribute;

constexpr std::string_view kCallInBranch =
    "a call whose result is used, inside a branch; draw a state that makes the call";

constexpr std::array<std::string_view, 16> kLogs{"qDebug",   "qInfo",   "qWarning", "qCritical", "yDebug", "yInfo",
                                                 "yWarning", "yError",  "yTrace",   "yCDebug",   "yCInfo", "yCWarning",
                                                 "yCError",  "yCTrace", "cout",     "cerr"};

bool is_log(std::string_view name) { return std::find(kLogs.begin(), kLogs.end(), name) != kLogs.end(); }

/// An event object that a snippet fills before it submits it.
struct EventObject {
  std::string name;
  std::string delay;
};

class StatementTranslator {
 public:
  StatementTranslator(const std::string& source, const SourceSpan& place, Names& names)
      : source_(source), place_(place), names_(names) {
    result_.pieces.emplace_back();
  }

  Snippet run() {
    const std::vector<Token> tokens = tokens_of(source_);
    all(Tokens(tokens), {}, 0);
    return std::move(result_);
  }

 private:
  /// Where content goes, and what it goes through.
  struct Scope {
    std::string* branch = nullptr;     ///< Inside an `if`; null: at the snippet's own level.
    std::optional<std::string> timer;  ///< Delay of the timer whose function this is.
  };

  void put(const Scope& scope, const std::string& xml) {
    (scope.branch != nullptr ? *scope.branch : result_.pieces.back().xml) += xml + "\n";
  }

  void all(Tokens tokens, const Scope& scope, int depth) {
    for (std::size_t at = 0; at < tokens.size();) {
      const std::size_t end = statement_end(tokens, at, 0);
      const Tokens statement = tokens.subspan(at, end - at);
      at = end;
      const std::size_t findings = result_.findings.size();
      const std::size_t pieces = result_.pieces.size();
      const std::size_t written = result_.pieces.back().xml.size();
      const auto done = one(statement, scope, depth);
      if (done) continue;
      // What was said and written of parts of it is said by the whole.
      result_.findings.resize(findings);
      result_.pieces.resize(pieces);
      result_.pieces.back().xml.erase(written);
      result_.pieces.back().call.reset();
      unmapped(statement, scope, done.error().message);
    }
  }

  void unmapped(Tokens statement, const Scope& scope, const std::string& reason) {
    const std::string original = source_of(statement);
    put(scope, comment_of("not translated, see IMPORT.md: " + original));
    result_.findings.push_back({Fate::kByHand, place_of(statement), shortened(original), reason});
  }

  void note(Fate fate, Tokens statement, std::string reason) {
    result_.findings.push_back({fate, place_of(statement), shortened(source_of(statement)), std::move(reason)});
  }

  [[nodiscard]] std::string source_of(Tokens tokens) const {
    return tokens.empty() ? std::string()
                          : source_.substr(tokens.front().begin, tokens.back().end - tokens.front().begin);
  }

  [[nodiscard]] SourceSpan place_of(Tokens tokens) const {
    SourceSpan place = place_;
    if (tokens.empty()) return place;
    const auto before = source_.begin() + static_cast<std::ptrdiff_t>(tokens.front().begin);
    const auto lines = static_cast<int>(std::count(source_.begin(), before, '\n'));
    place.line += lines;
    if (lines > 0) place.column = 0;
    return place;
  }

  // One past the last token of the statement at `at`.
  static std::size_t statement_end(Tokens tokens, std::size_t at, int depth) {
    if (tokens[at].kind == TokenKind::kComment) return at + 1;
    if (depth > kNestingMax) return tokens.size();
    if (tokens[at].is("{")) return std::min(closing(tokens, at) + 1, tokens.size());
    const bool has_head =
        tokens[at].is("if") || tokens[at].is("for") || tokens[at].is("while") || tokens[at].is("switch");
    if (has_head && at + 1 < tokens.size() && tokens[at + 1].is("(")) {
      std::size_t end = after_comments(tokens, closing(tokens, at + 1) + 1);
      if (end >= tokens.size()) return tokens.size();
      end = statement_end(tokens, end, depth + 1);
      const std::size_t otherwise = after_comments(tokens, end);
      if (!tokens[at].is("if") || otherwise >= tokens.size() || !tokens[otherwise].is("else")) return end;
      const std::size_t begin = after_comments(tokens, otherwise + 1);
      return begin < tokens.size() ? statement_end(tokens, begin, depth + 1) : tokens.size();
    }
    for (std::size_t end = at; end < tokens.size(); ++end) {
      if (tokens[end].is(";")) return end + 1;
      if (tokens[end].is("(") || tokens[end].is("[") || tokens[end].is("{")) end = closing(tokens, end);
    }
    return tokens.size();
  }

  static std::size_t after_comments(Tokens tokens, std::size_t at) {
    while (at < tokens.size() && tokens[at].kind == TokenKind::kComment) ++at;
    return at;
  }

  Result<void> one(Tokens statement, const Scope& scope, int depth) {
    if (depth > kNestingMax) return cannot(fmt::format("statements are nested more than {} deep", kNestingMax));
    const Token& first = statement.front();
    if (first.kind == TokenKind::kComment) {
      put(scope, comment_of(first.text));
      return {};
    }
    if (first.is(";")) return {};
    if (first.is("{")) {
      all(inside(statement, 0), scope, depth + 1);
      return {};
    }
    if (first.is("if")) return choice(statement, scope, depth);
    if (first.is("switch")) return cases(statement, scope, depth);
    if (first.is("for") || first.is("while") || first.is("do"))
      return cannot("a loop; draw it as states, or write it as ECMAScript in a <script>");
    const bool ends = statement.back().is(";");
    return simple(ends ? statement.first(statement.size() - 1) : statement, scope, depth);
  }

  // What is between the bracket at `open` and its end.
  static Tokens inside(Tokens tokens, std::size_t open) {
    const std::size_t close = closing(tokens, open);
    return tokens.subspan(open + 1, close - open - 1);
  }

  Result<void> choice(Tokens statement, const Scope& scope, int depth) {
    std::string xml;
    std::string_view element = "if";
    for (Tokens rest = statement;;) {
      if (rest.size() < 2 || !rest[1].is("(") || closing(rest, 1) >= rest.size())
        return cannot("an if without a condition");
      if (element == "elseif" && calls_in(inside(rest, 1))) return cannot("a call in the condition of an else-if");
      auto condition = hoisted(inside(rest, 1), scope);
      if (!condition) return tl::unexpected(condition.error());
      xml += fmt::format("<{}{}{}\n", element, xml_attribute("cond", *condition), element == "if" ? ">" : "/>");
      const std::size_t begin = after_comments(rest, closing(rest, 1) + 1);
      if (begin >= rest.size()) return cannot("an if without a statement");
      const std::size_t end = statement_end(rest, begin, 0);
      if (auto done = branch(rest.subspan(begin, end - begin), scope, depth, xml); !done) return done;
      const std::size_t otherwise = after_comments(rest, end);
      if (otherwise >= rest.size()) break;
      const std::size_t next = after_comments(rest, otherwise + 1);
      if (next >= rest.size()) return cannot("an else without a statement");
      if (rest[next].is("if")) {
        rest = rest.subspan(next);
        element = "elseif";
        continue;
      }
      xml += "<else/>\n";
      if (auto done = branch(rest.subspan(next), scope, depth, xml); !done) return done;
      break;
    }
    put(scope, xml + "</if>");
    return {};
  }

  Result<void> branch(Tokens statement, const Scope& scope, int depth, std::string& xml) {
    if (waits_in(statement)) return cannot(std::string(kCallInBranch));
    std::string inner;
    all(statement, {&inner, scope.timer}, depth + 1);
    xml += inner;
    return {};
  }

  // switch (x) { case A: case B: … break; default: … }
  Result<void> cases(Tokens statement, const Scope& scope, int depth) {
    if (statement.size() < 3 || !statement[1].is("(")) return cannot("a switch without a value");
    const std::size_t open = closing(statement, 1) + 1;
    if (open >= statement.size() || !statement[open].is("{")) return cannot("a switch without cases");
    auto value = hoisted(inside(statement, 1), scope);
    if (!value) return tl::unexpected(value.error());
    const Tokens body = inside(statement, open);
    std::string xml;
    std::string otherwise;
    bool has_default = false;
    std::string condition;
    bool is_default = false;
    for (std::size_t at = 0; at < body.size();) {
      at = after_comments(body, at);
      if (at >= body.size()) break;
      if (body[at].is("case") || body[at].is("default")) {
        std::size_t colon = at;
        while (colon < body.size() && !body[colon].is(":")) ++colon;
        if (body[at].is("case")) {
          const auto label = translate_expression(body.subspan(at + 1, std::min(colon, body.size()) - at - 1), names_);
          if (!label) return tl::unexpected(label.error());
          condition += fmt::format("{}{} == {}", condition.empty() ? "" : " || ", *value, label->text);
        } else {
          is_default = true;
        }
        at = colon + 1;
        continue;
      }
      std::size_t end = at;
      while (end < body.size() && !body[end].is("case") && !body[end].is("default")) {
        end = body[end].is("{") || body[end].is("(") ? closing(body, end) + 1 : end + 1;
      }
      Tokens content = body.subspan(at, std::min(end, body.size()) - at);
      at = end;
      if (!drop_break(content) && end < body.size()) return cannot("a case that falls through to the next");
      std::string inner;
      if (auto done = branch(content, scope, depth, inner); !done) return done;
      if (is_default) {
        otherwise = inner;
        has_default = true;
      } else {
        xml += fmt::format("{}{}{}\n{}", xml.empty() ? "<if" : "<elseif", xml_attribute("cond", condition),
                           xml.empty() ? ">" : "/>", inner);
      }
      condition.clear();
      is_default = false;
    }
    if (xml.empty()) {
      put(scope, otherwise);
    } else {
      put(scope, fmt::format("{}{}</if>", xml, has_default ? "<else/>\n" + otherwise : ""));
    }
    return {};
  }

  // Cuts the `break;` that ends a case, behind its statements or inside its braces.
  static bool drop_break(Tokens& content) {
    while (!content.empty() && (content.back().kind == TokenKind::kComment || content.back().is(";")))
      content = content.first(content.size() - 1);
    if (!content.empty() && (content.back().is("break") || content.back().is("return"))) {
      content = content.first(content.size() - 1);
      return true;
    }
    if (!content.empty() && content.front().is("{") && closing(content, 0) == content.size() - 1) {
      Tokens inner = content.subspan(1, content.size() - 2);
      if (!drop_break(inner)) return false;
      content = inner;
      return true;
    }
    return false;
  }

  [[nodiscard]] bool is_call_at(Tokens tokens, std::size_t at) const {
    return at + 3 < tokens.size() && names_.remotes.contains(tokens[at].text) &&
           (tokens[at + 1].is(".") || tokens[at + 1].is("->")) && tokens[at + 3].is("(");
  }

  [[nodiscard]] bool calls_in(Tokens tokens) const {
    for (std::size_t at = 0; at < tokens.size(); ++at) {
      if (is_call_at(tokens, at)) return true;
    }
    return false;
  }

  // A call that is not a statement of its own.
  [[nodiscard]] bool waits_in(Tokens tokens) const {
    for (std::size_t at = 0; at < tokens.size(); ++at) {
      if (!is_call_at(tokens, at)) continue;
      const bool begins = at == 0 || tokens[at - 1].is(";") || tokens[at - 1].is("{") || tokens[at - 1].is("}") ||
                          tokens[at - 1].is(")") || tokens[at - 1].is("else") || tokens[at - 1].is(":") ||
                          tokens[at - 1].kind == TokenKind::kComment;
      const std::size_t close = closing(tokens, at + 3);
      if (!begins || (close + 1 < tokens.size() && !tokens[close + 1].is(";"))) return true;
    }
    return false;
  }

  // The expression, its calls made before it, in their order.
  Result<std::string> hoisted(Tokens tokens, const Scope& scope) {
    if (scope.branch != nullptr && calls_in(tokens)) return cannot(std::string(kCallInBranch));
    std::vector<Token> rest(tokens.begin(), tokens.end());
    for (std::size_t at = 0; at < rest.size(); ++at) {
      if (rest[at].is("&&") || rest[at].is("||") || rest[at].is("?")) {
        if (calls_in(Tokens(rest).subspan(at)))
          return cannot("a call that is made only if what is before it is true; draw a state that makes the call");
        break;
      }
      if (!is_call_at(rest, at)) continue;
      const std::size_t close = closing(rest, at + 3);
      if (close >= rest.size()) return cannot("a call without its end");
      auto call = translate_call(Tokens(rest).subspan(at, close - at + 1), names_);
      if (!call) return tl::unexpected(call.error());
      const std::string name = fresh((*call)->method);
      wait(**call, name);
      const Token place{TokenKind::kName, name, rest[at].begin, rest[close].end};
      rest.erase(rest.begin() + static_cast<std::ptrdiff_t>(at), rest.begin() + static_cast<std::ptrdiff_t>(close) + 1);
      rest.insert(rest.begin() + static_cast<std::ptrdiff_t>(at), place);
    }
    auto expression = translate_expression(Tokens(rest), names_);
    if (!expression) return tl::unexpected(expression.error());
    if (expression->divides_integers) {
      note(Fate::kReview, tokens,
           "C++ divides integers without rest, ECMAScript does not; Math.floor(…) where that matters");
    }
    return std::move(expression->text);
  }

  // A name for the result of a call that the snippet did not name.
  std::string fresh(const std::string& method) {
    std::string name = method + "_result";
    for (int i = 2; names_.data.contains(name); ++i) name = fmt::format("{}_result{}", method, i);
    declare(name);
    return name;
  }

  void declare(const std::string& name) {
    if (names_.data.insert(name).second) result_.new_data.push_back(name);
  }

  void wait(RemoteCall call, const std::string& location) {
    Piece& piece = result_.pieces.back();
    piece.call = std::move(call);
    piece.result = location;
    result_.pieces.emplace_back();
  }

  Result<void> simple(Tokens tokens, const Scope& scope, int depth) {
    while (!tokens.empty() && tokens.front().kind == TokenKind::kComment) tokens = tokens.subspan(1);
    if (tokens.empty()) return {};
    if (is_log_statement(tokens)) return log(tokens, scope);
    for (std::size_t at = 0; at + 1 < tokens.size(); ++at) {
      if (!tokens[at + 1].is("(")) continue;
      if (tokens[at].is("submitEvent") || (at == 0 && tokens[at].is("raise"))) return submit(tokens, at + 1, scope);
      if (tokens[at].is("singleShot") && tokens[0].is("QTimer")) return timer(inside(tokens, at + 1), scope, depth);
      if (tokens[at].is("(") || tokens[at].is("=")) break;
    }
    if (tokens[0].is("return") && tokens.size() == 1 && scope.branch == nullptr && !scope.timer)
      return cannot("what follows a return is never reached");
    if (tokens[0].is("Connector")) {
      note(Fate::kNotNeeded, tokens, "a connection of ports; Sentree connects to services by their address");
      return {};
    }
    if (event_object(tokens)) return {};
    if (scope.timer && *scope.timer != "0") return cannot("a timer's function that does more than submit events");
    if (is_call_at(tokens, 0)) {
      const auto call = translate_call(tokens, names_);
      if (!call) return tl::unexpected(call.error());
      if (*call) {
        put(scope, send_of(**call, ""));
        return {};
      }
    }
    return assignment(tokens, scope);
  }

  static bool is_log_statement(Tokens tokens) {
    if (is_log(tokens[0].text)) return true;
    return tokens.size() > 2 && tokens[0].is("std") && tokens[1].is("::") && is_log(tokens[2].text);
  }

  // qDebug() << "at" << level: what can be said in ECMAScript is said.
  Result<void> log(Tokens tokens, const Scope& scope) {
    std::string expression;
    for (const Tokens part : split(tokens, "<<")) {
      if (part.data() == tokens.data()) {
        // qDebug("text") has its text in the parentheses.
        const auto text =
            std::find_if(part.begin(), part.end(), [](const Token& t) { return t.kind == TokenKind::kText; });
        if (text == part.end()) continue;
        expression += script_text(text->text);
        continue;
      }
      const auto translated = translate_expression(part, names_);
      if (!translated) continue;
      const bool one = part.size() == 1;
      expression +=
          (expression.empty() ? "" : " + ' ' + ") + (one ? translated->text : fmt::format("({})", translated->text));
    }
    if (!expression.empty()) put(scope, fmt::format("<log{}/>", xml_attribute("expr", expression)));
    return {};
  }

  // submitEvent("X"), submitEvent(condition ? "X" : "Y"), submitEvent(event).
  Result<void> submit(Tokens tokens, std::size_t open, const Scope& scope) {
    const std::vector<Tokens> arguments = split(inside(tokens, open), ",");
    if (arguments.empty()) return cannot("an event without a name");
    if (arguments.size() > 1 && !arguments[1].empty() && arguments[1].front().text.starts_with("QVariant"))
      return cannot("an event with data; write <send> with a <param> for each");
    return submit_named(arguments[0], scope, 0);
  }

  Result<void> submit_named(Tokens name, const Scope& scope, int depth) {
    while (name.size() > 2 && name.front().is("(") && closing(name, 0) == name.size() - 1)
      name = name.subspan(1, name.size() - 2);
    if (name.empty() || depth > kNestingMax) return cannot("an event without a name");
    if (name.size() == 1 && name[0].kind == TokenKind::kText) {
      emit(name[0].text, scope.timer, scope);
      return {};
    }
    if (const auto object = events_.find(name[0].text); name.size() == 1 && object != events_.end()) {
      if (object->second.name.empty()) return cannot("an event that got no name");
      emit(object->second.name, object->second.delay.empty() ? scope.timer : object->second.delay, scope);
      return {};
    }
    const std::vector<Tokens> question = split(name, "?");
    const std::vector<Tokens> colon = question.size() == 2 ? split(question[1], ":") : std::vector<Tokens>();
    if (colon.size() != 2) return cannot("the name of the event is not a text");
    if (scope.timer && *scope.timer != "0")
      return cannot("which event a timer submits is decided when it fires; submit it at once and test then");
    auto condition = hoisted(question[0], scope);
    if (!condition) return tl::unexpected(condition.error());
    std::string yes;
    std::string no;
    if (auto done = submit_named(colon[0], {&yes, scope.timer}, depth + 1); !done) return done;
    if (auto done = submit_named(colon[1], {&no, scope.timer}, depth + 1); !done) return done;
    put(scope, fmt::format("<if{}>\n{}<else/>\n{}</if>", xml_attribute("cond", *condition), yes, no));
    return {};
  }

  void emit(const std::string& event, const std::optional<std::string>& delay, const Scope& scope) {
    if (!delay) {
      put(scope, fmt::format("<raise{}/>", xml_attribute("event", event)));
    } else {
      put(scope, fmt::format("<send{}{}/>", xml_attribute("event", event),
                             *delay == "0" ? "" : xml_attribute("delay", *delay)));
    }
  }

  // QTimer::singleShot(500, stateMachine(), [=]() { … })
  Result<void> timer(Tokens arguments, const Scope& scope, int depth) {
    const std::vector<Tokens> parts = split(arguments, ",");
    if (parts.size() < 2) return cannot("a timer without a function");
    const auto delay = delay_of(parts[0]);
    if (!delay) return cannot("the delay of the timer is not a number");
    const Tokens function = parts.back();
    const bool is_lambda = !function.empty() && function.front().is("[");
    std::size_t open = 0;
    while (open < function.size() && !function[open].is("{")) ++open;
    if (!is_lambda || open >= function.size()) return cannot("a timer that calls a slot; submit an event instead");
    std::string inner;
    const std::size_t findings = result_.findings.size();
    all(inside(function, open), {&inner, *delay}, depth + 1);
    if (result_.findings.size() > findings && result_.findings.back().fate == Fate::kByHand)
      return cannot("in a timer: " + result_.findings.back().reason);
    while (inner.ends_with('\n')) inner.pop_back();
    put(scope, inner);
    return {};
  }

  // In the form of `delay`: "0", "500ms", "2s".
  static std::optional<std::string> delay_of(Tokens tokens) {
    std::string unit = "ms";
    const Token* number = nullptr;
    for (const Token& token : tokens) {
      if (token.kind == TokenKind::kNumber && number == nullptr) number = &token;
      if (token.is("seconds")) unit = "s";
      if (token.kind == TokenKind::kName && is_no_part_of_a_duration(token.text)) return std::nullopt;
    }
    if (number == nullptr) return std::nullopt;
    const std::size_t digits = number->text.find_first_not_of("0123456789");
    if (digits != std::string::npos) {
      unit = number->text.substr(digits);
      if (unit != "ms" && unit != "s") return std::nullopt;
    }
    const std::string count = number->text.substr(0, digits);
    return count.find_first_not_of('0') == std::string::npos ? "0" : count + unit;
  }

  static bool is_no_part_of_a_duration(std::string_view name) {
    return name != "std" && name != "chrono" && name != "milliseconds" && name != "seconds";
  }

  // QScxmlEvent *e = new QScxmlEvent; e->setName("X"); e->setDelay(500); e->setEventType(…);
  bool event_object(Tokens tokens) {
    if (tokens[0].is("QScxmlEvent") || (tokens[0].is("auto") && contains_name(tokens, "QScxmlEvent"))) {
      for (const Token& token : tokens.subspan(1)) {
        if (token.kind != TokenKind::kName) continue;
        events_[token.text] = {};
        return true;
      }
    }
    const auto object = events_.find(tokens[0].text);
    if (object == events_.end() || tokens.size() < 5 || !tokens[3].is("(")) return false;
    const Tokens value = inside(tokens, 3);
    if (tokens[2].is("setEventType")) return true;
    if (tokens[2].is("setName") && value.size() == 1 && value[0].kind == TokenKind::kText) {
      object->second.name = value[0].text;
      return true;
    }
    if (!tokens[2].is("setDelay")) return false;
    const auto delay = delay_of(value);
    if (delay) object->second.delay = *delay;
    return delay.has_value();
  }

  static bool contains_name(Tokens tokens, std::string_view name) {
    return std::any_of(tokens.begin(), tokens.end(), [&](const Token& token) { return token.is(name); });
  }

  // x = …, x += …, x++, T x = …, T x;
  Result<void> assignment(Tokens tokens, const Scope& scope) {
    static constexpr std::array<std::string_view, 6> kWith{"=", "+=", "-=", "*=", "/=", "%="};
    const auto increments = [](const Token& token) { return token.is("++") || token.is("--"); };
    if (tokens.size() > 1 && (increments(tokens.front()) || increments(tokens.back()))) {
      const bool before = increments(tokens.front());
      const Tokens place = before ? tokens.subspan(1) : tokens.first(tokens.size() - 1);
      const auto location = location_of(place);
      if (!location) return tl::unexpected(location.error());
      const char sign = (before ? tokens.front() : tokens.back()).text[0];
      return assign(location->text, fmt::format("{} {} 1", location->text, sign), scope);
    }
    for (const std::string_view with : kWith) {
      const std::vector<Tokens> sides = split(tokens, with);
      if (sides.size() != 2) continue;
      Tokens left = sides[0];
      std::vector<Token> own;
      if (const auto declared = declared_name(left)) {
        declare(*declared);
        own.push_back({TokenKind::kName, *declared, left.front().begin, left.back().end});
        left = own;
      }
      const auto location = location_of(left);
      if (!location) return tl::unexpected(location.error());
      if (with == "=" && is_call_at(sides[1], 0) && closing(sides[1], 3) == sides[1].size() - 1) {
        if (scope.branch != nullptr) return cannot(std::string(kCallInBranch));
        auto call = translate_call(sides[1], names_);
        if (!call) return tl::unexpected(call.error());
        if (!(*call)->has_result) return cannot((*call)->method + " has no result");
        wait(**call, location->text);
        return {};
      }
      auto value = hoisted(sides[1], scope);
      if (!value) return tl::unexpected(value.error());
      const std::string operation(with.substr(0, with.size() - 1));
      const std::string operand = value->find(' ') == std::string::npos ? *value : fmt::format("({})", *value);
      return assign(location->text,
                    operation.empty() ? *value : fmt::format("{} {} {}", location->text, operation, operand), scope);
    }
    if (const auto declared = declared_name(tokens)) {
      declare(*declared);
      return {};
    }
    return cannot("C++ without a counterpart; write it in SCXML, or give the component a method that does it");
  }

  // What can be assigned to: a name, members and elements of it.
  [[nodiscard]] Result<Expression> location_of(Tokens tokens) const {
    if (tokens.empty() || tokens.front().kind != TokenKind::kName) return cannot("an assignment to nothing");
    for (std::size_t at = 1; at < tokens.size(); ++at) {
      if (tokens[at].is("[")) at = closing(tokens, at);
      const bool fits =
          at < tokens.size() && (tokens[at].is("]") || tokens[at].is(".") || tokens[at].is("->") ||
                                 (tokens[at].kind == TokenKind::kName && tokens[at - 1].kind != TokenKind::kName));
      if (!fits) return cannot("an assignment to something that is no variable");
    }
    return translate_expression(tokens, names_);
  }

  Result<void> assign(const std::string& location, const std::string& value, const Scope& scope) {
    put(scope, fmt::format("<assign{}{}/>", xml_attribute("location", location), xml_attribute("expr", value)));
    return {};
  }

  // The name that `const std::vector<T>& name` declares.
  static std::optional<std::string> declared_name(Tokens tokens) {
    if (tokens.size() < 2 || tokens.back().kind != TokenKind::kName) return std::nullopt;
    for (const Token& token : tokens.first(tokens.size() - 1)) {
      const bool of_type = token.kind == TokenKind::kName || token.is("::") || token.is("<") || token.is(">") ||
                           token.is("*") || token.is("&") || token.is(",");
      if (!of_type) return std::nullopt;
    }
    const Token& before = tokens[tokens.size() - 2];
    const bool separated = before.kind == TokenKind::kName || before.is(">") || before.is("*") || before.is("&");
    return separated ? std::optional(tokens.back().text) : std::nullopt;
  }

  const std::string& source_;
  SourceSpan place_;
  Names& names_;
  Snippet result_;
  std::map<std::string, EventObject, std::less<>> events_;
};

}  // namespace

std::string shortened(std::string_view text) {
  constexpr std::size_t kMax = 120;
  std::string line;
  for (const char c : text) {
    const bool blank = c == ' ' || c == '\n' || c == '\t' || c == '\r';
    if (!blank) {
      line += c;
    } else if (!line.empty() && line.back() != ' ') {
      line += ' ';
    }
    if (line.size() >= kMax) return line + " …";
  }
  while (line.ends_with(' ')) line.pop_back();
  return line;
}

std::string comment_of(std::string_view text) {
  // "--" must not stand in a comment (XML 1.0, 2.5).
  std::string inside;
  for (const char c : text) {
    if (c == '-' && inside.ends_with('-')) inside += ' ';
    inside += c;
  }
  return fmt::format("<!-- {} -->", inside);
}

std::string send_of(const RemoteCall& call, const std::string& id) {
  std::string xml = fmt::format("<send type=\"thrift\"{}{}", xml_attribute("target", call.service),
                                xml_attribute("event", call.method));
  if (!id.empty()) xml += xml_attribute("id", id);
  if (call.arguments.empty()) return xml + "/>";
  xml += ">\n";
  for (const auto& [name, value] : call.arguments)
    xml += fmt::format("<param{}{}/>\n", xml_attribute("name", name), xml_attribute("expr", value));
  return xml + "</send>";
}

Snippet translate_snippet(const std::string& source, const SourceSpan& place, Names& names) {
  return StatementTranslator(source, place, names).run();
}

}  // namespace sentree::import
