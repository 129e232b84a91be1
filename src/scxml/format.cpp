#include "sentree/scxml/format.h"

#include <utility>

#include "sentree/text/xml_format.h"

namespace sentree::scxml {

namespace {

bool is_content(const text::XmlElement& element) {
  const std::string_view name = element.local_name();
  return name == "script" || name == "content" || name == "data" || name == "assign";
}

}  // namespace

Result<std::string> format(std::string_view source, std::string file) {
  return text::format_xml(source, std::move(file), {.attribute_rank = {}, .verbatim = is_content});
}

}  // namespace sentree::scxml
