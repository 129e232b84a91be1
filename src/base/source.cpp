#include "sentree/base/source.h"

#include <algorithm>

namespace sentree {

std::string to_string(const SourceSpan& span) {
  std::string text = span.file;
  if (span.line > 0) {
    text += (text.empty() ? "line " : ":") + std::to_string(span.line);
    if (span.column > 0) text += ":" + std::to_string(span.column);
  }
  return text;
}

LineIndex::LineIndex(std::string_view text) : size_(text.size()) {
  for (std::size_t at = text.find('\n'); at != std::string_view::npos; at = text.find('\n', at + 1)) {
    line_starts_.push_back(at + 1);
  }
}

LineIndex::Position LineIndex::position(std::size_t offset) const {
  offset = std::min(offset, size_);
  const auto next = std::upper_bound(line_starts_.begin(), line_starts_.end(), offset);
  const auto line = static_cast<std::size_t>(next - line_starts_.begin());
  return {static_cast<int>(line), static_cast<int>(offset - line_starts_[line - 1] + 1)};
}

}  // namespace sentree
