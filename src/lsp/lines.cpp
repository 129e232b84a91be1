#include "sentree/lsp/lines.h"

#include <algorithm>

namespace sentree::lsp {

namespace {

// Bytes of the character of UTF-8 that begins there; 1 for what begins none.
std::size_t size_at(std::string_view text, std::size_t at) {
  const auto first = static_cast<unsigned char>(text[at]);
  const std::size_t size = first < 0xC0 ? 1 : first < 0xE0 ? 2 : first < 0xF0 ? 3 : 4;
  return std::min(size, text.size() - at);
}

// Bytes between two marks.
constexpr std::size_t kMarkEvery = 1024;

std::uint64_t units_of(std::size_t bytes, Units units) {
  if (units == Units::kUtf8) return bytes;
  return bytes == 4 ? 2 : 1;
}

}  // namespace

Lines::Lines(std::string_view text) {
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '\n' || (text[i] == '\r' && (i + 1 >= text.size() || text[i + 1] != '\n'))) starts_.push_back(i + 1);
  }
  for (std::size_t line = 0; line < starts_.size(); ++line)
    mark(text, starts_[line], line + 1 < starts_.size() ? starts_[line + 1] : text.size());
}

void Lines::mark(std::string_view text, std::size_t from, std::size_t to) {
  if (to - from <= kMarkEvery) return;
  Mark here{from, 0};
  for (std::size_t next = from + kMarkEvery; here.byte < to;) {
    if (here.byte >= next) {
      marks_.push_back(here);
      next = here.byte + kMarkEvery;
    }
    const std::size_t size = size_at(text, here.byte);
    here.units16 += units_of(size, Units::kUtf16);
    here.byte += size;
  }
}

// The last one of a line that is not behind something.
Lines::Mark Lines::before(std::size_t start, std::size_t end, const std::function<bool(const Mark&)>& is_behind) const {
  const auto by_byte = [](const Mark& mark, std::size_t byte) { return mark.byte < byte; };
  const auto first = std::lower_bound(marks_.begin(), marks_.end(), start, by_byte);
  const auto last = std::lower_bound(first, marks_.end(), end, by_byte);
  const auto behind = std::partition_point(first, last, [&](const Mark& mark) { return !is_behind(mark); });
  return behind == first ? Mark{start, 0} : *std::prev(behind);
}

Position Lines::position(std::string_view text, std::size_t offset, Units units) const {
  offset = std::min(offset, text.size());
  const auto next = std::upper_bound(starts_.begin(), starts_.end(), offset);
  const std::size_t start = *std::prev(next);
  const Mark mark = before(start, offset, [&](const Mark& one) { return one.byte > offset; });
  Position position{static_cast<std::uint64_t>(next - starts_.begin() - 1),
                    units == Units::kUtf8 ? mark.byte - start : mark.units16};
  for (std::size_t at = mark.byte; at < offset;) {
    const std::size_t size = size_at(text, at);
    if (at + size > offset) break;
    position.character += units_of(size, units);
    at += size;
  }
  return position;
}

std::size_t Lines::offset(std::string_view text, Position position, Units units) const {
  if (position.line >= starts_.size()) return text.size();
  const std::size_t start = starts_[position.line];
  std::size_t end = position.line + 1 < starts_.size() ? starts_[position.line + 1] : text.size();
  while (end > start && (text[end - 1] == '\n' || text[end - 1] == '\r')) --end;
  const auto units_before = [&](const Mark& mark) { return units == Units::kUtf8 ? mark.byte - start : mark.units16; };
  const Mark mark = before(start, end, [&](const Mark& one) { return units_before(one) > position.character; });
  std::size_t at = mark.byte;
  for (std::uint64_t left = position.character - units_before(mark); at < end && left > 0;) {
    const std::size_t size = size_at(text, at);
    const std::uint64_t takes = units_of(size, units);
    if (takes > left) break;
    left -= takes;
    at += size;
  }
  return std::min(at, end);
}

Offsets::Offsets(std::string_view text) : size_(text.size()) {
  for (std::size_t end = text.find('\n'); end != std::string_view::npos; end = text.find('\n', end + 1))
    starts_.push_back(end + 1);
}

std::size_t Offsets::of(const SourceSpan& span) const {
  const auto line = static_cast<std::size_t>(std::max(span.line - 1, 0));
  if (line >= starts_.size()) return size_;
  return std::min(starts_[line] + static_cast<std::size_t>(std::max(span.column - 1, 0)), size_);
}

}  // namespace sentree::lsp
