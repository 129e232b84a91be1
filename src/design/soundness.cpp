#include "sentree/design/detail/soundness.h"

#include <algorithm>
#include <vector>

#include "sentree/design/requirement_edit.h"
#include "sentree/design/text_edit.h"
#include "sentree/design/tree_edit.h"
#include "sentree/scxml/model.h"
#include "sentree/text/xml.h"
#include "sentree/text/yaml.h"

namespace sentree::design {

namespace {

// Kinds that only the project knows take as many as they have.
bool has_children_as_wanted(const OutlineTree& tree) {
  static const Kinds kBuiltins{{}};
  std::vector<std::size_t> children(tree.nodes.size());
  for (const OutlineNode& node : tree.nodes) {
    if (node.parent >= 0) ++children[static_cast<std::size_t>(node.parent)];
  }
  for (std::size_t i = 0; i < tree.nodes.size(); ++i) {
    const OutlineNode& node = tree.nodes[i];
    if (kBuiltins.model(node.id) != nullptr && (children[i] < node.children_min || children[i] > node.children_max))
      return false;
  }
  return true;
}

bool is_sound_xml(const std::string& file, std::string_view text) {
  const auto outline = outline_of(text, Kinds{{}}, file);
  if (outline) return std::all_of(outline->trees.begin(), outline->trees.end(), has_children_as_wanted);
  return text.find("<BehaviorTree") == std::string_view::npos &&
         text::XmlDocument::parse(std::string(text), file, {.lenient = true}).has_value();
}

}  // namespace

bool is_sound(const std::string& file, std::string_view text) {
  if (file.ends_with(".yaml") || file.ends_with(".yml")) return text::parse_yaml(text, file).has_value();
  if (file.ends_with(".scxml")) return scxml::load(text, file).value.has_value();
  if (file.ends_with(".req")) return sentences_of(text, file).has_value();
  return !file.ends_with(".xml") || is_sound_xml(file, text);
}

std::optional<std::string> merged_soundly(const std::string& file, std::string_view base, std::string_view mine,
                                          std::string_view theirs) {
  auto merged = merge(base, mine, theirs);
  if (!merged || *merged == mine || *merged == theirs) return merged;
  if (!is_sound(file, *merged) && is_sound(file, mine) && is_sound(file, theirs)) return std::nullopt;
  return merged;
}

}  // namespace sentree::design
