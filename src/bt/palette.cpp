#include "sentree/bt/palette.h"

#include <algorithm>
#include <utility>

#include "sentree/text/xml.h"

namespace sentree::bt {

using text::XmlElement;

namespace {

std::optional<Category> category_of(std::string_view tag) {
  for (const Category category :
       {Category::kControl, Category::kDecorator, Category::kAction, Category::kCondition, Category::kSubTree}) {
    if (tag == to_string(category)) return category;
  }
  return std::nullopt;
}

}  // namespace

std::optional<NodeModel> read_model(const XmlElement& element) {
  const auto category = category_of(element.name());
  const auto id = element.attribute("ID");
  if (!category || !id) return std::nullopt;
  NodeModel model{std::string(*id), *category, {}, {}};
  for (XmlElement port = element.first_child(); port; port = port.next_sibling()) {
    PortInfo info;
    if (port.name() == to_string(PortDirection::kOutput)) {
      info.direction = PortDirection::kOutput;
    } else if (port.name() == to_string(PortDirection::kInOut)) {
      info.direction = PortDirection::kInOut;
    } else if (port.name() != to_string(PortDirection::kInput)) {
      continue;
    }
    info.name = port.attribute("name").value_or("");
    info.declared_type = port.attribute("type").value_or("");
    info.type = type_named(info.declared_type);
    if (const auto value = port.attribute("default")) info.default_text = std::string(*value);
    info.description = port.text();
    model.ports.push_back(std::move(info));
  }
  return model;
}

Result<std::vector<NodeModel>> read_models(std::string_view xml, std::string file) {
  const auto document = text::XmlDocument::parse(std::string(xml), std::move(file), {.lenient = true});
  if (!document) return tl::unexpected(document.error());
  const XmlElement root = document->root();
  if (root.name() != "root") return fail("bt.not-a-tree", "the root element is no <root>", root.span());
  std::vector<NodeModel> all;
  const XmlElement models = root.child("TreeNodesModel");
  for (XmlElement e = models ? models.first_child() : XmlElement(); e; e = e.next_sibling()) {
    if (auto model = read_model(e)) all.push_back(std::move(*model));
  }
  return all;
}

void Palette::add(const std::vector<NodeModel>& models) {
  for (const NodeModel& model : models) {
    if (model.category != Category::kSubTree) nodes_.try_emplace(model.id, model);
  }
}

const NodeModel* Palette::find(std::string_view id) const {
  const auto found = nodes_.find(id);
  return found != nodes_.end() ? &found->second : nullptr;
}

std::size_t node_count(const std::vector<NodeModel>& models) {
  return static_cast<std::size_t>(std::count_if(
      models.begin(), models.end(), [](const NodeModel& model) { return model.category != Category::kSubTree; }));
}

}  // namespace sentree::bt
