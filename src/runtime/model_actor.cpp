#include "sentree/runtime/detail/model_actor.h"

#include <fmt/format.h>

#include <condition_variable>
#include <mutex>
#include <optional>
#include <utility>

#include "sentree/mission/subscriptions.h"

namespace sentree::runtime {

// The answer that somebody outside waits for.
struct ModelActor::Waiting {
  std::uint64_t call = 0;
  std::mutex mutex;
  std::condition_variable changed;
  std::optional<mission::CallOutcome> outcome;
};

ModelActor::ModelActor(mission::ComponentModel model, std::size_t index, Surroundings surroundings)
    : index_(index),
      surroundings_(std::move(surroundings)),
      publisher_(surroundings_.publisher),
      scheduler_(surroundings_.scheduler),
      watched_(std::make_shared<Watched>([this](const SourceSpan& script) { give_up(script); })),
      machine_(std::move(model), &watched_->execution()),
      actor_(scheduler_.add_actor(fmt::format("{} ({})", machine_.model().name, machine_.model().chart.file()))) {
  scheduler_.on_delivery(
      actor_, [this](mission::Delivery delivery) { take(std::move(std::get<mission::ModelDelivery>(delivery.what))); });
  if (surroundings_.watchdog != nullptr) surroundings_.watchdog->watch(watched_);
}

void ModelActor::take(mission::ModelDelivery what) {
  watched_->in_this_thread();
  if (const auto* topic = std::get_if<mission::Published>(&what))
    topics_.taken(*topic->what, machine_.model().name, publisher_);
  if (given_up_)
    mission::ModelMachine::refuse(state_, what, why_, *this);
  else
    machine_.step(state_, std::move(what), *this);
}

void ModelActor::take_topic(const ToldTopic& told) {
  if (!topics_.add(scheduler_, told)) return;
  const TimePoint when = mission::Subscriptions::time_of(state_.topics_not_before, now(), told.delay);
  scheduler_.at(actor_, when, mission::Rank::kMessage, addressed(mission::Published{told.what}));
}

std::optional<mission::Admission> ModelActor::request(Message message) {
  const Value* const args = message.data.find("args");
  mission::Refused refused{.service = message.target,
                           .method = message.name.substr(message.target.size() + 1),
                           .id = message.call,
                           .args = args != nullptr ? *args : Value(),
                           .veto = {}};
  refused.method.erase(refused.method.rfind('.'));
  return publisher_.request(std::move(message),
                            [this, refused = std::move(refused)](const mission::Admission& decided) mutable {
                              if (!decided.veto) return;
                              refused.veto = *decided.veto;
                              scheduler_.post(actor_, addressed(std::move(refused)));
                            });
}

void ModelActor::give_up(const SourceSpan& script) {
  why_ = surroundings_.watchdog->reason(script, "model " + machine_.model().name);
  given_up_ = true;
  surroundings_.given_up(why_);
  scheduler_.abandon(actor_, why_);
}

void ModelActor::answer(std::size_t leaf, const mission::Shared<mission::Call>& call, mission::CallOutcome outcome) {
  if (leaf != mission::ServeCall::kOutside) return surroundings_.answer(leaf, {call, std::move(outcome)});
  // One that came too late for who called is nobody's.
  if (!waiting_ || waiting_->call != call->id) return;
  const std::lock_guard lock(waiting_->mutex);
  if (!waiting_->outcome) waiting_->outcome = std::move(outcome);
  waiting_->changed.notify_all();
}

mission::CallOutcome ModelActor::call(mission::Call call, const std::string& source, Duration patience) {
  const auto waiting = std::make_shared<Waiting>();
  waiting->call = call.id;
  const auto serve = [this, waiting,
                      what = mission::ServeCall{mission::ServeCall::kOutside, source,
                                                mission::Shared<mission::Call>(std::move(call))}] {
    waiting_ = waiting;
    take(what);
  };
  if (scheduler_.is_virtual())
    serve();
  else
    scheduler_.post(actor_, serve);
  std::unique_lock lock(waiting->mutex);
  if (!scheduler_.is_virtual()) waiting->changed.wait_for(lock, patience, [&] { return waiting->outcome.has_value(); });
  if (waiting->outcome) return *waiting->outcome;
  return mission::CallOutcome::failed(idl::CallErrorKind::kLate, "the model does not answer at once");
}

namespace {

class ModelPort final : public ServicePort {
 public:
  ModelPort(ModelActor& model, std::string leaf) : model_(model), leaf_(std::move(leaf)) {}
  bool take(std::size_t leaf, const mission::Shared<mission::Call>& call) override {
    model_.serve({leaf, leaf_, call});
    return true;
  }
  void call(const idl::Method&, Value, Done done) override {
    done(mission::CallOutcome::failed(idl::CallErrorKind::kUnreachable, "a model answers calls of skills only"));
  }

 private:
  ModelActor& model_;
  std::string leaf_;
};

}  // namespace

std::unique_ptr<ServicePort> make_model_port(ModelActor& model, std::string leaf) {
  return std::make_unique<ModelPort>(model, std::move(leaf));
}

}  // namespace sentree::runtime
