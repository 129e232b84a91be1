#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "sentree/base/result.h"
#include "sentree/project/plan.h"
#include "sentree/runtime/run.h"
#include "sentree/studio/server.h"
#include "sentree/text/file.h"

namespace sentree::studio {

/// A run beside a project that is edited: shown and steered by the project's page, and recorded. It may go on with the
/// edited project; then it is shown, and recorded in a file of its own, from there on.
class RunBeside {
 public:
  struct Options {
    std::filesystem::path folder;  ///< Of recordings; the oldest of them make room.
    double factor = 1.0;           ///< In virtual time: run seconds per wall second, above 0.
    std::string library;           ///< As in `replay::RecordingOptions`.
    std::function<std::string(const runtime::MonitorReport&)> story;  ///< Likewise.
    std::function<void()> on_end;  ///< The last that its thread does; what follows may destroy this.
  };

  /// Begins to run in a thread of its own. `files`: what the plan was read from.
  /// Errors: those of `runs_here`, record.* (the recording cannot be written).
  [[nodiscard]] static Result<std::shared_ptr<RunBeside>> begin(project::Plan plan,
                                                                const std::vector<text::ReadFile>& files,
                                                                Options options);
  ~RunBeside();
  RunBeside(const RunBeside&) = delete;
  RunBeside& operator=(const RunBeside&) = delete;

  /// Lets the run go on with another plan, from before its next tick, paused or not: see `mission::carry`. A run in
  /// real time stands meanwhile: it is taken over when what its parts have begun is done, while no time passes. In its
  /// new recording that is a "scenario.injection" whose `what` is "reload", with `changes`, and `nodes`: the nodes at
  /// work. What a person asked to pause at is forgotten. One at a time, and not of the run's thread; waits until it is
  /// done. Returns what came, went or is another one. Codes: those of `mission::carry`, then the run goes on as it did,
  /// and of `begin`; run.cannot-carry (a part of a run in real time does not come to rest), run.busy, run.ended.
  [[nodiscard]] Loaded<std::vector<std::string>> replace(project::Plan plan, std::vector<text::ReadFile> files);
  /// Ends the run in order, if it goes on, and waits for that. Of the thread that destroys this.
  void end();
  /// The recording's name in its folder.
  [[nodiscard]] std::string file() const;
  /// The recording of what was before the last replacement; empty: there was none.
  [[nodiscard]] std::string continues() const;
  /// Why the recording or the run is not whole; empty: it is, so far.
  [[nodiscard]] std::string problem() const;
  /// How pages reach it, also after its end.
  [[nodiscard]] std::shared_ptr<const RunAccess> access() const;
  /// For the page's server, which keeps alive what it shows.
  [[nodiscard]] Server::Shown shown() const;

 private:
  struct Impl;
  explicit RunBeside(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace sentree::studio
