#include "sentree/text/yaml_edit.h"

#include <algorithm>
#include <array>

#include "sentree/base/ascii.h"
#include "sentree/text/encoding.h"
#include "sentree/text/yaml.h"

namespace sentree::text {

namespace {

std::vector<std::string> lines_of(std::string_view source) {
  std::vector<std::string> lines;
  while (!source.empty()) {
    const std::size_t end = std::min(source.find('\n'), source.size() - 1);
    lines.emplace_back(source.substr(0, end + 1));
    source.remove_prefix(end + 1);
  }
  if (!lines.empty() && lines.back().back() != '\n') lines.back() += '\n';
  return lines;
}

// Neither empty nor only a comment.
bool says_something(const std::string& line) {
  const std::size_t first = line.find_first_not_of(" \t\r\n");
  return first != std::string::npos && line[first] != '#';
}

bool is_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; }

// Text that YAML takes for a text, or for a quantity such as "12.5 s", without quotes wherever it stands.
bool is_plain(std::string_view text) {
  static const std::array kOtherTypes{"true", "false", "null", "True", "False", "Null", "TRUE", "FALSE", "NULL"};
  if (text.empty() || !(is_letter(text.front()) || is_digit(text.front())) || text.back() == ' ') return false;
  if (std::find(kOtherTypes.begin(), kOtherTypes.end(), text) != kOtherTypes.end()) return false;
  const bool has_space = text.find(' ') != std::string_view::npos;
  if (is_digit(text.front()) && !has_space) return false;
  return std::all_of(text.begin(), text.end(), [](char c) {
    return is_letter(c) || is_digit(c) || c == '.' || c == '-' || c == '/' || c == '*' || c == ' ' || c == '%';
  });
}

std::string in_quotes(std::string_view text) {
  std::string out;
  append_json_string(out, text);
  return out;
}

// ---- What the document says afterwards ----

Value* child_of(Value& value, const YamlStep& step) {
  if (const auto* key = std::get_if<std::string>(&step)) {
    return value.as_map() != nullptr ? value.as_map()->find(*key) : nullptr;
  }
  List* list = value.as_list();
  const std::size_t at = std::get<std::size_t>(step);
  return list != nullptr && at < list->size() ? &(*list)[at] : nullptr;
}

// The value at the first `steps` of a path, with mappings made where nothing is.
Value& made(Value& root, const YamlPath& path, std::size_t steps) {
  Value* at = &root;
  for (std::size_t i = 0; i < steps; ++i) {
    Value* next = child_of(*at, path[i]);
    if (next == nullptr) {
      if (at->is_null()) *at = Map();
      next = &(*at->as_map())[std::get<std::string>(path[i])];
    }
    at = next;
  }
  return *at;
}

// ---- Where things stand in the text ----

class Editor {
 public:
  Editor(std::string_view source, std::string file) : file_(std::move(file)) {
    if (source.starts_with(kByteOrderMark)) mark_ = source.substr(0, kByteOrderMark.size());
    source_ = source.substr(mark_.size());
    for (std::size_t at = source_.find('\n'); at != std::string_view::npos; at = source_.find('\n', at + 1))
      lines_.push_back(at + 1);
  }

  Result<void> read() {
    auto root = parse_yaml(source_, file_);
    if (!root) return tl::unexpected(root.error());
    root_ = std::move(*root);
    wanted_ = root_.value();
    return {};
  }

  Result<std::string> set(const YamlPath& path, const Value& value) {
    follow(path);
    const YamlNode& last = *known_.back();
    const bool there = known_.size() > path.size();
    if (!there && (!has_keys_from(path, known_.size() - 1) || !(last.is_mapping() || last.is_null())))
      return no_place(path);
    made(wanted_, path, path.size()) = value;
    if (there) {
      const auto extent = extent_of(last, known_.size() - 1, path);
      if (!extent) return tl::unexpected(extent.error());
      return done({*extent, (extent->spaced ? " " : "") + written(value, extent->from)});
    }
    Value rest = value;
    for (std::size_t i = path.size() - 1; i >= known_.size(); --i)
      rest = Map{{std::get<std::string>(path[i]), std::move(rest)}};
    return add_entry(path, rest);
  }

  Result<std::string> insert(const YamlPath& path, std::size_t index, const Value& value) {
    follow(path);
    const YamlNode& last = *known_.back();
    if (known_.size() <= path.size() || last.is_null() || (last.is_sequence() && last.items.empty())) {
      if (path.size() == 1) {
        made(wanted_, path, 1) = List{value};
        return checked(with_entry(source_, std::get<std::string>(path[0]), "- " + yaml_flow(value), file_));
      }
      return set(path, List{value});
    }
    if (!last.is_sequence()) return no_place(path);
    index = std::min(index, last.items.size());
    List& list = *made(wanted_, path, path.size()).as_list();
    list.insert(list.begin() + static_cast<std::ptrdiff_t>(index), value);
    const std::vector<std::size_t> starts = starts_of(last);
    const std::string text = yaml_flow(value);
    if (is_flow(last) || in_flow(known_.size() - 1)) {
      if (index < starts.size()) return done({{starts[index], starts[index]}, text + ", "});
      return add_to_flow(last, text);
    }
    const std::string line = std::string(column(starts.front()), ' ') + "- " + text + "\n";
    if (index == 0) {
      // Above the comments of what was first.
      const std::size_t own = line_start(starts.front());
      const YamlNode& parent = *known_[known_.size() - (path.empty() ? 1 : 2)];
      const std::size_t below = path.empty() ? own : line_end(starts_of(parent)[index_of(parent, path.back())]) + 1;
      const std::size_t at = std::min(own, below);
      return done({{at, at}, line});
    }
    return add_line(child_end(last, starts, index - 1), line);
  }

  Result<std::string> remove(YamlPath path) {
    follow(path);
    if (known_.size() <= path.size() || path.empty()) return no_place(path);
    // What would be empty goes too.
    const auto siblings = [&] {
      const YamlNode& parent = *known_[path.size() - 1];
      return parent.items.size() + parent.entries.size();
    };
    while (path.size() > 1 && siblings() == 1 && !is_flow(*known_[path.size() - 1])) path.pop_back();
    const YamlNode& parent = *known_[path.size() - 1];
    const std::size_t index = index_of(parent, path.back());
    const std::vector<std::size_t> starts = starts_of(parent);
    Value& around = made(wanted_, path, path.size() - 1);
    if (const auto* key = std::get_if<std::string>(&path.back()))
      around.as_map()->erase(*key);
    else
      around.as_list()->erase(around.as_list()->begin() + static_cast<std::ptrdiff_t>(index));
    const std::size_t from = starts[index];
    const bool flow = is_flow(parent) || in_flow(path.size() - 1);
    const std::string_view before = source_.substr(line_start(from), from - line_start(from));
    const bool begins_line = before.find_first_not_of(' ') == std::string_view::npos;
    if (index + 1 < starts.size() && (flow || !begins_line)) return done({{from, starts[index + 1]}, ""});
    if (!flow) {
      const std::size_t end = line_end(child_end(parent, starts, index));
      if (path.size() == 1 && starts.size() == 1) wanted_ = Value();
      return done({{line_start(from), std::min(end + 1, source_.size())}, ""});
    }
    const auto to = end_of(*known_[path.size()], true);
    if (!to) return tl::unexpected(to.error());
    if (index == 0) return done({{from, *to}, ""});
    const YamlNode& previous = parent.is_sequence() ? parent.items[index - 1] : parent.entries[index - 1].second;
    const auto previous_end = end_of(previous, true);
    if (!previous_end) return tl::unexpected(previous_end.error());
    return done({{*previous_end, *to}, ""});
  }

 private:
  struct Extent {
    std::size_t from = 0;
    std::size_t to = 0;
    bool spaced = false;  // there is nothing yet, and no space before it
  };
  struct Change {
    Extent extent;
    std::string text;
  };

  [[nodiscard]] std::size_t place(const SourceSpan& span) const {
    const auto line = static_cast<std::size_t>(std::max(span.line, 1)) - 1;
    const std::size_t start = line < lines_.size() ? lines_[line] : source_.size();
    return std::min(start + static_cast<std::size_t>(std::max(span.column, 1)) - 1, source_.size());
  }
  [[nodiscard]] std::size_t line_start(std::size_t at) const {
    return *(std::upper_bound(lines_.begin(), lines_.end(), at) - 1);
  }
  [[nodiscard]] std::size_t line_end(std::size_t at) const { return std::min(source_.find('\n', at), source_.size()); }
  [[nodiscard]] std::size_t column(std::size_t at) const { return at - line_start(at); }
  [[nodiscard]] char at(std::size_t place) const { return place < source_.size() ? source_[place] : '\0'; }

  void follow(const YamlPath& path) {
    known_ = {&root_};
    for (const YamlStep& step : path) {
      const YamlNode& node = *known_.back();
      const YamlNode* next = nullptr;
      if (const auto* key = std::get_if<std::string>(&step))
        next = node.find(*key);
      else if (std::get<std::size_t>(step) < node.items.size())
        next = &node.items[std::get<std::size_t>(step)];
      if (next == nullptr) return;
      known_.push_back(next);
    }
  }
  static bool has_keys_from(const YamlPath& path, std::size_t from) {
    return std::all_of(path.begin() + static_cast<std::ptrdiff_t>(from), path.end(),
                       [](const YamlStep& step) { return std::holds_alternative<std::string>(step); });
  }
  static std::size_t index_of(const YamlNode& parent, const YamlStep& step) {
    if (const auto* index = std::get_if<std::size_t>(&step)) return *index;
    const auto& entries = parent.entries;
    const auto found = std::find_if(entries.begin(), entries.end(), [&](const auto& entry) {
      return entry.first.scalar == std::get<std::string>(step);
    });
    return static_cast<std::size_t>(found - entries.begin());
  }

  // Where a mapping or sequence itself begins, behind its anchor and tag.
  [[nodiscard]] std::size_t content(const YamlNode& node) const {
    std::size_t from = place(node.span);
    while (at(from) == '&' || at(from) == '!') {
      const std::size_t end = std::min(source_.find_first_of(" \t\r\n", from), source_.size());
      from = std::min(source_.find_first_not_of(" \t\r\n", end), source_.size());
    }
    return from;
  }
  [[nodiscard]] bool is_flow(const YamlNode& node) const {
    return (node.is_mapping() && at(content(node)) == '{') || (node.is_sequence() && at(content(node)) == '[');
  }
  [[nodiscard]] bool in_flow(std::size_t depth) const {
    return std::any_of(known_.begin(), known_.begin() + static_cast<std::ptrdiff_t>(depth),
                       [&](const YamlNode* node) { return is_flow(*node); });
  }
  [[nodiscard]] bool is_block(const YamlNode& node) const {
    return (node.is_mapping() || node.is_sequence()) && !is_flow(node);
  }

  // Where the children of a mapping or sequence begin: keys, dashes, items in brackets.
  [[nodiscard]] std::vector<std::size_t> starts_of(const YamlNode& node) const {
    std::vector<std::size_t> starts;
    for (const auto& [key, value] : node.entries) starts.push_back(place(key.span));
    if (!node.is_sequence()) return starts;
    if (is_flow(node)) {
      for (const YamlNode& item : node.items) starts.push_back(place(item.span));
      return starts;
    }
    const std::size_t first = content(node);
    starts.push_back(first);
    for (std::size_t line = line_end(first) + 1; line < source_.size() && starts.size() < node.items.size();
         line = line_end(line) + 1) {
      const std::size_t text = source_.find_first_not_of(' ', line);
      if (text != std::string_view::npos && text - line == column(first) && at(text) == '-') starts.push_back(text);
    }
    return starts;
  }

  // Behind the last line of block style that belongs to what begins at `from`, before `limit`.
  [[nodiscard]] std::size_t block_end(std::size_t from, std::size_t limit, std::size_t least, bool dashes) const {
    std::size_t end = line_end(from);
    for (std::size_t line = end + 1; line < limit; line = line_end(line) + 1) {
      const std::string text(source_.substr(line, line_end(line) - line));
      if (!says_something(text)) continue;
      const std::size_t indent = text.find_first_not_of(' ');
      if (indent < least && !(dashes && indent + 1 == least && text[indent] == '-')) break;
      end = line_end(line);
    }
    return end;
  }
  // Of a mapping or sequence in block style: the end of its last line.
  [[nodiscard]] std::size_t child_end(const YamlNode& node, const std::vector<std::size_t>& starts,
                                      std::size_t index) const {
    const std::size_t limit = index + 1 < starts.size() ? line_start(starts[index + 1]) : source_.size();
    return block_end(starts[index], limit, column(starts[index]) + 1, node.is_mapping());
  }

  [[nodiscard]] std::size_t quote_end(std::size_t from) const {
    const char quote = at(from);
    for (std::size_t i = from + 1; i < source_.size(); ++i) {
      if (quote == '"' && source_[i] == '\\') {
        ++i;
      } else if (source_[i] == quote) {
        if (quote == '\'' && at(i + 1) == '\'')
          ++i;
        else
          return i + 1;
      }
    }
    return source_.size();
  }
  [[nodiscard]] std::size_t bracket_end(std::size_t from) const {
    int open = 0;
    char before = '[';  // not a space
    for (std::size_t i = from; i < source_.size(); ++i) {
      const char c = source_[i];
      if ((c == '"' || c == '\'') && (before == '[' || before == '{' || before == ',' || before == ':')) {
        i = quote_end(i) - 1;
      } else if (c == '#' && i > 0 && is_space(source_[i - 1])) {
        i = line_end(i);
        continue;
      } else if (c == '[' || c == '{') {
        ++open;
      } else if ((c == ']' || c == '}') && --open == 0) {
        return i + 1;
      }
      if (!is_space(c)) before = source_[i];
    }
    return source_.size();
  }

  // Behind a value; an error where its text cannot be told from what stands around it.
  [[nodiscard]] Result<std::size_t> end_of(const YamlNode& node, bool in_flow) const {
    const std::size_t from = place(node.span);
    const char first = at(from);
    if (first == '&' || first == '*' || first == '!' || first == '|' || first == '>') return not_editable(node);
    if (is_flow(node)) return bracket_end(from);
    if (is_block(node)) {
      const std::vector<std::size_t> starts = starts_of(node);
      return child_end(node, starts, starts.size() - 1);
    }
    if (node.quoted) return quote_end(from);
    std::size_t end = from;
    while (end < source_.size() && source_[end] != '\n') {
      const char c = source_[end];
      if (in_flow && (c == ',' || c == ']' || c == '}')) break;
      if (c == '#' && end > from && is_space(source_[end - 1])) break;
      if (c == ':' && is_space(at(end + 1))) break;
      ++end;
    }
    while (end > from && is_space(source_[end - 1])) --end;
    if (node.is_scalar() && source_.substr(from, end - from) != node.scalar) return not_editable(node);
    return end;
  }

  [[nodiscard]] Result<Extent> extent_of(const YamlNode& node, std::size_t depth, const YamlPath& path) const {
    if (depth == 0) return no_place(path);
    const YamlNode& parent = *known_[depth - 1];
    if (node.is_null()) {
      // Nothing, or a word for it, behind the colon or the dash.
      const std::size_t start = starts_of(parent)[index_of(parent, path[depth - 1])];
      std::size_t behind = start + 1;
      if (parent.is_mapping()) {
        const std::size_t key_end = at(start) == '"' || at(start) == '\'' ? quote_end(start) : start;
        behind = source_.find(':', key_end) + 1;
      } else if (is_flow(parent)) {
        return not_editable(node);
      }
      const std::size_t word = source_.find_first_not_of(' ', behind);
      if (word != std::string_view::npos && at(word) == '~') return Extent{word, word + 1};
      if (word != std::string_view::npos && source_.substr(word).starts_with("null")) return Extent{word, word + 4};
      return Extent{behind, behind, true};
    }
    if (const char first = at(place(node.span));
        node.is_scalar() && (first == '|' || first == '>') && is_block(parent)) {
      // A text over several lines: all of them.
      const std::vector<std::size_t> starts = starts_of(parent);
      return Extent{place(node.span), child_end(parent, starts, index_of(parent, path[depth - 1]))};
    }
    const auto to = end_of(node, in_flow(depth));
    if (!to) return tl::unexpected(to.error());
    return Extent{place(node.span), *to};
  }

  // In the quotes of what stood there.
  [[nodiscard]] std::string written(const Value& value, std::size_t from) const {
    const std::string* text = value.as_string();
    if (text == nullptr) return yaml_flow(value);
    if (at(from) == '"') return in_quotes(*text);
    const bool fits = std::all_of(text->begin(), text->end(), [](char c) { return c >= ' ' && c != '\''; });
    return at(from) == '\'' && fits ? "'" + *text + "'" : yaml_flow(value);
  }

  // `path` leads on from a mapping that is there, or from nothing, by keys; `value` is that of the first of them.
  Result<std::string> add_entry(const YamlPath& path, const Value& value) {
    const YamlNode& last = *known_.back();
    const std::string key = yaml_flow(std::get<std::string>(path[known_.size() - 1]));
    const std::string entry = key + ": " + yaml_flow(value);
    if (last.is_null() && known_.size() > 1) {
      if (known_.size() == 2 && !in_flow(1))
        return checked(with_entry(source_, std::get<std::string>(path[0]), entry, file_));
      const auto extent = extent_of(last, known_.size() - 1, path);
      if (!extent) return tl::unexpected(extent.error());
      return done({*extent, (extent->spaced ? " {" : "{") + entry + "}"});
    }
    if (last.is_mapping() && (is_flow(last) || in_flow(known_.size() - 1))) return add_to_flow(last, entry);
    if (known_.size() == 1) {
      // One line a member, as people write sections.
      const Map* members = value.as_map();
      if (members != nullptr && members->size() == 1) {
        const auto& [name, member] = *members->begin();
        return checked(
            with_entry(source_, std::get<std::string>(path[0]), yaml_flow(name) + ": " + yaml_flow(member), file_));
      }
      return add_line(last_line(), entry + "\n");
    }
    const std::vector<std::size_t> starts = starts_of(last);
    return add_line(child_end(last, starts, starts.size() - 1),
                    std::string(column(starts.front()), ' ') + entry + "\n");
  }
  Result<std::string> add_to_flow(const YamlNode& node, const std::string& text) {
    std::size_t end = bracket_end(content(node)) - 1;
    const bool empty = node.items.empty() && node.entries.empty();
    while (end > 0 && is_space(source_[end - 1])) --end;
    return done({{end, end}, (empty ? "" : ", ") + text});
  }
  [[nodiscard]] std::size_t last_line() const {
    std::size_t end = 0;
    for (std::size_t line = 0; line < source_.size(); line = line_end(line) + 1) {
      if (says_something(std::string(source_.substr(line, line_end(line) - line)))) end = line_end(line);
    }
    return end;
  }
  // Below the line that ends at `end`; at the end of a file without a last line end, that stays so.
  Result<std::string> add_line(std::size_t end, std::string line) {
    if (end < source_.size()) return done({{end + 1, end + 1}, std::move(line)});
    line.pop_back();
    return done({{end, end}, (end > 0 ? "\n" : "") + line});
  }

  [[nodiscard]] Result<std::string> done(const Change& change) const {
    return checked(std::string(source_.substr(0, change.extent.from)) + change.text +
                   std::string(source_.substr(change.extent.to)));
  }
  // The least that can go wrong is that a text was written so that another value comes out: then nothing is changed.
  [[nodiscard]] Result<std::string> checked(Result<std::string> text) const {
    if (!text) return text;
    const auto again = parse_yaml(*text, file_);
    if (again && again->value() == wanted_) return std::string(mark_) + *text;
    return fail("yaml.not-editable", "it is written so that it cannot be changed here; change it in the text",
                known_.back()->span);
  }
  static tl::unexpected<Diagnostic> no_place(const YamlPath& path) {
    return fail("yaml.no-such-place", "there is no \"" + to_string(path) + "\"");
  }
  static tl::unexpected<Diagnostic> not_editable(const YamlNode& node) {
    return fail("yaml.not-editable", "it is written so that it cannot be changed here; change it in the text",
                node.span);
  }

  std::string file_;
  std::string_view mark_;  // of byte order
  std::string_view source_;
  std::vector<std::size_t> lines_{0};  // where they begin
  YamlNode root_;
  Value wanted_;                        // what the document is to say
  std::vector<const YamlNode*> known_;  // along the path, as far as it is there
};

}  // namespace

std::string to_string(const YamlPath& path) {
  std::string out;
  for (const YamlStep& step : path) {
    if (const auto* key = std::get_if<std::string>(&step))
      out += (out.empty() ? "" : ".") + *key;
    else
      out += "[" + std::to_string(std::get<std::size_t>(step)) + "]";
  }
  return out;
}

std::string yaml_flow(const Value& value) {
  if (const Map* map = value.as_map()) {
    std::string out = "{";
    for (const auto& [key, member] : *map)
      out += (out.size() > 1 ? ", " : "") + yaml_flow(key) + ": " + yaml_flow(member);
    return out + "}";
  }
  if (const List* list = value.as_list()) {
    std::string out = "[";
    for (const Value& item : *list) out += (out.size() > 1 ? ", " : "") + yaml_flow(item);
    return out + "]";
  }
  if (const std::string* text = value.as_string()) return is_plain(*text) ? *text : in_quotes(*text);
  return to_json(value);
}

Result<std::string> with_value(std::string_view source, const YamlPath& path, const Value& value,
                               const std::string& file) {
  Editor editor(source, file);
  if (auto read = editor.read(); !read) return tl::unexpected(read.error());
  return editor.set(path, value);
}

Result<std::string> with_item(std::string_view source, const YamlPath& path, std::size_t index, const Value& value,
                              const std::string& file) {
  Editor editor(source, file);
  if (auto read = editor.read(); !read) return tl::unexpected(read.error());
  return editor.insert(path, index, value);
}

Result<std::string> without(std::string_view source, const YamlPath& path, const std::string& file) {
  Editor editor(source, file);
  if (auto read = editor.read(); !read) return tl::unexpected(read.error());
  return editor.remove(path);
}

namespace {

// With LF, and one at the end.
Result<std::string> with_entry_line(std::string_view source, std::string_view section, std::string_view entry,
                                    const std::string& file) {
  const auto root = parse_yaml(source, file);
  if (!root) return tl::unexpected(root.error());
  std::vector<std::string> lines = lines_of(source);
  const auto joined = [&] {
    std::string out;
    for (const std::string& line : lines) out += line;
    return out;
  };
  const auto found = std::find_if(root->entries.begin(), root->entries.end(),
                                  [&](const auto& e) { return e.first.scalar == section; });
  if (found == root->entries.end()) {
    lines.push_back("\n" + std::string(section) + ":\n");
    lines.push_back("  " + std::string(entry) + "\n");
    return joined();
  }
  const auto key_line = static_cast<std::size_t>(found->first.span.line) - 1;
  const YamlNode& value = found->second;
  if (value.items.empty() && value.entries.empty()) {
    // "monitors:", "monitors: []"; what follows the colon was nothing.
    std::string& line = lines[key_line];
    const std::size_t comment = line.find(" #");
    line = std::string(section) + ":" + (comment == std::string::npos ? "\n" : line.substr(comment));
    lines.insert(lines.begin() + static_cast<std::ptrdiff_t>(key_line) + 1, "  " + std::string(entry) + "\n");
    return joined();
  }
  const SourceSpan& first = value.items.empty() ? value.entries.front().first.span : value.items.front().span;
  const std::string& first_line = lines[static_cast<std::size_t>(first.line) - 1];
  if (static_cast<std::size_t>(first.line) - 1 == key_line || value.span.line == found->first.span.line)
    return fail("yaml.flow", "\"" + std::string(section) + ":\" is written in one line; write its entries one a line",
                value.span);
  const std::string indent = first_line.substr(0, first_line.find_first_not_of(' '));
  std::size_t next = lines.size();
  for (const auto& other : root->entries) {
    const auto line = static_cast<std::size_t>(other.first.span.line) - 1;
    if (line > key_line) next = std::min(next, line);
  }
  while (!says_something(lines[next - 1])) --next;
  lines.insert(lines.begin() + static_cast<std::ptrdiff_t>(next), indent + std::string(entry) + "\n");
  return joined();
}

}  // namespace

Result<std::string> with_entry(std::string_view source, std::string_view section, std::string_view entry,
                               const std::string& file) {
  auto text = with_entry_line(source, section, entry, file);
  if (!text) return text;
  // As the lines that are there end.
  if (const std::size_t first = source.find('\n');
      first != std::string_view::npos && first > 0 && source[first - 1] == '\r') {
    for (std::size_t at = text->find('\n'); at != std::string::npos; at = text->find('\n', at + 1)) {
      if (at == 0 || (*text)[at - 1] != '\r') text->insert(at++, 1, '\r');
    }
  }
  if (!source.empty() && source.back() != '\n') {
    while (!text->empty() && (text->back() == '\n' || text->back() == '\r')) text->pop_back();
  }
  return text;
}

}  // namespace sentree::text
