#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "sentree/text/xml.h"

namespace sentree::import {

/// The first attribute of that name, whatever its prefix.
[[nodiscard]] std::optional<std::string_view> attribute_named(const text::XmlElement& element, std::string_view local);

/// The element's source as written, from '<' to '>'.
[[nodiscard]] std::string_view source_of(const text::XmlDocument& document, const text::XmlElement& element);

/// The start tag without its '>' or "/>"; values in `changes` replace those written, nothing removes the attribute, and
/// what is not there is added.
[[nodiscard]] std::string start_tag(const text::XmlElement& element,
                                    const std::map<std::string, std::optional<std::string>>& changes = {});

/// What stands between the children (text, comments, blanks) as written, each child as `emit` says.
[[nodiscard]] std::string rewritten_inside(const text::XmlDocument& document, const text::XmlElement& element,
                                           const std::function<std::string(const text::XmlElement&)>& emit);

/// The element with rewritten attributes and children.
[[nodiscard]] std::string element_text(const text::XmlElement& element, const std::string& tag,
                                       const std::string& inside);

}  // namespace sentree::import
