#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "sentree/base/message.h"
#include "sentree/base/result.h"
#include "sentree/mission/choice.h"
#include "sentree/mission/model.h"
#include "sentree/mission/skill.h"
#include "sentree/mission/state.h"
#include "sentree/mission/tree.h"
#include "sentree/project/plan.h"

namespace sentree::mission {

/// What a run in virtual time does to who tries it, and what that decides.
class Surroundings {
 public:
  virtual ~Surroundings() = default;
  /// Everything that monitors would observe, in its order, numbered and timed.
  virtual void observed(const Message&) {}
  /// Which alternative comes, below `Choice::count`; nothing: the model's generator says.
  virtual std::optional<std::uint64_t> choose(const Choice&) { return std::nullopt; }
  /// Which of several deliveries to different parts comes first; all are due now, in the order of virtual time.
  /// @param number  Of such instants of the run, from 1.
  virtual std::size_t order(std::uint64_t /*number*/, std::span<const Delivery* const>) { return 0; }
  /// Why a request is refused.
  virtual std::optional<Veto> judge(const Message& /*request*/) { return std::nullopt; }
  /// A chart of the skill of that leaf took a transition.
  virtual void taken(std::size_t /*leaf*/, scxml::TransitionIndex) {}
  /// Something a person should know; the run goes on.
  virtual void problem(const std::string&) {}
  /// A model said something that is no answer: to nobody, or of a wrong type.
  virtual void refused(const Diagnostic& why) { problem(to_string(why)); }
};

/// Runs a mission, its skills and the models of its components in virtual time: takes the next delivery by time, rank
/// and order, and gives it to whom it is for. Owns no state: that of the run is a value, which the caller has.
///
/// Deterministic: equal states and answers of the surroundings give equal observations. The same run as that of
/// `runtime::Run` in virtual time, message for message.
class VirtualHost {
 public:
  /// Why a plan cannot be run so: skills, services or observers in other processes, a simulated robot.
  /// Codes: verify.elsewhere, verify.no-model.
  [[nodiscard]] static Diagnostics obstacles(const project::Plan& plan);

  /// @param plan  Without obstacles; borrowed.
  explicit VirtualHost(const project::Plan& plan);
  ~VirtualHost();
  VirtualHost(const VirtualHost&) = delete;
  VirtualHost& operator=(const VirtualHost&) = delete;

  /// Steps of charts are looked up where they are known: for who goes through many states, and decides every choice.
  void remember_steps();

  /// Before anything has happened.
  [[nodiscard]] State begin();
  /// When the next delivery is due; kNever: nothing is left to do.
  [[nodiscard]] static TimePoint next(const State& state) {
    return state.queue.empty() ? kNever : state.queue.front().when;
  }
  /// Executes what is due first.
  void step(State& state, Surroundings& surroundings);
  /// What a timeline would do now: kills, restarts, and what stands.
  /// Errors: steering.part-state, steering.too-many, steering.unknown-id, verify.fault.
  Result<void> inject(State& state, const project::Intervention& what, Surroundings& surroundings);
  /// Nothing of the mission is left to do.
  [[nodiscard]] static bool ended(const State& state) { return state.tree.phase == TreePhase::kEnded; }

  [[nodiscard]] const project::Plan& plan() const { return plan_; }
  [[nodiscard]] const SkillMachine& skill(std::size_t leaf) const;
  [[nodiscard]] const ModelMachine& model(std::size_t index) const;

 private:
  class TreeSide;
  class SkillSide;
  class ModelSide;

  void put(TimePoint when, Rank rank, Delivery what);
  void post(Delivery what) { put(state_->now, Rank::kMessage, std::move(what)); }
  void publish(Message message);
  void deliver_topic(const Message& message);
  void tell_skill(std::size_t leaf, std::string_view message, SkillDelivery what);

  const project::Plan& plan_;
  std::map<std::string, std::size_t, std::less<>> model_of_;  // by service
  std::unique_ptr<TreeSide> tree_;
  std::vector<std::unique_ptr<SkillSide>> skills_;
  std::vector<std::unique_ptr<ModelSide>> models_;
  // Who subscribes to a topic: skills, then models, as in the plan.
  struct Taker {
    bool is_model = false;
    std::size_t index = 0;
  };
  std::map<std::string, std::vector<Taker>, std::less<>> takers_;
  State* state_ = nullptr;  // that is being stepped
  Surroundings* surroundings_ = nullptr;
};

}  // namespace sentree::mission
