#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "sentree/idl/conform.h"
#include "sentree/mission/detail/skill_step.h"

// What a skill asks others for: calls, and goals of actions.

namespace sentree::mission {

namespace {

SkillState::Line& line_of(SkillState& state, const std::string& service) {
  for (SkillState::Line& line : state.lines) {
    if (line.service == service) return line;
  }
  state.lines.push_back({service, {}, {}});
  return state.lines.back();
}

}  // namespace

bool is_action(const idl::Service& service) { return service.name.find("/action/") != std::string::npos; }

Result<void> check_call(const scxml::OutgoingSend& send, const std::map<std::string, project::ServicePlan>& services) {
  if (send.type != "thrift") return {};
  const auto service = services.find(send.target);
  if (service == services.end()) {
    std::vector<std::string> names;
    for (const auto& [name, plan] : services) names.push_back(name);
    return fail("run.unknown-service",
                fmt::format("service \"{}\" is not in sentree.yaml{}", send.target, did_you_mean(send.target, names)),
                send.span);
  }
  if (!service->second.observed.empty())
    return fail("run.observed", fmt::format("\"{}\" is observed and cannot be called", send.target), send.span);
  const auto method = idl::find_method(*service->second.service, send.event, send.target, send.span);
  if (!method) return tl::unexpected(method.error());
  if (send.data && idl::conforms_arguments(**method, *send.data)) return {};
  auto args = idl::conform_arguments(**method, send.data.value_or(Value(Map())));
  if (!args) return tl::unexpected(args.error());
  return {};
}

bool SkillMachine::Step::operator()(const Admitted& decided) {
  auto& waiting = line_of(state_, decided.call->service).waiting;
  waiting.erase(waiting.begin());
  admitted(decided.call, decided.admission);
  admit(decided.call->service);
  return false;
}

bool SkillMachine::Step::operator()(const Send& send) {
  host_.send(send.call, *machine_.called(*send.call).method);
  return false;
}

bool SkillMachine::Step::operator()(Outcome&& answered) {
  // What nobody answers has left, and that is all.
  const Called& called = machine_.called(*answered.call);
  if (answered.outcome.ok && called.method->oneway) return false;
  const std::string& name = called.name;
  const bool is_served = answered.outcome.is_served();
  if (is_served && host_.fails(Failing::kLate, name)) {
    auto late = CallOutcome::failed(idl::CallErrorKind::kLate, std::string(kMadeLate));
    host_.deliver_at(add_saturating(host_.now(), model_.call_deadline), Rank::kMessage,
                     Finish{answered.call, std::move(late), {}});
    return false;
  }
  if (answered.outcome.ok) host_.falsify(name, *called.method, answered.outcome.result);
  // What was not answered has no reply that could be held back.
  const Duration delay = is_served ? host_.delay_of(called.reply.text) : Duration(0);
  if (delay == Duration(0)) return (*this)(Finish{answered.call, std::move(answered.outcome), {}});
  host_.deliver_at(add_saturating(host_.now(), delay), Rank::kMessage,
                   Finish{answered.call, std::move(answered.outcome), {}});
  return false;
}

bool SkillMachine::Step::operator()(Finish&& finish) {
  const Call& call = *finish.call;
  CallOutcome& outcome = finish.outcome;
  const bool current = state_.is_current(call.run);
  // Nobody's but the run's own, which nobody waits for.
  const bool is_own = call.run == 0;
  if (!state_.goals.empty() && call.method == kSendGoal) note_accepted(call, outcome);
  Map data;
  data.reserve(4);
  data.append("args", call.args);
  if (outcome.ok) {
    data.append("result", std::move(outcome.result));
  } else {
    data.append("kind", outcome.kind_word());
    data.append("message", std::move(outcome.message));
    if (!outcome.result.is_null()) data.append("exception", std::move(outcome.result));
    if (!finish.vetoed_by.empty()) data.append("vetoed_by", std::move(finish.vetoed_by));
  }
  Called& called = machine_.called(call);
  if (current && outcome.ok && !host_.is_heard(called.reply)) {
    host_.pass();
    return finish_with(call, called.reply.text, scxml::EventType::kExternal, std::move(data));
  }
  Message message;
  message.kind = outcome.ok && (current || is_own) ? MessageKind::kReply : MessageKind::kError;
  message.source = model_.name;
  message.target = call.service;
  message.name = !current && !is_own ? called.name + ".late" : outcome.ok ? called.reply.text : called.name + ".error";
  message.call = call.id;
  if (!current) {
    message.data = std::move(data);
    host_.publish(std::move(message));
    return false;
  }
  message.data = std::move(data);
  using Kind = idl::CallErrorKind;
  const bool undelivered = outcome.kind == Kind::kUnreachable || outcome.kind == Kind::kLate ||
                           outcome.kind == Kind::kProtocol || outcome.kind == Kind::kInterrupted;
  // SCXML 6.2.5: what prevents delivery is an error event of the platform.
  const bool platform = !outcome.ok && undelivered;
  host_.show(message);
  return finish_with(call, platform ? "error.communication" : std::move(message.name),
                     platform ? scxml::EventType::kPlatform : scxml::EventType::kExternal,
                     std::move(*message.data.as_map()));
}

bool SkillMachine::Step::finish_with(const Call& call, std::string name, scxml::EventType type, Map data) {
  scxml::Event event;
  event.name = std::move(name);
  event.type = type;
  event.sendid = call.sendid;
  event.session = call.session;
  event.origintype = "thrift";
  event.data = idl::for_script(std::move(data));
  step(std::move(event));
  return settle();
}

void SkillMachine::Step::note_sent(const Call& call, const idl::Service& service) {
  if (!is_action(service)) return;
  if (call.method == kSendGoal) {
    if (state_.goals.size() >= kGoalsMax) state_.goals.erase(state_.goals.begin());
    state_.goals.push_back({.service = call.service, .id = {}});
    return;
  }
  const Value* const id = call.args.find("goal_id");
  const bool is_all = id == nullptr || id->text().empty();
  std::erase_if(state_.goals, [&](const SkillState::Goal& goal) {
    return goal.service == call.service && !goal.id.empty() && (is_all || goal.id == id->text());
  });
}

void SkillMachine::Step::note_accepted(const Call& call, const CallOutcome& outcome) {
  const auto goal = std::find_if(state_.goals.begin(), state_.goals.end(), [&](const SkillState::Goal& each) {
    return each.service == call.service && each.id.empty();
  });
  if (goal == state_.goals.end()) return;
  const Value* const accepted = outcome.result.find("accepted");
  const Value* const id = outcome.result.find("goal_id");
  if (!outcome.ok || accepted == nullptr || *accepted != Value(true) || id == nullptr || id->text().empty()) {
    state_.goals.erase(goal);
    return;
  }
  goal->id = id->text();
  if (goal->abandoned) abandon_goals();
}

void SkillMachine::Step::note_result(const Publication& what) {
  const Value* const id = what.args.find("goal_id");
  if (id == nullptr || !what.topic.ends_with(".result")) return;
  const std::string_view service = std::string_view(what.topic).substr(0, what.topic.rfind('.'));
  std::erase_if(state_.goals,
                [&](const SkillState::Goal& goal) { return goal.service == service && goal.id == id->text(); });
}

void SkillMachine::Step::abandon_goals() {
  std::vector<SkillState::Goal> left;
  for (SkillState::Goal& goal : std::exchange(state_.goals, {})) {
    goal.abandoned = true;
    if (goal.id.empty()) {
      left.push_back(std::move(goal));
      continue;
    }
    make({.run = 0,
          .id = host_.next_call(),
          .service = goal.service,
          .method = "cancel_goal",
          .args = Value(Map{{"goal_id", goal.id}}),
          .sendid = {},
          .session = {}});
  }
  state_.goals = std::move(left);
}

void SkillMachine::Step::forget_goals() {
  if (!state_.goals.empty()) std::erase_if(state_.goals, [](const auto& goal) { return !goal.abandoned; });
}

void SkillMachine::Step::call(scxml::OutgoingSend& send) {
  // `check_call` has passed: the chart's <send> would have failed otherwise.
  const idl::Service& service = *model_.services->at(send.target).service;
  const idl::Method& method = *service.find(send.event);
  Call call{.run = state_.run,
            .id = host_.next_call(),
            .service = std::move(send.target),
            .method = method.name,
            .args = send.data ? std::move(*send.data) : Value(Map()),
            .sendid = std::move(send.sendid),
            .session = {}};
  // By what is behind "SESSION." of an invoked chart's name.
  if (const std::string& own = state_.session.id(); send.session != own)
    call.session = send.session.substr(own.size() + 1);
  if (!idl::conforms_arguments(method, call.args)) call.args = *idl::conform_arguments(method, std::move(call.args));
  if (call.method == kSendGoal || call.method == "cancel_goal") note_sent(call, service);
  make(std::move(call));
}

void SkillMachine::Step::make(Call call) {
  const Shared<Call> shared(std::move(call));
  SkillState::Line& line = line_of(state_, shared->service);
  if (line.waiting.size() >= kGatedCallsMax) {
    const std::string why = fmt::format("{} calls are waiting for a gate already", kGatedCallsMax);
    host_.deliver(Finish{shared, CallOutcome::failed(idl::CallErrorKind::kUnreachable, why), {}});
    return;
  }
  line.waiting.push_back(shared);
  if (line.waiting.size() == 1) admit(shared->service);
}

void SkillMachine::Step::admit(const std::string& service) {
  for (;;) {
    SkillState::Line& line = line_of(state_, service);
    if (line.waiting.empty()) return;
    const Shared<Call> call = line.waiting.front();
    Called& called = machine_.called(*call);
    if (!host_.is_heard(called.request)) {
      host_.pass();
      line.waiting.erase(line.waiting.begin());
      admitted(call, {});
      continue;
    }
    Message request;
    request.kind = MessageKind::kRequest;
    request.source = model_.name;
    request.target = call->service;
    request.name = called.request.text;
    request.call = call->id;
    Map data;
    data.append("args", call->args);
    request.data = std::move(data);
    const auto admission = host_.request(std::move(request), call);
    if (!admission) return;
    line.waiting.erase(line.waiting.begin());
    admitted(call, *admission);
  }
}

void SkillMachine::Step::admitted(const Shared<Call>& call, const Admission& admission) {
  if (admission.veto) {
    const std::string by = admission.veto->by.empty() ? "" : " by " + admission.veto->by;
    host_.deliver(Finish{
        call, CallOutcome::failed(idl::CallErrorKind::kVetoed, fmt::format("vetoed{}: {}", by, admission.veto->reason)),
        admission.veto->by});
    return;
  }
  const Called& called = machine_.called(*call);
  if (!called.method->oneway && host_.fails(Failing::kUnreachable, called.name)) {
    host_.deliver(
        Finish{call, CallOutcome::failed(idl::CallErrorKind::kUnreachable, "a fault: nobody can be reached"), {}});
    return;
  }
  const TimePoint now = host_.now();
  TimePoint& not_before = line_of(state_, call->service).not_before;
  // What nobody serves arrives at those who subscribe to it, and is held back there.
  const bool is_served = model_.services->at(call->service).at != "topics";
  not_before = std::max(not_before, is_served ? now + host_.delay_of(called.name) : now);
  if (not_before > now) {
    host_.deliver_at(not_before, Rank::kMessage, Send{call});
  } else {
    not_before = TimePoint{};
    host_.send(call, *called.method);
  }
}

}  // namespace sentree::mission
