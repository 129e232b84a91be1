#pragma once

#include <memory>
#include <string>

#include "sentree/groot/server.h"
#include "sentree/project/plan.h"
#include "sentree/runtime/run.h"

namespace sentree::studio {

/// Runs, one after the other, shown to Groot 1 and Groot 2.
///
/// What Groot 2 sets are breakpoints and forced results of ours, and observed as such, from "groot". A breakpoint makes
/// the run stand between two ticks: the tick that reached it is still done, and a status given when it is unlocked is
/// the next answer of that leaf. Only leaves that skills run can be given results.
class GrootRun {
 public:
  /// Serves the tree of `plan`, which nothing executes yet. Errors: those of `groot::Server::start`,
  /// groot.too-many-nodes.
  [[nodiscard]] static Result<std::unique_ptr<GrootRun>> start(const project::Plan& plan, groot::ServerOptions options);
  ~GrootRun();
  GrootRun(const GrootRun&) = delete;
  GrootRun& operator=(const GrootRun&) = delete;

  /// Shows the next run; the first is that of `start`'s plan. `plan` is borrowed while it goes on. Error:
  /// groot.too-many-nodes.
  [[nodiscard]] Result<void> install(const project::Plan& plan, runtime::RunOptions& options);
  [[nodiscard]] const groot::Server& server() const;

 private:
  struct Impl;
  explicit GrootRun(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace sentree::studio
