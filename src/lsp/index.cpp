#include "sentree/lsp/index.h"

#include <fmt/format.h>

#include <algorithm>

#include "sentree/bt/registry.h"
#include "sentree/bt/tree.h"
#include "sentree/bt/write.h"
#include "sentree/design/workspace.h"
#include "sentree/project/interface_file.h"
#include "sentree/project/mission_tree.h"
#include "sentree/project/plan.h"
#include "sentree/scxml/diff.h"
#include "sentree/text/file.h"

namespace sentree::lsp {

namespace {

namespace fs = std::filesystem;
using text::XmlElement;

std::string attribute(const XmlElement& element, std::string_view name) {
  return std::string(element.attribute(name).value_or(""));
}

void read_tree(const text::XmlDocument& document, const std::string& path, IndexedFile& file,
               const std::set<std::string, std::less<>>& builtins) {
  if (auto models = bt::read_models(file.text, path)) file.models = std::move(*models);
  for (XmlElement child = document.root().first_child(); child; child = child.next_sibling()) {
    if (child.local_name() != "BehaviorTree") continue;
    if (std::string id = attribute(child, "ID"); !id.empty()) file.tree_ids.insert(std::move(id));
    for (XmlElement top = child.first_child(); top; top = top.next_sibling()) {
      text::for_each_element(top, [&](const XmlElement& node) {
        const std::string tag(node.name());
        std::string id;
        if (tag == "Action" || tag == "Condition")
          id = attribute(node, "ID");
        else if (!builtins.contains(tag) && tag != "SubTree" && tag != "Control" && tag != "Decorator")
          id = tag;
        std::string name = attribute(node, "name");
        if (!id.empty() && !name.empty()) file.leaves.try_emplace(name, id);
        if (!id.empty()) file.skill_ids.insert(std::move(id));
        if (!name.empty()) file.node_names.insert(std::move(name));
        node.for_each_attribute([&](std::string_view, std::string_view value) {
          if (value.size() > 2 && value.front() == '{' && value.back() == '}')
            file.entries.emplace(value.substr(1, value.size() - 2));
        });
      });
    }
  }
}

void read_chart(const text::XmlDocument& document, IndexedFile& file) {
  std::set<std::string> outputs;
  std::set<std::string> events;
  text::for_each_element(document.root(), [&](const XmlElement& element) {
    const std::string_view tag = element.local_name();
    if (tag == "data") {
      const bool has_value = element.attribute("expr") || element.attribute("src") || !element.text().empty();
      file.data.push_back({attribute(element, "id"), has_value});
    } else if (tag == "param" && element.parent().local_name() == "donedata") {
      outputs.insert(attribute(element, "name"));
    } else if (tag == "raise" || (tag == "send" && attribute(element, "type") != "thrift")) {
      if (std::string event = attribute(element, "event"); !event.empty()) events.insert(std::move(event));
    } else if (tag == "transition") {
      const std::string event = fmt::format(" {} ", attribute(element, "event"));
      file.is_action =
          file.is_action || event.find(" tick ") != std::string::npos || event.find(" halt ") != std::string::npos;
    } else if (tag == "final" && attribute(element, "id") == "halted") {
      file.is_action = true;
    }
  });
  file.outputs.assign(outputs.begin(), outputs.end());
  file.own_events.assign(events.begin(), events.end());
}

// Scenarios may lie anywhere: what begins with a word that only they have.
bool reads_as_scenario(std::string_view text) {
  while (!text.empty()) {
    for (const std::string_view word : {"timeline:", "expect:", "override:", "duration:", "processes:", "delays:"}) {
      if (text.starts_with(word)) return true;
    }
    text.remove_prefix(std::min(text.find('\n'), text.size() - 1) + 1);
  }
  return false;
}

bool is_xml(FileKind kind) { return kind == FileKind::kTree || kind == FileKind::kChart; }
bool is_yaml(FileKind kind) {
  return kind == FileKind::kProject || kind == FileKind::kScenario || kind == FileKind::kWorld;
}

}  // namespace

fs::path project_of(const fs::path& file) {
  std::error_code error;
  for (fs::path folder = file.parent_path();; folder = folder.parent_path()) {
    if (fs::exists(folder / "sentree.yaml", error)) return folder;
    if (folder == folder.parent_path()) return {};
  }
}

FileKind kind_of(const fs::path& file, std::string_view text) {
  const std::string ending = file.extension().string();
  if (ending == ".scxml") return FileKind::kChart;
  if (ending == ".xml") {
    if (text.find("<scxml") != std::string_view::npos) return FileKind::kChart;
    // Other XML is nobody's business.
    const bool is_tree =
        text.find("<root") != std::string_view::npos || text.find("<BehaviorTree") != std::string_view::npos;
    return is_tree ? FileKind::kTree : FileKind::kOther;
  }
  if (ending == ".req") return FileKind::kRequirements;
  if (ending == ".thrift") return FileKind::kInterface;
  if (ending != ".yaml" && ending != ".yml") return FileKind::kOther;
  if (file.filename() == "sentree.yaml") return FileKind::kProject;
  if (file.filename() == "campaign.yaml") return FileKind::kScenario;
  const std::string folder = file.parent_path().filename().string();
  if (folder == "scenarios" || folder == "verify" || folder == "campaign") return FileKind::kScenario;
  if (folder == "world") return FileKind::kWorld;
  return reads_as_scenario(text) ? FileKind::kScenario : FileKind::kOther;
}

const IndexedFile* Index::find(const std::string& file) const {
  const auto found = files_.find(file);
  return found != files_.end() ? &found->second : nullptr;
}

const idl::Schema* Index::schema(const std::string& file) const {
  const auto found = schemas_.find(file);
  return found != schemas_.end() ? &found->second : nullptr;
}

std::string Index::chart_of(std::string_view skill) const {
  const auto found = std::find_if(names_.charts.begin(), names_.charts.end(),
                                  [&](const auto& entry) { return entry.second == skill; });
  return found != names_.charts.end() ? found->first : std::string();
}

void Index::refresh(const text::Overlay& open) {
  std::set<std::string> changed;
  read_files(open, changed);
  if (changed.empty()) return;
  const text::ReadThrough edited(open);
  const Names before = names_;
  read_project();
  read_interfaces(changed);
  gather();
  name_all(changed, !(names_ == before));
}

void Index::read_files(const text::Overlay& open, std::set<std::string>& changed) {
  if (names_.builtins.empty()) {
    for (const bt::NodeModel& model : bt::models(bt::Registry(), true)) names_.builtins.insert(model.id);
    for (const char* tag : {"SubTree", "SubTreePlus"}) names_.builtins.insert(tag);
  }
  std::set<std::string> there;
  const auto take = [&](const fs::path& path) {
    const std::string name = path.string();
    if (!there.insert(name).second) return;
    const auto edited = open.find(path);
    if (edited != open.end()) {
      stamps_.erase(name);
      const IndexedFile* const known = find(name);
      if (known != nullptr && known->text == edited->second) return;
      files_[name].text = edited->second;
    } else {
      std::error_code error;
      const Stamp stamp{fs::last_write_time(path, error), fs::file_size(path, error)};
      const auto known = stamps_.find(name);
      if (known != stamps_.end() && known->second == stamp) return;
      auto text = text::read_file(path, {}, design::kDocumentBytesMax);
      if (!text) {
        there.erase(name);
        return;
      }
      stamps_[name] = stamp;
      if (const IndexedFile* file = find(name); file != nullptr && file->text == *text) return;
      files_[name].text = std::move(*text);
    }
    changed.insert(name);
  };
  (void)design::each_project_text(folder_, take);
  for (const auto& [path, text] : open) {
    if (design::is_project_text(path) && path.string().starts_with(folder_.string() + "/")) take(path);
  }
  // Interfaces that lie elsewhere, as long as a service is of them.
  for (const auto& [name, service] : names_.services) {
    if (!service.file.starts_with(folder_.string() + "/")) take(service.file);
  }
  for (auto file = files_.begin(); file != files_.end();) {
    if (there.contains(file->first)) {
      ++file;
      continue;
    }
    changed.insert(file->first);
    stamps_.erase(file->first);
    documents_.erase(file->first);
    yaml_.erase(file->first);
    schemas_.erase(file->first);
    file = files_.erase(file);
  }

  for (const std::string& name : changed) {
    const auto found = files_.find(name);
    if (found == files_.end()) continue;
    IndexedFile& file = found->second;
    file.lines = Lines(file.text);
    file.kind = name == world_file_ ? FileKind::kWorld : kind_of(name, file.text);
    file.readable = true;
    if (is_xml(file.kind)) {
      auto document = text::XmlDocument::parse(file.text, name, {.lenient = true});
      file.readable = document.has_value();
      if (!document) continue;
      documents_[name] = std::make_shared<const text::XmlDocument>(std::move(*document));
      IndexedFile fresh;
      fresh.text = std::move(file.text);
      fresh.lines = std::move(file.lines);
      fresh.kind = scxml::is_chart(documents_[name]->root()) ? FileKind::kChart : FileKind::kTree;
      file = std::move(fresh);
      if (file.kind == FileKind::kTree)
        read_tree(*documents_[name], name, file, names_.builtins);
      else
        read_chart(*documents_[name], file);
    } else if (is_yaml(file.kind)) {
      auto node = text::parse_yaml(file.text, name);
      file.readable = node.has_value();
      if (node) yaml_[name] = std::move(*node);
    }
  }
}

void Index::read_project() {
  auto loaded = project::load_project(folder_);
  if (!loaded.value) return;
  project_ = std::move(loaded.value);
  const std::string before = world_file_;
  world_file_ = project_->world ? (folder_ / project_->world->path).lexically_normal().string() : "";
  if (world_file_ == before) return;
  for (const std::string& name : {before, world_file_}) {
    const auto file = files_.find(name);
    if (file == files_.end()) continue;
    file->second.kind = name == world_file_ ? FileKind::kWorld : kind_of(name, file->second.text);
    auto node = text::parse_yaml(file->second.text, name);
    if (node) yaml_[name] = std::move(*node);
  }
}

void Index::read_interfaces(const std::set<std::string>& changed) {
  const bool any =
      std::any_of(changed.begin(), changed.end(), [](const auto& name) { return name.ends_with(".thrift"); });
  const auto load = [&](const std::string& file) {
    if (!any && schemas_.contains(file)) return;
    if (auto schema = project::load_interface(file, file); schema.value) schemas_.insert_or_assign(file, *schema.value);
  };
  for (const auto& [name, file] : files_) {
    if (file.kind == FileKind::kInterface) load(name);
  }
  if (!project_) return;
  std::map<std::string, Names::Service, std::less<>> services;
  for (const project::ServiceEntry& entry : project_->services) {
    std::error_code error;
    fs::path file = folder_ / "interfaces" / entry.idl;
    if (!fs::exists(file, error)) file = project::shipped_folder("interfaces") / entry.idl;
    const std::string name = file.lexically_normal().string();
    load(name);
    const idl::Schema* const known = schema(name);
    services[entry.name] = {name, entry.interface, known != nullptr ? known->service(entry.interface) : nullptr};
    if (!files_.contains(name) && fs::exists(file, error)) {
      if (auto text = text::read_file(file, {}, design::kDocumentBytesMax)) {
        IndexedFile& outside = files_[name];
        outside.text = std::move(*text);
        outside.lines = Lines(outside.text);
        outside.kind = FileKind::kInterface;
        if (known != nullptr) outside.occurrences = occurrences_in_interface(outside.text, *known, name);
        stamps_[name] = {fs::last_write_time(file, error), fs::file_size(file, error)};
      }
    }
  }
  names_.services = std::move(services);
}

void Index::gather() {
  names_.skills.clear();
  names_.nodes.clear();
  names_.spelled.clear();
  names_.trees.clear();
  names_.charts.clear();
  names_.leaves.clear();
  names_.monitors.clear();
  names_.locations.clear();
  names_.members.clear();
  names_.answering.clear();
  palette_ = {};
  for (const auto& [name, file] : files_) {
    names_.skills.insert(file.skill_ids.begin(), file.skill_ids.end());
    names_.nodes.insert(file.node_names.begin(), file.node_names.end());
    names_.trees.insert(file.tree_ids.begin(), file.tree_ids.end());
    palette_.add(file.models);
  }
  palette_.add(bt::models(bt::Registry(), true));
  const fs::path skills = folder_ / "skills";
  for (const auto& [name, file] : files_) {
    if (file.kind == FileKind::kChart && fs::path(name).parent_path() == skills)
      names_.charts[name] = fs::path(name).stem().string();
  }
  if (project_) {
    for (const project::SkillEntry& entry : project_->skills) {
      if (entry.file.path.empty()) continue;
      const std::string file = (folder_ / entry.file.path).lexically_normal().string();
      // A leaf's name is no ID.
      if (names_.skills.contains(entry.leaf)) names_.charts[file] = entry.leaf;
    }
    for (const project::MonitorEntry& entry : project_->monitors) {
      const std::string file = (folder_ / entry.file.path).lexically_normal().string();
      names_.monitors[entry.name] = file.ends_with(".req") ? "" : file;
    }
  }
  for (const auto& [file, skill] : names_.charts) {
    names_.skills.insert(skill);
    if (palette_.find(skill) != nullptr) continue;
    const IndexedFile* const chart = find(file);
    if (chart == nullptr) continue;
    bt::NodeModel model;
    model.id = skill;
    model.category = chart->is_action ? bt::Category::kAction : bt::Category::kCondition;
    for (const IndexedFile::Data& data : chart->data) {
      if (!data.has_value) model.ports.push_back({.name = data.id});
    }
    for (const std::string& output : chart->outputs)
      model.ports.push_back({.name = output, .direction = bt::PortDirection::kOutput});
    palette_.add({model});
  }
  for (const std::string& builtin : names_.builtins) names_.skills.erase(builtin);
  for (const std::string& name : names_.nodes) {
    if (std::string spelled = bt::event_name(name); spelled != name)
      names_.spelled.try_emplace(std::move(spelled), name);
  }
  for (const auto& [file, skill] : names_.charts) names_.leaves.try_emplace(skill, file);
  for (const auto& [name, file] : files_) {
    for (const auto& [leaf, id] : file.leaves) {
      if (const std::string chart = chart_of(id); !chart.empty())
        names_.leaves.try_emplace(bt::event_name(leaf), chart);
    }
  }
  if (project_) {
    for (const project::SkillEntry& entry : project_->skills) {
      if (!entry.file.path.empty() && !names_.skills.contains(entry.leaf))
        names_.leaves[bt::event_name(entry.leaf)] = (folder_ / entry.file.path).lexically_normal().string();
    }
  }
  for (const auto& [file, root] : yaml_) gather_answering(root);
  for (const auto& [file, schema] : schemas_) {
    const auto take = [&](const idl::Struct& structure) {
      for (const idl::Field& field : structure.fields) names_.members.insert(field.name);
    };
    for (const idl::Struct& structure : schema.structures()) take(structure);
    for (const idl::Service& service : schema.services()) {
      for (const idl::Method& method : service.own_methods) take(method.arguments);
    }
  }
  if (const auto world = yaml_.find(world_file_); world != yaml_.end()) {
    for (const char* section : {"locations", "areas"}) {
      const text::YamlNode* const places = world->second.find(section);
      if (places == nullptr) continue;
      for (const auto& [place, value] : places->entries) names_.locations.insert(place.scalar);
    }
  }
}

// protocols.*: {states: {ID: STATUS}, halted: ID}, also at a skill itself and in scenarios.
void Index::gather_answering(const text::YamlNode& node) {
  for (const text::YamlNode& item : node.items) gather_answering(item);
  for (const auto& [key, value] : node.entries) {
    if (key.scalar == "states") {
      for (const auto& [state, status] : value.entries) names_.answering.insert(state.scalar);
    } else if (key.scalar == "halted" && value.is_scalar()) {
      names_.answering.insert(value.scalar);
    }
    gather_answering(value);
  }
}

void Index::name_all(const std::set<std::string>& changed, bool all) {
  for (auto& [name, file] : files_) {
    if ((!all && !changed.contains(name)) || !file.readable) continue;
    switch (file.kind) {
      case FileKind::kTree: file.occurrences = occurrences_in_tree(*documents_[name], names_); break;
      case FileKind::kChart: file.occurrences = occurrences_in_chart(*documents_[name], name, names_); break;
      case FileKind::kRequirements: file.occurrences = occurrences_in_requirements(file.text, name, names_); break;
      case FileKind::kProject:
      case FileKind::kScenario:
        file.occurrences =
            occurrences_in_yaml(file.text, yaml_[name], file.kind == FileKind::kProject, folder_.string(), names_);
        break;
      case FileKind::kWorld: file.occurrences = occurrences_in_world(file.text, yaml_[name]); break;
      case FileKind::kInterface:
        if (const idl::Schema* known = schema(name))
          file.occurrences = occurrences_in_interface(file.text, *known, name);
        break;
      case FileKind::kOther: break;
    }
    std::sort(file.occurrences.begin(), file.occurrences.end(),
              [](const Occurrence& a, const Occurrence& b) { return a.from < b.from; });
  }
}

const Occurrence* Index::at(const std::string& name, std::size_t offset) const {
  const IndexedFile* const file = find(name);
  if (file == nullptr) return nullptr;
  for (const Occurrence& occurrence : file->occurrences) {
    if (offset < occurrence.from || offset > occurrence.to) continue;
    // Places are those of the last text that could be read.
    if (!file->readable &&
        (occurrence.to > file->text.size() ||
         file->text.substr(occurrence.from, occurrence.to - occurrence.from) != written_name(occurrence.symbol)))
      continue;
    return &occurrence;
  }
  return nullptr;
}

std::vector<Index::Place> Index::places_of(const Symbol& symbol) const {
  std::vector<Place> places;
  for (const auto& [name, file] : files_) {
    for (const Occurrence& occurrence : file.occurrences) {
      if (occurrence.symbol == symbol) places.push_back({&name, &occurrence});
    }
  }
  return places;
}

}  // namespace sentree::lsp
