#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "sentree/rpc/client.h"
#include "sentree/rpc/server.h"
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
  std::function<CallOutcome(const std::string& service, const std::string& method, const Value& arguments)> call;
  Tap* tap = nullptr;  ///< Borrowed.
};

/// Serves the handler on this process's control socket until destroyed. Errors: rpc.*, file.*.
[[nodiscard]] Result<std::unique_ptr<rpc::Server>> start_control(ControlHandler handler);

/// A client of the control socket of run `pid`; 0: the only run there is. Errors: control.no-run, control.many-runs.
[[nodiscard]] Result<std::unique_ptr<rpc::Client>> connect_control(int pid);

}  // namespace sentree::runtime
