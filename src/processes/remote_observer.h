#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "sentree/idl/schema.h"
#include "sentree/monitor/monitor.h"
#include "sentree/rpc/address.h"
#include "sentree/rpc/service.h"
#include "sentree/runtime/observer.h"

namespace sentree::processes {

/// Messages that wait for one observer; the newest are lost beyond it, counted and reported.
inline constexpr std::size_t kObserverQueueMax = 8192;
/// How long an observer may take for one message, and for what is left at the end of a run.
inline constexpr std::chrono::seconds kObserverPatience{2};

/// An observer in another process, in any language (interfaces/observer.thrift): given the run's stream in its order,
/// asked before the requests that it gates, and a monitor if its verdicts say so.
class RemoteObserver final : public runtime::Observer {
 public:
  struct Callbacks {
    std::function<void(const std::string&)> problem;         ///< In the observer's thread.
    std::function<void(const monitor::Decision&)> decision;  ///< In the observer's thread.
  };

  /// Asks it what it wants. Errors: observer.unreachable.
  [[nodiscard]] static Result<std::unique_ptr<RemoteObserver>> connect(std::string name, const rpc::Address& address,
                                                                       const idl::ServicePtr& interface,
                                                                       Callbacks callbacks);
  ~RemoteObserver() override;

  void observe(const Message& message) override;
  [[nodiscard]] bool is_gate_of(std::string_view call) const override;
  [[nodiscard]] const std::vector<std::string>& gates() const override;
  void ask(const Message& request, runtime::Stream::Decided decided) override;
  void finish(TimePoint end) override;

 private:
  class Impl;
  explicit RemoteObserver(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

/// Serves a monitor to runs elsewhere: interfaces/observer.thrift. `info`, with which a run begins, starts it anew.
/// @param on_decision  Called in a thread of the server.
[[nodiscard]] std::shared_ptr<rpc::Service> make_monitor_service(
    idl::ServicePtr interface, monitor::Model model, std::vector<std::string> gate,
    std::function<void(const monitor::Decision&)> on_decision);

}  // namespace sentree::processes
