#include "sentree/lsp/symbols.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <filesystem>

#include "sentree/base/ascii.h"
#include "sentree/design/findings.h"
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
    const std::size_t dot = std::min(name.find('.'), name.size());
    if (names_.nodes.contains(name.substr(0, dot)) || names_.skills.contains(name.substr(0, dot))) {
      node(from, from + dot);
      return true;
    }
    return false;
  }

  // A leaf or another node, by its name, or by its ID where it has none.
  void node(std::size_t from, std::size_t to) {
    std::string name = at(from, to);
    if (names_.nodes.contains(name))
      add(SymbolKind::kNode, std::move(name), from, to);
    else if (names_.skills.contains(name))
      add(SymbolKind::kSkill, std::move(name), from, to);
  }

  Occurrences found;

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
      const std::string end = fmt::format("</{}", tag);
      const std::size_t last = std::string_view(source_).substr(0, element.end_offset()).rfind("</");
      if (last != std::string::npos && last > element.offset() && source_.compare(last, end.size(), end) == 0)
        add(SymbolKind::kSkill, std::string(tag), last + 2, last + end.size());
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
          node(from, to);
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
    Diagnostics ignored;
    tokens_ = monitor::lex_requirements(text, file, ignored);
    for (const Token& token : tokens_) places_.push_back(design::offset_of(text, token.span));
    std::set<std::string, std::less<>> defined;
    for (std::size_t i = 0; i + 1 < tokens_.size(); ++i) {
      if (begins_definition(i)) defined.insert(tokens_[i + 1].text);
    }
    for (std::size_t i = 0; i < tokens_.size(); ++i) {
      const Token& token = tokens_[i];
      if (token.kind == Kind::kString) place(places_[i] + 1, places_[i] + 1 + token.text.size());
      if (token.kind != Kind::kName) continue;
      const std::size_t from = places_[i];
      const std::size_t to = from + token.text.size();
      if (text.substr(from, token.text.size()) != token.text) continue;
      if (i > 0 && begins_definition(i - 1)) {
        add(SymbolKind::kDefinition, fmt::format("{}#{}", file, token.text), from, to, true);
      } else if (token.starts_line && begins_requirement(i)) {
        add(SymbolKind::kRequirement, token.text, from, to, true);
      } else if (is_before(i, "from") || (is_symbol(i, 1, "(") && is_word_before(i, 2, "node"))) {
        node(from, to);
      } else if (token.text.find('.') != std::string::npos && dotted(from, to)) {
        continue;
      } else if (const std::string first = token.text.substr(0, token.text.find('.')); defined.contains(first)) {
        add(SymbolKind::kDefinition, fmt::format("{}#{}", file, first), from, from + first.size());
      } else if (names.locations.contains(token.text)) {
        add(SymbolKind::kLocation, token.text, from, to);
      }
    }
  }

 private:
  [[nodiscard]] bool begins_definition(std::size_t i) const {
    return tokens_[i].kind == Kind::kName && tokens_[i].starts_line &&
           (tokens_[i].text == "let" || tokens_[i].text == "event") && i + 1 < tokens_.size() &&
           tokens_[i + 1].kind == Kind::kName;
  }
  // NAME [ "(" attributes ")" ] [ STRING ] ":"
  [[nodiscard]] bool begins_requirement(std::size_t i) const {
    std::size_t next = i + 1;
    const auto is = [&](std::string_view symbol) {
      return next < tokens_.size() && tokens_[next].kind == Kind::kSymbol && tokens_[next].text == symbol;
    };
    if (is("(")) {
      while (next < tokens_.size() && !is(")") && !is(":")) ++next;
      if (is(")")) ++next;
    }
    if (next < tokens_.size() && tokens_[next].kind == Kind::kString) ++next;
    return is(":");
  }
  [[nodiscard]] bool is_word_before(std::size_t i, std::size_t back, std::string_view word) const {
    return i >= back && tokens_[i - back].kind == Kind::kName && tokens_[i - back].text == word;
  }
  [[nodiscard]] bool is_before(std::size_t i, std::string_view word) const { return is_word_before(i, 1, word); }
  [[nodiscard]] bool is_symbol(std::size_t i, std::size_t back, std::string_view symbol) const {
    return i >= back && tokens_[i - back].kind == Kind::kSymbol && tokens_[i - back].text == symbol;
  }

  const std::string& file_;
  std::vector<Token> tokens_;
  std::vector<std::size_t> places_;
};

// ---- YAML ----

// Where a scalar's text stands; nothing where it is not written as it reads.
std::optional<std::size_t> place_of(std::string_view text, const text::YamlNode& scalar) {
  const std::size_t from = design::offset_of(text, scalar.span) + (scalar.quoted ? 1 : 0);
  if (scalar.scalar.empty() || from > text.size() || text.substr(from, scalar.scalar.size()) != scalar.scalar)
    return std::nullopt;
  return from;
}

class YamlCollector : public Collector {
 public:
  YamlCollector(std::string_view text, bool is_project, std::string folder, const Names& names)
      : Collector(text, names), is_project_(is_project), folder_(std::move(folder)) {}

  // What calls, constants of skills and the blackboard are given, and where worlds begin.
  void places(const text::YamlNode& node, bool is_given = false, bool in_world = false) {
    static const std::set<std::string, std::less<>> kGiven{"args",  "data",       "blackboard",
                                                           "ports", "parameters", "value"};
    if (const auto from = node.is_scalar() && is_given ? place_of(text_, node) : std::nullopt)
      place(*from, *from + node.scalar.size());
    for (const text::YamlNode& item : node.items) places(item, is_given, in_world);
    for (const auto& [key, value] : node.entries) {
      const std::string& name = key.scalar;
      if (const auto from = place_of(text_, key); from && name.find('.') != std::string::npos)
        place_in_path(*from, name);
      if (in_world && (name == "locations" || name == "areas")) {
        for (const auto& [place_name, where] : value.entries) {
          if (const auto from = place_of(text_, place_name)) place(*from, *from + place_name.scalar.size());
        }
        continue;
      }
      const bool begins = in_world && (name == "start" || name == "pose");
      places(value, is_given || begins || kGiven.contains(name), in_world || (name == "world" && value.is_mapping()));
    }
  }

  void section(const text::YamlNode& root) {
    for (const auto& [key, value] : root.entries) {
      if (key.scalar == "services" || key.scalar == "observe") {
        for (const auto& [name, entry] : value.entries) {
          scalar(name, SymbolKind::kService, is_project_);
          interface(entry);
          if (const text::YamlNode* publish = entry.find("publish")) methods(name.scalar, *publish);
        }
      } else if (key.scalar == "skills") {
        for (const auto& [name, entry] : value.entries) {
          if (const auto from = place_of(text_, name)) node(*from, *from + name.scalar.size());
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
    if (const auto from = place_of(text_, node)) add(kind, node.scalar, *from, *from + node.scalar.size(), defines);
  }

  void interface(const text::YamlNode& entry) {
    const text::YamlNode* const written = entry.find("interface");
    if (written == nullptr) return;
    const auto from = place_of(text_, *written);
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
      const auto from = place_of(text_, method);
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
        if (const auto from = place_of(text_, node))
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
      if (const auto from = place_of(text_, *file)) {
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
    static constexpr std::array<std::string_view, 11> kOther{
        "description", "file", "world", "at", "data", "args", "reason", "rate", "palette", "title", "plugins"};
    if (std::find(kOther.begin(), kOther.end(), key) != kOther.end()) return;
    if (node.is_scalar()) {
      const auto from = place_of(text_, node);
      if (!from) return;
      const std::size_t to = *from + node.scalar.size();
      if (!dotted(*from, to)) this->node(*from, to);
    }
    for (const text::YamlNode& item : node.items) any(item, key);
    for (const auto& [name, value] : node.entries) {
      if (name.scalar == "skill" || name.scalar == "kill") {
        if (const auto from = value.is_scalar() ? place_of(text_, value) : std::nullopt)
          this->node(*from, *from + value.scalar.size());
      } else if (name.scalar == "monitor") {
        if (value.is_scalar()) scalar(value, SymbolKind::kRequirement, false);
      } else {
        any(value, name.scalar);
      }
    }
  }

  bool is_project_;
  std::string folder_;
};

}  // namespace

std::string written_name(const Symbol& symbol) {
  const bool has_file = symbol.kind == SymbolKind::kInterface || symbol.kind == SymbolKind::kMethod ||
                        symbol.kind == SymbolKind::kType || symbol.kind == SymbolKind::kState ||
                        symbol.kind == SymbolKind::kData || symbol.kind == SymbolKind::kDefinition;
  std::string name = has_file ? symbol.name.substr(symbol.name.find('#') + 1) : symbol.name;
  if (symbol.kind == SymbolKind::kMethod) name = name.substr(name.find('.') + 1);
  return name;
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
  std::set<std::string, std::less<>> names;
  for (const char* section : {"locations", "areas"}) {
    const text::YamlNode* const places = root.find(section);
    if (places == nullptr) continue;
    for (const auto& [name, value] : places->entries) {
      names.insert(name.scalar);
      if (const auto from = place_of(text, name))
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
      if (const auto from = place_of(text, value))
        found.push_back({{SymbolKind::kLocation, value.scalar}, *from, *from + value.scalar.size(), false});
    }
  };
  uses(uses, root);
  return found;
}

Occurrences occurrences_in_interface(std::string_view text, const idl::Schema& schema, const std::string& file) {
  Occurrences found;
  const auto define = [&](SymbolKind kind, const std::string& name, const std::string& symbol, const SourceSpan& span) {
    const std::size_t from = design::offset_of(text, span);
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
