#include <poll.h>
#include <sys/inotify.h>
#include <unistd.h>

#include "sentree/studio/detail/workshop.h"

namespace sentree::studio {

namespace fs = std::filesystem;

void Workshop::Impl::add_watches(const fs::path& below) {
  constexpr std::uint32_t kWhat = IN_CLOSE_WRITE | IN_MOVED_TO | IN_MOVED_FROM | IN_CREATE | IN_DELETE | IN_ONLYDIR;
  std::vector<fs::path> folders{below};
  for (std::size_t i = 0; i < folders.size() && watched.size() < kWatchesMax; ++i) {
    const int id = inotify_add_watch(inotify, folders[i].c_str(), kWhat);
    if (id < 0) continue;
    const std::string inside = folders[i].lexically_relative(folder).generic_string();
    watched[id] = inside == "." ? "" : inside;
    std::error_code error;
    for (const auto& entry : fs::directory_iterator(folders[i], error)) {
      const std::string name = entry.path().filename().string();
      if (entry.is_symlink(error) || !entry.is_directory(error) || name.starts_with('.') || name == "runs" ||
          name == "node_modules" || name == "build")
        continue;
      folders.push_back(entry.path());
    }
  }
}

void Workshop::Impl::watch() {
  add_watches(folder);
  // Editors replace a file in several moves, of which only the last says what it is.
  constexpr int kQuiet_ms = 15;
  constexpr int kMovesMax = 10;
  for (;;) {
    pollfd waiting[] = {{inotify, POLLIN, 0}, {wake, POLLIN, 0}};
    std::set<std::string> paths;
    for (int move = 0; poll(waiting, 2, move == 0 ? -1 : kQuiet_ms) > 0 && move < kMovesMax; ++move) {
      if ((waiting[1].revents & POLLIN) != 0) return;
      read_events(paths);
    }
    const std::lock_guard lock(mutex);
    const auto files = workspace.refresh({paths.begin(), paths.end()});
    if (files.empty()) continue;
    baseline.reset();
    changed(files);
  }
}

void Workshop::Impl::read_events(std::set<std::string>& paths) {
  alignas(inotify_event) char buffer[16 * 1024];
  const ssize_t size = read(inotify, buffer, sizeof buffer);
  for (ssize_t at = 0; at < size;) {
    const auto* event = reinterpret_cast<const inotify_event*>(buffer + at);
    at += static_cast<ssize_t>(sizeof(inotify_event) + event->len);
    if ((event->mask & IN_Q_OVERFLOW) != 0) paths.insert("");
    const auto below = watched.find(event->wd);
    if (below == watched.end()) continue;
    if ((event->mask & IN_IGNORED) != 0) {
      watched.erase(below);
      continue;
    }
    const std::string path = (below->second.empty() ? "" : below->second + "/") + (event->len > 0 ? event->name : "");
    if ((event->mask & IN_ISDIR) != 0) {
      if ((event->mask & (IN_CREATE | IN_MOVED_TO)) != 0) add_watches(folder / path);
      paths.insert(path);
    } else if (design::is_project_text(path) && (event->mask & IN_CREATE) == 0) {
      paths.insert(path);
    }
  }
}

}  // namespace sentree::studio
