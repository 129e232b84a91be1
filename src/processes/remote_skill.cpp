#include "sentree/processes/remote_skill.h"

#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <future>
#include <optional>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "sentree/base/assert.h"
#include "sentree/idl/conform.h"
#include "sentree/mission/memory_elsewhere.h"
#include "sentree/processes/detail/memory_client.h"
#include "sentree/processes/detail/observation_socket.h"
#include "sentree/processes/detail/remote_chart.h"
#include "sentree/processes/environment.h"
#include "sentree/processes/remote_service.h"
#include "sentree/processes/wire_message.h"
#include "sentree/project/project.h"
#include "sentree/rpc/client.h"
#include "sentree/rpc/middleware.h"
#include "sentree/runtime/monitors.h"
#include "sentree/text/file.h"
#include "sentree/text/json.h"

namespace sentree::processes {

using runtime::LeafReplies;
using runtime::Publisher;
using runtime::Scheduler;
using runtime::ServicePort;
using runtime::SkillActor;
using runtime::StandingFaults;
using runtime::Stream;
using runtime::Watchdog;

namespace {

Result<idl::ServicePtr> shipped_interface(const std::string& file, std::string_view service) {
  const auto source = text::read_file(project::shipped_folder("interfaces") / file, file);
  if (!source) return tl::unexpected(source.error());
  const auto schema = idl::Schema::load(*source, file);
  if (!schema.value) return tl::unexpected(schema.diagnostics.front());
  return idl::find_service(*schema.value, service);
}

class RemoteSkill final : public RemoteLeafDriver {
 public:
  RemoteSkill(std::unique_ptr<rpc::Caller> client, RemoteSkillOptions options, LeafReplies replies)
      : options_(std::move(options)),
        replies_(std::move(replies)),
        memory_(options_.address, options_.memory_interface),
        client_(std::move(client)) {}

  void tick(mission::TickSkill what, TimePoint /*asked*/) override {
    const std::uint64_t tick = what.tick;
    if (what.started) ++run_;
    Value request = Map{{"leaf", options_.leaf},
                        {"run", static_cast<std::int64_t>(run_)},
                        {"tick", static_cast<std::int64_t>(tick)},
                        {"inputs", to_json(Value(std::move(what.inputs)))}};
    client_->call("tick", Map{{"tick", std::move(request)}}, within(options_.tick_deadline),
                  [this, tick](const rpc::Outcome& reply) {
                    if (closed_) return;
                    if (!reply) {
                      replies_.problem(fmt::format("{}: {}", options_.leaf, reply.error().message));
                      replies_.unreachable(tick, reply.error().message);
                      return;
                    }
                    const Value* status = reply->find("status");
                    replies_.answered(tick,
                                      bt::parse_status(status ? status->text() : "").value_or(bt::Status::kFailure),
                                      json_object(reply->find("outputs")));
                  });
  }

  void halt(TimePoint /*asked*/) override {
    ask_halt(arguments(), std::chrono::steady_clock::now() + options_.halt_deadline);
  }

  void cancel(TimePoint /*asked*/) override {
    ++cancels_;
    client_->call("cancel", arguments(), within(options_.tick_deadline), [this](const rpc::Outcome&) { --cancels_; });
  }

  // Nobody waits for the answer to a cancellation but this.
  void remember(std::function<void(runtime::ToldMemory)> told) override {
    using Kind = runtime::ToldMemory::Kind;
    if (cancels_ > 0) return told({Kind::kNotNow, {}});
    if (!options_.memory_interface) return told({Kind::kNever, {}});
    memory_.ask(Map{{"leaf", options_.leaf}}, std::move(told));
  }

  // What is in flight fails now, and that is nobody's problem.
  void close() override {
    closed_ = true;
    memory_.close();
    client_->end();
  }

 private:
  static rpc::Deadline within(Duration time) { return std::chrono::steady_clock::now() + time; }
  [[nodiscard]] Value arguments() const {
    return Map{{"leaf", options_.leaf}, {"run", static_cast<std::int64_t>(run_)}};
  }

  // The skill says within each call whether it has halted; the deadline bounds how often it is asked.
  void ask_halt(const Value& args, rpc::Deadline until) {
    client_->call("halt", args, until, [this, args, until](const rpc::Outcome& reply) {
      if (closed_) return;
      const Value* halted = reply ? reply->find("halted") : nullptr;
      if (!reply) replies_.problem(fmt::format("{}: halt: {}", options_.leaf, reply.error().message));
      if (!reply || (halted != nullptr && halted->as_bool() != nullptr && *halted->as_bool())) return replies_.halted();
      if (std::chrono::steady_clock::now() < until) return ask_halt(args, until);
      replies_.problem(options_.leaf + " did not halt in time and was cancelled");
      client_->call("cancel", args, within(options_.tick_deadline), [this](const rpc::Outcome&) {
        if (!closed_) replies_.halted();
      });
    });
  }

  const RemoteSkillOptions options_;
  const LeafReplies replies_;
  // A skill outlives missions, whose runs of it it tells apart by number. Numbers are exact in JavaScript, too.
  std::uint64_t run_ = static_cast<std::uint64_t>(
      std::chrono::floor<std::chrono::microseconds>(std::chrono::system_clock::now().time_since_epoch()).count());
  std::atomic<bool> closed_ = false;
  std::atomic<int> cancels_ = 0;  // not yet answered
  MemoryClient memory_;
  const std::unique_ptr<rpc::Caller> client_;  // last: its thread uses the others
};

List to_list(const std::vector<std::string>& texts) { return {texts.begin(), texts.end()}; }

// A run that ends answers nobody; its skills do not wait longer than this.
constexpr std::chrono::seconds kGatePatience{5};

Value to_verdict(const mission::Admission& admission) {
  const bool accept = !admission.veto;
  return Map{
      {"accept", accept}, {"reason", accept ? "" : admission.veto->reason}, {"by", accept ? "" : admission.veto->by}};
}

class RemotePublisher final : public Publisher {
 public:
  /// @param outbox  The short way to a run on the same machine, or null.
  RemotePublisher(std::unique_ptr<rpc::Client> client, std::unique_ptr<ObservationOutbox> outbox,
                  std::uint64_t calls_from, std::function<void(const std::string&)> problem)
      : client_(std::move(client)), outbox_(std::move(outbox)), calls_(calls_from), problem_(std::move(problem)) {}

  void publish(Message message) override {
    if (outbox_ != nullptr && outbox_->send(message)) return;
    const auto published = observe(message);
    if (published) {
      tell_losses(message.source);
      return;
    }
    {
      const std::lock_guard lock(losses_mutex_);
      if (lost_++ == 0) first_lost_ = message.name;
    }
    problem_(fmt::format("an observation was lost ({}): {}", message.name, published.error().message));
  }

  // What may be refused is asked for; a request that nobody there has seen is not sent.
  std::optional<mission::Admission> request(Message message, Stream::Decided) override {
    if (outbox_ != nullptr && !may_be_gated(runtime::call_of(message)) && outbox_->send(message))
      return mission::Admission{};
    const auto verdict = observe(message);
    if (!verdict)
      return mission::Admission{
          mission::Veto{"", "the run that gates this skill cannot be asked: " + verdict.error().message}};
    const Value* accept = verdict->find("accept");
    if (accept == nullptr || accept->as_bool() == nullptr || *accept->as_bool()) return mission::Admission{};
    return mission::Admission{mission::Veto{text_of(*verdict, "by"), text_of(*verdict, "reason")}};
  }

  std::uint64_t next_call() override { return ++calls_; }

 private:
  bool may_be_gated(std::string_view call) {
    const std::lock_guard lock(gates_mutex_);
    if (!gates_) {
      const auto info = client_->call("info", Map(), std::chrono::steady_clock::now() + std::chrono::seconds(1));
      const Value* gates = info ? info->find("gates") : nullptr;
      if (gates == nullptr || gates->as_list() == nullptr) return true;
      gates_ = *gates->as_list();
    }
    return std::any_of(gates_->begin(), gates_->end(),
                       [&](const Value& pattern) { return project::matches_pattern(pattern.text(), call); });
  }

  // The run cannot know what did not reach it.
  void tell_losses(const std::string& source) {
    Message message;
    std::uint64_t told = 0;
    {
      const std::lock_guard lock(losses_mutex_);
      if (lost_ == 0) return;
      told = std::exchange(lost_, 0);
      message.data = Map{{"count", static_cast<std::int64_t>(told)}, {"first", first_lost_}};
    }
    message.source = source;
    message.name = "observer.lost";
    if (observe(message)) return;
    const std::lock_guard lock(losses_mutex_);
    lost_ += told;
  }

  rpc::Outcome observe(const Message& message) {
    return client_->call("observe", Map{{"message", to_wire(message)}},
                         std::chrono::steady_clock::now() + std::chrono::seconds(1));
  }

  std::unique_ptr<rpc::Client> client_;
  const std::unique_ptr<ObservationOutbox> outbox_;
  std::mutex gates_mutex_;
  std::optional<List> gates_;  // of the run; they do not change while it lasts
  std::atomic<std::uint64_t> calls_;
  std::function<void(const std::string&)> problem_;
  // Of the skill's actors, which may be several.
  std::mutex losses_mutex_;
  std::uint64_t lost_ = 0;
  std::string first_lost_;
};

class SilentPublisher final : public Publisher {
 public:
  void publish(Message) override {}
  std::optional<mission::Admission> request(Message, Stream::Decided) override { return mission::Admission{}; }
  std::uint64_t next_call() override { return ++calls_; }

 private:
  std::atomic<std::uint64_t> calls_ = 0;
};

// One leaf that a skill server runs: an actor, and the answers that its caller waits for.
struct ServedLeaf {
  std::unique_ptr<SkillActor> actor;
  std::mutex mutex;
  std::condition_variable changed;
  std::uint64_t run = 0;
  std::uint64_t tick = 0;           // number of the tick that is to be answered
  std::optional<rpc::Reply> reply;  // to it
  bool given_up = false;
  std::uint64_t halts_asked = 0;
  std::uint64_t halts_done = 0;
};

class SkillService final : public rpc::Service {
 public:
  SkillService(const project::SkillPlan& plan, idl::ServicePtr interface, Publisher& publisher, Scheduler& scheduler,
               SkillServerOptions options)
      : plan_(plan),
        interface_(std::move(interface)),
        publisher_(publisher),
        scheduler_(scheduler),
        options_(std::move(options)),
        standing_(options_.delays) {
    open_ports();
  }

  const idl::Service& interface() const override { return *interface_; }

  rpc::Outcome call(const idl::Method& method, const Value& arguments) override {
    const auto answer = std::make_shared<std::promise<rpc::Outcome>>();
    serve(method, arguments,
          rpc::Reply([answer](rpc::Outcome outcome, bool) { answer->set_value(std::move(outcome)); }));
    // A condition may take as long as its deadline, which the caller keeps; this bounds a caller that is gone.
    auto given = answer->get_future();
    if (given.wait_for(plan_.deadlines.unresponsive) == std::future_status::ready) return given.get();
    return refused("the skill did not answer in time");
  }

  void serve(const idl::Method& method, const Value& arguments, const rpc::Reply& reply) override {
    if (method.name == "info") {
      return reply.give(
          Value(Map{{"name", plan_.id}, {"pid", static_cast<std::int64_t>(getpid())}, {"condition", plan_.condition}}));
    }
    if (method.name == "reset") {
      const std::lock_guard lock(mutex_);
      for (auto& [name, leaf] : leaves_) leaf->actor->cancel(kNever);
      return reply.give(Value());
    }
    if (method.name == "step") return reply.give(charts_.step(arguments));
    if (method.name == "remember") return serve_memory(text_of(arguments, "leaf"), reply);
    if (method.service == "SkillRequest") return serve_plain(method.name, reply);
    const Value* tick = arguments.find("tick");
    ServedLeaf* leaf = find(text_of(tick != nullptr ? *tick : arguments, "leaf"));
    if (leaf == nullptr) return reply.give(refused(fmt::format("runs {} leaves already", kServedLeavesMax)));
    if (method.name == "tick") return serve_tick(*leaf, *tick, reply);
    if (method.name == "halt") return reply.give(serve_halt(*leaf));
    leaf->actor->cancel(kNever);
    end_tick(*leaf);
    reply.give(Value());
  }

 private:
  static rpc::Outcome refused(std::string why) {
    return tl::unexpected(rpc::CallError{rpc::CallErrorKind::kProtocol, std::move(why), {}, {}});
  }

  ServedLeaf* find(const std::string& name) {
    const std::lock_guard lock(mutex_);
    auto& slot = leaves_[name];
    if (slot) return slot.get();
    if (leaves_.size() > kServedLeavesMax) {
      leaves_.erase(name);
      return nullptr;
    }
    slot = std::make_unique<ServedLeaf>();
    ServedLeaf& leaf = *slot;
    SkillActor::Replies replies;
    replies.answered = [&leaf](std::uint64_t tick, bt::Status status, const Map& outputs) {
      std::optional<rpc::Reply> reply;
      bool given_up = false;
      {
        const std::lock_guard leaf_lock(leaf.mutex);
        if (leaf.tick == tick) reply = std::exchange(leaf.reply, std::nullopt);
        given_up = leaf.given_up;
      }
      if (!reply) return;
      Value answer = Map{{"status", to_string(status)}, {"outputs", to_json(Value(outputs))}};
      // The thread that hangs in the skill may be the one that reads the connection.
      if (given_up)
        reply->give_last(std::move(answer));
      else
        reply->give(std::move(answer));
    };
    replies.halted = [&leaf] {
      const std::lock_guard leaf_lock(leaf.mutex);
      leaf.halts_done = leaf.halts_asked;
      leaf.changed.notify_all();
    };
    replies.problem = options_.problem;
    replies.given_up = [this, &leaf](const std::string& why) {
      {
        const std::lock_guard leaf_lock(leaf.mutex);
        leaf.given_up = true;
      }
      options_.problem(why);
    };
    replies.log = [this, name](const scxml::LogLine& line) { options_.log(name, line); };
    const auto stretched = [this](Duration wall) {
      return Duration(static_cast<std::int64_t>(static_cast<double>(wall.count()) * options_.factor));
    };
    leaf.actor = std::make_unique<SkillActor>(
        mission::SkillModel{.name = name,
                            .condition = plan_.condition,
                            .halt_deadline = stretched(plan_.deadlines.halt),
                            .seed = options_.seed,
                            .chart = plan_.chart,
                            .services = &plan_.services,
                            .constants = project::initial_data(plan_.constants),
                            .protocol = plan_.protocol},
        0,
        SkillActor::Surroundings{.publisher = publisher_,
                                 .scheduler = scheduler_,
                                 .faults = standing_,
                                 .watchdog = &watchdog_,
                                 .make_port = [this](const project::ServicePlan& service) { return port(service); }},
        std::move(replies));
    return &leaf;
  }

  // So that the first call of the first leaf does not pay for connecting.
  void open_ports() {
    for (const scxml::SendInfo& send : scxml::sends_with_invoked(plan_.chart)) {
      if (send.type != "thrift" || !send.target) continue;
      const auto service = plan_.services.find(*send.target);
      if (service == plan_.services.end() || project::is_inside(service->second.at)) continue;
      const auto [opened, is_new] = opened_.try_emplace(service->first);
      if (!is_new) continue;
      opened->second = port(service->second);
      opened->second->open([] {});
    }
  }

  std::unique_ptr<ServicePort> port(const project::ServicePlan& service) {
    {
      const std::lock_guard lock(mutex_);
      if (const auto opened = opened_.find(service.name); opened != opened_.end() && opened->second)
        return std::exchange(opened->second, nullptr);
    }
    if (service.at == "topics") return runtime::make_topic_port();
    auto address = rpc::Address::parse(service.at);
    SENTREE_ASSERT(address.has_value());  // checked when the plan was prepared
    auto made = make_remote_port(*address, service.service, service.name, plan_.deadlines.call);
    SENTREE_ASSERT(made.has_value());
    return std::move(*made);
  }

  void serve_memory(const std::string& name, const rpc::Reply& reply) {
    SkillActor* actor = nullptr;
    {
      const std::lock_guard lock(mutex_);
      if (const auto leaf = leaves_.find(name); leaf != leaves_.end()) actor = leaf->second->actor.get();
    }
    if (actor == nullptr) return reply.give(octets_of(mission::remember(plan_.chart, {}, scheduler_.now())));
    actor->inspect([this, reply](const runtime::Skill* skill) {
      if (skill == nullptr) return reply.give(Value(Bytes()));
      reply.give(octets_of(mission::remember(plan_.chart, skill->state, scheduler_.now())));
    });
  }

  // The chart runs in this thread, as far as it can go on at once; whoever lets it go on later gives the answer.
  void serve_tick(ServedLeaf& leaf, const Value& request, const rpc::Reply& reply) {
    const std::uint64_t number = number_of(request, "tick");
    const std::uint64_t run = number_of(request, "run");
    std::optional<rpc::Reply> overtaken;
    bool started = false;
    {
      const std::lock_guard lock(leaf.mutex);
      started = leaf.run != run;
      leaf.run = run;
      leaf.tick = number;
      overtaken = std::exchange(leaf.reply, reply);
    }
    // When the mission published it is not known here, so the order is not told.
    leaf.actor->tick({number, started, json_object(request.find("inputs"))}, kNever);
  }

  // Of who knows neither leaves nor runs.
  void serve_plain(const std::string& method, const rpc::Reply& reply) {
    ServedLeaf* const leaf = find(plan_.id);
    if (leaf == nullptr) return reply.give(refused(fmt::format("runs {} leaves already", kServedLeavesMax)));
    const bool wants_status = method == "request_ack" || method == "request_tick";
    if (method == "send_stop" || method == "request_halt") {
      {
        const std::lock_guard lock(plain_.mutex);
        plain_.status = "SKILL_IDLE";
      }
      const rpc::Outcome halted = serve_halt(*leaf);
      return reply.give(halted ? rpc::Outcome(Value()) : halted);
    }
    std::int64_t run = 0;
    std::int64_t tick = 0;
    if (!plan_.without.empty() && !plain_.told_inputs.exchange(true) && options_.problem) {
      options_.problem(
          fmt::format("{} is ticked by who gives it no inputs, and the tree gives no constant for {}: give "
                      "it one there, under skills: as data:, or in the chart",
                      plan_.id, fmt::join(plan_.without, ", ")));
    }
    {
      const std::lock_guard lock(plain_.mutex);
      const bool starts = method == "send_start" || method == "request_tick";
      const bool is_over = plain_.status == "SKILL_SUCCESS" || plain_.status == "SKILL_FAILURE";
      // What was not asked for yet is told before anything new begins.
      const bool is_told = is_over && wants_status;
      if (is_told || (plain_.status == "SKILL_IDLE" && !starts) ||
          (plain_.status == "SKILL_RUNNING" && !wants_status)) {
        Value status =
            wants_status ? Value(is_told ? std::exchange(plain_.status, "SKILL_IDLE") : plain_.status) : Value();
        return reply.give(std::move(status));
      }
      if (plain_.status != "SKILL_RUNNING") ++plain_.run;
      plain_.status = "SKILL_RUNNING";
      run = plain_.run;
      tick = ++plain_.tick;
    }
    const rpc::Reply answered([this, reply, run, wants_status](rpc::Outcome outcome, bool is_last) {
      const Value* const status = outcome ? outcome->find("status") : nullptr;
      std::string told = status != nullptr ? fmt::format("SKILL_{}", status->text()) : "SKILL_FAILURE";
      {
        const std::lock_guard lock(plain_.mutex);
        const bool is_running = told == "SKILL_RUNNING";
        // Halted meanwhile, perhaps started anew.
        if (plain_.run == run && plain_.status == "SKILL_RUNNING" && !is_running)
          plain_.status = wants_status ? "SKILL_IDLE" : told;
      }
      Value answer = wants_status ? Value(std::move(told)) : Value();
      is_last ? reply.give_last(std::move(answer)) : reply.give(std::move(answer));
    });
    serve_tick(*leaf, Map{{"leaf", plan_.id}, {"run", run}, {"tick", tick}, {"inputs", to_json(Value(plan_.inputs))}},
               answered);
  }

  // A tick that a halt or a cancellation has made void is not answered by the skill any more.
  static void end_tick(ServedLeaf& leaf) {
    std::optional<rpc::Reply> open;
    {
      const std::lock_guard lock(leaf.mutex);
      open = std::exchange(leaf.reply, std::nullopt);
    }
    if (open) open->give(Map{{"status", to_string(bt::Status::kIdle)}, {"outputs", "{}"}});
  }

  rpc::Outcome serve_halt(ServedLeaf& leaf) {
    end_tick(leaf);
    std::unique_lock lock(leaf.mutex);
    const bool asked_already = leaf.halts_asked != leaf.halts_done;
    if (!asked_already) ++leaf.halts_asked;
    lock.unlock();
    if (!asked_already) leaf.actor->halt(kNever);  // in another process nobody replays that
    lock.lock();
    leaf.changed.wait_for(lock, std::chrono::milliseconds(100), [&] { return leaf.halts_done == leaf.halts_asked; });
    return Value(Map{{"halted", leaf.halts_done == leaf.halts_asked}});
  }

  const project::SkillPlan& plan_;
  idl::ServicePtr interface_;
  Publisher& publisher_;
  Scheduler& scheduler_;
  SkillServerOptions options_;
  StandingFaults standing_;
  Watchdog watchdog_{plan_.deadlines.script};
  ChartServer charts_{plan_};
  std::mutex mutex_;
  std::map<std::string, std::unique_ptr<ServedLeaf>> leaves_;
  std::map<std::string, std::unique_ptr<ServicePort>> opened_;  // by service; null: a leaf has it
  // Of the leaf that is ticked without a name.
  struct Plain {
    std::mutex mutex;
    std::string status = "SKILL_IDLE";
    std::int64_t run = 0;
    std::int64_t tick = 0;
    std::atomic<bool> told_inputs{false};
  } plain_;
};

}  // namespace

Result<idl::ServicePtr> skill_interface() { return shipped_interface("skill.thrift", "Skill"); }
Result<idl::ServicePtr> served_skill_interface() { return shipped_interface("skill.thrift", "KeptSkill"); }
Result<idl::ServicePtr> kept_simulation_interface() { return shipped_interface("robot.thrift", "KeptSimulation"); }
Result<idl::ServicePtr> observer_interface() { return shipped_interface("observer.thrift", "Observer"); }
Result<idl::ServicePtr> kept_observer_interface() { return shipped_interface("observer.thrift", "KeptObserver"); }

Result<std::unique_ptr<RemoteLeafDriver>> make_remote_skill(RemoteSkillOptions options, LeafReplies replies) {
  rpc::ClientOptions client_options;
  client_options.target = options.leaf;
  client_options.tls = environment_tls();
  auto client = rpc::connect(options.address, options.interface, std::move(client_options));
  if (!client) return tl::unexpected(client.error());
  return std::unique_ptr<RemoteLeafDriver>(
      std::make_unique<RemoteSkill>(std::move(*client), std::move(options), std::move(replies)));
}

std::shared_ptr<rpc::Service> make_observer_service(idl::ServicePtr interface, Publisher& publisher) {
  return std::make_shared<rpc::FunctionService>(
      std::move(interface), [&publisher](const idl::Method& method, const Value& arguments) -> rpc::Outcome {
        if (method.name == "info") {
          return Value(Map{{"name", "run"},
                           {"pid", static_cast<std::int64_t>(getpid())},
                           {"observes", List{"*"}},
                           {"gates", to_list(publisher.gates())}});
        }
        if (method.name == "finish") return to_verdict({});
        Message message = from_wire(*arguments.find("message"));
        if (message.kind != MessageKind::kRequest) {
          publisher.publish(std::move(message));
          return to_verdict({});
        }
        // The publisher keeps the deadline of a gate.
        const auto decision = std::make_shared<std::promise<mission::Admission>>();
        std::future<mission::Admission> decided = decision->get_future();
        if (const auto admission = publisher.request(
                std::move(message), [decision](mission::Admission made) { decision->set_value(std::move(made)); })) {
          return to_verdict(*admission);
        }
        if (decided.wait_for(kGatePatience) != std::future_status::ready)
          return to_verdict({mission::Veto{"", "the run is ending"}});
        return to_verdict(decided.get());
      });
}

Result<std::unique_ptr<Publisher>> make_remote_publisher(const rpc::Address& observer, idl::ServicePtr interface,
                                                         std::string_view self,
                                                         std::function<void(const std::string&)> problem) {
  rpc::ClientOptions options;
  options.target = "observer";
  options.tls = environment_tls();
  auto client = rpc::Client::remote(observer, std::move(interface), std::move(options));
  if (!client) return tl::unexpected(client.error());
  // Call numbers join request and reply in one run; each process draws from a range of its own.
  const std::uint64_t from = (hash_bytes(self) % 0xFFFFU + 1) * runtime::kCallsElsewhere;
  auto outbox = observer.kind == rpc::Address::Kind::kUnix ? ObservationOutbox::connect(observation_path(observer.path))
                                                           : nullptr;
  return std::unique_ptr<Publisher>(
      std::make_unique<RemotePublisher>(std::move(*client), std::move(outbox), from, std::move(problem)));
}

std::unique_ptr<Publisher> make_silent_publisher() { return std::make_unique<SilentPublisher>(); }

std::shared_ptr<rpc::Service> make_skill_service(const project::SkillPlan& plan, idl::ServicePtr interface,
                                                 Publisher& publisher, Scheduler& scheduler,
                                                 SkillServerOptions options) {
  return std::make_shared<SkillService>(plan, std::move(interface), publisher, scheduler, std::move(options));
}

}  // namespace sentree::processes
