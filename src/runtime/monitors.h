#pragma once

#include <functional>
#include <vector>

#include "sentree/runtime/run.h"
#include "sentree/runtime/scheduler.h"
#include "sentree/runtime/stream.h"

namespace sentree::runtime {

/// Feeds the run's monitors with the stream and wakes them when time matters to them. A listener of the stream.
class Monitors {
 public:
  Monitors(const std::vector<monitor::Model>& models, Scheduler& scheduler, Stream& stream,
           std::function<void(const MonitorReport&)> on_decision);

  void start();
  void observe(const Message& message);
  /// After the run: time passes until `end`, then nothing more is decided.
  void finish(TimePoint end);
  [[nodiscard]] const std::vector<MonitorReport>& reports() const { return reports_; }

 private:
  void advance(TimePoint now);
  void take(std::size_t index, std::optional<monitor::Decision> decision);
  void schedule();

  const std::vector<monitor::Model>& models_;
  Scheduler& scheduler_;
  Stream& stream_;
  std::function<void(const MonitorReport&)> on_decision_;
  std::vector<monitor::State> states_;
  std::vector<MonitorReport> reports_;
  TimePoint wake_ = kNever;
};

}  // namespace sentree::runtime
