#include "sentree/runtime/replay.h"

#include <algorithm>
#include <deque>
#include <map>

#include "sentree/idl/conform.h"
#include "sentree/runtime/behaviour.h"
#include "sentree/runtime/check_intervention.h"
#include "sentree/runtime/intervention.h"
#include "sentree/runtime/local_skill.h"
#include "sentree/runtime/monitors.h"
#include "sentree/sim/services.h"
#include "sentree/sim/simulation.h"

namespace sentree::runtime {

namespace {

// A request of the recording with what came of it.
struct Exchange {
  TimePoint asked{};
  std::optional<Duration> after;  // nothing: it was never answered
  CallOutcome outcome;
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

CallOutcome outcome_of(const Message& message) {
  CallOutcome outcome;
  if (const Value* result = message.data.find("result")) {
    outcome.ok = true;
    outcome.result = *result;
    return outcome;
  }
  // An outcome without `result` and without `kind` is that of a method that returns nothing.
  const Value* kind = message.data.find("kind");
  outcome.ok = kind == nullptr;
  if (kind != nullptr) outcome.kind = kind->text();
  if (const Value* text = message.data.find("message")) outcome.message = text->text();
  return outcome;
}

// What the replay itself has done to the world, to do it to a restored one.
struct Act {
  TimePoint time{};
  std::string interface;
  std::string method;
  std::string robot;
  Value args;
};

class Replay {
 public:
  Replay(RecordedRun& recorded, Plan plan, ReplayOptions options)
      : recorded_(recorded), plan_(std::move(plan)), options_(std::move(options)) {}

  Result<ReplayReport> run() {
    if (auto adapted = adapt(); !adapted) return tl::unexpected(adapted.error());
    auto messages = recorded_.observations();
    if (!messages) return tl::unexpected(messages.error());
    for (Message& message : *messages) restore_numbers(plan_, message);
    remember(*messages);

    RunOptions options = std::move(options_.run);
    options.inject = false;
    // A recording in real time has ticks that were late, and lacks some.
    for (const Message& message : *messages) {
      if (message.name == "mission.tick") options.tick_times.push_back(message.time);
    }
    options.listeners.insert(options.listeners.begin(),
                             [this](const Message& message) { now_behaviour_.observe(message); });
    options.make_port = [this](const ServicePlan& service, const std::string& leaf) {
      return std::make_unique<Port>(*this, service, leaf);
    };
    options.on_begin = [this, next = std::move(options.on_begin)](RunInside& inside) {
      if (next) next(inside);
      begin(inside);
    };
    Run run(plan_, std::move(options));
    report_.run = run.execute();
    compare();
    return std::move(report_);
  }

 private:
  class Port final : public ServicePort {
   public:
    Port(Replay& replay, const ServicePlan& service, std::string leaf)
        : replay_(replay), service_(service), leaf_(std::move(leaf)) {}
    void call(const idl::Method& method, Value args, Done done) override {
      replay_.call(service_, leaf_, method, std::move(args), std::move(done));
    }

   private:
    Replay& replay_;
    ServicePlan service_;
    std::string leaf_;
  };

  // Everything in this process, in virtual time.
  Result<void> adapt() {
    // Deadlines are wall time: in the recorded run they were this long in run time.
    const double factor = plan_.scenario.virtual_time ? 1.0 : plan_.scenario.factor;
    Deadlines& deadlines = plan_.scenario.project.deadlines;
    for (Duration* deadline :
         {&deadlines.call, &deadlines.condition, &deadlines.budget, &deadlines.halt, &deadlines.unresponsive})
      *deadline = Duration(static_cast<std::int64_t>(static_cast<double>(deadline->count()) * factor));
    plan_.scenario.virtual_time = true;
    plan_.scenario.factor = 1.0;
    for (const ProcessEntry& entry : plan_.scenario.processes) {
      if (!entry.skill.empty()) process_skills_[entry.name] = entry.skill;
    }
    plan_.scenario.processes.clear();
    plan_.observers.clear();
    for (LeafPlan& leaf : plan_.leaves) {
      if (!leaf.chart) {
        return fail("replay.foreign-skill",
                    "leaf \"" + leaf.name + "\" runs a skill in another language, of which the project has no chart",
                    plan_.tree.span(leaf.node));
      }
      leaf.at.clear();
    }
    for (auto& [name, service] : plan_.services) {
      if (plan_.world && sim::find_service(service.interface) != nullptr) service.at = "sim";
    }
    return {};
  }

  void remember(const std::vector<Message>& messages) {
    std::map<std::uint64_t, Exchange*> open;  // by call
    for (const Message& message : messages) {
      then_behaviour_.observe(message);
      if (message.name == "scenario.injection" || message.name == "process.restarted") injections_.push_back(message);
      const auto service = plan_.services.find(message.target);
      const Value* args = message.data.find("args");
      if (service == plan_.services.end() || args == nullptr) continue;
      if (message.kind == MessageKind::kRequest) {
        const std::string_view call = call_of(message);
        auto& exchanges = exchanges_[key_of(message.source, service->first, call.substr(call.rfind('.') + 1), *args)];
        exchanges.push_back({.asked = message.time, .after = {}, .outcome = {}});
        open[message.call] = &exchanges.back();
        ++report_.recorded_requests;
      } else if (const auto found = open.find(message.call); found != open.end() && message.call != 0) {
        found->second->after = message.time - found->second->asked;
        found->second->outcome = outcome_of(message);
        open.erase(found);
      }
    }
  }

  void begin(RunInside& inside) {
    inside_ = &inside;
    inside.put_faults_on_calls(false);
    for (const Message& injection : injections_) {
      inside.scheduler().at(inside.director(), injection.time, Rank::kInjection,
                            [this, &injection] { inject(injection); });
    }
    const TimePoint end = add_saturating(recorded_.ended(), Duration(1));
    inside.scheduler().at(inside.director(), end, Rank::kInjection, [this] {
      if (!report_.continued) inside_->end();
    });
  }

  // What was done then is done again, except to what answers as recorded.
  void inject(const Message& injection) {
    using Kind = Intervention::Kind;
    const Value* process = injection.data.find("process");
    if (injection.name == "process.restarted") {
      if (process != nullptr) of_process(std::string(process->text()), [](SkillActor& skill) { skill.restart(); });
      return;
    }
    const auto what = intervention_of(injection);
    const bool is_call = what && what->kind == Kind::kCall;
    if (what && !is_call && check_intervention(*what, scope_of(plan_))) {
      inside_->inject({.at = injection.time, .what = *what, .source = injection.source, .span = {}});
      return;
    }
    Message message;
    message.source = injection.source;
    message.target = injection.target;
    message.name = injection.name;
    message.data = injection.data;
    inside_->publish(std::move(message));
    if (what && what->kind == Kind::kKill) of_process(what->target, [](SkillActor& skill) { skill.kill(); });
    if (is_call && plan_.world) call_again(what->target, what->args);
  }

  // Skills that ran in that process then; they run in this one now.
  void of_process(const std::string& process, const std::function<void(SkillActor&)>& act) {
    const auto ran = process_skills_.find(process);
    if (ran == process_skills_.end()) return;
    for (std::size_t leaf = 0; leaf < plan_.leaves.size(); ++leaf) {
      const LeafPlan& plan = plan_.leaves[leaf];
      if (plan.name != ran->second && plan.id != ran->second) continue;
      if (SkillActor* skill = inside_->skill(leaf)) act(*skill);
    }
  }

  void call_again(const std::string& call, const Value& args) {
    const auto dot = call.rfind('.');
    const std::string name = call.substr(0, dot);
    Act act{inside_->scheduler().now(), {}, call.substr(dot + 1), {}, args};
    if (const auto robot = test_control_of(name, *plan_.world)) {
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
      if (exchange.asked > now + tolerance) break;
      if (distance(exchange) > tolerance) continue;
      Exchange*& slot = exchange.used ? used : best;
      if (slot == nullptr || distance(exchange) < distance(*slot)) slot = &exchange;
    }
    // Real time misses periods, which virtual time does not: what was asked once then may be asked twice now.
    return best != nullptr || recorded_.is_virtual() ? best : used;
  }

  void call(const ServicePlan& service, const std::string& leaf, const idl::Method& method, Value args,
            ServicePort::Done done) {
    if (report_.continued) {
      answer_live(service, method, args, done);
      return;
    }
    Exchange* exchange = find(key_of(leaf, service.name, method.name, args));
    const TimePoint now = inside_->scheduler().now();
    if (exchange == nullptr) {
      if (now > recorded_.ended() || !report_.unrecorded.empty()) return;
      report_.unrecorded = leaf + " asks " + service.name + "." + method.name + "(" + to_json(args) + ")";
      report_.unrecorded_at = now;
      if (options_.go_on && go_on(service))
        answer_live(service, method, args, done);
      else
        inside_->end();
      return;
    }
    exchange->used = true;
    ++report_.answered_requests;
    acts_.push_back({now, service.interface, method.name, service.robot, std::move(args)});
    if (!exchange->after) return;
    if (exchange->after->count() <= 0) {
      done(exchange->outcome);
      return;
    }
    inside_->scheduler().at(inside_->director(), now + *exchange->after, Rank::kMessage,
                            [done = std::move(done), outcome = exchange->outcome] { done(outcome); });
  }

  void answer_live(const ServicePlan& service, const idl::Method& method, const Value& args,
                   const ServicePort::Done& done) {
    if (service.at != "sim") {
      done({.ok = false, .result = {}, .kind = "unreachable", .message = "the replay has no \"" + service.name + "\""});
      return;
    }
    done(inside_->sim()->call(service.interface, method.name, args, service.robot));
  }

  // Brings the simulator to where it was: the last snapshot, and what happened since.
  bool go_on(const ServicePlan& service) {
    if (service.at != "sim" || inside_->sim() == nullptr) return false;
    const TimePoint now = inside_->scheduler().now();
    sim::State state = sim::initial_state(*plan_.world, plan_.scenario.seed);
    TimePoint from{};
    if (auto snapshot = recorded_.snapshot(now); snapshot && *snapshot) {
      const Value* world = (*snapshot)->value.find("world");
      auto restored = world != nullptr ? sim::restore(*plan_.world, *world) : fail("replay.no-world", "");
      if (restored) {
        state = std::move(*restored);
        from = (*snapshot)->time;
      }
    }
    for (const Act& act : acts_) {
      const Map* args = act.args.as_map();
      if (act.time < from || args == nullptr) continue;
      (void)sim::call(*plan_.world, state,
                      {.service = act.interface, .method = act.method, .args = *args, .robot = act.robot}, act.time);
    }
    sim::advance(*plan_.world, state, now);
    inside_->sim()->restore(std::move(state));
    inside_->put_faults_on_calls(true);
    report_.continued = true;
    return true;
  }

  void compare() {
    const bool exact = recorded_.is_virtual();
    // A run that was stopped in between halted its leaves at a moment that the replay does not know.
    const std::string ended_by = recorded_.fact("ended_by");
    const bool whole = !ended_by.empty() && ended_by != "interrupt" && ended_by != "error";
    const TimePoint until = !report_.unrecorded.empty() ? report_.unrecorded_at
                            : whole                     ? kNever
                                                        : recorded_.ended() - std::chrono::seconds(1);
    const auto& then = then_behaviour_.deeds();
    const auto& now = now_behaviour_.deeds();
    std::map<std::string, bool> all;
    for (const auto& [who, deeds] : then) all[who] = true;
    for (const auto& [who, deeds] : now) all[who] = true;
    for (const auto& [who, unused] : all) {
      static const std::vector<Deed> kNone;
      const auto at = [&](const auto& map) -> const std::vector<Deed>& {
        const auto found = map.find(who);
        return found != map.end() ? found->second : kNone;
      };
      const std::vector<Deed>& a = at(then);
      const std::vector<Deed>& b = at(now);
      for (std::size_t i = 0; i < std::max(a.size(), b.size()); ++i) {
        const Deed* recorded = i < a.size() ? &a[i] : nullptr;
        const Deed* replayed = i < b.size() ? &b[i] : nullptr;
        if (recorded != nullptr && replayed != nullptr && recorded->what == replayed->what &&
            (!exact || recorded->tick == replayed->tick))
          continue;
        // What comes first is where they part.
        const bool now_first = recorded == nullptr || (replayed != nullptr && replayed->time <= recorded->time);
        const Deed& first = now_first ? *replayed : *recorded;
        if (first.time > until) break;
        const auto text = [&](const Deed* deed) {
          if (deed != nullptr && (!exact || deed->tick == first.tick)) return deed->what;
          return i > 0 ? "no change: it last " + a[i - 1].what : std::string("nothing yet");
        };
        if (report_.differences.size() < kDifferencesMax)
          report_.differences.push_back({first.time, first.tick, first.sequence, who, text(recorded), text(replayed)});
        break;
      }
    }
    std::stable_sort(report_.differences.begin(), report_.differences.end(),
                     [](const Difference& x, const Difference& y) {
                       return x.time != y.time ? x.time < y.time : x.sequence < y.sequence;
                     });
  }

  RecordedRun& recorded_;
  Plan plan_;
  ReplayOptions options_;
  ReplayReport report_;
  RunInside* inside_ = nullptr;
  std::map<std::string, std::deque<Exchange>> exchanges_;
  std::vector<Message> injections_;
  std::map<std::string, std::string> process_skills_;  // what each recorded process ran
  std::vector<Act> acts_;
  Behaviour then_behaviour_;
  Behaviour now_behaviour_;
};

}  // namespace

Result<ReplayReport> replay(RecordedRun& recorded, Plan plan, ReplayOptions options) {
  return Replay(recorded, std::move(plan), std::move(options)).run();
}

}  // namespace sentree::runtime
