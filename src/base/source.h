#pragma once

#include <compare>
#include <string>
#include <string_view>
#include <vector>

namespace sentree {

/// A place in a source text, for messages. Lines and columns count from 1; columns count bytes.
/// Line 0 means "the file as a whole".
struct SourceSpan {
  std::string file;  ///< As the user wrote it; empty for text that came from memory.
  int line = 0;      ///< 1-based; 0: no line.
  int column = 0;    ///< 1-based, in bytes; 0: no column.
  int length = 0;    ///< Bytes covered from the start; 0: unknown.

  friend auto operator<=>(const SourceSpan&, const SourceSpan&) = default;
};

/// "file:line:column", leaving out what is unknown.
[[nodiscard]] std::string to_string(const SourceSpan& span);

/// Turns byte offsets of one text into lines and columns.
///
/// Construction reads the text once; look-up is O(log lines). Does not keep the text.
class LineIndex {
 public:
  LineIndex() = default;
  explicit LineIndex(std::string_view text);

  struct Position {
    int line;
    int column;
  };
  /// Position of byte `offset`; offsets past the end give the end.
  [[nodiscard]] Position position(std::size_t offset) const;

 private:
  std::vector<std::size_t> line_starts_{0};
  std::size_t size_ = 0;
};

}  // namespace sentree
