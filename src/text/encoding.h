#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace sentree::text {

/// With which a text in UTF-8 may begin.
inline constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";

/// XML that is not in UTF-8 as UTF-8, its declaration included: UTF-16 with or without a byte order mark, and what
/// declares itself as ISO-8859-1 or Windows-1252. A declaration of UTF-16 that is itself written in bytes is wrong, and
/// mended. Nothing: it is nothing of that, or no XML.
/// Cost: O(1) where nothing is to be done, else O(size).
/// Source: XML 1.0, appendix F; WHATWG Encoding, index windows-1252.
[[nodiscard]] std::optional<std::string> xml_as_utf8(std::string_view source);

/// The other way: bytes of which `xml_as_utf8` makes `text`, in the encoding of the document that begins with `begin`
/// (its first kilobyte is enough). Nothing: that was in UTF-8, `text` declares another encoding, or has what it cannot
/// hold.
[[nodiscard]] std::optional<std::string> xml_encoded_as(std::string_view begin, std::string_view text);

/// The encoding that the XML declaration of `text` names, if that is another than UTF-8.
[[nodiscard]] std::optional<std::string_view> xml_declared_otherwise(std::string_view text);
/// The bytes of a text, itself in UTF-8, in the encoding that its XML declaration names. Nothing: `xml_as_utf8` does
/// not know that, or it cannot hold the text.
[[nodiscard]] std::optional<std::string> xml_as_declared(std::string_view text);

/// `text` with lines that end as the first one of `source` does, with CR LF or LF. One CR LF too many is not made.
[[nodiscard]] std::string with_line_ends_of(std::string_view source, std::string text);

}  // namespace sentree::text
