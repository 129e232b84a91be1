#include "sentree/project/mission_tree.h"

#include <algorithm>
#include <map>
#include <utility>

#include <fmt/format.h>

#include "sentree/bt/library.h"
#include "sentree/bt/load.h"
#include "sentree/nav2/nav2.h"
#include "sentree/project/check_unnamed.h"
#include "sentree/project/detail/check_plugins.h"
#include "sentree/project/plan.h"
#include "sentree/text/file.h"

namespace sentree::project {

namespace {

using std::filesystem::path;

class MissionLoader {
 public:
  MissionLoader(const Project& project, bt::Registry& registry) : project_(project), registry_(registry) {}

  Loaded<bt::Tree> load(TreePurpose purpose) {
    auto source = read(project_.mission);
    if (!source) return {std::nullopt, std::move(diagnostics_)};
    // Without its plug-ins the tree would be full of unknown nodes, which is not what is wrong.
    if (!load_plugins(project_, registry_, diagnostics_)) return {std::nullopt, std::move(diagnostics_)};
    const bt::Registry plugins = project_.plugins.empty() ? bt::Registry() : registry_;
    if (!palettes()) return {std::nullopt, std::move(diagnostics_)};
    for (const FileRef& file : project_.mission_files) add(file);
    bt::LoadOptions options;
    options.registry = &registry_;
    options.partial = purpose == TreePurpose::kLook;
    options.main_tree = project_.tree;
    options.skills = skill_names();
    options.skill_kind = [this](std::string_view id, std::string_view name) { return skill_kind(id, name); };
    options.read_file = [this](const path& file) { return text::read_file(absolute(file), file.string()); };
    options.find_package = [this](std::string_view package) {
      std::vector<path> folders;
      for (const FileRef& folder : project_.packages) folders.push_back(project_.shown(folder.path));
      return bt::find_ros_package(package, folders);
    };
    options.entries = start_entries(project_);
    options.where_tree = [this](std::string_view id) { return where_tree(id); };
    library_.serve(options);
    auto loaded = bt::load(std::move(*source), options, project_.shown(project_.mission.path));
    loaded.diagnostics.insert(loaded.diagnostics.begin(), diagnostics_.begin(), diagnostics_.end());
    for (Diagnostic& found : loaded.diagnostics) place_of_plugin(found);
    if (has_errors(diagnostics_)) loaded.value.reset();
    if (loaded.value) check_plugins(project_, plugins, *loaded.value, skill_names(), loaded.diagnostics);
    return loaded;
  }

 private:
  // What is wrong with nodes of a plug-in stands where that is named.
  void place_of_plugin(Diagnostic& found) const {
    if (!found.span.file.empty()) return;
    for (const FileRef& plugin : project_.plugins) {
      if (found.message.starts_with(fmt::format("plug-in {}: ", (project_.folder / plugin.path).string())))
        found.span = plugin.span;
    }
  }
  // The message stands where the file is named.
  std::optional<std::string> read(const FileRef& file) {
    auto source = text::read_file(project_.folder / file.path, project_.shown(file.path));
    if (source) return std::move(*source);
    Diagnostic why = std::move(source.error());
    if (file.span.line > 0) {
      why.message = fmt::format("file \"{}\": {}", project_.shown(file.path), why.message);
      why.span = file.span;
    }
    diagnostics_.push_back(std::move(why));
    return std::nullopt;
  }

  bool add(const FileRef& file) {
    const auto source = read(file);
    if (!source) return false;
    const auto added = library_.add(project_.shown(file.path), *source);
    // The mission's own file tells that itself.
    if (!added && file.path != project_.mission.path) diagnostics_.push_back(added.error());
    return added.has_value();
  }

  bool palettes() {
    bool all = true;
    for (const FileRef& palette : project_.palettes) {
      std::error_code error;
      if (palette.path == nav2::kPalette && !std::filesystem::exists(project_.folder / palette.path, error)) {
        nav2::add_nodes(registry_);
        // What the project runs itself is its own.
        for (const std::string& name : skill_names()) registry_.remove(name);
        library_.add(nav2::models());
      } else {
        all = add(palette) && all;
      }
    }
    return all;
  }

  // Behind the message that there is no such BehaviorTree: the first other file of the project that has it.
  std::string where_tree(std::string_view id) {
    if (!elsewhere_) {
      elsewhere_.emplace();
      std::vector<path> files;
      std::error_code error;
      constexpr std::size_t kLookedAtMax = 1'000;
      for (auto entry = std::filesystem::recursive_directory_iterator(
               project_.folder, std::filesystem::directory_options::skip_permission_denied, error);
           !error && files.size() < kLookedAtMax && entry != std::filesystem::recursive_directory_iterator();
           entry.increment(error)) {
        const path& file = entry->path();
        if (entry->is_directory(error)) {
          if (file.filename().string().starts_with('.') || entry.depth() >= kNamedDepthMax)
            entry.disable_recursion_pending();
        } else if (file.extension() == ".xml") {
          files.push_back(file.lexically_relative(project_.folder));
        }
      }
      std::sort(files.begin(), files.end());
      for (const path& file : files) {
        if (const auto text = text::read_file(project_.folder / file)) (void)elsewhere_->add(file, *text);
      }
    }
    const auto found = elsewhere_->find_tree(id);
    if (!found) return {};
    const std::string name = found->generic_string();
    return project_.mission_files.empty()
               ? fmt::format("; {0} has it: write mission: {{files: [{1}, {0}]}}", name, project_.mission.path)
               : fmt::format("; {} has it; name it under mission.files", name);
  }

  path absolute(const path& shown) const {
    if (shown.is_absolute()) return shown;
    const path above = path(project_.file).parent_path();
    return project_.folder / shown.lexically_relative(above.empty() ? path(".") : above);
  }

  std::vector<std::string> skill_names() const {
    std::vector<std::string> names;
    for (const SkillEntry& entry : project_.skills) names.push_back(entry.leaf);
    std::error_code error;
    for (const auto& file : std::filesystem::directory_iterator(project_.folder / "skills", error)) {
      if (file.path().extension() == ".scxml") names.push_back(file.path().stem().string());
    }
    std::sort(names.begin(), names.end());
    return names;
  }

  // A chart that does not load says so when the leaf is planned.
  std::optional<bt::Category> skill_kind(std::string_view id, std::string_view name) {
    const SkillEntry* const entry = project_.skill(name, id);
    const FileRef file = skill_file(project_, entry, id);
    if (const auto known = kinds_.find(file.path); known != kinds_.end()) return known->second;
    auto& kind = kinds_[file.path];
    std::error_code error;
    if (std::filesystem::exists(project_.folder / file.path, error)) {
      kind = bt::Category::kAction;
      const path full = project_.folder / file.path;
      scxml::LoadOptions options;
      options.read = [&](std::string_view uri) { return text::read_file(full.parent_path() / std::string(uri)); };
      const auto source = text::read_file(full);
      const auto chart = source ? scxml::load(*source, file.path, options) : Loaded<scxml::Chart>();
      if (chart.ok()) kind = category_of(*chart.value, entry);
    } else if (entry != nullptr && !entry->at.empty()) {
      kind = bt::Category::kAction;
    }
    return kind;
  }

  const Project& project_;
  bt::Registry& registry_;
  bt::Library library_;
  std::optional<bt::Library> elsewhere_;  ///< All files of the project with trees; read when one is missed.
  Diagnostics diagnostics_;
  std::map<std::string, std::optional<bt::Category>, std::less<>> kinds_;
};

}  // namespace

Loaded<bt::Tree> load_mission(const Project& project, bt::Registry& registry, TreePurpose purpose) {
  return MissionLoader(project, registry).load(purpose);
}

std::vector<bt::StartEntry> start_entries(const Project& project) {
  std::vector<bt::StartEntry> entries;
  for (const MissionEntry& entry : project.entries) entries.push_back({entry.name, entry.value, entry.span});
  return entries;
}

bt::Category category_of(const scxml::Chart& chart, const SkillEntry* entry) {
  if (entry != nullptr && entry->protocol)
    return entry->protocol->halt.empty() ? bt::Category::kCondition : bt::Category::kAction;
  for (const std::string& event : chart.events_handled()) {
    if (event == "tick" || event == "halt") return bt::Category::kAction;
  }
  const auto halted = chart.find("halted");
  const bool can_be_halted = halted && chart.states()[*halted].parent == 0;
  return can_be_halted ? bt::Category::kAction : bt::Category::kCondition;
}

FileRef skill_file(const Project& project, const SkillEntry* entry, std::string_view leaf_id) {
  if (entry != nullptr && !entry->file.path.empty()) return entry->file;
  const std::string name = entry != nullptr ? entry->leaf : std::string(leaf_id);
  FileRef own{fmt::format("skills/{}.scxml", name), entry != nullptr ? entry->span : SourceSpan{}};
  std::error_code error;
  const auto is_nav2 = [](const FileRef& palette) { return palette.path == nav2::kPalette; };
  if (std::none_of(project.palettes.begin(), project.palettes.end(), is_nav2) ||
      std::filesystem::exists(project.folder / own.path, error))
    return own;
  const auto is_action = [](const ServiceEntry& service) { return service.idl.starts_with("nav2_msgs/action/"); };
  std::vector<std::string> endings{".scxml"};
  if (std::any_of(project.services.begin(), project.services.end(), is_action))
    endings.insert(endings.begin(), std::string(kActionChart));
  for (const std::string& ending : endings) {
    // A recording has it among the project's own.
    for (const path& file :
         {path("skills") / (name + ending), shipped_folder("skills") / nav2::kPalette / (name + ending)}) {
      if (!std::filesystem::exists(project.folder / file, error)) continue;
      own.path = file.string();
      return own;
    }
  }
  return own;
}

void find_mission(Project& project, const SourceSpan& place, Diagnostics& diagnostics) {
  if (project.mission_files.empty()) return;
  bt::Library library;
  std::vector<std::string> ids;
  for (const FileRef& file : project.mission_files) {
    const auto source = text::read_file(project.folder / file.path, project.shown(file.path));
    // What is wrong with a file is told when the tree is loaded.
    if (source) (void)library.add(file.path, *source);
  }
  const bt::TreeFile* const found = library.main_file(project.tree);
  const auto is_found = [&](const FileRef& file) { return found != nullptr && path(file.path) == found->path; };
  const auto main = std::find_if(project.mission_files.begin(), project.mission_files.end(), is_found);
  project.mission = main != project.mission_files.end() ? *main : project.mission_files.front();
  if (main != project.mission_files.end()) {
    // Between several files main_tree_to_execute of one need not be there.
    if (project.tree.empty() && found->main_tree.empty() && found->trees.size() == 1)
      project.tree = found->trees.front();
    return;
  }
  if (library.files().size() < project.mission_files.size()) return;
  for (const bt::TreeFile& file : library.files()) ids.insert(ids.end(), file.trees.begin(), file.trees.end());
  diagnostics.push_back({Severity::kError, "project.no-tree",
                         fmt::format("none of the mission's files has a BehaviorTree{}{}",
                                     project.tree.empty() ? std::string() : fmt::format(" \"{}\"", project.tree),
                                     did_you_mean(project.tree, ids)),
                         place});
}

}  // namespace sentree::project
