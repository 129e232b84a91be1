// Names in requirements.

#include <algorithm>

#include <fmt/format.h>

#include "sentree/lsp/detail/collector.h"
#include "sentree/lsp/lines.h"
#include "sentree/lsp/symbols.h"
#include "sentree/monitor/requirement.h"
#include "sentree/monitor/requirement_lexer.h"
#include "sentree/text/encoding.h"

namespace sentree::lsp {

namespace {

class RequirementCollector : public Collector {
 public:
  using Token = monitor::RequirementToken;
  using Kind = Token::Kind;

  RequirementCollector(std::string_view text, const std::string& file, const Names& names)
      : Collector(text, names), file_(file) {
    const std::size_t begin =
        text.starts_with(sentree::text::kByteOrderMark) ? sentree::text::kByteOrderMark.size() : 0;
    Diagnostics ignored;
    tokens_ = monitor::lex_requirements(text.substr(begin), file, ignored);
    const Offsets offsets(text.substr(begin));
    for (const Token& token : tokens_) places_.push_back(begin + offsets.of(token.span));
    for (std::size_t i = 0; i < tokens_.size(); ++i) {
      if (!begins_definition(i) || is_word_of_requirements(tokens_[i + 1].text)) continue;
      (tokens_[i].text == "event" ? events_ : values_).insert(tokens_[i + 1].text);
    }
    for (std::size_t i = 0; i < tokens_.size();) i = statement(i);
  }

 private:
  // What a parenthesis belongs to.
  struct Open {
    std::string_view of;    // the word before it; empty: it groups
    bool in_where = false;  // of a source: its members can be asked for
  };

  void add_own(SymbolKind kind, std::size_t i, bool defines) {
    add(kind, kind == SymbolKind::kRequirement ? tokens_[i].text : fmt::format("{}#{}", file_, tokens_[i].text),
        places_[i], places_[i] + tokens_[i].text.size(), defines);
  }

  // Behind the statement that begins there.
  std::size_t statement(std::size_t i) {
    open_.clear();
    parameters_.clear();
    has_trigger_ = false;
    if (begins_definition(i)) {
      add_own(tokens_[i].text == "event" ? SymbolKind::kEvent : SymbolKind::kDefinition, i + 1, true);
      i = behind_parameters(i + 2);
    } else if (tokens_[i].starts_line && tokens_[i].kind == Kind::kName && colon_behind(i) != 0) {
      add_own(SymbolKind::kRequirement, i, true);
      i = colon_behind(i);
    }
    do look(i);
    while (++i < tokens_.size() && !begins_statement(i));
    return i;
  }
  std::size_t behind_parameters(std::size_t i) {
    if (is(i, "(") && tokens_[i].adjacent) {
      for (++i; tokens_[i].kind == Kind::kName || is(i, ","); ++i) parameters_.insert(tokens_[i].text);
    }
    if (is(i, ")")) ++i;
    // A unit, until its bracket is closed.
    if (is(i, "[")) {
      while (i + 1 < tokens_.size() && !is(i, "]") && !tokens_[i + 1].starts_line) ++i;
    }
    return std::min(i, tokens_.size() - 1);
  }

  void look(std::size_t i) {
    const Token& token = tokens_[i];
    if (is(i, "(")) {
      const bool is_call = i > 0 && tokens_[i - 1].kind == Kind::kName && takes_name(tokens_[i - 1].text);
      open_.push_back({is_call ? std::string_view(tokens_[i - 1].text) : std::string_view(), in_where()});
    } else if (is(i, ")") && !open_.empty()) {
      open_.pop_back();
    } else if (token.kind == Kind::kString) {
      const std::size_t from = places_[i] + 1;
      if (!named(i, from, from + token.text.size())) place(from, from + token.text.size());
    } else if (token.kind == Kind::kName && !named(i, places_[i], places_[i] + token.text.size())) {
      word(i);
    }
  }

  // What an observation is called or a leaf, where one of them is to stand.
  bool named(std::size_t i, std::size_t from, std::size_t to) {
    if (is_word_before(i, 1, "from")) {
      path(from, to, true);
      return true;
    }
    if (open_.empty() || open_.back().of.empty() || !is(i - 1, "(")) return false;
    if (open_.back().of == "node") {
      path(from, to, false);
    } else if (open_.back().of != "event" || !is(i + 1, "(") || !takes_name(tokens_[i].text)) {
      if (open_.back().of == "event" && events_.contains(tokens_[i].text))
        add_own(SymbolKind::kEvent, i, false);
      else
        dotted(from, to);
    }
    return true;
  }

  // A name in a condition: of a definition, or what stands for itself.
  void word(std::size_t i) {
    const Token& token = tokens_[i];
    if (token.text == "where" && !open_.empty()) open_.back().in_where = true;
    if (token.text == "whenever" || (token.text == "once" && may_begin_body(i))) {
      has_trigger_ = true;
      return;
    }
    if (is_of_grammar(i) || parameters_.contains(token.text)) return;
    if (values_.contains(token.text)) {
      if (!in_where() || !is_member(token.text)) add_own(SymbolKind::kDefinition, i, false);
    } else if (names_.locations.contains(token.text)) {
      if (!is_word_of_requirements(token.text) && (!in_where() || !is_member(token.text)))
        add(SymbolKind::kLocation, token.text, places_[i], places_[i] + token.text.size());
    } else if (token.text.find('.') != std::string::npos && !in_where()) {
      dotted(places_[i], places_[i] + token.text.size());
    }
  }

  // Where no name of a definition can stand: a member, a unit, a status, who shall, "at least", "at most".
  [[nodiscard]] bool is_of_grammar(std::size_t i) const {
    const Token& token = tokens_[i];
    if (i == 0) return false;
    const bool is_unit = tokens_[i - 1].kind == Kind::kNumber && !token.starts_line;
    const bool is_ratio = i >= 3 && is(i - 1, "/") && token.adjacent && tokens_[i - 1].adjacent &&
                          tokens_[i - 2].kind == Kind::kName && tokens_[i - 3].kind == Kind::kNumber;
    if (is(i - 1, ".") || is_unit || is_ratio || is_word_before(i, 1, "in") || is_name(i + 1, "shall")) return true;
    return (token.text == "at" && (is_name(i + 1, "least") || is_name(i + 1, "most"))) ||
           (token.text == "every" && is_word_before(i, 1, "least"));
  }
  [[nodiscard]] bool may_begin_body(std::size_t i) const {
    return i > 0 && !has_trigger_ && open_.empty() &&
           (is(i - 1, ":") || is(i - 1, ",") || is_word_before(i, 1, "globally"));
  }
  // Of what is observed: whether `where` takes the name for one of its members.
  static bool is_member(const std::string& name) {
    return monitor::parse_requirements(fmt::format("r: always reply(a.b where {}).\n", name), {}).value.has_value();
  }
  static bool takes_name(std::string_view word) {
    constexpr std::array<std::string_view, 7> kWords{"request",     "reply", "error", "late",
                                                     "observation", "node",  "event"};
    return std::find(kWords.begin(), kWords.end(), word) != kWords.end();
  }
  [[nodiscard]] bool in_where() const { return !open_.empty() && open_.back().in_where; }

  [[nodiscard]] bool begins_statement(std::size_t i) const {
    return begins_definition(i) || (tokens_[i].starts_line && tokens_[i].kind == Kind::kName && colon_behind(i) != 0);
  }
  [[nodiscard]] bool begins_definition(std::size_t i) const {
    return tokens_[i].kind == Kind::kName && tokens_[i].starts_line &&
           (tokens_[i].text == "let" || tokens_[i].text == "event") && i + 1 < tokens_.size() &&
           tokens_[i + 1].kind == Kind::kName;
  }
  // Of NAME [ "(" attributes ")" ] [ STRING ] ":"; 0: it is something else.
  [[nodiscard]] std::size_t colon_behind(std::size_t i) const {
    std::size_t next = i + 1;
    if (is(next, "(")) {
      for (++next; is(next, ",") || (next < tokens_.size() && tokens_[next].kind == Kind::kName);) ++next;
      if (is(next, ")")) ++next;
    }
    if (next < tokens_.size() && tokens_[next].kind == Kind::kString) ++next;
    return is(next, ":") ? next : 0;
  }
  [[nodiscard]] bool is(std::size_t i, std::string_view symbol) const {
    return i < tokens_.size() && tokens_[i].kind == Kind::kSymbol && tokens_[i].text == symbol;
  }
  [[nodiscard]] bool is_name(std::size_t i, std::string_view word) const {
    return i < tokens_.size() && tokens_[i].kind == Kind::kName && tokens_[i].text == word;
  }
  [[nodiscard]] bool is_word_before(std::size_t i, std::size_t back, std::string_view word) const {
    return i >= back && is_name(i - back, word);
  }

  const std::string& file_;
  std::vector<Token> tokens_;
  std::vector<std::size_t> places_;
  std::set<std::string, std::less<>> values_;  // what `let` defines
  std::set<std::string, std::less<>> events_;  // what `event` does
  // Of the statement that is looked at.
  std::set<std::string, std::less<>> parameters_;
  std::vector<Open> open_;
  bool has_trigger_ = false;
};

}  // namespace

bool is_word_of_requirements(const std::string& name) {
  return !monitor::parse_requirements(fmt::format("let {} = true\n", name), {}).value.has_value();
}

Occurrences occurrences_in_requirements(std::string_view text, const std::string& file, const Names& names) {
  return std::move(RequirementCollector(text, file, names).found);
}

}  // namespace sentree::lsp
