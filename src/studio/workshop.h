#pragma once

#include <filesystem>
#include <memory>

#include "sentree/studio/server.h"

namespace sentree::studio {

/// Files and folders of a project that are watched.
inline constexpr std::size_t kWatchesMax = 1'000;

/// A project that is edited in pages: its texts, what `check` finds in them while they are edited, and a scenario that
/// runs again after each edit.
///
/// One thread checks and runs, always the newest texts; one waits for changes of the files.
class Workshop {
 public:
  /// @param folder  With a sentree.yaml, or empty.
  /// Errors: those of `Server::start` and `design::Workspace::open`.
  [[nodiscard]] static Result<std::unique_ptr<Workshop>> start(const std::filesystem::path& folder,
                                                               ServerOptions options);
  ~Workshop();
  Workshop(const Workshop&) = delete;
  Workshop& operator=(const Workshop&) = delete;

  [[nodiscard]] const Server& server() const;

 private:
  struct Impl;
  explicit Workshop(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace sentree::studio
