#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "sentree/base/result.h"

namespace sentree::design {

/// Bytes `from` to `to` of a text replaced by `text`.
struct TextEdit {
  std::size_t from = 0;
  std::size_t to = 0;
  std::string text;
  friend bool operator==(const TextEdit&, const TextEdit&) = default;
};

/// By place, without overlap, all of one and the same text.
using TextEdits = std::vector<TextEdit>;

/// Lines that a comparison may find inserted and deleted before it calls the whole middle changed.
inline constexpr int kDifferentLinesMax = 1000;

/// The edited text. Errors: design.bad-edit (out of bounds, out of order, or overlapping).
[[nodiscard]] Result<std::string> with_edits(std::string_view text, const TextEdits& edits);

/// What makes the edited text `text` again, byte for byte. `edits` can be applied to `text`.
[[nodiscard]] TextEdits inverse(std::string_view text, const TextEdits& edits);

/// Edits that make `after` of `before`: lines are compared, and what differs in a run of lines is cut to the characters
/// that differ. Cuts lie between characters of UTF-8.
/// Source: Myers, "An O(ND) Difference Algorithm and Its Variations", 1986.
[[nodiscard]] TextEdits edits_between(std::string_view before, std::string_view after);

/// Lines that the edits make end as the first line of `text` does: with CR LF, or LF.
void end_lines_alike(std::string_view text, TextEdits& edits);

/// Both changes of `base` in one text, line by line; what both made alike counts once. Nothing: they change the same
/// lines, or put lines at the same place.
[[nodiscard]] std::optional<std::string> merge(std::string_view base, std::string_view mine, std::string_view theirs);

/// `edits` of an earlier text of a file as edits of what it is `now`. Errors: design.bad-edit; design.conflict: both
/// changed the same lines, or a file that both leave sound would not be any more.
[[nodiscard]] Result<TextEdits> joined(const std::string& file, std::string_view earlier, std::string_view now,
                                       const TextEdits& edits);

}  // namespace sentree::design
