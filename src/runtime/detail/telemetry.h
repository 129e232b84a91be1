#pragma once

#include <memory>
#include <string>
#include <vector>

#include "sentree/idl/schema.h"
#include "sentree/runtime/publisher.h"
#include "sentree/runtime/scheduler.h"
#include "sentree/runtime/services.h"

namespace sentree::runtime {

/// What the simulator publishes, each topic at its rate: at the multiples of its period, before anything else of that
/// instant but what is injected. A service that is killed is silent; what gates refuse is told as an error.
class Telemetry {
 public:
  struct Topic {
    std::string service;
    std::string method;
    std::string argument;               ///< Of the method: takes what is published.
    std::unique_ptr<ServicePort> port;  ///< To the simulated service that is asked,
    std::string source;                 ///< and its method.
    Duration period{};
    TimePoint next{};
  };

  /// @param actor  In which it happens. All are borrowed.
  Telemetry(Scheduler& scheduler, Publisher& publisher, ActorId actor);
  /// Before the run, in the order in which topics of one instant are published.
  void add(Topic topic) { topics_.push_back(std::move(topic)); }
  /// @param from  The run goes on from there; null: it begins.
  void start(const mission::State* from);

 private:
  void schedule();
  void publish(const Topic& topic, Value what);
  void refuse(Message request, const mission::Veto& veto);

  Scheduler& scheduler_;
  Publisher& publisher_;
  ActorId actor_;
  std::vector<Topic> topics_;
};

}  // namespace sentree::runtime
