#include "sentree/project/interface_file.h"

#include "sentree/project/plan.h"
#include "sentree/text/file.h"

namespace sentree::project {

using std::filesystem::path;

Loaded<idl::Schema> load_interface(const path& file, const std::string& shown) {
  Loaded<idl::Schema> loaded;
  const auto source = text::read_file(file, shown);
  if (!source) {
    loaded.diagnostics.push_back(source.error());
    return loaded;
  }
  const path shown_folder = path(shown).parent_path().lexically_normal();
  const path shipped = shipped_folder("interfaces");
  const idl::IncludeReader include = [&](std::string_view name, std::string_view from) -> Result<idl::IncludedFile> {
    const path beside = (path(from).parent_path() / name).lexically_normal();
    const path full = path(name).is_absolute() ? beside : file.parent_path() / beside.lexically_relative(shown_folder);
    auto text = text::read_file(full.lexically_normal(), beside.string());
    if (text) return idl::IncludedFile{beside.string(), std::move(*text)};
    auto ours = text::read_file(shipped / name, std::string(name));
    if (ours) return idl::IncludedFile{std::string(name), std::move(*ours)};
    return tl::unexpected(text.error());
  };
  return idl::Schema::load(*source, shown, include);
}

}  // namespace sentree::project
