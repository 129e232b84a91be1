#include "sentree/runtime/durable.h"

#include <algorithm>
#include <set>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "sentree/mission/carry.h"
#include "sentree/project/cpp_nodes.h"
#include "sentree/runtime/detail/decision_record.h"
#include "sentree/runtime/local_skill.h"
#include "sentree/runtime/run.h"

namespace sentree::runtime {

namespace {

// Observations that a snapshot keeps of what leads to a monitor's state.
constexpr std::size_t kTrailMax = 256;

std::uint64_t outcome_of(const mission::Delivery& delivery) {
  const auto* to_skill = std::get_if<mission::SkillDelivery>(&delivery.what);
  const auto* outcome = to_skill != nullptr ? std::get_if<mission::Outcome>(to_skill) : nullptr;
  return outcome != nullptr ? outcome->call->id : 0;
}

}  // namespace

class Durability::Port final : public ServicePort {
 public:
  Port(Durability& of, std::unique_ptr<ServicePort> port) : durability_(of), port_(std::move(port)) {}
  bool take(std::size_t leaf, const mission::Shared<mission::Call>& call) override {
    durability_.make(leaf, call, *port_);
    return true;
  }
  void open(const std::function<void()>& done) override { port_->open(done); }
  void call(const idl::Method& method, Value args, Done done) override {
    port_->call(method, std::move(args), std::move(done));
  }

 private:
  Durability& durability_;
  std::unique_ptr<ServicePort> port_;
};

Durability::Durability(const project::Plan& plan, Scheduler& scheduler, const DurableOptions& options,
                       std::function<SkillActor*(std::size_t)> skill, std::vector<Gap> gaps)
    : plan_(plan),
      scheduler_(scheduler),
      skill_(std::move(skill)),
      settle_(options.settle),
      journal_(options),
      gaps_(std::move(gaps)) {}

std::string Durability::obstacle(const project::Plan& plan) {
  for (const project::LeafPlan& leaf : plan.leaves) {
    if (!leaf.chart) return fmt::format("the skill of {} is no chart, and what it knows is not the run's", leaf.name);
  }
  for (const auto& [name, service] : plan.services) {
    if (!service.observed.empty())
      return fmt::format("what is observed as {} comes from outside, and is not in its journal", name);
    if (service.uses_other_middleware())
      return fmt::format("service {} is reached through another middleware than Thrift", name);
  }
  return {};
}

std::string Durability::done_again(const project::Plan& plan) {
  if (plan.scenario.project.plugins.empty()) return {};
  const std::string nodes = project::shown_cpp_nodes(plan);
  if (nodes.empty()) return {};
  return fmt::format(
      "nodes in C++ ({}) are no part of the journal: --resume executes again what they did since its last state, with "
      "what they find then",
      nodes);
}

const idl::Method& Durability::method_of(const mission::Call& call) const {
  return *plan_.services.at(call.service).service->find(call.method);
}

bool Durability::is_idempotent(const mission::Call& call) const {
  return plan_.services.at(call.service).is_idempotent(method_of(call));
}

void Durability::entered(const Place& where, const mission::Delivery& what) {
  journal_.input(where, mission::save(what));
  open_.erase(outcome_of(what));
}

std::unique_ptr<ServicePort> Durability::guard(std::unique_ptr<ServicePort> port) {
  return std::make_unique<Port>(*this, std::move(port));
}

void Durability::make(std::size_t leaf, const mission::Shared<mission::Call>& call, ServicePort& port) {
  open_[call->id] = {leaf, call, !catching_up_ || sent_.contains(call->id)};
  if (catching_up_) return;
  if (!is_idempotent(*call)) journal_.sent(call->id);
  journal_.before_leaving();
  port.call(method_of(*call), call->args, [this, leaf, call](mission::CallOutcome outcome) {
    scheduler_.enter(skill_(leaf)->actor(), {leaf, mission::Outcome{call, std::move(outcome)}});
  });
}

void Durability::intervention(const project::Intervention& what, const std::string& source) {
  if (!catching_up_) journal_.intervention(scheduler_.place(), mission::save(what), source);
}

tl::expected<Value, mission::ChartElsewhere::Away> Durability::execute(mission::ChartElsewhere& chart,
                                                                       const scxml::Session& session,
                                                                       const scxml::StepOrder& order) {
  using Away = mission::ChartElsewhere::Away;
  const std::uint64_t number = ++chart_steps_;
  if (catching_up_ && lost_.contains(number)) return tl::unexpected(Away::kLost);
  if (executes_here_) return tl::unexpected(Away::kHere);
  const auto begun = std::chrono::steady_clock::now();
  auto told = chart.execute(session, order);
  if (!catching_up_) waited_for_charts_ += std::chrono::steady_clock::now() - begun;
  if (told) return told;
  if (catching_up_) {
    // It was executed then. Nobody waits for each of thousands of steps.
    executes_here_ = true;
    return tl::unexpected(Away::kHere);
  }
  journal_.lost(number);
  return told;
}

void Durability::observed(const Message& message) {
  if (catching_up_) return;
  journal_.input(scheduler_.place(),
                 Map{{"observed", message.name}, {"target", message.target}, {"data", message.data}});
}

void Durability::decided(const std::string& monitor, const monitor::Decision& decision) {
  if (!catching_up_) journal_.input(scheduler_.place(), Map{{"decided", monitor}, {"decision", save(decision)}});
}

std::optional<std::pair<std::string, monitor::Decision>> Durability::decided(const Value& input) {
  const Value* monitor = input.find("decided");
  const Value* saved = input.find("decision");
  auto decision = monitor != nullptr && saved != nullptr ? restore_decision(*saved) : std::nullopt;
  if (!decision) return std::nullopt;
  return std::pair(std::string(monitor->text()), std::move(*decision));
}

std::optional<Message> Durability::observed(const Value& input) {
  const Value* name = input.find("observed");
  const Value* target = input.find("target");
  const Value* data = input.find("data");
  if (name == nullptr || target == nullptr || data == nullptr) return std::nullopt;
  Message message;
  message.source = "run";
  message.target = target->text();
  message.name = name->text();
  message.data = *data;
  return message;
}

std::optional<TimePoint> Durability::timeline_to(const Journaled& journaled) {
  for (const Value& entry : journaled.open) {
    const Value* to = entry.find("timeline_to");
    if (to != nullptr && to->as_int() != nullptr) return TimePoint(Duration(*to->as_int()));
  }
  return std::nullopt;
}

void Durability::snapshot(mission::State state, List beside, TimePoint timeline_to) {
  if (catching_up_) return;
  const auto begun = std::chrono::steady_clock::now();
  mission::forget_history(state, kTrailMax);
  const auto saved = mission::save(plan_, state);
  // A recording in real time is at most a second late, and the journal reaches back for seconds; but not behind its
  // first state, and in virtual time a recording may be as late as it likes.
  if (settle_ && (std::exchange(is_first_, false) || plan_.scenario.virtual_time)) settle_();
  journal_.spent(std::chrono::steady_clock::now() - begun);
  List all = open();
  std::move(beside.begin(), beside.end(), std::back_inserter(all));
  all.push_back(Map{{"timeline_to", timeline_to.time_since_epoch().count()}});
  if (saved)
    journal_.snapshot(state.now, *saved, std::move(all), gaps_);
  else
    journal_.give_up(to_string(saved.error()));
}

List Durability::open() const {
  List open;
  for (const auto& [id, call] : open_) {
    const mission::Delivery form{call.leaf, mission::SkillDelivery(mission::Send{call.call})};
    open.push_back(Map{{"call", mission::save(form)}, {"sent", call.sent}});
  }
  open.push_back(Map{{"chart_steps", static_cast<std::int64_t>(chart_steps_)}});
  return open;
}

List Durability::reached() {
  for (const std::uint64_t call : answered_) open_.erase(call);
  return open();
}

std::string behind_the_clock(Duration behind, Duration for_charts, Duration for_disk) {
  const auto text = [](Duration time) {
    const auto tenths = std::chrono::round<std::chrono::milliseconds>(time).count() / 100;
    return fmt::format("{}.{} s", tenths / 10, tenths % 10);
  };
  return fmt::format(
      "the run was held up, and is {} behind the clock; services elsewhere went on meanwhile. Since it began it has "
      "waited {} for processes of skills and {} for the disk",
      text(behind), text(for_charts), text(for_disk));
}

Result<void> Durability::begin_again(const Journaled& journaled, Again& again) {
  catching_up_ = true;
  sent_ = journaled.sent;
  lost_ = journaled.lost;
  const auto bad = [&](const std::string& what) {
    return fail("journal.damaged", fmt::format("{}: {}", journaled.file.string(), what));
  };
  for (const Value& entry : journaled.open) {
    if (const Value* steps = entry.find("chart_steps"); steps != nullptr && steps->as_int() != nullptr) {
      chart_steps_ = static_cast<std::uint64_t>(*steps->as_int());
      continue;
    }
    const auto is = [&](const char* what) { return entry.find(what) != nullptr; };
    if (is("observer") || is("decided") || is("timeline_to")) continue;
    const Value* call = entry.find("call");
    const Value* sent = entry.find("sent");
    auto form = call != nullptr ? mission::restore_delivery(plan_, *call) : bad("an open call is missing");
    if (!form) return tl::unexpected(form.error());
    const auto* to_skill = std::get_if<mission::SkillDelivery>(&form->what);
    const auto* send = to_skill != nullptr ? std::get_if<mission::Send>(to_skill) : nullptr;
    if (send == nullptr || sent == nullptr || sent->as_bool() == nullptr) return bad("an open call is none");
    open_[send->call->id] = {form->leaf, send->call, *sent->as_bool() || sent_.contains(send->call->id)};
  }
  for (const auto& [where, saved] : journaled.inputs) {
    if (saved.find("observed") != nullptr || saved.find("decided") != nullptr) continue;
    auto what = mission::restore_delivery(plan_, saved);
    if (!what) return tl::unexpected(what.error());
    if (!std::holds_alternative<mission::SkillDelivery>(what->what)) return bad("an input is for no skill");
    answered_.insert(outcome_of(*what));
    again.emplace_back(where, [this, when = where.when, what = std::move(*what)]() mutable {
      const auto actor = skill_(what.leaf)->actor();
      scheduler_.at(actor, when, mission::Rank::kInjection, std::move(what));
    });
  }
  return {};
}

void Durability::resumed(const Gap& gap, Duration lost) {
  gaps_.push_back(gap);
  catching_up_ = false;
  executes_here_ = false;
  for (const std::uint64_t call : answered_) open_.erase(call);
  std::erase_if(open_, [&](const auto& entry) {
    const Open& open = entry.second;
    if (!open.sent || is_idempotent(*open.call)) return false;
    scheduler_.post(
        skill_(open.leaf)->actor(),
        mission::Delivery{open.leaf, mission::Outcome{open.call, mission::CallOutcome::failed(
                                                                     idl::CallErrorKind::kInterrupted,
                                                                     "the run was interrupted while the call "
                                                                     "was on its way; it may have been "
                                                                     "executed")}});
    return true;
  });
  for (std::size_t leaf = 0; leaf < plan_.leaves.size(); ++leaf) {
    mission::SkillState& state = skill_(leaf)->state();
    if (state.halt_due) state.halt_due = add_saturating(*state.halt_due, lost);
  }
}

void Durability::ask_again() {
  const std::map<std::uint64_t, Open> open = std::exchange(open_, {});
  for (const auto& [id, call] : open) skill_(call.leaf)->send_again(call.call, method_of(*call.call));
}

Loaded<Replaced> replace_plan(const project::Plan& before, const Journaled& journaled, std::uint64_t known,
                              const project::Plan& after) {
  Loaded<Replaced> out;
  const auto refuse = [&](Diagnostic why) {
    out.diagnostics.push_back(std::move(why));
    return std::move(out);
  };
  Replaced replaced;
  std::optional<RunOptions::Reached> reached;
  RunOptions options;
  options.durable = DurableOptions{.journal = journaled.file, .known = known};
  options.resume = &journaled;
  options.on_reached = [&](RunOptions::Reached what) { reached = std::move(what); };
  options.listeners.emplace_back([&](const Message& message) {
    replaced.untold.emplace_back([message](const RunOptions& to) {
      for (const auto& listener : to.listeners) listener(message);
    });
  });
  options.on_decision = [&](const MonitorReport& report) {
    replaced.untold.emplace_back([report](const RunOptions& to) {
      if (to.on_decision) to.on_decision(report);
    });
  };
  const RunReport report = Run(before, std::move(options)).execute();
  if (!report.error.empty()) return refuse({Severity::kError, "journal.damaged", report.error, {}});
  if (!reached) {
    return refuse({Severity::kError,
                   "run.ended",
                   "the run had ended when its executive died; sentree run --resume without --project says how",
                   {}});
  }
  auto carried = mission::carry(before, reached->state, after);
  if (!carried.ok()) {
    out.diagnostics = std::move(carried.diagnostics);
    return out;
  }
  Journaled& next = replaced.journaled;
  next = journaled;
  next.inputs.clear();
  next.interventions.clear();
  next.sent.clear();
  next.lost.clear();
  next.open.clear();
  next.gaps = reached->gaps;
  next.reached = carried.value->state.now;
  for (const Value& entry : reached->open) {
    if (entry.find("call") == nullptr) {
      next.open.push_back(entry);
      continue;
    }
    auto call = mission::restore_delivery(before, *entry.find("call"));
    if (!call) return refuse(call.error());
    call->leaf = carried.value->leaf_of[call->leaf];
    // Nobody waits for it any more.
    if (call->leaf == mission::Carried::kGone) continue;
    if (auto fits = mission::restore_delivery(after, mission::save(*call)); !fits) return refuse(fits.error());
    next.open.push_back(Map{{"call", mission::save(*call)}, {"sent", *entry.find("sent")}});
  }
  auto saved = mission::save(after, carried.value->state);
  if (!saved) return refuse(saved.error());
  next.state = std::move(*saved);
  replaced.changes = std::move(carried.value->changes);
  out.value = std::move(replaced);
  return out;
}

}  // namespace sentree::runtime
