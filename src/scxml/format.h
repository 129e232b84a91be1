#pragma once

#include <string>
#include <string_view>

#include "sentree/base/result.h"

namespace sentree::scxml {

/// The document in the canonical form of `text::format_xml`, attributes in the order written. White space in <script>,
/// <content>, <data> and <assign> is content and stays. Formatting twice changes nothing. Errors: xml.*.
[[nodiscard]] Result<std::string> format(std::string_view source, std::string file = {});

}  // namespace sentree::scxml
