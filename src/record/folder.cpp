#include "sentree/record/folder.h"

#include <fmt/format.h>

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <ctime>

namespace sentree::record {

namespace fs = std::filesystem;

namespace {

constexpr std::string_view kEnding = ".mcap";

bool is_digits(std::string_view text) {
  return !text.empty() && text.find_first_not_of("0123456789") == std::string_view::npos;
}

// "<name>-<8 digits>-<6 digits>[-<number>].mcap"
bool is_ours(const std::string& file) {
  std::string_view stem = file;
  if (!stem.ends_with(kEnding)) return false;
  stem.remove_suffix(kEnding.size());
  std::vector<std::string_view> parts;
  for (int i = 0; i < 3; ++i) {
    const auto dash = stem.rfind('-');
    if (dash == std::string_view::npos) break;
    parts.push_back(stem.substr(dash + 1));
    stem = stem.substr(0, dash);
  }
  const auto dated = [&](std::size_t i) {
    return i + 1 < parts.size() && parts[i].size() == 6 && is_digits(parts[i]) && parts[i + 1].size() == 8 &&
           is_digits(parts[i + 1]);
  };
  return dated(0) || (dated(1) && is_digits(parts[0]));
}

bool is_being_written(const fs::path& path) {
  const int file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (file < 0) return true;
  const bool free = ::flock(file, LOCK_EX | LOCK_NB) == 0;
  ::close(file);
  return !free;
}

// Without them, that run could not go on.
bool is_waited_for(const fs::path& path, const std::function<bool(const fs::path&)>& waits) {
  std::error_code error;
  const fs::path journal = fs::path(path).replace_extension(".journal");
  return waits && fs::exists(journal, error) && waits(journal);
}

}  // namespace

fs::path new_recording(const fs::path& folder, std::string_view name) {
  std::string stem;
  for (const char c : name) {
    const bool plain =
        (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' || c == '_';
    stem += plain ? c : '_';
  }
  if (stem.empty()) stem = "run";
  const std::time_t now = std::time(nullptr);
  std::tm utc{};
  gmtime_r(&now, &utc);
  char date[32];
  (void)std::strftime(date, sizeof date, "-%Y%m%d-%H%M%S", &utc);
  stem += date;
  std::error_code error;
  fs::path path = folder / (stem + std::string(kEnding));
  for (int number = 2; fs::exists(path, error); ++number) path = folder / fmt::format("{}-{}{}", stem, number, kEnding);
  return path;
}

std::vector<fs::path> remove_old(const fs::path& folder, const FolderLimits& limits,
                                 const std::function<bool(const fs::path&)>& waits) {
  struct File {
    fs::path path;
    fs::file_time_type changed;
    std::uint64_t size;
  };
  std::vector<File> files;
  std::uint64_t total = 0;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    if (!entry.is_regular_file(error) || !is_ours(entry.path().filename().string())) continue;
    if (is_waited_for(entry.path(), waits)) continue;  // nor does it take the room of others
    files.push_back({entry.path(), entry.last_write_time(error), entry.file_size(error)});
    total += files.back().size;
  }
  std::sort(files.begin(), files.end(), [](const File& a, const File& b) {
    return a.changed != b.changed ? a.changed < b.changed : a.path < b.path;
  });
  std::vector<fs::path> removed;
  std::size_t left = files.size();
  for (const File& file : files) {
    if (left < limits.recordings && total <= limits.bytes) break;
    if (is_being_written(file.path) || !fs::remove(file.path, error)) continue;
    // What is left of its journal says nothing without it.
    fs::remove(fs::path(file.path).replace_extension(".journal"), error);
    removed.push_back(file.path);
    total -= file.size;
    --left;
  }
  return removed;
}

}  // namespace sentree::record
