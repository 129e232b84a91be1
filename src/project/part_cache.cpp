#include "sentree/project/part_cache.h"

#include "sentree/project/detail/part_cache.h"
#include "sentree/project/interface_file.h"
#include "sentree/text/file.h"

namespace sentree::project {

using std::filesystem::path;

PartCache::PartCache() : impl_(std::make_unique<Impl>()) {}
PartCache::~PartCache() = default;
PartCache::PartCache(PartCache&&) noexcept = default;
PartCache& PartCache::operator=(PartCache&&) noexcept = default;

bool PartCache::Impl::Text::is_same() const {
  const auto now = text::read_file(file, shown);
  return now ? content && *now == *content : !content;
}

const PartCache::Impl::Looked* PartCache::Impl::chart(const std::pair<std::string, std::vector<std::string>>& key,
                                                      const std::string& source) const {
  const auto looked = charts.find(key);
  if (looked == charts.end() || looked->second.source != source) return nullptr;
  return are_same(looked->second.included) ? &looked->second : nullptr;
}

Result<std::shared_ptr<const WorldSource>> PartCache::Impl::world_source(const Project& project) {
  const path file = project.folder / project.world->path;
  if (world_text && world_text->file.file == file && world_text->file.shown == project.shown(project.world->path) &&
      world_text->file.is_same())
    return world_text->source;
  world_text.reset();
  auto source = WorldSource::read(project);
  if (!source) return tl::unexpected(source.error());
  Text text{file, project.shown(project.world->path), {}};
  auto shared = std::make_shared<const WorldSource>(std::move(*source));
  if (auto content = text::read_file(text.file, text.shown)) {
    text.content = std::move(*content);
    world_text = WorldText{std::move(text), shared};
  }
  return shared;
}

std::shared_ptr<PartCache::Impl::Requirements> PartCache::Impl::requirements_of(Text file) {
  if (requirements.size() >= kRequirementFilesMax) requirements.clear();
  auto& known = requirements[file.file.string()];
  if (known == nullptr || known->file.content != file.content || known->file.shown != file.shown) {
    auto parsed = monitor::parse_requirements(*file.content, file.shown);
    known = std::make_shared<Requirements>(Requirements{std::move(file), std::move(parsed), {}});
  }
  return known;
}

const Loaded<idl::Schema>& PartCache::Impl::interface(const path& file, const std::string& shown) {
  const std::pair key{file.string(), shown};
  const auto known = interfaces.find(key);
  if (known != interfaces.end() && are_same(known->second.files)) return known->second.schema;
  if (interfaces.size() >= kInterfacesMax) interfaces.clear();
  Interface read;
  read.schema = load_interface(
      file, shown, [&](const path& part, const std::string& name, const std::optional<std::string>& content) {
        read.files.push_back({part, name, content});
      });
  return interfaces.insert_or_assign(key, std::move(read)).first->second.schema;
}

}  // namespace sentree::project
