#include "sentree/project/skill_models.h"

#include <algorithm>
#include <iterator>
#include <map>
#include <set>

#include "sentree/project/mission_tree.h"
#include "sentree/project/plan.h"
#include "sentree/scxml/chart.h"
#include "sentree/text/file.h"
#include "sentree/text/xml.h"

namespace sentree::project {

namespace {

using std::filesystem::path;

/// Data that the chart itself writes, as far as its text tells.
class Written {
 public:
  explicit Written(const scxml::Chart& chart) {
    const auto document = text::XmlDocument::parse(chart.source(), chart.file());
    if (document) visit(document->root());
  }

  [[nodiscard]] bool contains(const std::string& id) const {
    if (places_.contains(id)) return true;
    for (std::size_t at = scripts_.find(id); at != std::string::npos; at = scripts_.find(id, at + 1)) {
      const auto letter = [this](std::size_t i) {
        const char c = i < scripts_.size() ? scripts_[i] : ' ';
        return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '$';
      };
      // Any mention in a script may change it.
      if ((at == 0 || !letter(at - 1)) && !letter(at + id.size())) return true;
    }
    return false;
  }

 private:
  void visit(const text::XmlElement& element) {
    for (const std::string_view name : {"location", "idlocation", "item", "index"}) {
      if (const auto place = element.attribute(name)) {
        // "goal.id" and "goals[0]" write goal.
        places_.emplace(place->substr(0, place->find_first_of(".[ ")));
      }
    }
    if (element.local_name() == "script") scripts_ += element.text() + "\n";
    for (text::XmlElement child = element.first_child(); child; child = child.next_sibling()) visit(child);
  }

  std::set<std::string> places_;
  std::string scripts_;
};

bt::PortInfo port(std::string name, bt::PortDirection direction, const std::optional<Value>& constant) {
  bt::PortInfo info;
  info.name = std::move(name);
  info.direction = direction;
  if (!constant) return info;
  if (constant->as_bool() != nullptr)
    info.type = &bt::type_of<bool>();
  else if (constant->is_number())
    info.type = &bt::type_of<double>();
  else if (constant->as_string() != nullptr)
    info.type = &bt::type_of<std::string>();
  return info;
}

std::string default_text(const Value& constant) {
  if (const bool* flag = constant.as_bool()) return *flag ? "true" : "false";
  if (const std::string* text = constant.as_string()) return *text;
  std::string number = to_json(constant);
  if (number.ends_with(".0")) number.resize(number.size() - 2);
  return number;
}

bt::Ports ports_of(const scxml::Chart& chart) {
  std::set<std::string> outputs;
  for (const scxml::State& state : chart.states()) {
    if (state.parent == 0) outputs.insert(state.donedata.begin(), state.donedata.end());
  }
  const Written written(chart);
  bt::Ports ports;
  for (const scxml::DataItem& item : chart.data()) {
    const bool constant = item.initial && !item.initial->is_null() && !written.contains(item.id);
    const bool is_output = outputs.contains(item.id);
    const bool is_input = !item.has_value || (constant && !is_output);
    if (!is_input && !is_output) continue;
    outputs.erase(item.id);
    ports.push_back(port(item.id,
                         !is_output ? bt::PortDirection::kInput
                         : is_input ? bt::PortDirection::kInOut
                                    : bt::PortDirection::kOutput,
                         item.initial));
    if (is_input && constant && ports.back().type != nullptr) ports.back().default_text = default_text(*item.initial);
  }
  for (const std::string& name : outputs) ports.push_back(port(name, bt::PortDirection::kOutput, std::nullopt));
  return ports;
}

class Collection {
 public:
  explicit Collection(const Project& project) : project_(project) {}

  Loaded<std::vector<bt::NodeModel>> run() {
    read_mission();
    find_charts();
    for (const auto& [id, file] : files_) {
      if (const auto chart = load(file)) charts_.emplace(id, *chart);
    }
    for (const auto& [id, chart] : charts_) {
      if (!is_variant(id, chart)) models_.push_back(model(id, chart));
    }
    for (const auto& [id, known] : known_) {
      if (!charts_.contains(id) && used_.contains(id)) models_.push_back(known);
    }
    std::sort(models_.begin(), models_.end(), [](const auto& a, const auto& b) { return a.id < b.id; });
    if (has_errors(diagnostics_)) return {.value = std::nullopt, .diagnostics = std::move(diagnostics_)};
    return {.value = std::move(models_), .diagnostics = std::move(diagnostics_)};
  }

 private:
  /// What the mission's own model says, and which leaves it has. A mission that does not load says nothing here.
  void read_mission() {
    std::vector<FileRef> files{project_.mission};
    files.insert(files.end(), project_.mission_files.begin(), project_.mission_files.end());
    files.insert(files.end(), project_.palettes.begin(), project_.palettes.end());
    for (const FileRef& file : files) {
      const auto source = text::read_file(project_.folder / file.path, project_.shown(file.path));
      if (!source) continue;
      if (const auto models = bt::read_models(*source, project_.shown(file.path))) {
        for (const bt::NodeModel& known : *models) known_.emplace(known.id, known);
      }
    }
    bt::Registry registry;
    const auto tree = load_mission(project_, registry, TreePurpose::kLook);  // `check` tells what is wrong with it
    // C++ nodes are for the palette too.
    models_ = bt::models(registry);
    if (!tree.ok()) return;
    for (bt::NodeId node = 0; node < tree.value->size(); ++node) {
      const bool leaf = tree.value->is_external(node);
      const bt::Category category = tree.value->category(node);
      if (!leaf && (!tree.value->is_unknown(node) || category == bt::Category::kSubTree)) continue;
      const std::string id(tree.value->registration(node));
      used_.insert(id);
      if (leaf) names_.insert(std::string(tree.value->name(node)));
      if (known_.try_emplace(id, bt::NodeModel{id, category, {}, {}}).second) undeclared_.insert(id);
      if (undeclared_.contains(id)) add_used_ports(*tree.value, node, known_[id].ports);
    }
  }

  // What nobody declares may be read and written where an entry stands.
  static void add_used_ports(const bt::Tree& tree, bt::NodeId node, bt::Ports& ports) {
    for (const bt::PortFact& fact : tree.ports(node)) {
      if (fact.name.starts_with('_')) continue;
      auto port = std::find_if(ports.begin(), ports.end(), [&](const bt::PortInfo& p) { return p.name == fact.name; });
      if (port == ports.end())
        port = ports.insert(port, {std::string(fact.name), bt::PortDirection::kInput, nullptr, {}, {}, {}});
      if (fact.output) port->direction = bt::PortDirection::kInOut;
    }
  }

  void find_charts() {
    std::error_code error;
    for (const auto& entry : std::filesystem::directory_iterator(project_.folder / "skills", error)) {
      const path& file = entry.path();
      if (file.extension() == ".scxml") files_[file.stem().string()] = "skills/" + file.filename().string();
    }
    for (const SkillEntry& entry : project_.skills) {
      if (entry.file.path.empty()) continue;
      // An entry for one leaf by its name is a variant of that leaf's skill.
      if (names_.contains(entry.leaf) && !used_.contains(entry.leaf)) continue;
      files_[entry.leaf] = entry.file.path;
    }
    for (const SkillEntry& entry : project_.skills) entries_[entry.leaf] = &entry;
  }

  std::optional<scxml::Chart> load(const std::string& file) {
    const std::string shown = project_.shown(file);
    const auto source = text::read_file(project_.folder / file, shown);
    if (!source) {
      diagnostics_.push_back(source.error());
      return std::nullopt;
    }
    scxml::LoadOptions options;
    options.read = [&](std::string_view uri) {
      return text::read_file((project_.folder / file).parent_path() / std::string(uri));
    };
    auto chart = scxml::load(*source, shown, options);
    diagnostics_.insert(diagnostics_.end(), chart.diagnostics.begin(), chart.diagnostics.end());
    return std::move(chart.value);
  }

  [[nodiscard]] bool is_variant(const std::string& id, const scxml::Chart& chart) const {
    return !used_.contains(id) && chart.name() != id && charts_.contains(chart.name());
  }

  [[nodiscard]] bt::NodeModel model(const std::string& id, const scxml::Chart& chart) const {
    const auto known = known_.find(id);
    const auto entry = entries_.find(id);
    bt::NodeModel model{id, category_of(chart, entry != entries_.end() ? entry->second : nullptr), ports_of(chart), {}};
    if (entry != entries_.end()) {
      // What sentree.yaml sets is no port.
      std::erase_if(model.ports, [&](const bt::PortInfo& port) {
        const auto& data = entry->second->data;
        return std::any_of(data.begin(), data.end(), [&](const SkillConstant& set) { return set.id == port.name; });
      });
    }
    if (known == known_.end()) return model;
    model.category = known->second.category;
    if (undeclared_.contains(id)) return model;
    // In the order and the words of the mission; what the chart no longer has is left out, what is new comes last.
    bt::Ports ports;
    for (const bt::PortInfo& old : known->second.ports) {
      const auto same =
          std::find_if(model.ports.begin(), model.ports.end(), [&](const auto& p) { return p.name == old.name; });
      if (same == model.ports.end()) continue;
      bt::PortInfo port = old;
      port.direction = same->direction;
      if (port.type == nullptr && port.declared_type.empty()) port.type = same->type;
      ports.push_back(std::move(port));
      model.ports.erase(same);
    }
    std::move(model.ports.begin(), model.ports.end(), std::back_inserter(ports));
    model.ports = std::move(ports);
    return model;
  }

  const Project& project_;
  Diagnostics diagnostics_;
  std::map<std::string, bt::NodeModel> known_;
  std::set<std::string> undeclared_;  ///< Of them, those that no TreeNodesModel has.
  std::set<std::string> used_;        ///< IDs of the mission's leaves.
  std::set<std::string> names_;       ///< And their names.
  std::map<std::string, std::string> files_;
  std::map<std::string, const SkillEntry*> entries_;
  std::map<std::string, scxml::Chart> charts_;
  std::vector<bt::NodeModel> models_;
};

}  // namespace

Loaded<std::vector<bt::NodeModel>> skill_models(const Project& project) { return Collection(project).run(); }

}  // namespace sentree::project
