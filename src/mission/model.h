#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "sentree/base/message.h"
#include "sentree/base/result.h"
#include "sentree/base/rng.h"
#include "sentree/base/time.h"
#include "sentree/base/value.h"
#include "sentree/idl/schema.h"
#include "sentree/mission/choice.h"
#include "sentree/mission/delivery.h"
#include "sentree/mission/step_memory.h"
#include "sentree/scxml/chart.h"
#include "sentree/scxml/host.h"
#include "sentree/scxml/session.h"

namespace sentree::mission {

/// Calls that one model may have open; one more is answered as unreachable.
inline constexpr std::size_t kOpenCallsMax = 256;

/// What a model of components is made of: one chart, one session for the whole run. Never changes.
struct ComponentModel {
  std::string name;  ///< In messages.
  std::string file;  ///< Of its chart, in the places of its choices.
  std::uint64_t seed = 1;
  Duration patience = std::chrono::milliseconds(40);  ///< A call that is open longer is late. Run time.
  scxml::Chart chart;
  std::map<std::string, idl::ServicePtr> serves;
  std::map<std::string, idl::ServicePtr> topics = {};  ///< Services that nobody serves: it may publish on them too.
};

/// Of a model of the plan, in virtual time.
[[nodiscard]] ComponentModel component_model(const project::Plan& plan, std::size_t model);

/// What a model remembers between deliveries. A plain value: a copy goes on alike.
struct ModelState {
  struct OpenCall {
    std::size_t leaf = 0;  ///< As `ServeCall::leaf`.
    Shared<Call> call;
    TimePoint due{};       ///< When it is late.
    std::uint64_t id = 0;  ///< Under which the chart knows it: the smallest number that no open call has.
    bool lost = false;     ///< A fault has taken its answer: it is late.
    friend bool operator==(const OpenCall&, const OpenCall&) = default;
  };

  scxml::Session session;
  std::vector<OpenCall> open;  ///< The oldest first.
  Rng rng{1};                  ///< Of its choices.
  std::uint64_t fresh = 0;     ///< Numbers given out by fresh().
  std::uint64_t choices = 0;   ///< Made so far.
  TimePoint wake = kNever;     ///< When its timer rings.
  /// Earliest time at which what is published may reach it; written by who delivers it.
  TimePoint topics_not_before{};
  friend bool operator==(const ModelState&, const ModelState&) = default;
};

/// What a model does to the world around it, in order.
class ModelHost {
 public:
  virtual ~ModelHost() = default;
  [[nodiscard]] virtual TimePoint now() const = 0;
  virtual void publish(Message message) = 0;
  [[nodiscard]] virtual std::uint64_t next_call() = 0;
  /// Publishes a request unless a gate refuses it. Nothing: `Refused` follows if one does.
  [[nodiscard]] virtual std::optional<Admission> request(Message message) = 0;
  virtual void deliver_at(TimePoint when, Rank rank, ModelDelivery what) = 0;
  /// Which alternative comes, below `Choice::count`; nothing: the model's generator says.
  [[nodiscard]] virtual std::optional<std::uint64_t> choose(const Choice&) { return std::nullopt; }
  /// Whether a fault makes answers of "SERVICE.METHOD" late.
  [[nodiscard]] virtual bool is_made_late(std::string_view /*call*/) { return false; }
  /// The outcome of a call that came from `leaf`.
  virtual void answer(std::size_t leaf, const Shared<Call>& call, CallOutcome outcome) = 0;
  /// Its chart enters a state, or takes a transition. With a memory of steps, told when a step is executed, not when it
  /// is looked up.
  virtual void entered(scxml::StateIndex /*state*/) {}
  virtual void taken(scxml::TransitionIndex /*transition*/) {}
  /// Something a person should know; the run goes on.
  virtual void problem(const std::string& what) = 0;
  /// It said something that is no answer: to nobody, or of a wrong type.
  virtual void refused(const Diagnostic& why) { problem(to_string(why)); }
};

/// Serves calls by a chart. A call is the event SERVICE.METHOD.request, with `args`, `source` and `id` as data; what
/// answers it is <send type="thrift" target="SERVICE" event="METHOD.reply"> with the param `result`, or METHOD.error
/// with `kind` and `message`. The oldest open call of the method is meant, or the one that the param `id` names. A call
/// that is not answered within the patience is late. A call of a one-way method needs no answer.
///
/// It publishes on a topic by <send type="thrift" target="SERVICE" event="METHOD"> with the arguments of that one-way
/// method; a gate's veto is the event SERVICE.METHOD.error. What is published on a topic that it subscribes to is the
/// event SERVICE.METHOD, whose data are the arguments.
///
/// Its scripts can call choose(a, …), pick('NAME', a, …), between(low, high [, step]), chance(p), draw([[p, a], …]) and
/// fresh(): decided by the host, else drawn from the state's generator, but for fresh(), which counts. Each choice is
/// the observation NAME.choice: `function`, `value`, `place`, and `name` where it has one. Owns no thread and no clock.
/// Deterministic: equal states, deliveries and times give equal effects.
class ModelMachine {
 public:
  /// @param watch  Sees the chart's scripts; borrowed; null: nobody looks on.
  explicit ModelMachine(ComponentModel model, scxml::ExecutionWatch* watch = nullptr);
  ModelMachine(const ModelMachine&) = delete;
  ModelMachine& operator=(const ModelMachine&) = delete;

  [[nodiscard]] const ComponentModel& model() const { return model_; }
  /// Steps of its chart are looked up where they are known. Only with hosts that decide every choice.
  void remember_steps() { memory_.emplace(model_.chart); }
  void step(ModelState& state, ModelDelivery&& delivery, ModelHost& host);
  /// What a model does that can do nothing any more, instead of `step`: calls are unreachable, open ones too.
  static void refuse(ModelState& state, const ModelDelivery& delivery, const std::string& why, ModelHost& host);

 private:
  class Step;
  struct Answer {
    std::string service;
    std::string method;
    CallOutcome outcome;
    std::uint64_t id = 0;  // 0: the oldest
  };
  struct Topic {
    std::string service;
    std::string method;
    Value args;
  };
  using Meaning = std::variant<Answer, Topic>;
  [[nodiscard]] Result<Meaning> meaning_of(const scxml::OutgoingSend& send) const;
  [[nodiscard]] Result<Topic> topic_of(const scxml::OutgoingSend& send, const idl::Service& service) const;
  // `by_chance` says what the generator of the state gives.
  Result<Value> decide(const Choice& choice, const std::function<std::uint64_t(Rng&)>& by_chance);
  // The alternative that comes; it will be said.
  std::uint64_t ask(Choice choice, const std::function<std::uint64_t(Rng&)>& by_chance);
  // Where the script stands that executes.
  [[nodiscard]] std::string place() const;
  void add_choices();
  struct Observer final : scxml::Observer {
    explicit Observer(ModelMachine& of) : machine(of) {}
    void event(const scxml::Chart& chart, std::string_view session, const scxml::Event& event) override;
    void transition(const scxml::Chart& chart, std::string_view session, scxml::TransitionIndex taken) override;
    void entered(const scxml::Chart& chart, std::string_view session, scxml::StateIndex state) override;
    ModelMachine& machine;
  };

  ComponentModel model_;
  scxml::ExecutionWatch watch_;  // if nobody else looks on: errors say where
  Observer observer_{*this};
  scxml::Host host_;
  ModelState* stepped_ = nullptr;  // whose chart executes
  ModelHost* surroundings_ = nullptr;
  std::optional<StepMemory> memory_;
  // What leaves at once in this step means, by its id, in its order: it has been looked at when it was sent.
  std::deque<std::pair<std::string, Meaning>> meanings_;
  std::vector<Map> choices_;                      // made in this step
  Diagnostics wrong_;                             // likewise: what was no answer, and what failed
  bool handles_failures_ = false;                 // its chart does
  std::optional<scxml::TransitionIndex> latest_;  // taken in this step: what fails is of it, or of where it leads
  scxml::Effects effects_;
};

}  // namespace sentree::mission
