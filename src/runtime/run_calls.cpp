#include "sentree/runtime/detail/run_impl.h"

#include <algorithm>
#include <condition_variable>
#include <memory>
#include <mutex>

#include <fmt/format.h>

#include "sentree/base/assert.h"
#include "sentree/idl/conform.h"
#include "sentree/sim/services.h"
#include "sentree/sim/topics.h"

namespace sentree::runtime {

namespace {

// What a call of somebody who steers the run gets.
constexpr std::chrono::seconds kCallPatience{1};

// A service at an address, in a run that reaches none.
class UnreachablePort final : public ServicePort {
 public:
  explicit UnreachablePort(std::string name) : name_(std::move(name)) {}
  void call(const idl::Method&, Value, Done done) override {
    done(mission::CallOutcome::failed(idl::CallErrorKind::kUnreachable,
                                      fmt::format("{} is elsewhere{}", name_, kOnlyHere)));
  }

 private:
  const std::string name_;
};

// For services outside the run, all together, before it begins.
constexpr std::chrono::seconds kOpenPatience{1};

// Nobody serves it: what is published has left when it was observed.
bool is_published_only(const project::ServicePlan& service) {
  return service.at == "topics" || (service.at == "sim" && service.interface == sim::kTelemetry);
}

}  // namespace

std::unique_ptr<ServicePort> Run::Impl::make_port(const project::ServicePlan& service, const std::string& leaf) {
  if (options_.make_port) {
    if (auto port = options_.make_port(service, leaf)) return port;
  }
  if (is_published_only(service)) return make_topic_port();
  if (service.at == "sim") {
    SENTREE_ASSERT(sim_ != nullptr);  // checked when the plan was prepared
    return steering_.guard(service.name, project::kSimulatorPart,
                           make_sim_port(*sim_, service.interface, service.robot));
  }
  if (service.at == "model") return steering_.guard(service.name, "", make_model_port(*model_of(service.name), leaf));
  auto port = elsewhere_ ? elsewhere_->make_port(service, scenario_.project.deadlines.call) : nullptr;
  if (!port) port = std::make_unique<UnreachablePort>(service.name);
  return durability_ ? durability_->guard(std::move(port)) : std::move(port);
}

void Run::Impl::open_ports() {
  // Whoever answers after the patience finds it still there.
  struct Waiting {
    std::mutex mutex;
    std::condition_variable changed;
    std::size_t left = 0;
  };
  const auto waiting = std::make_shared<Waiting>();
  std::vector<ServicePort*> ports;
  for (SkillActor* const skill : skills_) {
    if (skill == nullptr) continue;
    const auto made = skill->make_ports();
    ports.insert(ports.end(), made.begin(), made.end());
  }
  waiting->left = ports.size();
  for (ServicePort* const port : ports) {
    port->open([waiting] {
      const std::lock_guard lock(waiting->mutex);
      --waiting->left;
      waiting->changed.notify_all();
    });
  }
  std::unique_lock lock(waiting->mutex);
  waiting->changed.wait_for(lock, kOpenPatience, [&] { return waiting->left == 0; });
}

void Run::Impl::deliver(const Message& message) {
  const auto told = subscriptions_.told_of(message);
  if (!told.problem.empty()) return problem(told.problem);
  if (told.takers == nullptr) return;
  const ToldTopic topic{.what = told.what,
                        .delay = steering_.faults().delay_of(told.topic),
                        .published = message.time,
                        .sequence = message.sequence};
  for (const auto& taker : *told.takers) {
    if (taker.is_model)
      models_[taker.index]->take_topic(topic);
    else
      deliver(taker.index, topic);
  }
}

void Run::Impl::deliver(std::size_t leaf, const ToldTopic& told) {
  SkillActor* const skill = skills_[leaf];
  const TimePoint at = options_.topic_arrival ? options_.topic_arrival(leaf, *told.what) : TimePoint{};
  if (at == kNever) return;
  if (at <= scheduler_->now()) return skill->take_topic(told);
  scheduler_->at(director_, at, mission::Rank::kMessage, [skill, late = told]() mutable {
    late.delay = Duration(0);  // `at` has it
    skill->take_topic(late);
  });
}

void Run::Impl::tell_unanswered(const Message& message) {
  if (message.kind != MessageKind::kError) return;
  const auto service = plan_.services.find(message.target);
  if (service == plan_.services.end() || project::is_inside(service->second.at)) return;
  // What is meant to fail is no problem, and of the run's own processes it is told when they end.
  if (steering_.faults().any() || service->second.at.starts_with('{')) return;
  const Value* const kind = message.data.find("kind");
  const Value* const why = message.data.find("message");
  if (kind == nullptr || why == nullptr || (kind->text() != "unreachable" && kind->text() != "late")) return;
  problem(fmt::format("{}: {}", std::string_view(message.name).substr(0, message.name.rfind('.')), why->text()));
}

void Run::Impl::schedule_telemetry() {
  if (!sim_) return;
  for (const project::ServiceEntry& service : scenario_.project.services) {
    if (service.at != "sim") continue;
    for (const project::PublishedTopic& topic : service.publish) {
      const sim::TopicInfo* const info = sim::find_topic(topic.method);
      const idl::Method* const method = services_.at(service.name).service->find(topic.method);
      SENTREE_ASSERT(info != nullptr && method != nullptr);  // checked when the plan was prepared
      telemetry_.add({.service = service.name,
                      .method = topic.method,
                      .argument = method->arguments.fields.front().name,
                      .port = steering_.guard(service.name, project::kSimulatorPart,
                                              make_sim_port(*sim_, std::string(info->service), service.robot)),
                      .source = std::string(info->method),
                      .period = topic.period});
    }
  }
  telemetry_.start(options_.from);
}

mission::CallOutcome Run::Impl::call_service(const std::string& name, const std::string& method,
                                             const Value& arguments) {
  const auto controlled = plan_.world ? project::test_control_of(name, *plan_.world) : std::nullopt;
  const auto service = services_.find(name);
  const idl::ServicePtr interface = controlled                   ? plan_.test_control
                                    : service != services_.end() ? service->second.service
                                                                 : nullptr;
  if (!interface)
    return mission::CallOutcome::failed(idl::CallErrorKind::kArguments,
                                        fmt::format("the run has no service \"{}\"", name));
  const auto found = idl::find_method(*interface, method, name);
  if (!found) return mission::CallOutcome::failed(idl::CallErrorKind::kArguments, found.error().message);
  const auto args = idl::conform_arguments(**found, arguments);
  if (!args) return mission::CallOutcome::failed(idl::CallErrorKind::kArguments, args.error().message);
  if (const auto checked = idl::check_ranges(**found, *args); !checked)
    return mission::CallOutcome::failed(idl::CallErrorKind::kArguments, checked.error().message);
  const std::string at = !controlled  ? service->second.at
                         : sim_       ? "sim"
                         : elsewhere_ ? elsewhere_->control_address(services_, name)
                                      : std::string();
  if ((*found)->oneway) {
    Message request;
    request.kind = MessageKind::kRequest;
    request.source = "scenario";
    request.target = name;
    request.name = fmt::format("{}.{}.request", name, method);
    request.call = publisher_.next_call();
    request.data = Map{{"args", *args}};
    stream_.publish(std::move(request));
    if (!controlled && is_published_only(service->second)) return mission::CallOutcome::returned();
  }
  if (at == "sim") return sim_->call(interface->name, method, *args, controlled ? *controlled : service->second.robot);
  if (at == "model") {
    mission::Call call{.run = 0,
                       .id = publisher_.next_call(),
                       .service = name,
                       .method = method,
                       .args = *args,
                       .sendid = {},
                       .session = {}};
    return model_of(name)->call(std::move(call), "scenario", kCallPatience);
  }
  // It has left the run already.
  if (is_again()) return mission::CallOutcome::returned();
  if (!elsewhere_)
    return mission::CallOutcome::failed(idl::CallErrorKind::kUnreachable,
                                        fmt::format("nothing in the run serves \"{}\"", name));
  return elsewhere_->call(at, interface, name, method, *args, kCallPatience);
}

bool Run::Impl::serves_control() const {
  return elsewhere_ && (!scenario_.virtual_time || options_.pace > 0 || options_.paused);
}

void Run::Impl::serve_control() {
  ControlHandler handler;
  handler.scenario = [this] { return scenario_.name; };
  handler.now = [this] { return scheduler_->now(); };
  handler.services = [this] {
    std::vector<ControlHandler::ServiceEntry> entries;
    for (const auto& [name, service] : services_)
      entries.push_back({name, service.service, service.observed.empty() ? service.at : service.observed});
    if (plan_.test_control && plan_.world) {
      for (const std::string& name : project::test_control_names(*plan_.world))
        entries.push_back({name, plan_.test_control, "sim"});
    }
    return entries;
  };
  handler.call = [this](const std::string& service, const std::string& method, const Value& arguments) {
    auto applied = steering_.apply_for(
        project::intervention::Call{.method = fmt::format("{}.{}", service, method), .args = arguments}, "control");
    if (applied) return std::move(applied->outcome);
    return mission::CallOutcome::failed(idl::CallErrorKind::kArguments, applied.error().message);
  };
  handler.tap = &tap_;
  handler.open_page = options_.open_page;
  elsewhere_->serve_control(std::move(handler));
}

}  // namespace sentree::runtime
