#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "sentree/text/xml.h"
#include "sentree/text/xml_tree.h"

namespace sentree::text {

/// Attributes of one element; one more is the error xml.too-many.
inline constexpr std::size_t kXmlAttributesMax = 1000;

struct XmlScan {
  std::vector<XmlElementPlace> elements;  ///< In document order; so are the attributes.
  std::vector<XmlAttributePlace> attributes;
  std::vector<std::string> resolved;
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
[[nodiscard]] XmlScan scan_xml(const std::string& source, const XmlOptions& options);

/// Character data of a well-formed document with its references resolved (a bare '&' stays) and each line end as '\n'.
[[nodiscard]] std::string resolve_text(std::string_view written);
/// The same for a CDATA section, which has no references.
[[nodiscard]] std::string resolve_line_ends(std::string_view written);

}  // namespace sentree::text
