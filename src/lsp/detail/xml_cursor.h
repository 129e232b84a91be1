#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace sentree::lsp {

/// Where a place in a document of XML is, whether or not the document is well-formed: somebody is typing it.
struct XmlCursor {
  enum class Where : std::uint8_t {
    kText,            ///< Between tags.
    kTagName,         ///< Behind '<'.
    kAttributeName,   ///< In a start tag, where an attribute's name is or may be.
    kAttributeValue,  ///< Between its quotes.
    kElsewhere,       ///< In a comment, an end tag, a CDATA section, a declaration.
  };
  struct Element {
    std::string name;
    std::vector<std::pair<std::string, std::string>> attributes;              ///< As written.
    [[nodiscard]] std::string_view attribute(std::string_view wanted) const;  ///< Empty: none.
  };
  Where where = Where::kText;
  std::vector<Element> open;  ///< Those that it is inside of, the outermost first.
  Element tag;                ///< In whose start tag it is; else empty.
  std::string attribute;      ///< kAttributeValue: its name.
  std::size_t from = 0;       ///< Of the name or value that it is in, up to `to`.
  std::size_t to = 0;
};

/// Elements inside elements that are followed; deeper ones count for their ancestors.
inline constexpr std::size_t kOpenElementsMax = 1'000;

/// Cost: O(offset).
[[nodiscard]] XmlCursor xml_cursor(std::string_view text, std::size_t offset);

}  // namespace sentree::lsp
