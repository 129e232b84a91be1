#pragma once

#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "sentree/project/plan.h"
#include "sentree/runtime/scheduler.h"
#include "sentree/runtime/services.h"
#include "sentree/runtime/skill.h"
#include "sentree/runtime/standing.h"
#include "sentree/runtime/stream.h"

namespace sentree::runtime {

/// Where a caller publishes what it does: the run's stream, or another process's.
class Publisher {
 public:
  virtual ~Publisher() = default;
  virtual void publish(Message message) = 0;
  /// Publishes a request unless a gate refuses it. Returns what became of it; nothing: `decided` will be told, once,
  /// in any thread.
  virtual std::optional<Admission> request(Message message, Stream::Decided decided) = 0;
  [[nodiscard]] virtual std::uint64_t next_call() = 0;
  /// Names of the calls that `request` may refuse; * stands for any characters.
  [[nodiscard]] virtual std::vector<std::string> gates() const { return {"*"}; }
};

/// Calls of one chart to one service that wait for a gate's decision; one more fails at once as unreachable.
inline constexpr std::size_t kGatedCallsMax = 256;

/// Makes the calls of one chart: checks them against the IDL, asks the gates, publishes request and outcome, keeps
/// their order.
/// This is the one seam that every call of every skill passes through. Used in the skill's actor only.
class Caller {
 public:
  using MakePort = std::function<std::unique_ptr<ServicePort>(const project::ServicePlan&)>;

  /// @param deliver  Gives the chart an outcome; false if the run it belongs to is over.
  Caller(std::string name, const std::map<std::string, project::ServicePlan>& services, MakePort make_port,
         Publisher& publisher, Scheduler& scheduler, ActorId actor, StandingInterventions& standing,
         std::function<bool(const SkillEvent&)> deliver, std::function<bool(std::uint64_t run)> is_current);

  /// Whether the call can be made at all; for `SkillOptions::check_call`.
  [[nodiscard]] Result<void> check(const scxml::OutgoingSend& send) const;
  void call(SkillCall call);

 private:
  struct Pending {
    SkillCall call;
    const idl::Method* method = nullptr;
    std::uint64_t id = 0;
    Value args;
    std::string vetoed_by;  // the gate that refused it
  };
  // Asks for the calls to one service, one after the other, until a decision has to be waited for.
  void admit(const std::string& service);
  void admitted(const std::shared_ptr<Pending>& pending, Admission admission);
  void fail_later(const std::shared_ptr<Pending>& pending, CallOutcome outcome);
  void execute(std::shared_ptr<Pending> pending);
  Duration delay_of(const std::string& message);
  // What the service answered, as the faults that stand let it through.
  void answered(const std::shared_ptr<Pending>& pending, CallOutcome outcome);
  void finish(const Pending& pending, CallOutcome outcome);

  std::string name_;
  const std::map<std::string, project::ServicePlan>& services_;
  MakePort make_port_;
  Publisher& publisher_;
  Scheduler& scheduler_;
  ActorId actor_;
  StandingInterventions& standing_;
  std::function<bool(const SkillEvent&)> deliver_;
  std::function<bool(std::uint64_t)> is_current_;
  std::map<std::string, std::unique_ptr<ServicePort>> ports_;
  std::map<std::string, std::deque<std::shared_ptr<Pending>>> waiting_;  // by service, in the order sent
  std::map<std::string, TimePoint> not_before_;  // by service: a delayed call holds back the later ones
};

}  // namespace sentree::runtime
