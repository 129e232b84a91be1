#pragma once

#include <functional>
#include <string>
#include <vector>

#include "sentree/base/message.h"
#include "sentree/monitor/monitor_set.h"
#include "sentree/runtime/run.h"

namespace sentree::cli {

/// What monitors make of a recording, reported as a run reports its own: with explanation, leaf and standing.
class Verdicts {
 public:
  /// @param decided  Told of each decision, in order of time; may be empty.
  explicit Verdicts(std::vector<monitor::Model> models,
                    std::function<void(const runtime::MonitorReport&)> decided = {});

  /// Observations, in the order of the recording.
  void observe(Message message);
  /// The recording ends at `end`, inclusive; what is open then stays undecided.
  [[nodiscard]] std::vector<runtime::MonitorReport> finish(TimePoint end);

 private:
  void take();

  monitor::MonitorSet set_;
  std::function<void(const runtime::MonitorReport&)> decided_;
  std::vector<runtime::MonitorReport> reports_;
  std::vector<monitor::MonitorSet::Decided> news_;
};

}  // namespace sentree::cli
