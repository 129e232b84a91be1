#pragma once

#include <memory>
#include <string>

#include "sentree/base/result.h"
#include "sentree/processes/component.h"
#include "sentree/rpc/address.h"

namespace sentree::cli {

/// What the simulated robots publish in a network of YARP: the topics of robot.thrift/Telemetry at the ports
/// /telemetry/battery:o, /telemetry/position:o and so on, each message with its topic's name before it. With several
/// robots in the world they are below /ROBOT. Ends when it is destroyed, which must be before the server goes.
class YarpRobot {
 public:
  /// @param at  What names begin with: "yarp:/". Errors: rpc.*, those of the interface.
  [[nodiscard]] static Result<std::unique_ptr<YarpRobot>> start(processes::SimServer& server, const sim::World& world,
                                                                const rpc::Address& at);
  ~YarpRobot();
  YarpRobot(const YarpRobot&) = delete;
  YarpRobot& operator=(const YarpRobot&) = delete;

 private:
  class Impl;
  explicit YarpRobot(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace sentree::cli
