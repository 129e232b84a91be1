#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "sentree/base/result.h"
#include "sentree/text/xml_diff.h"

namespace sentree::scxml {

/// What differs in meaning between two charts: states, transitions, executable content, data, and what other dialects
/// add. States are the same if their ids are, wherever they stand; transitions are paired by their events and their
/// order. White space, comments, the order of attributes, empty attributes and the layout that editors keep do not
/// count. Charts in any data model, of any dialect. Errors: xml.*, scxml.no-scxml.
/// @param pairs  If given, receives which elements are the same.
[[nodiscard]] Result<std::vector<text::Difference>> diff(std::string_view before, std::string_view after,
                                                         std::string before_file = {}, std::string after_file = {},
                                                         text::ElementPairs* pairs = nullptr);

/// Whether a document with this root is a chart: <scxml>, or CONVINCE's <ascxml>, in whatever namespace.
[[nodiscard]] bool is_chart(const text::XmlElement& root);

}  // namespace sentree::scxml
