#include "sentree/text/yaml_edit.h"

#include <algorithm>
#include <vector>

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

}  // namespace

Result<std::string> with_entry(std::string_view source, std::string_view section, std::string_view entry,
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

}  // namespace sentree::text
