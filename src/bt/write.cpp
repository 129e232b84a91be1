#include "sentree/bt/write.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <set>
#include <utility>

#include "sentree/bt/model.h"
#include "sentree/text/xml.h"

namespace sentree::bt {

using text::XmlElement;

std::vector<NodeModel> models(const Registry& registry, bool with_builtins) {
  std::vector<NodeModel> all;
  if (with_builtins) {
    for (const Manifest& m : builtins(4)) {
      if (m.kind != Kind::kSubTree) all.push_back({m.id, m.category, m.ports, m.description});
    }
  }
  for (const auto& [id, entry] : registry.entries())
    all.push_back({id, entry.category, entry.ports, entry.description});
  std::sort(all.begin(), all.end(), [](const NodeModel& a, const NodeModel& b) { return a.id < b.id; });
  return all;
}

namespace {

/// @param kept  Elements that are no ports, as they are written behind them.
std::string write_model(const NodeModel& model, const std::string& indent, std::string_view kept = {}) {
  std::string out = fmt::format("{}<{}{}", indent, to_string(model.category), text::xml_attribute("ID", model.id));
  if (model.ports.empty() && kept.empty()) return out + "/>\n";
  out += ">\n";
  for (const PortInfo& port : model.ports) {
    const std::string tag(to_string(port.direction));
    out += fmt::format("{}  <{}{}", indent, tag, text::xml_attribute("name", port.name));
    const std::string type = !port.declared_type.empty() ? port.declared_type
                             : port.type != nullptr      ? port.type->name
                                                         : "";
    if (!type.empty()) out += text::xml_attribute("type", type);
    if (port.default_text) out += text::xml_attribute("default", *port.default_text);
    out += port.description.empty() ? "/>\n" : fmt::format(">{}</{}>\n", text::xml_escape(port.description), tag);
  }
  out += kept;
  return fmt::format("{}{}</{}>\n", out, indent, to_string(model.category));
}

/// What a model has beside its ports: MetadataFields, descriptions. Byte for byte, each on a line of its own.
std::string kept_of(const text::XmlDocument& document, const XmlElement& model, const std::string& indent) {
  std::string kept;
  for (XmlElement e = model.first_child(); e; e = e.next_sibling()) {
    if (e.name().ends_with("_port")) continue;
    kept += fmt::format("{}{}\n", indent, document.source().substr(e.offset(), e.end_offset() - e.offset()));
  }
  return kept;
}

std::string trimmed_end(std::string text) {
  while (!text.empty() && (text.back() == '\n' || text.back() == ' ')) text.pop_back();
  return text;
}

std::string trimmed_start(const std::string& text) {
  return text.substr(std::min(text.find_first_not_of(" \n"), text.size()));
}

}  // namespace

std::string write_models(const std::vector<NodeModel>& models) {
  std::string out = "  <TreeNodesModel>\n";
  for (const NodeModel& model : models) out += write_model(model, "    ");
  return out + "  </TreeNodesModel>\n";
}

Result<std::string> with_models(std::string_view xml, const std::vector<NodeModel>& models, std::string file) {
  auto document = text::XmlDocument::parse(std::string(xml), std::move(file), {.lenient = true});
  if (!document) return tl::unexpected(std::move(document.error()));
  const XmlElement root = document->root();
  if (root.name() != "root") return fail("bt.not-a-tree", "the root element is no <root>", root.span());
  text::XmlEdit edit(*document);
  const XmlElement old = root.child("TreeNodesModel");
  if (!old) {
    edit.append_child(root, trimmed_end(trimmed_start(write_models(models))));
    return edit.apply();
  }
  std::set<std::string_view> written;
  for (XmlElement element = old.first_child(); element; element = element.next_sibling()) {
    const auto id = element.attribute("ID");
    const auto model =
        std::find_if(models.begin(), models.end(), [&](const NodeModel& m) { return id && m.id == *id; });
    if (model == models.end()) continue;
    written.insert(model->id);
    const auto present = read_model(element);
    if (present && write_model(*present, "") == write_model(*model, "")) continue;
    const std::string kept = kept_of(*document, element, "      ");
    edit.replace(element, trimmed_end(trimmed_start(write_model(*model, "    ", kept))));
  }
  for (const NodeModel& model : models) {
    if (!written.contains(model.id)) edit.append_child(old, trimmed_end(trimmed_start(write_model(model, "    "))));
  }
  return edit.apply();
}

}  // namespace sentree::bt
