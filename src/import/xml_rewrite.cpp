#include "sentree/import/detail/xml_rewrite.h"

#include <fmt/format.h>

namespace sentree::import {

using text::XmlDocument;
using text::XmlElement;

std::optional<std::string_view> attribute_named(const XmlElement& element, std::string_view local) {
  std::optional<std::string_view> found;
  element.for_each_attribute([&](std::string_view name, std::string_view value) {
    const std::size_t colon = name.find(':');
    if (!found && (colon == std::string_view::npos ? name : name.substr(colon + 1)) == local) found = value;
  });
  return found;
}

std::string_view source_of(const XmlDocument& document, const XmlElement& element) {
  return std::string_view(document.source()).substr(element.offset(), element.end_offset() - element.offset());
}

std::string start_tag(const XmlElement& element, const std::map<std::string, std::optional<std::string>>& changes) {
  std::string tag = fmt::format("<{}", element.name());
  element.for_each_attribute([&](std::string_view name, std::string_view value) {
    const auto change = changes.find(std::string(name));
    if (change == changes.end()) {
      tag += text::xml_attribute(name, value);
    } else if (change->second) {
      tag += text::xml_attribute(name, *change->second);
    }
  });
  for (const auto& [name, value] : changes) {
    if (value && !element.attribute(name)) tag += text::xml_attribute(name, *value);
  }
  return tag;
}

std::string rewritten_inside(const XmlDocument& document, const XmlElement& element,
                             const std::function<std::string(const XmlElement&)>& emit) {
  const std::string_view inner = element.inner_source();
  if (inner.empty()) return {};
  const std::string_view source = document.source();
  auto at = static_cast<std::size_t>(inner.data() - source.data());
  const std::size_t end = at + inner.size();
  std::string text;
  for (XmlElement child = element.first_child(); child; child = child.next_sibling()) {
    text += source.substr(at, child.offset() - at);
    text += emit(child);
    at = child.end_offset();
  }
  return text += source.substr(at, end - at);
}

std::string element_text(const XmlElement& element, const std::string& tag, const std::string& inside) {
  if (inside.empty()) return tag + "/>";
  return fmt::format("{}>{}</{}>", tag, inside, element.name());
}

}  // namespace sentree::import
