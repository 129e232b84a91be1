#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "sentree/base/message.h"
#include "sentree/base/result.h"
#include "sentree/mission/choice.h"
#include "sentree/mission/met.h"
#include "sentree/mission/observation_name.h"
#include "sentree/mission/parts.h"
#include "sentree/mission/state.h"
#include "sentree/project/plan.h"

namespace sentree::mission {

/// What a run in virtual time does to who tries it, and what that decides.
class Surroundings {
 public:
  virtual ~Surroundings() = default;
  /// Everything that monitors would observe, in its order, numbered and timed.
  virtual void observed(const Message&) {}
  /// Whether it wants to be told of observations of that name: those that it does not want are not made.
  [[nodiscard]] virtual bool is_heard(ObservationName& /*name*/) { return true; }
  /// Which alternative comes, below `Choice::count`; nothing: the model's generator says.
  virtual std::optional<std::uint64_t> choose(const Choice&) { return std::nullopt; }
  /// Which of several deliveries to different parts comes first; all are due now, in the order of virtual time.
  /// @param number  Of such instants of the run, from 1.
  virtual std::size_t order(std::uint64_t /*number*/, std::span<const Delivery* const>) { return 0; }
  /// Why a request is refused.
  virtual std::optional<Veto> judge(const Message& /*request*/) { return std::nullopt; }
  /// A chart of the skill of that leaf took a transition.
  virtual void taken(std::size_t /*leaf*/, scxml::TransitionIndex) {}
  virtual void met(const Met& /*what*/) {}
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
class VirtualHost final : private Ground {
 public:
  /// Why a plan cannot be run so: skills, services or observers in other processes, a simulated robot.
  /// Codes: verify.elsewhere, verify.no-model.
  [[nodiscard]] static Diagnostics obstacles(const project::Plan& plan);

  /// @param plan  Without obstacles; borrowed.
  explicit VirtualHost(const project::Plan& plan) : parts_(plan) {}
  VirtualHost(const VirtualHost&) = delete;
  VirtualHost& operator=(const VirtualHost&) = delete;

  /// Steps of charts are looked up where they are known: for who goes through many states, and decides every choice.
  void remember_steps() { parts_.remember_steps(); }
  /// Ticks and runs get the smallest number that nothing on its way has, so that behaviour that comes again has the
  /// same numbers again. Only charts that ask for their session's name can see it.
  void reuse_numbers() { reuses_numbers_ = true; }

  /// Before anything has happened.
  [[nodiscard]] State begin();
  /// When the next delivery is due; kNever: nothing is left to do.
  [[nodiscard]] static TimePoint next(const State& state) {
    return state.queue.empty() ? kNever : state.queue.front().when;
  }
  /// What is due first.
  [[nodiscard]] static const Delivery& front(const State& state) { return state.queue.front().what; }
  /// Executes what is due first.
  void step(State& state, Surroundings& surroundings);
  /// What a timeline would do now: kills, restarts, and what stands.
  /// @param number  As of `mission::inject`.
  /// Errors: steering.part-state, steering.too-many, steering.unknown-id, verify.fault.
  Result<void> inject(State& state, const project::Intervention& what, Surroundings& surroundings,
                      std::optional<std::uint64_t> number = std::nullopt);
  /// Whether a skill is killed, or is at once.
  [[nodiscard]] static bool is_killed(const State& state, std::size_t leaf) {
    return will_be_killed(leaf, state.skills[leaf].phase == SkillPhase::kKilled, state.queue,
                          [](const Waiting& waiting) -> const Delivery& { return waiting.what; });
  }
  /// Nothing of the mission is left to do.
  [[nodiscard]] static bool ended(const State& state) { return state.tree.phase == TreePhase::kEnded; }

  /// No tick follows; else when the next one is planned.
  [[nodiscard]] static bool over(const State& state) { return state.tree.over; }
  [[nodiscard]] static TimePoint planned(const State& state) { return state.tree.planned; }

  [[nodiscard]] const project::Plan& plan() const { return parts_.plan(); }
  [[nodiscard]] const Parts& parts() const { return parts_; }

 private:
  TimePoint now() const override { return state_->now; }
  void publish(Message message) override { show(message); }
  void show(Message& message) override;
  // What is published on a topic reaches its subscribers.
  bool is_heard(ObservationName& name) override {
    return !parts_.subscriptions().empty() || surroundings_->is_heard(name);
  }
  void pass() override {
    ++state_->published;
    ++state_->stamp;
  }
  void set_tick(std::uint64_t tick) override { state_->tick = tick; }
  void put(TimePoint when, Rank rank, Delivery&& what) override;
  void tell_skill(std::size_t leaf, std::string_view message, SkillDelivery what) override;
  void call(std::size_t leaf, const Shared<Call>& call) override;
  void serve(std::size_t model, ServeCall what) override;
  void taken(std::size_t leaf, scxml::TransitionIndex transition) override { surroundings_->taken(leaf, transition); }
  void met(const Met& what) override { surroundings_->met(what); }
  void problem(const std::string& what) override { surroundings_->problem(what); }
  void refused(const Diagnostic& why) override { surroundings_->refused(why); }
  std::uint64_t next_call() override { return ++state_->calls; }
  std::uint64_t tick_number(std::size_t leaf, std::uint64_t next) override;
  std::uint64_t run_number(std::size_t leaf, std::uint64_t next) override;
  std::optional<bt::Status> forced(std::string_view leaf) override { return state_->faults.forced(leaf); }
  Duration delay_of(std::string_view message) override { return state_->faults.delay_of(message); }
  void falsify(std::string_view call, const idl::Method& method, Value& result) override {
    state_->faults.falsify(call, method, result);
  }
  bool fails(Failing how, std::string_view call) override { return state_->faults.fails(how, call); }
  std::optional<Veto> judge(Message& request) override;
  std::optional<std::uint64_t> choose(const Choice& choice) override { return surroundings_->choose(choice); }
  void deliver_topic(const Message& message);
  /// Whether something is on its way of which that is true.
  template <class Is>
  [[nodiscard]] bool waits(const Is& is) const;

  Parts parts_;
  bool reuses_numbers_ = false;
  State* state_ = nullptr;  // that is being stepped
  Surroundings* surroundings_ = nullptr;
  // Where what is executed stood in the queue: what is put next is moved there, and then nothing needs to move up.
  static constexpr std::size_t kNoRoom = static_cast<std::size_t>(-1);
  std::size_t room_ = kNoRoom;
  // Of the step that is executed; here for what they hold.
  std::vector<std::size_t> due_;
  std::vector<const Delivery*> first_;
};

}  // namespace sentree::mission
