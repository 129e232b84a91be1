#include "sentree/import/detail/source_folder.h"

#include <algorithm>
#include <array>

#include <fmt/format.h>

#include "sentree/import/import.h"
#include "sentree/text/file.h"

namespace sentree::import {

namespace {

constexpr std::array<std::string_view, 4> kLeftOut{"build", "install", "node_modules", "log"};

}  // namespace

Result<SourceFolder> SourceFolder::open(const std::filesystem::path& folder) {
  std::error_code error;
  if (!std::filesystem::is_directory(folder, error))
    return fail("file.not-found", "there is no such folder", SourceSpan{folder.string()});
  SourceFolder source;
  source.folder_ = folder;
  std::filesystem::path last = folder;  // which is opened by the next step, if it is a folder
  for (auto at = std::filesystem::recursive_directory_iterator(
           folder, std::filesystem::directory_options::skip_permission_denied, error);
       at != decltype(at)(); at.increment(error)) {
    last = at->path();
    const std::string name = last.filename().string();
    const bool is_folder = at->is_directory(error) && !at->is_symlink(error);
    if (is_folder) {
      const bool left_out = std::find(kLeftOut.begin(), kLeftOut.end(), name) != kLeftOut.end();
      if (name.starts_with('.') || left_out || at->is_symlink(error)) at.disable_recursion_pending();
      if (at.depth() >= kFolderDepthMax) {
        return fail("import.too-large",
                    fmt::format("folders are nested more than {} deep; import a part of it", kFolderDepthMax),
                    SourceSpan{at->path().string()});
      }
      continue;
    }
    if (name.starts_with('.') || at->is_symlink(error) || !at->is_regular_file(error)) continue;
    source.files_.push_back(at->path().lexically_relative(folder).generic_string());
    if (source.files_.size() > kFilesMax) {
      return fail("import.too-large", fmt::format("the folder has more than {} files; import a part of it", kFilesMax),
                  SourceSpan{folder.string()});
    }
  }
  if (error) return fail("file.unreadable", error.message(), SourceSpan{last.string()});
  std::sort(source.files_.begin(), source.files_.end());
  return source;
}

std::vector<std::string> SourceFolder::with_ending(std::initializer_list<std::string_view> endings) const {
  std::vector<std::string> found;
  for (const std::string& file : files_) {
    if (std::any_of(endings.begin(), endings.end(), [&](std::string_view ending) { return file.ends_with(ending); }))
      found.push_back(file);
  }
  return found;
}

bool SourceFolder::contains(const std::string& file) const {
  return std::binary_search(files_.begin(), files_.end(), file);
}

Result<std::string> SourceFolder::read(const std::string& file) const {
  if (!contains(file)) {
    return fail("import.outside", fmt::format("\"{}\" is not a file of the imported folder", file),
                SourceSpan{shown(file)});
  }
  return text::read_file(folder_ / file, shown(file), kFileBytesMax);
}

std::optional<std::string> SourceFolder::resolve(const std::string& from, std::string_view reference) {
  const std::filesystem::path path =
      (std::filesystem::path(from).parent_path() / std::string(reference)).lexically_normal();
  if (path.is_absolute() || path.empty() || *path.begin() == "..") return std::nullopt;
  return path.generic_string();
}

}  // namespace sentree::import
