#pragma once

#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>

#include "sentree/idl/schema.h"
#include "sentree/mission/skill.h"
#include "sentree/project/plan.h"
#include "sentree/rpc/address.h"
#include "sentree/rpc/call.h"

namespace sentree::processes {

/// How long a process that executes steps may be away before the run of its chart is over [wall time].
inline constexpr std::chrono::seconds kChartPatience{10};

struct RemoteChartOptions {
  std::string leaf;
  scxml::Chart chart;
  rpc::Address address;
  Duration step_deadline{};     ///< Of one step that is executed; past it `hangs` is called. Wall time.
  std::function<void()> hangs;  ///< Ends the process.
  std::function<void(const std::string&)> problem;
};
/// Has a chart's steps executed by `sentree skill` (service SkillSteps of interfaces/skill.thrift). Of one thread.
[[nodiscard]] Result<std::unique_ptr<mission::ChartElsewhere>> make_remote_chart(RemoteChartOptions options);

/// The other end: executes steps of one skill's chart for runs that keep its state. From any thread.
class ChartServer {
 public:
  /// @param plan  Borrowed.
  explicit ChartServer(const project::SkillPlan& plan) : plan_(plan) {}
  /// Serves SkillSteps.step.
  [[nodiscard]] rpc::Outcome step(const Value& arguments);

 private:
  struct Known {
    std::int64_t number = 0;
    scxml::Session session;
  };
  const project::SkillPlan& plan_;
  std::mutex mutex_;
  std::map<std::string, Known> leaves_;  // at most kServedLeavesMax; only spares the way of a session
};

}  // namespace sentree::processes
