#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "sentree/idl/schema.h"
#include "sentree/monitor/monitor.h"
#include "sentree/rpc/address.h"
#include "sentree/rpc/service.h"
#include "sentree/runtime/stream.h"

namespace sentree::runtime {

/// Messages that wait for one observer; the newest are lost beyond it, counted and reported.
inline constexpr std::size_t kObserverQueueMax = 8192;
/// How long an observer may take for one message, and for what is left at the end of a run.
inline constexpr std::chrono::seconds kObserverPatience{2};

/// An observer in another process, in any language (interfaces/observer.thrift): given the run's stream in its order,
/// asked before the requests that it gates, and a monitor if its verdicts say so.
class RemoteObserver {
 public:
  struct Callbacks {
    std::function<void(const std::string&)> problem;         ///< In the observer's thread.
    std::function<void(const monitor::Decision&)> decision;  ///< In the observer's thread.
  };

  /// Asks it what it wants. Errors: observer.unreachable.
  [[nodiscard]] static Result<std::unique_ptr<RemoteObserver>> connect(std::string name, const rpc::Address& address,
                                                                       const idl::ServicePtr& interface,
                                                                       Callbacks callbacks);
  ~RemoteObserver();

  [[nodiscard]] const std::string& name() const;
  /// Hands a message on, if the observer wants it. Never waits. Called in the stream's order.
  void observe(const Message& message);
  /// Whether it must be asked before this call, "<service>.<method>".
  [[nodiscard]] bool is_gate_of(std::string_view call) const;
  [[nodiscard]] const std::vector<std::string>& gates() const;
  /// Asks it, after all messages handed on before. `decided` is called once, in its thread or before this returns; one
  /// that cannot be asked refuses.
  void ask(const Message& request, Stream::Decided decided);
  /// Waits until it has seen everything, tells it that time has passed until `end`, and stops.
  void finish(TimePoint end);

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

}  // namespace sentree::runtime
