#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include "sentree/text/xml.h"

namespace sentree::text {

/// Where the parts of one element stand in the source; byte offsets.
struct XmlExtent {
  std::uint32_t begin;        ///< The '<' of the start tag.
  std::uint32_t open_end;     ///< One past the '>' of the start tag.
  std::uint32_t close_begin;  ///< The '<' of the end tag; `open_end` for an empty-element tag.
  std::uint32_t end;          ///< One past the '>' of the end tag.
};

struct XmlScan {
  std::vector<XmlExtent> extents;  ///< In document order, so sorted by `begin`.
  struct Finding {
    std::size_t offset;
    const char* code;
    std::string message;
  };
  std::vector<Finding> warnings;
  std::optional<Finding> error;  ///< The first violation; scanning ends there.
};

/// Checks that `source` is a well-formed document as XmlDocument promises and finds its elements.
/// Source: XML 1.0 (fifth edition), Namespaces in XML 1.0 (third edition).
[[nodiscard]] XmlScan scan_xml(std::string_view source, const XmlOptions& options);

/// One attribute of a start tag, as byte offsets.
struct XmlAttributeExtent {
  std::size_t name_begin, name_end;
  std::size_t value_begin, value_end;  ///< Inside the quotes.
};

/// The attributes of the well-formed start tag that begins at `tag_begin`.
[[nodiscard]] std::vector<XmlAttributeExtent> scan_attributes(std::string_view source, std::size_t tag_begin);

}  // namespace sentree::text
