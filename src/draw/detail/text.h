#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace sentree::draw {

/// Width of UTF-8 `text` [px] in a sans-serif font of `size_px`; the same on every machine.
///
/// An estimate on the generous side (it follows the widest of the usual sans-serif fonts): boxes sized with it hold
/// their text.
[[nodiscard]] double text_width(std::string_view text, double size_px);

/// Splits `text` into at most `lines_max` lines of at most `width_max`, at blanks and after punctuation where
/// possible, else within words; what does not fit is replaced by "…". Never splits a UTF-8 sequence. Newlines and other
/// control characters count as blanks.
[[nodiscard]] std::vector<std::string> wrap(std::string_view text, double size_px, double width_max, int lines_max);

/// For XML text and attribute values: markup characters as entities, control characters that XML 1.0 forbids and
/// invalid UTF-8 as U+FFFD.
[[nodiscard]] std::string xml_escape(std::string_view text);

/// `text` with invalid UTF-8 and control characters (newline and tab included) replaced: the former by U+FFFD, the
/// latter by a blank.
[[nodiscard]] std::string printable(std::string_view text);

/// At most two decimals, no trailing zeros, never "-0".
[[nodiscard]] std::string coordinate(double value);

}  // namespace sentree::draw
