#include "sentree/project/detail/checks.h"
#include "sentree/project/plan.h"
#include "sentree/project/variant.h"
#include "sentree/sim/world_variant.h"
#include "sentree/text/file.h"
#include "sentree/text/read_fence.h"
#include "sentree/text/yaml.h"

namespace sentree::project {

using std::filesystem::path;

Result<WorldSource> WorldSource::read(const Project& project) {
  WorldSource world;
  world.file_ = project.folder / project.world->path;
  world.shown_ = project.shown(project.world->path);
  const auto source = text::read_file(world.file_, world.shown_);
  if (!source) return tl::unexpected(missing(project, *project.world, source.error()));
  auto root = text::parse_yaml(*source, world.shown_);
  if (!root) return tl::unexpected(root.error());
  world.root_ = std::move(*root);
  return world;
}

Loaded<sim::World> WorldSource::with(const std::optional<text::YamlNode>& overrides, const sim::World* like,
                                     const OnRead& on_read) const {
  const auto read = [&](const std::string& name) {
    const std::string shown = (path(shown_).parent_path() / name).string();
    auto content = text::read_file(file_.parent_path() / name, shown);
    if (content && on_read) on_read(file_.parent_path() / name, shown, *content);
    return content;
  };
  if (!overrides) return sim::parse_world_like(root_, read, like);
  text::YamlNode root = root_;
  merge(root, *overrides);
  return sim::parse_world_like(root, read, overrides->find("map") == nullptr ? like : nullptr);
}

path WorldSource::map_file(const std::optional<text::YamlNode>& overrides) const {
  const text::YamlNode* map = overrides ? overrides->find("map") : nullptr;
  if (map == nullptr) map = root_.find("map");
  return map != nullptr ? file_.parent_path() / map->scalar : path();
}

Loaded<sim::World> load_project_world(const Project& project) {
  const text::ReadFence fence(project.folder, {shipped_folder("interfaces")});
  const auto source = WorldSource::read(project);
  if (!source) return {.value = std::nullopt, .diagnostics = {source.error()}};
  return source->with(project.world_overrides);
}

}  // namespace sentree::project
