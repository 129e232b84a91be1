#pragma once

#include <functional>
#include <vector>

#include "sentree/runtime/run.h"
#include "sentree/runtime/scheduler.h"
#include "sentree/runtime/stream.h"

namespace sentree::runtime {

/// "<service>.<method>" of a request.
[[nodiscard]] std::string_view call_of(const Message& request);

/// Feeds the run's monitors with the stream and wakes them when time matters to them. A listener of the stream.
class Monitors {
 public:
  Monitors(const Plan& plan, Scheduler& scheduler, Stream& stream,
           std::function<void(const MonitorReport&)> on_decision);

  void start();
  void observe(const Message& message);
  /// Whether a monitor gates calls of this name, "<service>.<method>". From any thread.
  [[nodiscard]] bool is_gated(std::string_view call) const;
  /// What the gates say of a request that is not yet sent. Called where `observe` is.
  [[nodiscard]] std::optional<Veto> judge(const Message& request) const;
  /// After the run: time passes until `end`, then nothing more is decided.
  void finish(TimePoint end);
  [[nodiscard]] const std::vector<MonitorReport>& reports() const { return reports_; }

 private:
  void advance(TimePoint now);
  void count_veto(const Message& error);
  void take(std::size_t index, std::optional<monitor::Decision> decision);
  void schedule();

  const std::vector<monitor::Model>& models_;
  const std::vector<GatePlan>& gates_;
  Scheduler& scheduler_;
  Stream& stream_;
  std::function<void(const MonitorReport&)> on_decision_;
  std::vector<monitor::State> states_;
  std::vector<MonitorReport> reports_;
  TimePoint wake_ = kNever;
};

}  // namespace sentree::runtime
