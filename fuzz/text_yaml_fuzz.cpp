// Reads the bytes as YAML and looks at every scalar in every way.

#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

#include "sentree/text/yaml.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto document = sentree::text::parse_yaml({reinterpret_cast<const char*>(data), size}, "fuzz.yaml");
  if (!document) return 0;
  static_cast<void>(document->value().hash());
  std::vector<const sentree::text::YamlNode*> open = {&*document};
  while (!open.empty()) {
    const auto* node = open.back();
    open.pop_back();
    static_cast<void>(node->number());
    static_cast<void>(node->integer());
    static_cast<void>(node->boolean());
    for (const auto& item : node->items) open.push_back(&item);
    for (const auto& [key, value] : node->entries) open.push_back(&value);
  }
  return 0;
}
