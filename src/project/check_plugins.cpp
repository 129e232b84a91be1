#include "sentree/project/detail/check_plugins.h"

#include <algorithm>
#include <filesystem>
#include <set>

#include <fmt/format.h>

#include "sentree/bt/palette.h"
#include "sentree/text/file.h"
#include "sentree/text/xml.h"

namespace sentree::project {

namespace {

void check_model(const text::XmlElement& element, const bt::Registry& registry, Diagnostics& diagnostics) {
  const auto model = bt::read_model(element);
  const bt::Registry::Entry* const node = model ? registry.find(model->id) : nullptr;
  if (node == nullptr) return;
  const auto warn = [&](std::string message, const SourceSpan& span) {
    add(diagnostics, Severity::kWarning, "check.plugin-model", std::move(message), span);
  };
  if (model->category != node->category) {
    warn(fmt::format("the plug-in's node {} is of kind {}, not {}", node->id, bt::to_string(node->category),
                     bt::to_string(model->category)),
         element.span());
  }
  std::vector<std::string> names;
  for (const bt::PortInfo& port : node->ports) names.push_back(port.name);
  for (text::XmlElement port = element.first_child(); port; port = port.next_sibling()) {
    const std::string name(port.attribute("name").value_or(""));
    const auto is_it = [&](const bt::PortInfo& info) { return info.name == name; };
    const auto said = std::find_if(model->ports.begin(), model->ports.end(), is_it);
    if (said == model->ports.end()) continue;
    const auto own = std::find_if(node->ports.begin(), node->ports.end(), is_it);
    if (own == node->ports.end()) {
      warn(fmt::format("the plug-in's node {} has no port \"{}\"{}", node->id, name, did_you_mean(name, names)),
           port.span());
    } else if (own->direction != said->direction) {
      warn(fmt::format("\"{}\" of the plug-in's node {} is an {}", name, node->id, bt::to_string(own->direction)),
           port.span());
    }
  }
}

}  // namespace

void check_plugins(const Project& project, const bt::Registry& registry, const bt::Tree& tree,
                   const std::vector<std::string>& skills, Diagnostics& diagnostics) {
  if (project.plugins.empty()) return;
  std::set<std::string, std::less<>> used;
  for (bt::NodeId node = 0; node < tree.size(); ++node) used.emplace(tree.registration(node));
  std::set<std::string> told;
  for (const std::string& skill : skills) {
    if (registry.find(skill) == nullptr || !used.contains(skill) || !told.insert(skill).second) continue;
    add(diagnostics, Severity::kWarning, "check.hidden-skill",
        fmt::format("a plug-in's node {0} takes the place of the skill {0}, whose chart is not run; remove "
                    "the chart, or give one of them another name",
                    skill),
        project.plugins.front().span);
  }
  std::vector<FileRef> files = project.mission_files;
  if (files.empty()) files.push_back(project.mission);
  files.insert(files.end(), project.palettes.begin(), project.palettes.end());
  for (const FileRef& file : files) {
    const std::string shown = project.shown(file.path);
    const auto source = text::read_file(project.folder / file.path, shown);
    const auto document = source ? text::XmlDocument::parse(*source, shown) : tl::unexpected(source.error());
    if (!document) continue;  // has been told
    for (text::XmlElement child = document->root().first_child(); child; child = child.next_sibling()) {
      if (child.local_name() != "TreeNodesModel") continue;
      for (text::XmlElement node = child.first_child(); node; node = node.next_sibling())
        check_model(node, registry, diagnostics);
    }
  }
}

}  // namespace sentree::project
