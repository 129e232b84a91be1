#include "sentree/design/yaml_gesture.h"

#include <fmt/format.h>

namespace sentree::design {

namespace {

struct EditedYaml {
  Result<std::string> text;
  std::string name;
};

class YamlEditor {
 public:
  YamlEditor(std::string_view yaml, const std::string& file) : yaml_(yaml), file_(file) {}

  EditedYaml operator()(const SetYaml& set) const {
    constexpr std::size_t kShownMax = 40;
    const std::string value = text::yaml_flow(set.value);
    return {text::with_value(yaml_, set.path, set.value, file_),
            fmt::format("set {}{}", text::to_string(set.path), value.size() <= kShownMax ? " to " + value : "")};
  }
  EditedYaml operator()(const InsertYaml& insert) const {
    return {text::with_item(yaml_, insert.path, insert.index, insert.value, file_),
            fmt::format("add to {}", text::to_string(insert.path))};
  }
  EditedYaml operator()(const RemoveYaml& remove) const {
    return {text::without(yaml_, remove.path, file_), fmt::format("delete {}", text::to_string(remove.path))};
  }

 private:
  std::string_view yaml_;
  const std::string& file_;
};

}  // namespace

Result<GestureResult> edit_yaml(std::string_view yaml, const YamlGesture& gesture, const std::string& file) {
  auto [text, name] = std::visit(YamlEditor(yaml, file), gesture);
  if (!text) return tl::unexpected(text.error());
  GestureResult result{edits_between(yaml, *text), std::move(name)};
  if (result.edits.empty()) return fail("design.nothing-to-do", "it is so already");
  end_lines_alike(yaml, result.edits);
  return result;
}

}  // namespace sentree::design
