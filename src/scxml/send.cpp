#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "sentree/scxml/detail/interpreter.h"
#include "sentree/scxml/loader.h"

namespace sentree::scxml {
namespace {

bool is_basic_http(std::string_view type) { return type == kBasicHttpProcessor || type == kBasicHttpProcessorShort; }

constexpr std::string_view kSessionTarget = "#_scxml_";

// Bytes, about.
std::size_t weight(const Value& value) {
  constexpr std::size_t kOfEach = 32;
  std::size_t bytes = kOfEach;
  if (const auto* text = value.as_string()) {
    bytes += text->size();
  } else if (const auto* binary = value.as_bytes()) {
    bytes += binary->octets.size();
  } else if (const auto* list = value.as_list()) {
    for (const Value& item : *list) bytes += weight(item);
  } else if (const auto* map = value.as_map()) {
    for (const auto& [name, item] : *map) bytes += name.size() + weight(item);
  }
  return bytes;
}

}  // namespace

void Interpreter::raise(Event event) {
  if (session_.internal_.size() >= run_.host.limits.events_max) {
    fail_session(
        "scxml.queue-full",
        fmt::format("more than {} internal events wait; the last is {}", run_.host.limits.events_max, event.name),
        run_.place);
    return;
  }
  session_.internal_.push(std::move(event));
}

// A chart is told the line, whoever observes it the place.
std::string Interpreter::message_of(const Diagnostic& why) {
  return why.code == "scxml.script" && why.span.line > 0 ? fmt::format("{} (line {})", why.message, why.span.line)
                                                         : why.message;
}

void Interpreter::raise_error(Diagnostic why, std::string sendid, std::string_view name) {
  std::string message = message_of(why);
  if (observer_ != nullptr && failures_.size() < kFailuresMax) {
    const bool has_place = !why.span.file.empty();
    failures_.push_back(std::move(why));
    if (!has_place) failures_.back().span = chart_.span(run_.place);
  }
  raise({.name = std::string(name),
         .type = EventType::kPlatform,
         .sendid = std::move(sendid),
         .data = Value(Map{{"message", Value(std::move(message))}})});
}

void Interpreter::raise_communication_error(std::string message, std::string sendid) {
  raise_error({Severity::kError, "scxml.unreachable", std::move(message), {}}, std::move(sendid), kErrorCommunication);
}

std::string Interpreter::make_id(std::string_view whose, std::string_view what) {
  const std::string number = std::to_string(++session_.ids_);
  std::string id;
  id.reserve(whose.size() + what.size() + number.size());
  id.append(whose).append(what).append(number);
  return id;
}

bool Interpreter::execute_send(const Send& send, const Place& place) {
  Timer timer;
  timer.place = place;
  timer.event.sendid = send.id;
  if (send.idlocation != kNoExpression) {
    timer.event.sendid = make_id(session_.id(), ".send");
    if (auto assigned = data_->assign_value(send.idlocation, Value(timer.event.sendid)); !assigned) {
      raise_error(std::move(assigned.error()));
      return false;
    }
  }
  if (auto prepared = prepare_send(send, timer); !prepared) {
    // SCXML 6.2.3: if an argument cannot be evaluated, nothing is sent.
    raise_error(std::move(prepared.error()), timer.event.sendid);
    return false;
  }
  if (!spend_output(timer.event.data ? weight(*timer.event.data) : 0, place)) return false;
  const bool outside = !is_scxml_processor(timer.type);
  const bool at_once = timer.delay <= Duration(0);
  if (outside) {
    if (timer.event.sendid.empty()) timer.event.sendid = make_id(session_.id(), ".send");
    const auto is_allowed = [this](OutgoingSend& leaving) {
      if (!run_.host.on_send) return true;
      auto allowed = run_.host.on_send(leaving);
      if (!allowed) raise_error(std::move(allowed.error()), std::move(leaving.sendid));
      return allowed.has_value();
    };
    if (at_once) {
      OutgoingSend leaving = outgoing(std::move(timer));
      if (!is_allowed(leaving)) return false;
      send_outside(std::move(leaving));
      return true;
    }
    if (run_.host.on_send) {
      OutgoingSend leaving = outgoing(Timer(timer));
      if (!is_allowed(leaving)) return false;
    }
  } else if (at_once) {
    dispatch(std::move(timer));
    return true;
  }
  if (session_.timers_->size() >= run_.host.limits.timers_max) {
    raise_error({Severity::kError, "scxml.too-many-timers",
                 fmt::format("more than {} delayed events wait", run_.host.limits.timers_max), chart_.span(place)},
                timer.event.sendid);
    return false;
  }
  timer.due = add_saturating(run_.now, timer.delay);
  timer.sequence = session_.sequence_++;
  session_.timers_.edit().insert(std::move(timer));
  return true;
}

// Evaluates the arguments and refuses what can never be sent (SCXML 6.2.4, C.1).
Result<void> Interpreter::prepare_send(const Send& send, Timer& timer) {
  const auto write = [this](const Text& of, std::string& out) -> Result<void> {
    if (of.expr == kNoExpression) {
      out = of.constant;
      return {};
    }
    auto text = data_->text(of.expr);
    if (!text) return tl::unexpected(std::move(text.error()));
    out = *std::move(text);
    return {};
  };
  if (auto r = write(send.event, timer.event.name); !r) return r;
  if (auto r = write(send.target, timer.target); !r) return r;
  if (auto r = write(send.type, timer.type); !r) return r;
  timer.delay = send.delay_constant;
  if (send.delay.expr != kNoExpression) {
    auto text = data_->text(send.delay.expr);
    if (!text) return tl::unexpected(std::move(text.error()));
    const auto delay = parse_delay(*text);
    if (!delay)
      return fail("scxml.bad-delay",
                  fmt::format("delay \"{}\" is no time; write a number with s or ms, as in \"1.5s\"", *text));
    timer.delay = *delay;
  }
  auto data = payload_data(send.payload, true);
  if (!data) return tl::unexpected(std::move(data.error()));
  timer.event.data = *std::move(data);
  timer.is_content = send.payload.has_content;

  if (!is_scxml_processor(timer.type)) {
    const auto& processors = run_.host.processors;
    const bool offered = std::any_of(processors.begin(), processors.end(), [&](const Processor& p) {
      return p.type == timer.type || (is_basic_http(p.type) && is_basic_http(timer.type));
    });
    if (!offered)
      return fail("scxml.unknown-type", fmt::format("no I/O processor of type \"{}\" is offered here", timer.type));
    return {};
  }
  if (!timer.target.empty() && !timer.target.starts_with("#_")) {
    return fail("scxml.bad-target", fmt::format("\"{}\" is no target of the SCXML processor", timer.target));
  }
  if (timer.target == "#_internal" && timer.delay > Duration(0)) {
    return fail("scxml.bad-target", "an event to #_internal cannot be delayed");
  }
  return {};
}

OutgoingSend Interpreter::outgoing(Timer&& timer) const {
  OutgoingSend send;
  send.session = session_.id();
  send.type = std::move(timer.type);
  send.target = std::move(timer.target);
  send.event = std::move(timer.event.name);
  send.sendid = std::move(timer.event.sendid);
  send.data = std::move(timer.event.data);
  send.is_content = timer.is_content;
  send.delay = timer.delay;
  send.span = chart_.span(timer.place);
  return send;
}

// The time of the event has come. Errors found here are error.communication: the target was legal, but is not there.
void Interpreter::dispatch(Timer&& timer) {
  if (!is_scxml_processor(timer.type)) return send_outside(outgoing(std::move(timer)));
  Event event = std::move(timer.event);
  event.type = EventType::kExternal;
  event.origin = std::string(kSessionTarget) + session_.id();
  event.origintype = kScxmlProcessor;
  const std::string& target = timer.target;
  if (target.empty()) return send_to_session(session_, std::move(event));
  if (target == "#_internal") {
    event.type = EventType::kInternal;
    event.origin.clear();
    event.origintype.clear();
    return raise(std::move(event));
  }
  if (target == "#_parent") {
    event.invokeid = session_.identity_->invokeid;
    if (parent_) return send_to_session(*parent_, std::move(event));
    return raise_communication_error("no session invoked this one, so there is no #_parent", std::move(event.sendid));
  }
  if (target.starts_with(kSessionTarget)) {
    const std::string_view id = std::string_view(target).substr(kSessionTarget.size());
    Session* const session = run_.root.id() == id ? &run_.root : find_invoked(run_.root, id).session;
    if (session != nullptr) return send_to_session(*session, std::move(event));
    if (run_.host.knows_session && run_.host.knows_session(id)) {
      timer.event = std::move(event);
      timer.type = kScxmlProcessor;
      return send_outside(outgoing(std::move(timer)));
    }
    return raise_communication_error(fmt::format("there is no session \"{}\"", id), std::move(event.sendid));
  }
  const std::string_view invokeid = std::string_view(target).substr(2);
  for (Invocation& invocation : session_.invocations_) {
    if (invocation.id != invokeid || (invocation.child && !invocation.child->running())) continue;
    if (invocation.child) return send_to_session(*invocation.child, std::move(event));
    run_.effects.emplace_back(InvokeEvent{session_.id(), invocation.id, std::move(event)});
    return;
  }
  raise_communication_error(fmt::format("there is no invocation \"{}\" running", invokeid), std::move(event.sendid));
}

void Interpreter::send_to_session(Session& target, Event&& event) {
  if (target.external_.size() >= run_.host.limits.events_max) {
    return fail_session(
        "scxml.queue-full",
        fmt::format("more than {} external events wait; the last is {}", run_.host.limits.events_max, event.name),
        run_.place);
  }
  target.external_.push(std::move(event));
}

void Interpreter::send_outside(OutgoingSend&& send) {
  if (is_basic_http(send.type) && send.target.empty()) {
    return raise_communication_error("a <send> over HTTP needs a target", std::move(send.sendid));
  }
  send.delay = Duration(0);
  run_.effects.emplace_back(std::move(send));
  run_.sent = true;
}

bool Interpreter::execute_cancel(const Cancel& cancel) {
  std::string id = cancel.sendid;
  if (cancel.sendid_expr != kNoExpression) {
    auto text = data_->text(cancel.sendid_expr);
    if (!text) {
      raise_error(std::move(text.error()));
      return false;
    }
    id = *std::move(text);
  }
  if (!session_.timers_->empty()) session_.timers_.edit().cancel(id);
  return true;
}

void Interpreter::deliver(Timer timer) {
  dispatch(std::move(timer));
  if (!session_.internal_.empty()) run_to_completion();
}

}  // namespace sentree::scxml
