#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>

#include "sentree/runtime/run.h"
#include "sentree/studio/server.h"

namespace sentree::studio {

/// Files and folders of a project that are watched.
inline constexpr std::size_t kWatchesMax = 1'000;

/// A project that is edited in pages: its texts, what `check` finds in them while they are edited, and a scenario that
/// runs again after each edit. One run at a time goes on beside it, steered and recorded in the project's runs/.
///
/// One thread checks and runs, always the newest texts; one waits for changes of the files; each recorded run has one.
class Workshop {
 public:
  /// @param folder  With a sentree.yaml, or empty.
  /// @param story  Of a violation, for runs that are recorded: as in `replay::RecordingOptions`.
  /// Errors: those of `Server::start` and `design::Workspace::open`.
  [[nodiscard]] static Result<std::unique_ptr<Workshop>> start(
      const std::filesystem::path& folder, ServerOptions options,
      std::function<std::string(const runtime::MonitorReport&)> story = {});
  ~Workshop();
  Workshop(const Workshop&) = delete;
  Workshop& operator=(const Workshop&) = delete;

  [[nodiscard]] const Server& server() const;
  /// Who else edits the project, so that it is only shown here; empty: nobody.
  [[nodiscard]] std::string held_by() const;

 private:
  struct Impl;
  explicit Workshop(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace sentree::studio
