#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <string>

#include "sentree/mission/model.h"
#include "sentree/runtime/publisher.h"
#include "sentree/runtime/scheduler.h"
#include "sentree/runtime/services.h"
#include "sentree/runtime/standing.h"
#include "sentree/runtime/topics.h"
#include "sentree/runtime/watchdog.h"

namespace sentree::runtime {

/// A model of components in an actor of its own. One whose script does not end is given up: its thread is left behind,
/// its calls are unreachable, and everything else goes on.
class ModelActor final : private mission::ModelHost {
 public:
  /// What it uses of the run; all of it outlives the actor.
  struct Surroundings {
    Publisher& publisher;
    Scheduler& scheduler;
    StandingFaults& faults;
    Watchdog* watchdog = nullptr;
    /// Gives a skill the outcome of its call; in the model's actor.
    std::function<void(std::size_t leaf, mission::Outcome outcome)> answer;
    std::function<void(const std::string&)> problem;
    /// Which alternative of a choice comes; nothing: its generator says.
    std::function<std::optional<std::uint64_t>(const mission::Choice&)> choose;
    /// Its script does not end. In the watchdog's thread.
    std::function<void(const std::string& why)> given_up;
  };

  /// @param index  Its number in what is on its way to it.
  ModelActor(mission::ComponentModel model, std::size_t index, Surroundings surroundings);

  /// Before the run: its chart begins with it.
  void start() { scheduler_.at(actor_, TimePoint{}, mission::Rank::kSimulator, addressed(mission::StartModel{})); }
  /// A skill calls. From any thread.
  void serve(mission::ServeCall call) { scheduler_.post(actor_, addressed(std::move(call))); }
  /// As `SkillActor::take_topic`.
  void take_topic(const ToldTopic& told);
  /// Somebody who steers the run calls, and waits; `late` if it is not answered within `patience` of wall time, or, in
  /// virtual time, at once. In another actor.
  [[nodiscard]] mission::CallOutcome call(mission::Call call, const std::string& source, Duration patience);
  /// What it remembers: of its actor, and of anybody while nothing is executed.
  [[nodiscard]] mission::ModelState& state() { return state_; }
  [[nodiscard]] ActorId actor() const { return actor_; }

 private:
  struct Waiting;

  TimePoint now() const override { return scheduler_.now(); }
  void publish(Message message) override { publisher_.publish(std::move(message)); }
  std::uint64_t next_call() override { return publisher_.next_call(); }
  std::optional<mission::Admission> request(Message message) override;
  void deliver_at(TimePoint when, mission::Rank rank, mission::ModelDelivery what) override {
    scheduler_.at(actor_, when, rank, addressed(std::move(what)));
  }
  std::optional<std::uint64_t> choose(const mission::Choice& choice) override { return surroundings_.choose(choice); }
  bool is_made_late(std::string_view call) override {
    return surroundings_.faults.fails(mission::Failing::kLate, call);
  }
  void answer(std::size_t leaf, const mission::Shared<mission::Call>& call, mission::CallOutcome outcome) override;
  void problem(const std::string& what) override { surroundings_.problem(what); }

  [[nodiscard]] mission::Delivery addressed(mission::ModelDelivery what) const { return {index_, std::move(what)}; }
  void take(mission::ModelDelivery what);
  void give_up(const SourceSpan& script);

  const std::size_t index_;
  Surroundings surroundings_;
  Publisher& publisher_;
  Scheduler& scheduler_;
  std::shared_ptr<Watched> watched_;
  mission::ModelMachine machine_;
  mission::ModelState state_;
  ActorId actor_;
  std::shared_ptr<Waiting> waiting_;  // who calls from outside; of the actor
  TopicInbox topics_;
  std::atomic<bool> given_up_ = false;
  std::string why_;  // it was given up; written before given_up_
};

/// A service that a model serves, for the skill of a leaf.
[[nodiscard]] std::unique_ptr<ServicePort> make_model_port(ModelActor& model, std::string leaf);

}  // namespace sentree::runtime
