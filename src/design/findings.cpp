#include "sentree/design/findings.h"

#include <algorithm>

namespace sentree::design {

namespace {

constexpr std::string_view kSuggestion = "did you mean \"";

// What a message has in quotes, up to `end`.
std::vector<std::string_view> quoted(std::string_view message, std::size_t end) {
  std::vector<std::string_view> words;
  for (std::size_t open = message.find('"'); open < end;) {
    const std::size_t close = message.find('"', open + 1);
    if (close >= end) break;
    words.push_back(message.substr(open + 1, close - open - 1));
    open = message.find('"', close + 1);
  }
  return words;
}

bool is_word(char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_'; }

// Where `word` stands by itself in [from, to).
std::size_t find_word(std::string_view text, std::string_view word, std::size_t from, std::size_t to) {
  for (std::size_t at = text.find(word, from); at < to; at = text.find(word, at + 1)) {
    const std::size_t end = at + word.size();
    if ((at == 0 || !is_word(text[at - 1])) && (end >= text.size() || !is_word(text[end]))) return at;
  }
  return std::string_view::npos;
}

}  // namespace

std::size_t offset_of(std::string_view text, const SourceSpan& span) {
  std::size_t at = 0;
  for (int line = 1; line < span.line; ++line) {
    const std::size_t end = text.find('\n', at);
    if (end == std::string_view::npos) return text.size();
    at = end + 1;
  }
  const auto column = static_cast<std::size_t>(std::max(span.column - 1, 0));
  return std::min(at + column, text.size());
}

std::string file_inside(const std::filesystem::path& folder, const std::string& shown) {
  if (shown.empty()) return {};
  const std::filesystem::path relative =
      (folder / std::filesystem::path(shown)).lexically_normal().lexically_relative(folder);
  if (relative.empty() || *relative.begin() == ".." || relative == ".") return {};
  return relative.generic_string();
}

Finding locate(Diagnostic diagnostic, const std::filesystem::path& folder, std::string_view text) {
  Finding finding;
  finding.file = file_inside(folder, diagnostic.span.file);
  finding.diagnostic = std::move(diagnostic);
  if (finding.file.empty()) return finding;
  const SourceSpan& span = finding.diagnostic.span;
  finding.from = offset_of(text, span);
  const std::size_t line_end = std::min(text.find('\n', finding.from), text.size());
  finding.to = finding.from + static_cast<std::size_t>(std::max(span.length, 0));
  if (finding.to == finding.from) {
    while (finding.to < line_end && is_word(text[finding.to])) ++finding.to;
    if (finding.to == finding.from) finding.to = std::min(finding.from + 1, line_end);
  }
  finding.to = std::min(finding.to, text.size());

  const std::string& message = finding.diagnostic.message;
  const std::size_t suggested = message.rfind(kSuggestion);
  if (suggested == std::string::npos) return finding;
  const std::size_t begin = suggested + kSuggestion.size();
  const std::string better = message.substr(begin, message.find('"', begin) - begin);
  const auto words = quoted(message, suggested);
  for (auto word = words.rbegin(); word != words.rend(); ++word) {
    if (word->empty() || *word == better) continue;
    const std::size_t at = find_word(text, *word, finding.from, std::max(line_end, finding.to));
    if (at == std::string_view::npos) continue;
    finding.fixes.push_back({better, {at, at + word->size(), better}});
    break;
  }
  return finding;
}

}  // namespace sentree::design
