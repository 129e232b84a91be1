#include "sentree/text/yaml_node_edit.h"

#include <utility>

namespace sentree::text {

namespace {

YamlNode scalar(std::string text) {
  YamlNode node;
  node.kind = YamlNode::Kind::kScalar;
  node.scalar = std::move(text);
  return node;
}

}  // namespace

YamlNode& member(YamlNode& mapping, std::string_view key) {
  mapping.kind = YamlNode::Kind::kMapping;
  for (auto& [name, value] : mapping.entries) {
    if (name.scalar == key) return value;
  }
  mapping.entries.emplace_back(scalar(std::string(key)), YamlNode());
  return mapping.entries.back().second;
}

void set_scalar(YamlNode& mapping, std::string_view key, std::string text) {
  member(mapping, key) = scalar(std::move(text));
}

}  // namespace sentree::text
