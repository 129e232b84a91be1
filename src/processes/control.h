#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "sentree/rpc/client.h"
#include "sentree/rpc/server.h"
#include "sentree/runtime/control_handler.h"

namespace sentree::processes {

/// Where runs of this user put their control sockets: $XDG_RUNTIME_DIR/sentree, else a private folder below /tmp.
[[nodiscard]] std::filesystem::path control_folder();

/// Serves the handler on this process's control socket until destroyed. Sockets of processes that were killed are taken
/// away, here and wherever runs are looked for. Errors: rpc.*, file.*.
[[nodiscard]] Result<std::unique_ptr<rpc::Server>> start_control(runtime::ControlHandler handler);

/// A process of this user with a control socket that answers.
struct RunningRun {
  int pid = 0;
  std::string scenario;
  double time = 0.0;  ///< [s]
  bool has_page = false;
};
/// All of them, by process id. Whoever does not answer within `patience` is left out.
[[nodiscard]] std::vector<RunningRun> running_runs(Duration patience);

/// A client of the control socket of run `pid`; 0: the only run there is. Errors: control.no-run, control.many-runs.
[[nodiscard]] Result<std::unique_ptr<rpc::Client>> connect_control(int pid);

}  // namespace sentree::processes
