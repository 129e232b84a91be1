#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <string_view>

#include "sentree/text/xml.h"

namespace sentree::text {

/// A start tag that would be longer is wrapped, further attributes standing under the first.
inline constexpr std::size_t kXmlColumnsMax = 120;

/// What a kind of document adds to the common rules of `format_xml`.
struct XmlStyle {
  /// Place of an attribute in its tag: lower ones first, equal ones as they were written. Not set: all as written.
  std::function<int(std::string_view attribute)> attribute_rank;
  /// True for an element whose inside is kept byte for byte, because white space in it may mean something.
  std::function<bool(const XmlElement& element)> verbatim;
};

/// The document in canonical form: two spaces a level, one element a line (an only child without children may share its
/// parent's, if it did), double quotes, `/>` without a blank, at most one blank line between elements. Attributes that
/// begin a line do so again, under the first. Comments stay with what they stand beside: behind an element on its line,
/// or above the next. Values, texts and everything unknown are kept as written; elements that hold text are not touched
/// inside. Formatting twice changes nothing. All lines end as the first one does; a byte order mark stays.
/// Errors: those of `XmlDocument::parse`. Cost: O(size).
[[nodiscard]] Result<std::string> format_xml(std::string_view source, std::string file, const XmlStyle& style = {},
                                             const XmlOptions& options = {});

}  // namespace sentree::text
