#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "sentree/rpc/client.h"
#include "sentree/rpc/server.h"
#include "sentree/runtime/open_page.h"
#include "sentree/runtime/services.h"

namespace sentree::runtime {

/// Where runs of this user put their control sockets: $XDG_RUNTIME_DIR/sentree, else a private folder below /tmp.
[[nodiscard]] std::filesystem::path control_folder();

class Tap;

/// What a run does for those who connect to its control socket. Called from the server's threads.
struct ControlHandler {
  std::function<std::string()> scenario;
  std::function<TimePoint()> now;
  /// Name, interface and service.
  struct ServiceEntry {
    std::string name;
    idl::ServicePtr service;
    std::string at;  ///< "sim" or an address.
  };
  std::function<std::vector<ServiceEntry>()> services;
  std::function<mission::CallOutcome(const std::string& service, const std::string& method, const Value& arguments)>
      call;
  Tap* tap = nullptr;       ///< Borrowed.
  OpenPage open_page = {};  ///< Null: there is no page.
};

/// Serves the handler on this process's control socket until destroyed. Errors: rpc.*, file.*.
[[nodiscard]] Result<std::unique_ptr<rpc::Server>> start_control(ControlHandler handler);

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

}  // namespace sentree::runtime
