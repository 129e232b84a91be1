#include "sentree/runtime/caller.h"

#include <algorithm>

#include "sentree/idl/conform.h"

namespace sentree::runtime {

Caller::Caller(std::string name, const std::map<std::string, project::ServicePlan>& services, MakePort make_port,
               Publisher& publisher, Scheduler& scheduler, ActorId actor, StandingInterventions& standing,
               std::function<bool(const SkillEvent&)> deliver, std::function<bool(std::uint64_t)> is_current)
    : name_(std::move(name)),
      services_(services),
      make_port_(std::move(make_port)),
      publisher_(publisher),
      scheduler_(scheduler),
      actor_(actor),
      standing_(standing),
      deliver_(std::move(deliver)),
      is_current_(std::move(is_current)) {}

Result<void> Caller::check(const scxml::OutgoingSend& send) const {
  if (send.type != "thrift") return {};
  const auto service = services_.find(send.target);
  if (service == services_.end()) {
    std::vector<std::string> names;
    for (const auto& [name, plan] : services_) names.push_back(name);
    return fail("run.unknown-service",
                "service \"" + send.target + "\" is not in sentree.yaml" + did_you_mean(send.target, names), send.span);
  }
  const auto method = idl::find_method(*service->second.service, send.event, send.target, send.span);
  if (!method) return tl::unexpected(method.error());
  auto args = idl::conform_arguments(**method, send.data.value_or(Value(Map())));
  if (!args) return tl::unexpected(args.error());
  return {};
}

void Caller::call(SkillCall call) {
  // `check` has passed: the chart's <send> would have failed otherwise.
  const project::ServicePlan& service = services_.at(call.service);
  auto pending = std::make_shared<Pending>();
  pending->method = service.service->find(call.method);
  pending->id = publisher_.next_call();
  pending->args = *idl::conform_arguments(*pending->method, std::move(call.args));
  pending->call = std::move(call);

  auto& waiting = waiting_[pending->call.service];
  if (waiting.size() >= kGatedCallsMax) {
    const std::string why = std::to_string(kGatedCallsMax) + " calls are waiting for a gate already";
    fail_later(pending, {.ok = false, .result = {}, .kind = "unreachable", .message = why});
    return;
  }
  waiting.push_back(pending);
  if (waiting.size() == 1) admit(pending->call.service);
}

void Caller::admit(const std::string& service) {
  auto& waiting = waiting_[service];
  while (!waiting.empty()) {
    const std::shared_ptr<Pending> pending = waiting.front();
    Message request;
    request.kind = MessageKind::kRequest;
    request.source = name_;
    request.target = service;
    request.name = service + "." + pending->call.method + ".request";
    request.call = pending->id;
    request.data = Map{{"args", pending->args}};
    auto admission = publisher_.request(std::move(request), [this, pending](Admission decided) {
      scheduler_.post(actor_, [this, pending, decided = std::move(decided)]() mutable {
        waiting_[pending->call.service].pop_front();
        admitted(pending, std::move(decided));
        admit(pending->call.service);
      });
    });
    if (!admission) return;
    waiting.pop_front();
    admitted(pending, std::move(*admission));
  }
}

void Caller::admitted(const std::shared_ptr<Pending>& pending, Admission admission) {
  if (admission.veto) {
    pending->vetoed_by = admission.veto->by;
    const std::string by = admission.veto->by.empty() ? "" : " by " + admission.veto->by;
    fail_later(pending,
               {.ok = false, .result = {}, .kind = "vetoed", .message = "vetoed" + by + ": " + admission.veto->reason});
    return;
  }
  const Duration delay = delay_of(pending->call.service + "." + pending->call.method);
  TimePoint& not_before = not_before_[pending->call.service];
  not_before = std::max(not_before, scheduler_.now() + delay);
  if (not_before > scheduler_.now()) {
    scheduler_.at(actor_, not_before, Rank::kMessage, [this, pending] { execute(pending); });
  } else {
    execute(pending);
  }
}

void Caller::fail_later(const std::shared_ptr<Pending>& pending, CallOutcome outcome) {
  scheduler_.post(actor_, [this, pending, outcome = std::move(outcome)] { finish(*pending, outcome); });
}

void Caller::execute(std::shared_ptr<Pending> pending) {
  auto& port = ports_[pending->call.service];
  if (!port) port = make_port_(services_.at(pending->call.service));
  port->call(*pending->method, pending->args, [this, pending](CallOutcome outcome) {
    // Often from a thread that waited for the reply and has nothing else to do.
    scheduler_.hand_over(
        actor_, [this, pending, outcome = std::move(outcome)]() mutable { answered(pending, std::move(outcome)); });
  });
}

Duration Caller::delay_of(const std::string& message) {
  if (!standing_.any(project::Intervention::Kind::kDelay) || standing_.calls_spared()) return Duration(0);
  return standing_.delay_of(message);
}

void Caller::answered(const std::shared_ptr<Pending>& pending, CallOutcome outcome) {
  const std::string name = pending->call.service + "." + pending->call.method;
  if (outcome.ok && standing_.any(project::Intervention::Kind::kFalsify) && !standing_.calls_spared())
    standing_.falsify(name, *pending->method, outcome.result);
  const Duration delay = delay_of(name + ".reply");
  if (delay == Duration(0)) {
    finish(*pending, std::move(outcome));
    return;
  }
  scheduler_.at(actor_, add_saturating(scheduler_.now(), delay), Rank::kMessage,
                [this, pending, outcome = std::move(outcome)]() mutable { finish(*pending, std::move(outcome)); });
}

void Caller::finish(const Pending& pending, CallOutcome outcome) {
  const std::string base = pending.call.service + "." + pending.call.method;
  const bool current = is_current_(pending.call.run);
  Map data{{"args", pending.args}};
  if (outcome.ok) {
    data["result"] = std::move(outcome.result);
  } else {
    data["kind"] = outcome.kind;
    data["message"] = outcome.message;
    if (!pending.vetoed_by.empty()) data["vetoed_by"] = pending.vetoed_by;
  }
  Message message;
  message.kind = outcome.ok && current ? MessageKind::kReply : MessageKind::kError;
  message.source = name_;
  message.target = pending.call.service;
  message.name = base + (!current ? ".late" : outcome.ok ? ".reply" : ".error");
  message.call = pending.id;
  message.data = data;
  publisher_.publish(std::move(message));
  if (!current) return;

  SkillEvent event;
  event.run = pending.call.run;
  event.sendid = pending.call.sendid;
  const bool undelivered = outcome.kind == "unreachable" || outcome.kind == "late" || outcome.kind == "protocol";
  event.name = outcome.ok ? base + ".reply" : undelivered ? "error.communication" : base + ".error";
  event.data = idl::for_script(std::move(data));
  deliver_(event);
}

}  // namespace sentree::runtime
