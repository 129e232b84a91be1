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
/// Messages since it was last asked what it is that are kept for one of a durable run, should its process be started
/// anew; beyond it that process would not see all, which is told.
inline constexpr std::size_t kObserverKeptMax = 1U << 17U;
/// How long the process of such an observer may be away.
inline constexpr std::chrono::seconds kObserverReturn{15};
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
  /// @param kept  It is taken back to where it was when its process was started anew; `interface` is KeptObserver. Then
  ///              `recall` comes first.
  [[nodiscard]] static Result<std::unique_ptr<RemoteObserver>> connect(std::string name, const rpc::Address& address,
                                                                       const idl::ServicePtr& interface,
                                                                       Callbacks callbacks, bool kept = false);
  ~RemoteObserver() override;

  void observe(const Message& message) override;
  [[nodiscard]] bool is_gate_of(std::string_view call) const override;
  [[nodiscard]] const std::vector<std::string>& gates() const override;
  void ask(const Message& request, runtime::Stream::Decided decided) override;
  [[nodiscard]] std::optional<Value> remember(Duration patience) override;
  [[nodiscard]] Result<void> recall(const Value& memory) override;
  void finish(TimePoint end) override;

 private:
  class Impl;
  explicit RemoteObserver(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

/// Serves a monitor to runs elsewhere: KeptObserver of interfaces/observer.thrift. `info`, with which a run begins,
/// starts it anew; before it, and before `recall`, it observes nothing.
/// @param on_decision  Called in a thread of the server.
[[nodiscard]] std::shared_ptr<rpc::Service> make_monitor_service(
    idl::ServicePtr interface, monitor::Model model, std::vector<std::string> gate,
    std::function<void(const monitor::Decision&)> on_decision);

}  // namespace sentree::processes
