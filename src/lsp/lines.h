#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string_view>
#include <vector>

#include "sentree/base/source.h"

namespace sentree::lsp {

/// What a place inside a line is counted in.
enum class Units : std::uint8_t { kUtf8, kUtf16 };

/// As the protocol counts: lines and units from 0.
struct Position {
  std::uint64_t line = 0;
  std::uint64_t character = 0;
  friend bool operator==(const Position&, const Position&) = default;
};

/// Lines of a text, which end with \n, \r\n or \r. Does not keep the text. Places are found in O(log(size of the
/// text)), however long their lines are. Source: Language Server Protocol 3.17, Text Documents.
class Lines {
 public:
  Lines() = default;
  explicit Lines(std::string_view text);

  /// Of byte `offset` of the text; past its end: the end.
  [[nodiscard]] Position position(std::string_view text, std::size_t offset, Units units) const;
  /// The byte of a position. What lies behind the end of a line or of the text is that end; the middle of a character
  /// is its beginning.
  [[nodiscard]] std::size_t offset(std::string_view text, Position position, Units units) const;

 private:
  // The beginning of a character within a long line, and what is before it in that line.
  struct Mark {
    std::size_t byte = 0;
    std::uint64_t units16 = 0;
  };
  void mark(std::string_view text, std::size_t from, std::size_t to);
  [[nodiscard]] Mark before(std::size_t start, std::size_t end,
                            const std::function<bool(const Mark&)>& is_behind) const;

  std::vector<std::size_t> starts_{0};
  std::vector<Mark> marks_;  // every so many bytes
};

/// The bytes of many places of one text, as readers tell them: line and column from 1, lines end with \n. Does not keep
/// the text.
class Offsets {
 public:
  explicit Offsets(std::string_view text);
  /// What lies behind the end of the text is that end. O(1).
  [[nodiscard]] std::size_t of(const SourceSpan& span) const;

 private:
  std::vector<std::size_t> starts_{0};
  std::size_t size_ = 0;
};

}  // namespace sentree::lsp
