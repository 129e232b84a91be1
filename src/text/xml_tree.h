#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "sentree/base/diagnostic.h"
#include "sentree/base/source.h"

namespace sentree::text {

/// Where an attribute stands in the source; byte offsets.
struct XmlAttributePlace {
  static constexpr std::uint32_t kAsWritten = 0xFFFFFFFFU;

  std::uint32_t name_begin, name_end;
  std::uint32_t value_begin, value_end;  ///< Inside the quotes.
  std::uint32_t resolved = kAsWritten;   ///< Its value in `XmlTree::resolved`, where that is not as written.
};

/// Where an element stands in the source; byte offsets, and indices into the tree.
struct XmlElementPlace {
  std::uint32_t begin;        ///< The '<' of the start tag.
  std::uint32_t name_size;    ///< Of the name, which follows the '<'.
  std::uint32_t open_end;     ///< One past the '>' of the start tag.
  std::uint32_t close_begin;  ///< The '<' of the end tag; `open_end` for an empty-element tag.
  std::uint32_t end;          ///< One past the '>' of the end tag.
  std::uint32_t parent;       ///< Element; its own index for the root.
  std::uint32_t subtree_end;  ///< One past the last element in it.
  std::uint32_t attributes;   ///< Its first attribute; the next element's begin where its own end.
};

/// What reading a document gives: its elements and attributes in document order, as places in the source. A value that
/// has no references and no line breaks is not copied.
struct XmlTree {
  std::string source;
  std::string file;
  std::vector<XmlElementPlace> elements;
  std::vector<XmlAttributePlace> attributes;
  std::vector<std::string> resolved;
  LineIndex lines;
  Diagnostics warnings;

  [[nodiscard]] std::string_view name(std::uint32_t element) const {
    const XmlElementPlace& place = elements[element];
    return {source.data() + place.begin + 1, place.name_size};
  }
  [[nodiscard]] const XmlAttributePlace* attributes_begin(std::uint32_t element) const {
    return attributes.data() + elements[element].attributes;
  }
  [[nodiscard]] const XmlAttributePlace* attributes_end(std::uint32_t element) const {
    return attributes.data() +
           (element + 1 < elements.size() ? std::size_t{elements[element + 1].attributes} : attributes.size());
  }
  [[nodiscard]] std::string_view name(const XmlAttributePlace& place) const {
    return {source.data() + place.name_begin, place.name_end - place.name_begin};
  }
  [[nodiscard]] std::string_view value(const XmlAttributePlace& place) const {
    if (place.resolved != XmlAttributePlace::kAsWritten) return resolved[place.resolved];
    return {source.data() + place.value_begin, place.value_end - place.value_begin};
  }
};

}  // namespace sentree::text
