#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "sentree/base/message.h"
#include "sentree/base/result.h"
#include "sentree/mission/choice.h"
#include "sentree/mission/delivery.h"
#include "sentree/mission/faults.h"
#include "sentree/mission/met.h"
#include "sentree/mission/model.h"
#include "sentree/mission/observation_name.h"
#include "sentree/mission/skill.h"
#include "sentree/mission/subscriptions.h"
#include "sentree/mission/tree.h"
#include "sentree/project/plan.h"

namespace sentree::mission {

/// What the parts of a mission in virtual time stand on: everything that a step does or asks passes here, in order.
class Ground {
 public:
  virtual ~Ground() = default;
  [[nodiscard]] virtual TimePoint now() const = 0;

  // What a step does.
  virtual void publish(Message message) = 0;
  /// Likewise; the caller keeps what it says.
  virtual void show(Message& message) { publish(message); }
  /// Whether anybody would see an observation of that name. One that nobody would see is not published but passed.
  [[nodiscard]] virtual bool is_heard(ObservationName& /*name*/) { return true; }
  /// Has its place in the order, and that is all.
  virtual void pass() {}
  /// From now on observations belong to this root tick.
  virtual void set_tick(std::uint64_t tick) = 0;
  /// Something is on its way.
  virtual void put(TimePoint when, Rank rank, Delivery&& what) = 0;
  /// A tick, a halt or a cancellation (`message`) for a skill; a delayed one holds back the later ones.
  virtual void tell_skill(std::size_t leaf, std::string_view message, SkillDelivery what) = 0;
  /// The skill of a leaf makes a call to a service that a model serves.
  virtual void call(std::size_t leaf, const Shared<Call>& call) = 0;
  /// A model gets a call of somebody outside the mission: now, before anything else.
  virtual void serve(std::size_t model, ServeCall what) = 0;
  virtual void taken(std::size_t leaf, scxml::TransitionIndex transition) = 0;
  virtual void met(const Met& what) = 0;
  virtual void problem(const std::string& what) = 0;
  /// A model said something that is no answer.
  virtual void refused(const Diagnostic& why) = 0;

  // What it asks.
  [[nodiscard]] virtual std::uint64_t next_call() = 0;
  /// The number of a leaf's next tick, or of a skill's next run: at least 1, and of nothing that is still on its way.
  /// @param next  Where they are counted.
  [[nodiscard]] virtual std::uint64_t tick_number(std::size_t leaf, std::uint64_t next) = 0;
  [[nodiscard]] virtual std::uint64_t run_number(std::size_t leaf, std::uint64_t next) = 0;
  [[nodiscard]] virtual std::optional<bt::Status> forced(std::string_view leaf) = 0;
  [[nodiscard]] virtual Duration delay_of(std::string_view message) = 0;
  virtual void falsify(std::string_view call, const idl::Method& method, Value& result) = 0;
  [[nodiscard]] virtual bool fails(Failing how, std::string_view call) = 0;
  /// Why a request is refused; nothing: it goes out.
  /// @param request  Is given the members that the ground knows.
  [[nodiscard]] virtual std::optional<Veto> judge(Message& request) = 0;
  [[nodiscard]] virtual std::optional<std::uint64_t> choose(const Choice& choice) = 0;
};

/// The tree, the skills and the models of a plan in virtual time: steps each of them on a ground. Owns no state.
class Parts {
 public:
  /// @param plan  Without obstacles for `VirtualHost`; borrowed.
  explicit Parts(const project::Plan& plan);
  ~Parts();
  Parts(const Parts&) = delete;
  Parts& operator=(const Parts&) = delete;

  /// Steps of charts are looked up where they are known; the ground decides every choice then.
  void remember_steps();

  void start(TreeState& state, Ground& ground);
  void step(TreeState& state, TreeDelivery&& what, Ground& ground);
  void step(std::size_t leaf, SkillState& state, SkillDelivery&& what, Ground& ground);
  void step(std::size_t model, ModelState& state, ModelDelivery&& what, Ground& ground);

  [[nodiscard]] const project::Plan& plan() const { return plan_; }
  [[nodiscard]] TreeState initial_tree() const;
  [[nodiscard]] std::size_t skills() const { return skills_.size(); }
  [[nodiscard]] std::size_t models() const { return models_.size(); }
  [[nodiscard]] const SkillMachine& skill(std::size_t leaf) const;
  [[nodiscard]] const ModelMachine& model(std::size_t index) const;
  /// That serves a service.
  [[nodiscard]] std::optional<std::size_t> model_of(std::string_view service) const;
  /// What becomes of a call while its service is not killed.
  [[nodiscard]] Delivery delivery_of(std::size_t leaf, const Shared<Call>& call) const;
  /// What becomes of it else.
  [[nodiscard]] static SkillDelivery unreachable(const Shared<Call>& call);

  [[nodiscard]] const Subscriptions& subscriptions() const { return subscriptions_; }

 private:
  class TreeSide;
  class SkillSide;
  class ModelSide;

  const project::Plan& plan_;
  std::map<std::string, std::size_t, std::less<>> model_of_;  // by service
  std::unique_ptr<TreeSide> tree_;
  std::vector<std::unique_ptr<SkillSide>> skills_;
  std::vector<std::unique_ptr<ModelSide>> models_;
  Subscriptions subscriptions_;
};

/// The leaf and the number of the tick that a delivery is about, or of the run whose call it carries; nothing: of none.
using Numbered = std::optional<std::pair<std::size_t, std::uint64_t>>;
[[nodiscard]] Numbered numbered_tick(const Delivery& what);
[[nodiscard]] Numbered numbered_call(const Delivery& what);

/// What a timeline would do now (`mission::apply`).
/// @param is_killed  Whether the skill of a leaf is.
/// @param number     Of what stands from then on; nothing: the next one.
/// Errors: those of `apply`; verify.fault, also of a call of a service that no model of the mission serves.
Result<void> inject(const Parts& parts, Faults& faults, std::set<std::string>& down,
                    const std::function<bool(std::size_t leaf)>& is_killed, const project::Intervention& what,
                    Ground& ground, std::optional<std::uint64_t> number = std::nullopt);

/// Whether a skill is killed, once what is on its way to it has come.
/// @param is_killed  It is now.
/// @param waiting    On its way to anybody, in order; `delivery` gives one of them.
template <class Waiting, class DeliveryOf>
[[nodiscard]] bool will_be_killed(std::size_t leaf, bool is_killed, const Waiting& waiting,
                                  const DeliveryOf& delivery) {
  for (const auto& one : waiting) {
    const Delivery& what = delivery(one);
    const auto* skill = std::get_if<SkillDelivery>(&what.what);
    if (skill == nullptr || what.leaf != leaf) continue;
    if (std::holds_alternative<KillSkill>(*skill)) is_killed = true;
    if (std::holds_alternative<RestartSkill>(*skill)) is_killed = false;
  }
  return is_killed;
}

}  // namespace sentree::mission
