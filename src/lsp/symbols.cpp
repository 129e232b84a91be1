#include "sentree/lsp/symbols.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <filesystem>

#include "sentree/base/ascii.h"
#include "sentree/lsp/lines.h"
#include "sentree/monitor/requirement.h"
#include "sentree/monitor/requirement_lexer.h"

namespace sentree::lsp {

namespace {

using text::XmlElement;

// Calls `visit(from, to)` for each word between white space.
template <class Visit>
void each_word(std::string_view text, std::size_t from, std::size_t to, Visit&& visit) {
  while (from < to) {
    while (from < to && is_space(text[from])) ++from;
    const std::size_t begin = from;
    while (from < to && !is_space(text[from])) ++from;
    if (from > begin) visit(begin, from);
  }
}

class Collector {
 public:
  Collector(std::string_view text, const Names& names) : text_(text), names_(names) {}

  void add(SymbolKind kind, std::string name, std::size_t from, std::size_t to, bool defines = false) {
    if (from < to && to <= text_.size()) found.push_back({{kind, std::move(name)}, from, to, defines});
  }
  [[nodiscard]] std::string at(std::size_t from, std::size_t to) const {
    return std::string(text_.substr(from, to - from));
  }

  // Services, methods and nodes in the name of an observation, or in a pattern of such names.
  bool dotted(std::size_t from, std::size_t to) {
    const std::string_view name = text_.substr(from, to - from);
    const Observed parts = observed(name, names_);
    if (parts.service != nullptr) {
      const std::size_t end = from + parts.service_name.size();
      add(SymbolKind::kService, std::string(parts.service_name), from, end);
      if (parts.method != nullptr) {
        const Symbol symbol = method_symbol(*parts.method, parts.service->file);
        add(symbol.kind, symbol.name, end + 1, end + 1 + parts.method_name.size());
      }
      return true;
    }
    return path(from, to, true);
  }

  // The path of a node, with its SubTrees, as far as names in it are known; with what a message of it is called behind.
  bool path(std::size_t from, std::size_t to, bool in_message) {
    const std::string_view written = text_.substr(from, to - from);
    if (written.find('.') == std::string_view::npos || names_.nodes.contains(written))
      return node(from, to, true, in_message);
    constexpr std::array<std::string_view, 7> kMessages{"tick", "halt", "cancel", "timer", "topic", "log", "given_up"};
    bool is_known = false;
    for (std::size_t begin = from; begin < to;) {
      const std::size_t end = std::min(written.find('.', begin - from), written.size()) + from;
      const std::string_view name = text_.substr(begin, end - begin);
      if (in_message && is_known && std::find(kMessages.begin(), kMessages.end(), name) != kMessages.end()) break;
      // The number of one of several leaves: GoTo::7.
      const std::size_t number = std::min(name.find("::"), name.size());
      if (!node(begin, begin + number, end == to, in_message)) break;
      is_known = true;
      begin = end + 1;
    }
    return is_known;
  }

  // A node, by its name, or by its ID where it has none: that of a SubTree is a tree's.
  bool node(std::size_t from, std::size_t to, bool is_last, bool in_message) {
    std::string name = at(from, to);
    if (names_.nodes.contains(name)) return add_node(SymbolKind::kNode, std::move(name), from, to, in_message);
    if (const auto spelled = names_.spelled.find(name); in_message && spelled != names_.spelled.end())
      return add_node(SymbolKind::kNode, spelled->second, from, to, true);
    const bool is_skill = names_.skills.contains(name);
    if (names_.trees.contains(name) && !(is_last && is_skill))
      return add_node(SymbolKind::kTree, std::move(name), from, to, in_message);
    return is_skill && add_node(SymbolKind::kSkill, std::move(name), from, to, in_message);
  }

  Occurrences found;

 private:
  bool add_node(SymbolKind kind, std::string name, std::size_t from, std::size_t to, bool in_message) {
    add(kind, std::move(name), from, to);
    if (in_message && !found.empty()) found.back().in_message = true;
    return true;
  }

 protected:
  void place(std::size_t from, std::size_t to) {
    if (to <= text_.size() && names_.locations.contains(text_.substr(from, to - from)))
      add(SymbolKind::kLocation, at(from, to), from, to);
  }

  // Names of places in an expression or a script: whole texts, and what tables keep by such names. `owner` is what the
  // expression is the value of.
  void places_in_code(std::size_t from, std::size_t to, const std::string& owner = {}) {
    const std::string_view code = text_.substr(0, to);
    for (std::size_t i = from; i < to;) {
      if (is_word(code[i])) {
        const std::size_t end = end_of_word(code, i);
        if (is_of_table(code, from, i, end)) place(i, end);
        i = end;
        continue;
      }
      if (code[i] == '{') table(code, from, i, owner);
      std::size_t begin = 0;
      std::size_t end = 0;
      const std::size_t next = after_token(code, i, begin, end);
      if (begin < end && !code.substr(from, i - from).ends_with("In(")) place(begin, end);
      i = next;
    }
  }

 private:
  static std::size_t end_of_word(std::string_view code, std::size_t at) {
    while (at < code.size() && is_word(code[at])) ++at;
    return at;
  }
  static std::size_t after_spaces(std::string_view code, std::size_t at) {
    while (at < code.size() && is_space(code[at])) ++at;
    return at;
  }

  // Behind a comment, a text (which lies from `begin` to `end`) or one other character.
  static std::size_t after_token(std::string_view code, std::size_t at, std::size_t& begin, std::size_t& end) {
    const std::string_view rest = code.substr(at);
    constexpr std::array<std::pair<std::string_view, std::string_view>, 3> kComments{
        {{"//", "\n"}, {"/*", "*/"}, {"<!--", "-->"}}};
    for (const auto& [opens, closes] : kComments) {
      if (!rest.starts_with(opens)) continue;
      const std::size_t found = code.find(closes, at + opens.size());
      return found == std::string_view::npos ? code.size() : found + closes.size();
    }
    for (const std::string_view quote : {"'", "\"", "`", "&apos;", "&quot;"}) {
      if (!rest.starts_with(quote)) continue;
      begin = end = at + quote.size();
      while (end < code.size() && !code.substr(end).starts_with(quote)) end += code[end] == '\\' ? 2 : 1;
      end = std::min(end, code.size());
      return std::min(end + quote.size(), code.size());
    }
    return at + 1;
  }

  // {kitchen: 2, study: 3}: an object all of whose members are called like places.
  void table(std::string_view code, std::size_t first, std::size_t open, const std::string& owner) {
    std::vector<std::pair<std::size_t, std::size_t>> keys;
    int depth = 0;
    bool at_key = true;
    for (std::size_t i = open + 1; i < code.size();) {
      i = after_spaces(code, i);
      if (i == code.size()) return;
      if (at_key && is_word(code[i])) {
        const std::size_t end = end_of_word(code, i);
        const std::size_t colon = after_spaces(code, end);
        if (colon == code.size() || code[colon] != ':' || !names_.locations.contains(code.substr(i, end - i))) return;
        keys.emplace_back(i, end);
        at_key = false;
        i = colon + 1;
        continue;
      }
      const char c = code[i];
      if (c == '}' && depth == 0) break;
      if (c == ',' && depth == 0)
        at_key = true;
      else if (at_key)
        return;
      if (c == '(' || c == '[' || c == '{') ++depth;
      if (c == ')' || c == ']' || c == '}') --depth;
      std::size_t begin = 0;
      std::size_t end = 0;
      i = after_token(code, i, begin, end);
    }
    // A single one may be the argument of a call.
    if (keys.empty() || (keys.size() == 1 && is_member(code, keys.front()))) return;
    for (const auto& [from, to] : keys) place(from, to);
    std::size_t before = open;
    while (before > first && (is_space(code[before - 1]) || code[before - 1] == '(')) --before;
    if (before == first && !owner.empty()) tables_.insert(owner);
    if (before == first || code[before - 1] != '=') return;
    for (--before; before > first && is_space(code[before - 1]);) --before;
    std::size_t name = before;
    while (name > first && is_word(code[name - 1])) --name;
    tables_.insert(std::string(code.substr(name, before - name)));
  }
  [[nodiscard]] bool is_member(std::string_view code, const std::pair<std::size_t, std::size_t>& word) const {
    return names_.members.contains(code.substr(word.first, word.second - word.first));
  }

  // x.WORD, where x is a table, or no message has such a member.
  [[nodiscard]] bool is_of_table(std::string_view code, std::size_t first, std::size_t from, std::size_t to) const {
    if (from == first || code[from - 1] != '.') return false;
    std::size_t begin = from - 1;
    while (begin > first && is_word(code[begin - 1])) --begin;
    if (tables_.contains(code.substr(begin, from - 1 - begin))) return true;
    while (begin > first && (is_word(code[begin - 1]) || code[begin - 1] == '.')) --begin;
    return !code.substr(begin).starts_with("_event.") && !is_member(code, {from, to});
  }

  std::set<std::string, std::less<>> tables_;

 protected:
  std::string_view text_;
  const Names& names_;
};

const text::XmlAttributePlace* place_of(const XmlElement& element, std::string_view name, const std::string& source) {
  for (const text::XmlAttributePlace& place : element.attribute_places()) {
    if (std::string_view(source).substr(place.name_begin, place.name_end - place.name_begin) == name) return &place;
  }
  return nullptr;
}

// ---- Trees ----

constexpr std::array<std::string_view, 5> kByAttribute{"Action", "Condition", "Control", "Decorator", "SubTree"};

class TreeCollector : public Collector {
 public:
  TreeCollector(const text::XmlDocument& document, const Names& names)
      : Collector(document.source(), names), source_(document.source()) {
    for (XmlElement child = document.root().first_child(); child; child = child.next_sibling()) {
      if (child.local_name() == "BehaviorTree") {
        attribute(child, "ID", SymbolKind::kTree, true);
        for (XmlElement node = child.first_child(); node; node = node.next_sibling())
          text::for_each_element(node, [&](const XmlElement& element) { of_node(element); });
      } else if (child.local_name() == "TreeNodesModel") {
        for (XmlElement model = child.first_child(); model; model = model.next_sibling()) {
          attribute(model, "ID", model.local_name() == "SubTree" ? SymbolKind::kTree : SymbolKind::kSkill, false);
          text::for_each_element(model, [&](const XmlElement& part) {
            if (const auto* const value = place_of(part, "default", source_))
              place(value->value_begin, value->value_end);
          });
        }
      }
    }
    attribute(document.root(), "main_tree_to_execute", SymbolKind::kTree, false);
  }

 private:
  void attribute(const XmlElement& element, std::string_view name, SymbolKind kind, bool defines) {
    const auto* const place = place_of(element, name, source_);
    if (place == nullptr) return;
    std::string value = at(place->value_begin, place->value_end);
    if (kind == SymbolKind::kSkill && names_.builtins.contains(value)) return;
    add(kind, std::move(value), place->value_begin, place->value_end, defines);
  }

  void of_node(const XmlElement& element) {
    static const std::set<std::string, std::less<>> kOfCode{"code", "if", "else"};
    const std::string_view tag = element.name();
    const bool is_builtin = names_.builtins.contains(tag);
    const bool by_attribute = std::find(kByAttribute.begin(), kByAttribute.end(), tag) != kByAttribute.end();
    const bool is_tree = tag == "SubTree";
    if (by_attribute) {
      attribute(element, "ID", is_tree ? SymbolKind::kTree : SymbolKind::kSkill, false);
    } else if (!is_builtin) {
      const std::size_t from = element.offset() + 1;
      add(SymbolKind::kSkill, std::string(tag), from, from + tag.size());
      // Only an end tag has nothing but its name before it: of <A/> it is not looked for.
      std::size_t end = element.end_offset() - 1;
      while (end > from && is_space(source_[end - 1])) --end;
      const std::size_t last = end - std::min(end, tag.size());
      if (last > from + 1 && source_.compare(last - 2, 2, "</") == 0 && source_.compare(last, tag.size(), tag) == 0)
        add(SymbolKind::kSkill, std::string(tag), last, end);
    }
    attribute(element, "name", SymbolKind::kNode, true);
    for (const text::XmlAttributePlace& written : element.attribute_places()) {
      const std::string name = at(written.name_begin, written.name_end);
      if (name == "name" || name == "ID" || name == "output_key") continue;
      if (name.starts_with('_') || (is_builtin && kOfCode.contains(name)))
        places_in_code(written.value_begin, written.value_end);
      else
        place(written.value_begin, written.value_end);
    }
  }

  const std::string& source_;
};

// ---- Charts ----

class ChartCollector : public Collector {
 public:
  ChartCollector(const text::XmlDocument& document, const std::string& file, const Names& names)
      : Collector(document.source(), names), source_(document.source()), file_(file) {
    const auto skill = names.charts.find(file);
    if (skill != names.charts.end()) {
      const auto* const place = place_of(document.root(), "name", source_);
      if (place != nullptr && at(place->value_begin, place->value_end) == skill->second) {
        add(SymbolKind::kSkill, skill->second, place->value_begin, place->value_end, true);
      } else {
        const std::size_t from = document.root().offset() + 1;
        add(SymbolKind::kSkill, skill->second, from, from + document.root().name().size(), true);
      }
    }
    text::for_each_element(document.root(), [&](const XmlElement& element) {
      of_element(element);
      places_of(element);
    });
    in_expressions(document.root());
  }

 private:
  void of_element(const XmlElement& element) {
    const std::string_view tag = element.local_name();
    const bool is_state = tag == "state" || tag == "parallel" || tag == "final" || tag == "history";
    const bool is_send = tag == "send";
    const bool to_service =
        is_send && element.attribute("type").value_or("") == "thrift" && element.attribute("target").has_value();
    for (const text::XmlAttributePlace& place : element.attribute_places()) {
      const std::string name = at(place.name_begin, place.name_end);
      const std::size_t from = place.value_begin;
      const std::size_t to = place.value_end;
      if (is_state && name == "id") {
        add(SymbolKind::kState, fmt::format("{}#{}", file_, at(from, to)), from, to, true);
      } else if (tag == "data" && name == "id") {
        add(SymbolKind::kData, fmt::format("{}#{}", file_, at(from, to)), from, to, true);
      } else if (name == "initial" || (tag == "transition" && name == "target")) {
        each_word(text_, from, to, [&](std::size_t begin, std::size_t end) {
          add(SymbolKind::kState, fmt::format("{}#{}", file_, at(begin, end)), begin, end);
        });
      } else if (tag == "transition" && name == "event") {
        each_word(text_, from, to, [&](std::size_t begin, std::size_t end) { event(begin, end); });
      } else if (to_service && name == "target") {
        if (names_.services.contains(at(from, to))) add(SymbolKind::kService, at(from, to), from, to);
      } else if (to_service && name == "event") {
        const auto service = names_.services.find(*element.attribute("target"));
        if (service == names_.services.end() || !service->second.service) continue;
        if (const idl::Method* method = service->second.service->find(at(from, to))) {
          const Symbol symbol = method_symbol(*method, service->second.file);
          add(symbol.kind, symbol.name, from, to);
        }
      } else if ((tag == "assign" && name == "location") || (tag == "param" && name == "expr")) {
        if (std::all_of(text_.begin() + static_cast<std::ptrdiff_t>(from),
                        text_.begin() + static_cast<std::ptrdiff_t>(to), is_word))
          add(SymbolKind::kData, fmt::format("{}#{}", file_, at(from, to)), from, to);
      }
    }
  }

  void places_of(const XmlElement& element) {
    static const std::set<std::string, std::less<>> kOfCode{"cond",      "expr",       "location", "array",
                                                            "delayexpr", "targetexpr", "eventexpr"};
    static const std::set<std::string, std::less<>> kCode{"script", "data", "assign", "content"};
    const std::string owner(element.attribute(element.local_name() == "data" ? "id" : "location").value_or(""));
    for (const text::XmlAttributePlace& written : element.attribute_places()) {
      if (kOfCode.contains(at(written.name_begin, written.name_end)))
        places_in_code(written.value_begin, written.value_end, owner);
    }
    if (!kCode.contains(element.local_name())) return;
    const std::string_view code = element.inner_source();
    const auto from = static_cast<std::size_t>(code.data() - source_.data());
    if (!code.empty()) places_in_code(from, from + code.size(), owner);
  }

  void event(std::size_t from, std::size_t to) {
    constexpr std::string_view kDone = "done.state.";
    if (text_.substr(from, to - from).starts_with(kDone)) {
      const std::size_t id = from + kDone.size();
      add(SymbolKind::kState, fmt::format("{}#{}", file_, at(id, to)), id, to);
    } else {
      dotted(from, to);
    }
  }

  // In('state'), and what a message's source is compared with.
  void in_expressions(const XmlElement& root) {
    for (std::size_t place = root.offset(); place < root.end_offset(); ++place) {
      const char quote = text_[place];
      if (quote != '\'' && quote != '"') continue;
      const std::size_t from = place + 1;
      std::size_t to = from;
      while (to < root.end_offset() && (is_word(text_[to]) || text_[to] == '-' || text_[to] == '.')) ++to;
      if (to == from || to >= root.end_offset() || text_[to] != quote) continue;
      std::size_t before = place;
      while (before > 0 && is_space(text_[before - 1])) --before;
      if (before >= 3 && text_.substr(before - 3, 3) == "In(" && (before == 3 || !is_word(text_[before - 4]))) {
        add(SymbolKind::kState, fmt::format("{}#{}", file_, at(from, to)), from, to);
      } else if (before > 0 && text_[before - 1] == '=') {
        while (before > 0 && (text_[before - 1] == '=' || text_[before - 1] == '!' || is_space(text_[before - 1])))
          --before;
        constexpr std::string_view kSource = "_event.data.source";
        if (before >= kSource.size() && text_.substr(before - kSource.size(), kSource.size()) == kSource)
          path(from, to, true);
      }
      place = to;
    }
  }

  const std::string& source_;
  const std::string& file_;
};

// ---- Requirements ----

class RequirementCollector : public Collector {
 public:
  using Token = monitor::RequirementToken;
  using Kind = Token::Kind;

  RequirementCollector(std::string_view text, const std::string& file, const Names& names)
      : Collector(text, names), file_(file) {
    constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
    const std::size_t begin = text.starts_with(kByteOrderMark) ? kByteOrderMark.size() : 0;
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

// ---- YAML ----

// Where a scalar's text stands; nothing where it is not written as it reads.
std::optional<std::size_t> place_of(std::string_view text, const Offsets& offsets, const text::YamlNode& scalar) {
  const std::size_t from = offsets.of(scalar.span) + (scalar.quoted ? 1 : 0);
  if (scalar.scalar.empty() || from > text.size() || text.substr(from, scalar.scalar.size()) != scalar.scalar)
    return std::nullopt;
  return from;
}

class YamlCollector : public Collector {
 public:
  YamlCollector(std::string_view text, bool is_project, std::string folder, const Names& names)
      : Collector(text, names), is_project_(is_project), folder_(std::move(folder)), offsets_(text) {}

  // What calls, constants of skills and the blackboard are given, and where worlds begin.
  void places(const text::YamlNode& node, bool is_given = false, bool in_world = false) {
    static const std::set<std::string, std::less<>> kGiven{"args",  "data",       "blackboard",
                                                           "ports", "parameters", "value"};
    if (const auto from = node.is_scalar() && is_given ? place_of(node) : std::nullopt)
      place(*from, *from + node.scalar.size());
    for (const text::YamlNode& item : node.items) places(item, is_given, in_world);
    for (const auto& [key, value] : node.entries) {
      const std::string& name = key.scalar;
      if (const auto from = place_of(key); from && name.find('.') != std::string::npos) place_in_path(*from, name);
      if (in_world && (name == "locations" || name == "areas")) {
        for (const auto& [place_name, where] : value.entries) {
          if (const auto from = place_of(place_name)) place(*from, *from + place_name.scalar.size());
        }
        continue;
      }
      const bool begins = in_world && (name == "start" || name == "pose");
      places(value, is_given || begins || kGiven.contains(name), in_world || (name == "world" && value.is_mapping()));
    }
  }

  void section(const text::YamlNode& root) {
    if (const text::YamlNode* const processes = root.find("processes")) {
      for (const auto& [name, entry] : processes->entries) processes_.insert(name.scalar);
    }
    for (const auto& [key, value] : root.entries) {
      if (key.scalar == "services" || key.scalar == "observe") {
        for (const auto& [name, entry] : value.entries) {
          scalar(name, SymbolKind::kService, is_project_);
          interface(entry);
          if (const text::YamlNode* publish = entry.find("publish")) methods(name.scalar, *publish);
        }
      } else if (key.scalar == "skills") {
        for (const auto& [name, entry] : value.entries) {
          if (const auto from = place_of(name)) path(*from, *from + name.scalar.size(), false);
          any(entry, {});
        }
      } else if (key.scalar == "monitors" && value.is_mapping()) {
        for (const auto& [name, verdict] : value.entries) scalar(name, SymbolKind::kRequirement, false);
      } else if (key.scalar == "monitors") {
        for (const text::YamlNode& entry : value.items) monitor(entry);
      } else if (key.scalar == "override" || key.scalar == "expect") {
        section(value);
      } else if (key.scalar == "mission") {
        if (const text::YamlNode* tree = value.find("tree")) scalar(*tree, SymbolKind::kTree, false);
      } else {
        any(value, key.scalar);
      }
    }
  }

 private:
  // world.locations.NAME, as parameters of campaigns are written.
  void place_in_path(std::size_t from, std::string_view path) {
    for (const std::string_view section : {"locations.", "areas."}) {
      const std::size_t at = path.find(section);
      if (at == std::string_view::npos || (at > 0 && path[at - 1] != '.')) continue;
      const std::size_t begin = at + section.size();
      place(from + begin, from + std::min(path.find('.', begin), path.size()));
    }
  }

  void scalar(const text::YamlNode& node, SymbolKind kind, bool defines) {
    if (const auto from = place_of(node)) add(kind, node.scalar, *from, *from + node.scalar.size(), defines);
  }

  void interface(const text::YamlNode& entry) {
    const text::YamlNode* const written = entry.find("interface");
    if (written == nullptr) return;
    const auto from = place_of(*written);
    const std::size_t slash = written->scalar.rfind('/');
    if (!from || slash == std::string::npos) return;
    for (const auto& [name, service] : names_.services) {
      if (service.interface == written->scalar.substr(slash + 1) &&
          service.file.ends_with(written->scalar.substr(0, slash)))
        return add(SymbolKind::kInterface, fmt::format("{}#{}", service.file, service.interface), *from + slash + 1,
                   *from + written->scalar.size());
    }
  }

  void methods(const std::string& name, const text::YamlNode& publish) {
    const auto service = names_.services.find(name);
    if (service == names_.services.end() || !service->second.service) return;
    for (const auto& [method, rate] : publish.entries) {
      const idl::Method* const known = service->second.service->find(method.scalar);
      const auto from = place_of(method);
      if (known == nullptr || !from) continue;
      const Symbol symbol = method_symbol(*known, service->second.file);
      add(symbol.kind, symbol.name, *from, *from + method.scalar.size());
    }
  }

  void monitor(const text::YamlNode& entry) {
    const text::YamlNode* const file = entry.find("file");
    const std::string chart =
        file == nullptr ? "" : (std::filesystem::path(folder_) / file->scalar).lexically_normal().string();
    if (const text::YamlNode* states = entry.find("violated")) {
      const auto state = [&](const text::YamlNode& node) {
        if (const auto from = place_of(node))
          add(SymbolKind::kState, fmt::format("{}#{}", chart, node.scalar), *from, *from + node.scalar.size());
      };
      if (states->is_scalar()) state(*states);
      for (const text::YamlNode& item : states->items) state(item);
    }
    const text::YamlNode* const name = entry.find("name");
    if (name != nullptr) {
      scalar(*name, SymbolKind::kRequirement, true);
    } else if (file != nullptr && chart.ends_with(".scxml")) {
      const std::string stem = std::filesystem::path(chart).stem().string();
      if (const auto from = place_of(*file)) {
        const std::size_t in = file->scalar.rfind(stem);
        if (in != std::string::npos) add(SymbolKind::kRequirement, stem, *from + in, *from + in + stem.size(), true);
      }
    }
    for (const auto& [key, value] : entry.entries) {
      if (key.scalar == "events" || key.scalar == "gate") any(value, key.scalar);
    }
  }

  // Observations, services and nodes, wherever they are named; texts of other kinds are not looked into.
  void any(const text::YamlNode& node, std::string_view key) {
    static const std::set<std::string, std::less<>> kOther{
        "description", "file",     "world",   "at",        "data",  "args",      "reason",  "rate",
        "palette",     "title",    "plugins", "interface", "name",  "model",     "choices", "orders",
        "loop",        "fair",     "value",   "status",    "clock", "component", "listen",  "path",
        "by",          "protocol", "tree",    "number",    "count", "place",     "state",   "chart"};
    if (kOther.contains(key)) return;
    if (node.is_scalar()) {
      const auto from = place_of(node);
      if (!from) return;
      const std::size_t to = *from + node.scalar.size();
      if (key == "node")
        path(*from, to, false);
      else if (key == "monitor")
        scalar(node, SymbolKind::kRequirement, false);
      else if ((key != "kill" && key != "restart") || !processes_.contains(node.scalar))
        dotted(*from, to);
    }
    for (const text::YamlNode& item : node.items) any(item, key);
    for (const auto& [name, value] : node.entries) any(value, name.scalar);
    if (node.is_mapping()) breakpoint(node);
  }

  // {chart: "skill:LEAF", state: ID} or {chart: "monitor:NAME", state: ID}.
  void breakpoint(const text::YamlNode& node) {
    const text::YamlNode* const written = node.find("chart");
    const auto from = written != nullptr && written->is_scalar() ? place_of(*written) : std::nullopt;
    if (!from) return;
    const std::string_view chart = written->scalar;
    const std::size_t to = *from + chart.size();
    std::string file;
    if (constexpr std::string_view kSkill = "skill:"; chart.starts_with(kSkill)) {
      path(*from + kSkill.size(), to, true);
      const std::size_t dot = chart.rfind('.');
      const auto leaf = names_.leaves.find(chart.substr(dot == std::string_view::npos ? kSkill.size() : dot + 1));
      if (leaf != names_.leaves.end()) file = leaf->second;
    } else if (constexpr std::string_view kMonitor = "monitor:"; chart.starts_with(kMonitor)) {
      const std::string name(chart.substr(kMonitor.size()));
      add(SymbolKind::kRequirement, name, *from + kMonitor.size(), to);
      if (const auto monitor = names_.monitors.find(name); monitor != names_.monitors.end()) file = monitor->second;
    }
    const text::YamlNode* const state = node.find("state");
    const auto at = state != nullptr && state->is_scalar() && !file.empty() ? place_of(*state) : std::nullopt;
    if (at) add(SymbolKind::kState, fmt::format("{}#{}", file, state->scalar), *at, *at + state->scalar.size());
  }

  [[nodiscard]] std::optional<std::size_t> place_of(const text::YamlNode& scalar) const {
    return lsp::place_of(text_, offsets_, scalar);
  }

  bool is_project_;
  std::string folder_;
  Offsets offsets_;
  std::set<std::string, std::less<>> processes_;  // of a scenario: what they are called is killed first
};

}  // namespace

std::string written_name(const Symbol& symbol) {
  const bool has_file = symbol.kind == SymbolKind::kInterface || symbol.kind == SymbolKind::kMethod ||
                        symbol.kind == SymbolKind::kType || symbol.kind == SymbolKind::kState ||
                        symbol.kind == SymbolKind::kData || symbol.kind == SymbolKind::kDefinition ||
                        symbol.kind == SymbolKind::kEvent;
  std::string name = has_file ? symbol.name.substr(symbol.name.rfind('#') + 1) : symbol.name;
  if (symbol.kind == SymbolKind::kMethod) name = name.substr(name.find('.') + 1);
  return name;
}

bool is_word_of_requirements(const std::string& name) {
  return !monitor::parse_requirements(fmt::format("let {} = true\n", name), {}).value.has_value();
}

Symbol method_symbol(const idl::Method& method, const std::string& file) {
  const bool is_absolute = std::filesystem::path(method.span.file).is_absolute();
  return {SymbolKind::kMethod,
          fmt::format("{}#{}.{}", is_absolute ? method.span.file : file, method.service, method.name)};
}

Observed observed(std::string_view name, const Names& names) {
  Observed parts;
  const std::size_t dot = std::min(name.find('.'), name.size());
  const auto service = names.services.find(name.substr(0, dot));
  if (service == names.services.end()) return parts;
  parts.service = &service->second;
  parts.service_name = name.substr(0, dot);
  if (dot == name.size()) return parts;
  const std::string_view rest = name.substr(dot + 1);
  const std::size_t second = std::min(rest.find('.'), rest.size());
  parts.method_name = rest.substr(0, second);
  if (parts.service->service) parts.method = parts.service->service->find(parts.method_name);
  if (second < rest.size()) parts.kind = rest.substr(second + 1);
  return parts;
}

Occurrences occurrences_in_tree(const text::XmlDocument& document, const Names& names) {
  return std::move(TreeCollector(document, names).found);
}

Occurrences occurrences_in_chart(const text::XmlDocument& document, const std::string& file, const Names& names) {
  return std::move(ChartCollector(document, file, names).found);
}

Occurrences occurrences_in_requirements(std::string_view text, const std::string& file, const Names& names) {
  return std::move(RequirementCollector(text, file, names).found);
}

Occurrences occurrences_in_yaml(std::string_view text, const text::YamlNode& root, bool is_project,
                                const std::string& folder, const Names& names) {
  YamlCollector collector(text, is_project, folder, names);
  collector.section(root);
  collector.places(root);
  return std::move(collector.found);
}

Occurrences occurrences_in_world(std::string_view text, const text::YamlNode& root) {
  Occurrences found;
  const Offsets offsets(text);
  std::set<std::string, std::less<>> names;
  for (const char* section : {"locations", "areas"}) {
    const text::YamlNode* const places = root.find(section);
    if (places == nullptr) continue;
    for (const auto& [name, value] : places->entries) {
      names.insert(name.scalar);
      if (const auto from = place_of(text, offsets, name))
        found.push_back({{SymbolKind::kLocation, name.scalar}, *from, *from + name.scalar.size(), true});
    }
  }
  // Where a robot begins, and where a station is.
  const auto uses = [&](const auto& self, const text::YamlNode& node) -> void {
    for (const text::YamlNode& item : node.items) self(self, item);
    for (const auto& [key, value] : node.entries) {
      self(self, value);
      if ((key.scalar != "start" && key.scalar != "pose") || !value.is_scalar() || !names.contains(value.scalar))
        continue;
      if (const auto from = place_of(text, offsets, value))
        found.push_back({{SymbolKind::kLocation, value.scalar}, *from, *from + value.scalar.size(), false});
    }
  };
  uses(uses, root);
  return found;
}

Occurrences occurrences_in_interface(std::string_view text, const idl::Schema& schema, const std::string& file) {
  Occurrences found;
  const Offsets offsets(text);
  const auto define = [&](SymbolKind kind, const std::string& name, const std::string& symbol, const SourceSpan& span) {
    const std::size_t from = offsets.of(span);
    if (text.substr(from, name.size()) == name)
      found.push_back({{kind, fmt::format("{}#{}", file, symbol)}, from, from + name.size(), true});
  };
  std::set<std::string, std::less<>> types;
  for (const idl::Service& service : schema.services()) {
    define(SymbolKind::kInterface, service.name, service.name, service.span);
    for (const idl::Method& method : service.own_methods)
      define(SymbolKind::kMethod, method.name, fmt::format("{}.{}", service.name, method.name), method.span);
  }
  const auto define_types = [&](const auto& all) {
    for (const auto& type : all) {
      types.insert(type.name);
      define(SymbolKind::kType, type.name, type.name, type.span);
    }
  };
  define_types(schema.structures());
  define_types(schema.enumerations());
  define_types(schema.typedefs());
  // Every other word of that name outside of comments and texts is a use.
  std::set<std::size_t> defined;
  for (const Occurrence& occurrence : found) defined.insert(occurrence.from);
  for (std::size_t at = 0; at < text.size();) {
    const char c = text[at];
    const bool is_line = c == '#' || text.substr(at, 2) == "//";
    if (is_line || text.substr(at, 2) == "/*" || c == '"' || c == '\'') {
      const std::string_view end = is_line ? "\n" : c == '/' ? "*/" : text.substr(at, 1);
      const std::size_t close = text.find(end, at + (c == '/' ? 2 : 1));
      at = close == std::string_view::npos ? text.size() : close + end.size();
    } else if (is_word(c)) {
      const std::size_t from = at;
      while (at < text.size() && is_word(text[at])) ++at;
      const std::string_view word = text.substr(from, at - from);
      if (types.contains(word) && !defined.contains(from) && (from == 0 || text[from - 1] != '.'))
        found.push_back({{SymbolKind::kType, fmt::format("{}#{}", file, word)}, from, at, false});
    } else {
      ++at;
    }
  }
  return found;
}

}  // namespace sentree::lsp
