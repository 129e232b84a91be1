#include "sentree/replay/replay.h"

#include <algorithm>
#include <deque>
#include <map>
#include <set>
#include <utility>

#include <fmt/format.h>

#include "sentree/idl/conform.h"
#include "sentree/project/check_intervention.h"
#include "sentree/project/intervention.h"
#include "sentree/replay/behaviour.h"
#include "sentree/replay/detail/arrivals.h"
#include "sentree/replay/detail/at_rest.h"
#include "sentree/replay/detail/snapshot.h"
#include "sentree/replay/recording.h"
#include "sentree/runtime/local_skill.h"
#include "sentree/runtime/monitors.h"
#include "sentree/runtime/steering.h"
#include "sentree/sim/services.h"
#include "sentree/sim/simulation.h"
#include "sentree/text/json.h"

namespace sentree::replay {

namespace {

// A request of the recording with what came of it.
struct Exchange {
  TimePoint asked{};
  std::uint64_t tick = 0;         // of the root, when it was asked
  std::optional<Duration> after;  // nothing: it was never answered
  mission::CallOutcome outcome;
  bool used = false;
};

std::string key_of(std::string_view leaf, std::string_view service, std::string_view method, const Value& args) {
  std::string key;
  for (const std::string_view part : {leaf, service, method}) {
    key += part;
    key += '\n';
  }
  return key + to_json(args);
}

mission::CallOutcome outcome_of(const Message& message) {
  mission::CallOutcome outcome;
  if (const Value* result = message.data.find("result")) {
    outcome.ok = true;
    outcome.result = *result;
    return outcome;
  }
  // An outcome without `result` and without `kind` is that of a method that returns nothing.
  const Value* kind = message.data.find("kind");
  outcome.ok = kind == nullptr;
  if (kind != nullptr) outcome.kind = idl::parse_call_error_kind(kind->text());
  if (const Value* text = message.data.find("message")) outcome.message = text->text();
  if (const Value* exception = message.data.find("exception")) outcome.result = *exception;
  return outcome;
}

// What the replay itself has done to the world, to do it to a restored one.
struct Act {
  TimePoint time{};
  std::uint64_t sequence = 0;  // observations before it, its own included
  std::string interface;
  std::string method;
  std::string robot;
  Value args;
};

// Leaves in C++, whose results are nowhere but in their statuses.
std::set<std::string> nodes_in_cpp(const project::Plan& plan) {
  std::set<std::string> paths;
  for (bt::NodeId node = 0; node < plan.tree.size(); ++node) {
    if (plan.tree.is_user(node) && plan.tree.children(node).empty()) paths.insert(plan.tree.path(node));
  }
  return paths;
}

class Replay {
 public:
  Replay(RecordedRun& recorded, project::Plan plan, ReplayOptions options)
      : recorded_(recorded),
        plan_(std::move(plan)),
        options_(std::move(options)),
        then_behaviour_(nodes_in_cpp(plan_)),
        now_behaviour_(nodes_in_cpp(plan_)) {}

  Result<ReplayReport> run() {
    // Nothing of it can be gone on with at its end.
    if (options_.go_on_at == recorded_.ended()) options_.at = std::exchange(options_.go_on_at, std::nullopt);
    for (const auto& moment : {options_.at, options_.go_on_at}) {
      if (moment && *moment > recorded_.ended())
        return fail("replay.after-end", fmt::format("at that moment the run was over: it ended at {} s",
                                                    shortest_decimal(seconds(recorded_.ended()))));
    }
    if (!can_restore()) return run_recorded(std::nullopt, kNever);
    return recorded_.is_virtual() ? run_restored() : run_from_rest();
  }

 private:
  Result<ReplayReport> run_from_rest() {
    const TimePoint known = add_saturating(moment(), options_.go_on_at ? longest_answer() : kSnapshotPeriod);
    auto from = at_rest_before(recorded_, plan_, moment(), known);
    if (!from) return tl::unexpected(from.error());
    return run_recorded(std::move(*from), known);
  }

  // The recorded messages are executed again: from there on, or from the beginning; and those until `known` are.
  Result<ReplayReport> run_recorded(std::optional<AtRest> at_rest, TimePoint known) {
    if (options_.go_on_at && !plan_.world) {
      return fail("replay.no-simulator",
                  "from a moment on it is the simulated robot that answers, and the project has none: what its models "
                  "and components would have answered is not known. The whole recording can be replayed, and a run in "
                  "virtual time gone on with from any moment if its project is unchanged");
    }
    if (auto adapted = adapt(); !adapted) return tl::unexpected(adapted.error());
    auto messages =
        at_rest ? Result<std::vector<Message>>(std::move(at_rest->messages)) : recorded_.observations(known);
    if (!messages) return tl::unexpected(messages.error());
    for (Message& message : *messages) restore_numbers(plan_, message);
    remember(*messages, at_rest ? Arrivals::From::kMiddle : Arrivals::From::kBeginning);
    if (!recorded_.is_virtual() && recorded_.fact("ended_by") == "time limit") end_as_late_as(*messages);

    runtime::RunOptions options = std::move(options_.run);
    options.inject = false;
    // What the simulator published then is published again.
    for (project::ServiceEntry& service : plan_.scenario.project.services) service.publish.clear();
    // A recording in real time has ticks that were late, and lacks some.
    for (const Message& message : *messages) {
      if (message.name != "mission.tick") continue;
      options.tick_times.push_back(message.time);
      ticked_[message.tick] = message.time;
    }
    if (at_rest) {
      prepare_for_replay(at_rest->state, options.tick_times);
      report_.restored = at_rest->state.now;
      tick_ = at_rest->state.tick;
      options.from = &at_rest->state;
    }
    options.listeners.insert(options.listeners.begin(), [this](const Message& message) {
      now_behaviour_.observe(message);
      tick_ = message.tick;
      if (recorded_.is_virtual()) note_request(message);
      if (!recorded_.is_virtual() && message.kind == MessageKind::kRequest) arrivals_->published(message);
    });
    if (!recorded_.is_virtual()) {
      options.arrival = [this](std::size_t leaf, Arrivals::LeafMessage what) {
        if (report_.continued) return TimePoint{};
        return arrivals_->of(leaf, what, tick_, inside_->scheduler().now());
      };
      options.topic_arrival = [this](std::size_t leaf, const mission::Publication& what) {
        return report_.continued ? TimePoint{} : arrivals_->of_topic(leaf, what);
      };
      options.stop_arrival = [this] { return report_.continued ? TimePoint{} : arrivals_->of_stop(); };
      options.veto_arrival = [this](std::size_t leaf, const std::string& call) {
        return report_.continued ? TimePoint{} : arrivals_->of_veto(leaf, call);
      };
      options.timer_arrival = [this](std::size_t leaf, std::uint64_t number) {
        return report_.continued ? TimePoint{} : arrivals_->of_timer(leaf, number);
      };
    }
    options.make_port = [this](const project::ServicePlan& service, const std::string& leaf) {
      return is_live(service) ? nullptr : std::make_unique<Port>(*this, service, leaf);
    };
    options.on_begin = [this, next = std::move(options.on_begin)](runtime::RunInside& inside) {
      if (next) next(inside);
      begin(inside);
    };
    return execute(std::move(options));
  }

  class Port final : public runtime::ServicePort {
   public:
    Port(Replay& replay, const project::ServicePlan& service, std::string leaf)
        : replay_(replay), service_(service), leaf_(std::move(leaf)) {}
    bool take(std::size_t /*leaf*/, const mission::Shared<mission::Call>& call) override {
      call_ = call->id;
      return false;
    }
    void call(const idl::Method& method, Value args, Done done) override {
      replay_.call({service_, leaf_, method, call_}, std::move(args), std::move(done));
    }

   private:
    Replay& replay_;
    project::ServicePlan service_;
    std::string leaf_;
    std::uint64_t call_ = 0;  // the latest
  };

  struct Asked {
    const project::ServicePlan& service;
    const std::string& leaf;
    const idl::Method& method;
    std::uint64_t call = 0;
  };

  // The recorded run is one of this plan, and was a value at some of its moments.
  bool can_restore() const {
    return (options_.at || options_.go_on_at) && recorded_.fact("plan") == std::to_string(plan_.identity);
  }
  [[nodiscard]] TimePoint moment() const {
    return std::min(options_.at.value_or(kNever), options_.go_on_at.value_or(kNever));
  }

  // Until what was asked at a moment has been answered, or is late [run time].
  [[nodiscard]] Duration longest_answer() const {
    const project::Deadlines& deadlines = plan_.scenario.project.deadlines;
    const Duration longest =
        std::max({deadlines.call, deadlines.condition, deadlines.budget, deadlines.halt, deadlines.unresponsive});
    return kSnapshotPeriod +
           Duration(static_cast<std::int64_t>(static_cast<double>(longest.count()) * plan_.scenario.factor));
  }

  Result<ReplayReport> run_restored() {
    const TimePoint moment = this->moment();
    plan_.scenario.virtual_time = true;
    std::optional<mission::State> from;
    if (auto snapshot = recorded_.snapshot(moment); snapshot && *snapshot) {
      if (auto state = mission::restore(plan_, (*snapshot)->state)) from = std::move(*state);
    }
    report_.restored = from ? from->now : TimePoint{};
    tick_ = from ? from->tick : 0;
    const std::uint64_t before = from ? from->published : 0;
    auto read = recorded_.each(
        [&](Message message) {
          restore_numbers(plan_, message);
          if (message.sequence > before) then_behaviour_.observe(message);
          return true;
        },
        *report_.restored, moment);
    if (!read) return tl::unexpected(read.error());
    auto injections = recorded_.interventions(*report_.restored);
    if (!injections) return tl::unexpected(injections.error());
    std::erase_if(*injections, [&](const Message& message) { return message.sequence <= before; });

    runtime::RunOptions options = std::move(options_.run);
    options.inject = false;
    options.from = from ? &*from : nullptr;
    options.listeners.insert(options.listeners.begin(), [this, moment](const Message& message) {
      if (message.time <= moment) now_behaviour_.observe(message);
      tick_ = message.tick;
    });
    options.on_begin = [&, next = std::move(options.on_begin)](runtime::RunInside& inside) {
      if (next) next(inside);
      inside_ = &inside;
      for (const Message& injection : *injections) {
        const auto what = project::intervention_of(injection);
        if (!what || !check_intervention(*what, scope_of(plan_))) continue;
        inside.scheduler().at(
            inside.director(), injection.time, mission::Rank::kInjection, [&inside, what, &injection] {
              inside.inject({.at = injection.time, .what = *what, .source = injection.source, .span = {}});
            });
      }
      if (options_.go_on_at) {
        inside.scheduler().at(inside.director(), *options_.go_on_at, mission::Rank::kInjection,
                              [this] { report_.continued = true; });
      }
      if (options_.at) tell_moment_at(*options_.at);
    };
    return execute(std::move(options));
  }

  // The recorded project lies in a folder that is gone when one reads what it says of its files.
  ReplayReport execute(runtime::RunOptions options) {
    if (options.on_problem) {
      options.on_problem = [this, told = std::move(options.on_problem)](const std::string& what) {
        told(recorded_.named(what));
      };
    }
    if (options_.at == recorded_.ended()) {
      // It may be over before anything else can happen.
      options.on_view = [this, told = std::move(options.on_view)](runtime::RunView* view) {
        if (view == nullptr && !report_.moment) tell_end();
        if (told) told(view);
      };
    }
    runtime::Run run(plan_, std::move(options));
    report_.run = run.execute();
    for (auto* texts : {&report_.run.problems, &report_.run.given_up}) {
      for (std::string& text : *texts) text = recorded_.named(std::move(text));
    }
    for (std::string* text : {&report_.run.reason, &report_.run.error}) *text = recorded_.named(std::move(*text));
    for (runtime::MonitorReport& monitor : report_.run.monitors)
      monitor.failure = recorded_.named(std::move(monitor.failure));
    compare();
    return std::move(report_);
  }

  // Everything in this process, in virtual time.
  Result<void> adapt() {
    // Deadlines are wall time: in the recorded run they were this long in run time.
    const double factor = plan_.scenario.virtual_time ? 1.0 : plan_.scenario.factor;
    project::Deadlines& deadlines = plan_.scenario.project.deadlines;
    // Charts of the recording's own project answer as late as they did; changed ones may be quicker.
    const auto extracted = recorded_.extract();
    is_own_ = extracted && plan_.scenario.file == *extracted;
    for (Duration* deadline :
         {&deadlines.call, &deadlines.condition, &deadlines.budget, &deadlines.halt, &deadlines.unresponsive})
      *deadline = Duration(static_cast<std::int64_t>(static_cast<double>(deadline->count()) * factor));
    plan_.scenario.virtual_time = true;
    plan_.scenario.factor = 1.0;
    for (const project::ProcessEntry& entry : plan_.scenario.processes) {
      if (!entry.skill.empty()) process_skills_[entry.name] = entry.skill;
    }
    plan_.scenario.processes.clear();
    plan_.observers.clear();
    if (const std::string& by = plan_.scenario.project.executed_by; !by.empty())
      return fail("replay.foreign-mission",
                  fmt::format("the mission was executed by {}, not here; it can be looked at only", by));
    for (project::LeafPlan& leaf : plan_.leaves) {
      if (!leaf.chart) {
        return fail(
            "replay.foreign-skill",
            fmt::format("leaf \"{}\" runs a skill in another language, of which the project has no chart", leaf.name),
            plan_.tree.span(leaf.node));
      }
      leaf.at.clear();
    }
    for (const project::ModelPlan& model : plan_.models) models_.insert(model.name);
    // In real time what models answered is known, and what they said is said again. In virtual time they do it again:
    // where in an instant they did is in no recording.
    if (!recorded_.is_virtual()) plan_.models.clear();
    for (auto& [name, service] : plan_.services) {
      if (plan_.world && sim::find_service(service.interface) != nullptr && !is_live(service)) service.at = "sim";
    }
    return {};
  }

  // A model serves it, and is executed.
  [[nodiscard]] bool is_live(const project::ServicePlan& service) const {
    return service.at == "model" && recorded_.is_virtual();
  }

  // Said by a model that is executed, or by a call of one.
  [[nodiscard]] bool is_said_anew(const Message& message) const {
    if (models_.contains(message.source)) return recorded_.is_virtual();
    const auto service = plan_.services.find(message.target);
    return message.kind == MessageKind::kRequest && message.source == "scenario" && service != plan_.services.end() &&
           is_live(service->second);
  }

  // None of a recording that does not say where its skills ran.
  [[nodiscard]] std::set<std::size_t> leaves_that_tell_timers() const {
    std::set<std::size_t> leaves;
    const auto elsewhere = text::parse_json(recorded_.fact(kLeavesElsewhere));
    const List* const names = elsewhere ? elsewhere->as_list() : nullptr;
    if (names == nullptr || !recorded_.fact("durable").empty()) return leaves;
    for (std::size_t leaf = 0; leaf < plan_.leaves.size(); ++leaf) {
      if (std::find(names->begin(), names->end(), Value(plan_.leaves[leaf].name)) == names->end()) leaves.insert(leaf);
    }
    return leaves;
  }

  void remember(const std::vector<Message>& messages, Arrivals::From from) {
    std::map<std::uint64_t, Exchange*> open;  // by call
    std::set<std::string_view> leaves;
    for (const project::LeafPlan& leaf : plan_.leaves) leaves.insert(leaf.name);
    arrivals_.emplace(plan_, process_skills_,
                      is_own_ ? Arrivals::NeverCame::kDoesNotCome : Arrivals::NeverCame::kComesAtOnce,
                      leaves_that_tell_timers(), from);
    for (const Message& message : messages) {
      then_behaviour_.observe(message);
      const bool is_arrival = arrivals_->note(message);
      // Models, scenarios and components publish on topics; what leaves publish they publish again.
      if (is_said_anew(message)) continue;
      const bool is_published = message.kind == MessageKind::kRequest && plan_.services.contains(message.target) &&
                                !leaves.contains(message.source);
      if (message.name == "scenario.injection" || is_of_process(message) || tells_unreached(message) ||
          models_.contains(message.source) || is_published) {
        injections_.push_back(message);
        continue;
      }
      if (is_arrival) continue;
      const auto service = plan_.services.find(message.target);
      const Value* args = message.data.find("args");
      if (service == plan_.services.end() || args == nullptr) continue;
      if (message.kind == MessageKind::kRequest) {
        const std::string_view call = runtime::call_of(message);
        auto& exchanges = exchanges_[key_of(message.source, service->first, call.substr(call.rfind('.') + 1), *args)];
        exchanges.push_back({.asked = message.time, .tick = message.tick, .after = {}, .outcome = {}});
        open[message.call] = &exchanges.back();
        ++report_.recorded_requests;
      } else if (const auto found = open.find(message.call); found != open.end() && message.call != 0) {
        found->second->after = message.time - found->second->asked;
        found->second->outcome = outcome_of(message);
        open.erase(found);
      }
    }
  }

  // The time limit, which a late machine noticed later: when the mission began to halt.
  void end_as_late_as(const std::vector<Message>& messages) {
    Duration& limit = plan_.scenario.duration;
    const auto halts = [&](const Message& message) {
      return message.time >= TimePoint(limit) && message.source == "mission" &&
             (message.name.ends_with(".cancel") || message.name.ends_with(".halt.request"));
    };
    const auto first = std::find_if(messages.begin(), messages.end(), halts);
    limit = (first != messages.end() ? first->time : recorded_.ended()).time_since_epoch();
  }

  void begin(runtime::RunInside& inside) {
    inside_ = &inside;
    // What a late machine made of them is in what was answered, and when leaves took what was held back is recorded.
    if (!recorded_.is_virtual()) {
      // Those of durable runs, and older ones, do not say the latter.
      const bool tells = !recorded_.fact(kTellsDelays).empty() && recorded_.fact("durable").empty();
      inside.spare(tells ? runtime::Spared::kMessages : runtime::Spared::kCalls);
    }
    for (const Message& injection : injections_) {
      inside.scheduler().at(inside.director(), injection.time, mission::Rank::kInjection, [this, &injection] {
        const auto tick = ticked_.find(injection.tick);
        // What was said in the instant of a tick, and after it, is said after it again.
        if (models_.contains(injection.source) && tick != ticked_.end() && tick->second == injection.time)
          inside_->scheduler().at(inside_->director(), injection.time, mission::Rank::kTick,
                                  [this, &injection] { inject(injection); });
        else
          inject(injection);
      });
    }
    if (options_.go_on_at) {
      inside.scheduler().at(inside.director(), *options_.go_on_at, mission::Rank::kInjection, [this] {
        if (report_.unrecorded.empty()) go_on();
      });
    }
    if (options_.at) tell_moment_at(*options_.at);
    const TimePoint end = add_saturating(recorded_.ended(), Duration(1));
    inside.scheduler().at(inside.director(), end, mission::Rank::kInjection, [this] {
      if (!report_.continued) inside_->end();
    });
  }

  // What was done then is done again, except to what answers as recorded.
  void inject(const Message& injection) {
    if (tells_unreached(injection)) return fail_unreached(injection);
    if (is_of_process(injection)) {
      const Value* const process = injection.data.find("process");
      if (process == nullptr) return;
      const bool exited = injection.name == "process.exited";
      of_process(std::string(process->text()), [this, exited](runtime::SkillActor& skill) {
        const TimePoint now = inside_->scheduler().now();
        exited ? skill.kill(now) : skill.restart(now);
      });
      return;
    }
    const auto what = project::intervention_of(injection);
    const auto* call = what ? std::get_if<project::intervention::Call>(&*what) : nullptr;
    const auto* kill = what ? std::get_if<project::intervention::Kill>(&*what) : nullptr;
    if (what && (call == nullptr || calls_model(*call)) && check_intervention(*what, scope_of(plan_))) {
      inside_->inject({.at = injection.time, .what = *what, .source = injection.source, .span = {}});
      return;
    }
    Message message;
    message.source = injection.source;
    message.kind = injection.kind;
    if (injection.call != 0) message.call = inside_->next_call();
    message.target = injection.target;
    message.name = injection.name;
    message.data = injection.data;
    inside_->publish(std::move(message));
    if (kill != nullptr) {
      of_process(kill->part, [this](runtime::SkillActor& skill) { skill.kill(inside_->scheduler().now()); });
    }
    if (call != nullptr && plan_.world) call_again(call->method, call->args);
  }

  static bool is_of_process(const Message& message) {
    return message.source == "run" && (message.name == "process.exited" || message.name == "process.restarted");
  }

  // The leaf of a skill that was gone fails as it did then, and the chart that was at work has gone.
  void fail_unreached(const Message& told) {
    const auto leaf = std::find_if(plan_.leaves.begin(), plan_.leaves.end(),
                                   [&](const project::LeafPlan& each) { return each.name == told.target; });
    const Value* const reason = told.data.find("reason");
    if (leaf == plan_.leaves.end() || reason == nullptr) return;
    const auto index = static_cast<std::size_t>(leaf - plan_.leaves.begin());
    const auto unreached = arrivals_->of_unreached(index);
    if (!unreached) return;
    runtime::SkillActor* const skill = inside_->skill(index);
    if (unreached->was_at_work && skill != nullptr) {
      skill->kill(inside_->scheduler().now());
      skill->restart(inside_->scheduler().now());
    }
    inside_->scheduler().at(inside_->director(), unreached->known, mission::Rank::kMessage,
                            [this, index, why = std::string(reason->text())] { inside_->fail_leaf(index, why); });
  }

  // Only a model tells what comes of that.
  [[nodiscard]] bool calls_model(const project::intervention::Call& call) const {
    const auto service = plan_.services.find(call.method.substr(0, call.method.rfind('.')));
    return service != plan_.services.end() && is_live(service->second);
  }

  // Skills that ran in that process then; they run in this one now.
  void of_process(const std::string& process, const std::function<void(runtime::SkillActor&)>& act) {
    for (const std::size_t leaf : leaves_of_process(plan_, process_skills_, process)) {
      if (runtime::SkillActor* skill = inside_->skill(leaf)) act(*skill);
    }
  }

  void call_again(const std::string& call, const Value& args) {
    const auto dot = call.rfind('.');
    const std::string name = call.substr(0, dot);
    Act act{inside_->scheduler().now(), inside_->published(), {}, call.substr(dot + 1), {}, args};
    if (const auto robot = project::test_control_of(name, *plan_.world)) {
      act.interface = plan_.test_control ? plan_.test_control->name : "";
      act.robot = *robot;
    } else if (const auto service = plan_.services.find(name); service != plan_.services.end()) {
      act.interface = service->second.interface;
      act.robot = service->second.robot;
    }
    if (report_.continued)
      (void)inside_->sim()->call(act.interface, act.method, act.args, act.robot);
    else
      acts_.push_back(std::move(act));
  }

  Exchange* find(const std::string& key) {
    const auto found = exchanges_.find(key);
    if (found == exchanges_.end()) return nullptr;
    const TimePoint now = inside_->scheduler().now();
    const Duration tolerance = plan_.scenario.project.period * kReplayTicksMax;
    const auto distance = [now](const Exchange& e) { return e.asked > now ? e.asked - now : now - e.asked; };
    Exchange* best = nullptr;
    Exchange* used = nullptr;
    for (Exchange& exchange : found->second) {
      const std::uint64_t ticks = std::max(exchange.tick, tick_) - std::min(exchange.tick, tick_);
      // A late machine stretches time between ticks; a changed skill shifts ticks.
      if (distance(exchange) > tolerance && ticks > kReplayTicksMax) {
        if (exchange.asked > now) break;
        continue;
      }
      Exchange*& slot = exchange.used ? used : best;
      if (slot == nullptr || distance(exchange) < distance(*slot)) slot = &exchange;
    }
    // Real time misses periods, which virtual time does not: what was asked once then may be asked twice now.
    return best != nullptr || recorded_.is_virtual() ? best : used;
  }

  // In virtual time faults hold requests back again, and let some never leave.
  void note_request(const Message& message) {
    const Value* const args = message.data.find("args");
    if (report_.continued || message.kind != MessageKind::kRequest || args == nullptr) return;
    const std::string_view call = runtime::call_of(message);
    Exchange* const exchange = find(key_of(message.source, message.target, call.substr(call.rfind('.') + 1), *args));
    if (exchange == nullptr) return;
    if (!std::exchange(exchange->used, true)) ++report_.answered_requests;
    if (!is_live(plan_.services.at(message.target))) asked_[message.call] = exchange;
  }

  Exchange* exchange_of(const Asked& asked, const Value& args) {
    if (!recorded_.is_virtual()) return find(key_of(asked.leaf, asked.service.name, asked.method.name, args));
    const auto found = asked_.extract(asked.call);
    return found ? found.mapped() : nullptr;
  }

  void call(const Asked& asked, Value args, runtime::ServicePort::Done done) {
    const auto& [service, leaf, method, id] = asked;
    if (report_.continued) {
      answer_live(service, method, args, done);
      return;
    }
    Exchange* exchange = exchange_of(asked, args);
    if (method.oneway && (exchange == nullptr || !exchange->after || exchange->outcome.ok)) {
      // What nobody answers can be said anew as well.
      if (exchange != nullptr && !std::exchange(exchange->used, true)) ++report_.answered_requests;
      return done(mission::CallOutcome::returned());
    }
    const TimePoint now = inside_->scheduler().now();
    if (exchange == nullptr) {
      // Of the last moment of a run that was stopped in between not everything was done.
      const bool is_over = now > recorded_.ended() || (now == recorded_.ended() && !is_whole());
      if (is_over || !report_.unrecorded.empty()) return;
      report_.unrecorded = fmt::format("{} asks {}.{}({})", leaf, service.name, method.name, to_json(args));
      report_.unrecorded_at = now;
      if (options_.go_on && service.at == "sim" && inside_->sim() != nullptr) go_on();
      if (report_.continued)
        answer_live(service, method, args, done);
      else
        inside_->end();
      return;
    }
    if (exchange->outcome.kind != idl::CallErrorKind::kUnreachable)
      acts_.push_back({now, inside_->published(), service.interface, method.name, service.robot, std::move(args)});
    if (recorded_.is_virtual()) return answer_at_once(fmt::format("{}.{}", service.name, method.name), *exchange, done);
    const bool again = std::exchange(exchange->used, true);
    if (!again) ++report_.answered_requests;
    if (!exchange->after) return;
    // The request may have been late: its outcome comes when it came then.
    const TimePoint when = again ? now + *exchange->after : exchange->asked + *exchange->after;
    if (when <= now) {
      done(exchange->outcome);
      return;
    }
    inside_->scheduler().at(inside_->director(), when, mission::Rank::kMessage,
                            [done = std::move(done), outcome = exchange->outcome] { done(outcome); });
  }

  // What serves a skill in virtual time takes no time. Faults do, and they are put on this answer again; to falsify it
  // twice changes nothing.
  void answer_at_once(const std::string& call, const Exchange& exchange, const runtime::ServicePort::Done& done) {
    if (!exchange.after) return;
    if (exchange.outcome.kind != idl::CallErrorKind::kLate || !is_made_late(call)) return done(exchange.outcome);
    done(mission::CallOutcome::returned());  // what the fault keeps back
  }

  [[nodiscard]] bool is_made_late(const std::string& call) const {
    const auto standing = inside_->steering().standing();
    return std::any_of(standing.begin(), standing.end(), [&](const mission::StandingIntervention& each) {
      const auto* const late = std::get_if<project::intervention::Late>(&each.what);
      return late != nullptr && project::matches_pattern(late->call, call);
    });
  }

  void answer_live(const project::ServicePlan& service, const idl::Method& method, const Value& args,
                   const runtime::ServicePort::Done& done) {
    if (service.at != "sim") {
      done(mission::CallOutcome::failed(idl::CallErrorKind::kUnreachable,
                                        fmt::format("the replay has no \"{}\"", service.name)));
      return;
    }
    done(inside_->sim()->call(service.interface, method.name, args, service.robot));
  }

  // The world as it was at `now`: the last snapshot, and what was done to it since.
  sim::State world_at(TimePoint now) {
    sim::State state = sim::initial_state(*plan_.world, plan_.scenario.seed);
    TimePoint from{};
    std::uint64_t sequence = 0;
    if (auto snapshot = recorded_.snapshot(now); snapshot && *snapshot) {
      const Value* part = (*snapshot)->value.find("world");
      const auto whole = mission::saved_world((*snapshot)->state);
      const Value* world = whole ? &*whole : part;
      auto restored = world != nullptr ? sim::restore(*plan_.world, *world) : fail("replay.no-world", "");
      if (restored) {
        state = std::move(*restored);
        from = (*snapshot)->time;
        sequence = (*snapshot)->sequence;
      }
    }
    for (const Act& act : acts_) {
      const Map* args = act.args.as_map();
      if (args == nullptr || act.time < from || (act.time == from && act.sequence <= sequence)) continue;
      (void)sim::call(*plan_.world, state,
                      {.service = act.interface, .method = act.method, .args = *args, .robot = act.robot}, act.time);
    }
    sim::advance(*plan_.world, state, now);
    return state;
  }

  // By what executes it; in a recording of real time the simulator's answers are those of then.
  [[nodiscard]] bool is_world_restored() const { return report_.restored && recorded_.is_virtual(); }

  void go_on() {
    inside_->sim()->restore(world_at(inside_->scheduler().now()));
    inside_->spare(runtime::Spared::kNone);
    report_.continued = true;
  }

  void tell_moment_at(TimePoint at) {
    inside_->scheduler().at(inside_->director(), at + Duration(1), mission::Rank::kInjection,
                            [this] { tell_moment(); });
  }

  void tell_moment() {
    if (inside_->sim() != nullptr && !report_.continued && !is_world_restored())
      inside_->sim()->restore(world_at(inside_->scheduler().now()));
    take_snapshot(*inside_, plan_, [this](TimePoint, const Map& snapshot) {
      tell_moment(snapshot);
      inside_->end();
    });
  }

  void tell_end() {
    if (inside_ == nullptr) return;
    if (inside_->sim() != nullptr && !report_.continued && !is_world_restored())
      inside_->sim()->restore(world_at(recorded_.ended()));
    tell_moment(snapshot_of_end(*inside_, plan_));
  }

  void tell_moment(const Map& snapshot) {
    Map moment{{"time", seconds(*options_.at)}, {"tick", static_cast<std::int64_t>(tick_)}};
    Map nodes;
    for (bt::NodeId node = 0; node < plan_.tree.size(); ++node) {
      const bt::Status status = inside_->mission().state().tree.status(node);
      if (status != bt::Status::kIdle) nodes.append(plan_.tree.path(node), bt::to_string(status));
    }
    moment["nodes"] = std::move(nodes);
    for (const auto& [key, value] : snapshot) moment[key] = value;
    for (const project::LeafPlan& leaf : plan_.leaves) {
      Value* saved = moment["skills"].as_map()->find(leaf.name);
      const Value* saved_session = saved != nullptr ? saved->find("session") : nullptr;
      const auto session =
          saved_session != nullptr ? scxml::restore(*leaf.chart, *saved_session) : fail("replay.no-session", "");
      if (!session) continue;
      List states;
      for (std::string& id : session->active_ids(*leaf.chart)) states.emplace_back(std::move(id));
      (*saved->as_map())["states"] = std::move(states);
      (*saved->as_map())["data"] = session->data(*leaf.chart);
    }
    for (std::size_t i = 0; i < plan_.monitors.size(); ++i) {
      const monitor::State* state = inside_->monitors().state(i);
      Value* saved = moment["monitors"].as_map()->find(plan_.monitors[i].name());
      if (state == nullptr || saved == nullptr || state->verdict != monitor::Verdict::kUndecided) continue;
      (*saved->as_map())["standing"] = monitor::standing(plan_.monitors[i], *state).text();
    }
    report_.moment = std::move(moment);
  }

  // A run that was stopped in between halted its leaves at a moment that the replay does not know.
  [[nodiscard]] bool is_whole() const {
    const std::string ended_by = recorded_.fact("ended_by");
    return !ended_by.empty() && ended_by != "interrupt" && ended_by != "error";
  }

  void compare() {
    const bool is_before_end = report_.moment && *options_.at < recorded_.ended();
    const TimePoint until = !report_.unrecorded.empty() ? report_.unrecorded_at
                            : is_before_end             ? *options_.at
                            : options_.go_on_at         ? *options_.go_on_at - Duration(1)
                            : is_whole()                ? kNever
                                                        : recorded_.ended() - std::chrono::seconds(1);
    report_.differences = differences(then_behaviour_, now_behaviour_,
                                      recorded_.is_virtual() ? Compared::kOrderAndTick : Compared::kOrder, until);
    if (report_.differences.size() > kDifferencesMax) report_.differences.resize(kDifferencesMax);
  }

  RecordedRun& recorded_;
  project::Plan plan_;
  ReplayOptions options_;
  ReplayReport report_;
  runtime::RunInside* inside_ = nullptr;
  std::map<std::string, std::deque<Exchange>> exchanges_;
  std::map<std::uint64_t, Exchange*> asked_;  // in virtual time, by call: requests that have not reached their service
  std::vector<Message> injections_;
  std::map<std::uint64_t, TimePoint> ticked_;  // when, by tick of the root
  std::set<std::string> models_;               // names of those of the recorded run
  ProcessSkills process_skills_;
  std::vector<Act> acts_;
  std::optional<Arrivals> arrivals_;
  std::uint64_t tick_ = 0;  // of the root, the latest
  bool is_own_ = false;     // the plan is that of the recording
  Behaviour then_behaviour_;
  Behaviour now_behaviour_;
};

}  // namespace

Result<ReplayReport> replay(RecordedRun& recorded, project::Plan plan, ReplayOptions options) {
  if (const std::string first = recorded.begun_in(); !first.empty()) {
    return fail(
        "replay.continued",
        fmt::format("{}: this run was resumed in the middle of its mission; replay {}, in which it began, up to "
                    "where its executive died",
                    recorded.path(), first));
  }
  return Replay(recorded, std::move(plan), std::move(options)).run();
}

}  // namespace sentree::replay
