#pragma once

#include <string>
#include <string_view>
#include <variant>

#include "sentree/design/tree_edit.h"
#include "sentree/text/yaml_edit.h"

namespace sentree::design {

struct SetYaml {
  text::YamlPath path;
  Value value;
};
/// Before item `index` of the sequence at `path`.
struct InsertYaml {
  text::YamlPath path;
  std::size_t index = 0;
  Value value;
};
struct RemoveYaml {
  text::YamlPath path;
};
using YamlGesture = std::variant<SetYaml, InsertYaml, RemoveYaml>;

/// A change of sentree.yaml, a scenario or a world as edits of its text: see text/yaml_edit.h.
/// Errors: those of `text::with_value`; design.nothing-to-do.
[[nodiscard]] Result<GestureResult> edit_yaml(std::string_view yaml, const YamlGesture& gesture,
                                              const std::string& file = {});

}  // namespace sentree::design
