#include "sentree/project/interface_file.h"

#include <algorithm>
#include <cstdlib>
#include <string_view>

#include <fmt/format.h>

#include "sentree/project/plan.h"
#include "sentree/text/file.h"

namespace sentree::project {

using std::filesystem::path;

namespace {

constexpr const char* kRosForms[] = {"msg", "srv", "action"};

bool is_of_ros(const path& file) {
  const std::string ending = file.extension().string();
  return std::any_of(std::begin(kRosForms), std::end(kRosForms),
                     [&](const char* form) { return ending == std::string(".") + form; });
}

}  // namespace

InterfaceName interface_name(const std::string& text) {
  const auto slash = text.rfind('/');
  if (slash == std::string::npos) return {};
  InterfaceName out{text.substr(0, slash), text.substr(slash + 1)};
  for (const char* form : kRosForms) {
    if (out.file.ends_with(std::string("/") + form)) return {fmt::format("{}.{}", text, form), out.service};
  }
  return out;
}

std::optional<path> find_interface(const path& own, const std::string& file) {
  std::error_code error;
  std::vector<path> places{own};
  const char* const prefixes = is_of_ros(file) ? std::getenv("AMENT_PREFIX_PATH") : nullptr;
  std::string_view left = prefixes != nullptr ? prefixes : "";
  while (!left.empty()) {
    const std::size_t end = std::min(left.find(':'), left.size());
    if (end > 0) places.push_back(path(left.substr(0, end)) / "share");
    left.remove_prefix(std::min(end + 1, left.size()));
  }
  places.push_back(shipped_folder("interfaces"));
  for (const path& place : places) {
    // A package's folder is no interface.
    if (std::filesystem::is_regular_file(place / file, error)) return place / file;
  }
  return std::nullopt;
}

std::string missing_form(const path& own, const std::string& file, const std::string& service) {
  if (path(file).has_extension()) return {};
  for (const char* form : kRosForms) {
    const std::string whole = fmt::format("{}/{}/{}", file, form, service);
    if (find_interface(own, fmt::format("{}.{}", whole, form))) return fmt::format("; did you mean \"{}\"?", whole);
  }
  return "; an interface is FILE.thrift/SERVICE, or of ROS PACKAGE/msg/NAME, PACKAGE/srv/NAME or PACKAGE/action/NAME";
}

Loaded<idl::Schema> load_interface(const path& file, const std::string& shown, const OnInterfaceRead& on_read) {
  Loaded<idl::Schema> loaded;
  const auto read = [&](const path& from, const std::string& name) {
    auto text = text::read_file(from, name);
    if (on_read) on_read(from, name, text ? std::optional(*text) : std::nullopt);
    return text;
  };
  const auto source = read(file, shown);
  if (!source) {
    loaded.diagnostics.push_back(source.error());
    return loaded;
  }
  const path shown_folder = path(shown).parent_path().lexically_normal();
  const path shipped = shipped_folder("interfaces");
  if (is_of_ros(file)) {
    const path root = (file.parent_path() / "../..").lexically_normal();
    const path shown_root = (shown_folder / "../..").lexically_normal();
    const idl::IncludeReader used = [&](std::string_view name, std::string_view) -> Result<idl::IncludedFile> {
      const auto place = find_interface(root, std::string(name));
      // Where it would have been found first.
      if (on_read && (!place || *place != root / name)) on_read(root / name, std::string(name), std::nullopt);
      if (!place) {
        return fail(
            "idl.include",
            fmt::format(
                "it is neither beside {}, in $AMENT_PREFIX_PATH, nor among those of Sentree; copy it to interfaces/{}",
                shown, name));
      }
      const std::string other = place->parent_path().parent_path().parent_path() == root
                                    ? (shown_root / name).lexically_normal().string()
                                    : std::string(name);
      auto text = read(*place, other);
      if (!text) return tl::unexpected(text.error());
      return idl::IncludedFile{other, std::move(*text)};
    };
    auto schema = idl::Schema::load(*source, shown, used);
    const char* const release = std::getenv("ROS_DISTRO");
    // The others of these files are the same in all releases.
    const bool differs = source->find("# As in Humble.") != std::string::npos && release != nullptr &&
                         *release != '\0' && std::string_view(release) != "humble";
    if (differs && root / "" == (shipped / "").lexically_normal()) {
      schema.diagnostics.push_back(
          {Severity::kWarning,
           "check.release",
           fmt::format("{} is Humble's, and ROS_DISTRO is {}, whose nodes may have other fields; "
                       "set AMENT_PREFIX_PATH, or copy the file of that release to interfaces/",
                       shown, release),
           {}});
    }
    return schema;
  }
  const idl::IncludeReader include = [&](std::string_view name, std::string_view from) -> Result<idl::IncludedFile> {
    const path beside = (path(from).parent_path() / name).lexically_normal();
    const path full = path(name).is_absolute() ? beside : file.parent_path() / beside.lexically_relative(shown_folder);
    auto text = read(full.lexically_normal(), beside.string());
    if (text) return idl::IncludedFile{beside.string(), std::move(*text)};
    auto ours = read(shipped / name, std::string(name));
    if (ours) return idl::IncludedFile{std::string(name), std::move(*ours)};
    return tl::unexpected(text.error());
  };
  return idl::Schema::load(*source, shown, include);
}

}  // namespace sentree::project
