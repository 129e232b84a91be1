#pragma once

#include <algorithm>
#include <array>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "sentree/base/ascii.h"
#include "sentree/lsp/symbols.h"

namespace sentree::lsp {

/// Finds what names stand for in one file; each kind of file has its own. Offsets are bytes of the text.
class Collector {
 public:
  Collector(std::string_view text, const Names& names) : text_(text), names_(names) {}

  void add(SymbolKind kind, std::string name, std::size_t from, std::size_t to, bool defines = false) {
    if (from < to && to <= text_.size()) found.push_back({{kind, std::move(name)}, from, to, defines});
  }
  // What may be written with references of XML, by what it means.
  void add_meant(SymbolKind kind, const std::string& of, const std::string& name, std::size_t from, std::size_t to,
                 bool defines = false) {
    const std::size_t before = found.size();
    add(kind, of + name, from, to, defines);
    if (found.size() > before) found.back().escaped = at(from, to) != name;
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

}  // namespace sentree::lsp
