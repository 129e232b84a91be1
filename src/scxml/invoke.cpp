#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "sentree/base/assert.h"
#include "sentree/scxml/detail/interpreter.h"
#include "sentree/scxml/loader.h"

namespace sentree::scxml {
namespace {

bool is_scxml_type(std::string_view type) {
  return type.empty() || type == "scxml" || type == "http://www.w3.org/TR/scxml" ||
         type == "http://www.w3.org/TR/scxml/";
}

}  // namespace

Interpreter::Relative Interpreter::find_invoked(Session& session, std::string_view id) {
  for (Invocation& invocation : session.invocations_) {
    if (!invocation.child || !invocation.child->running()) continue;
    if (invocation.child->id() == id) return {invocation.child.get(), &invocation.child.chart(), &session};
    if (const Relative found = find_invoked(*invocation.child, id); found.session != nullptr) return found;
  }
  return {};
}

void Interpreter::invoke_entered_states() {
  Scratch& s = *scratch_;
  const StateSet entered = s.to_invoke;
  s.to_invoke.clear();
  s.has_to_invoke = false;
  entered.for_each([&](StateIndex state) {
    for (const std::uint32_t index : model_.state_code[state].invokes) {
      if (!running()) return;
      if (auto started = start_invocation(index); !started) {
        const bool missing = started.error().code == "scxml.unreadable";
        raise_error(std::move(started.error()), {}, missing ? kErrorCommunication : kErrorExecution);
      }
    }
  });
}

Result<void> Interpreter::start_invocation(std::uint32_t index) {
  const Invoke& invoke = model_.invokes[index];
  const Limits& limits = run_.host.limits;
  if (session_.invocations_.size() >= limits.invocations_max) {
    return fail("scxml.too-many-invocations", fmt::format("more than {} invocations at once", limits.invocations_max));
  }
  if (run_.depth >= limits.invocation_depth_max) {
    return fail("scxml.too-deep", fmt::format("invocations are nested more than {} deep", limits.invocation_depth_max));
  }
  Invocation invocation;
  invocation.invoke = index;
  invocation.state = invoke.state;
  invocation.id = invoke.id;
  if (invocation.id.empty()) {
    // SCXML 6.4.1: "stateid.platformid".
    invocation.id = make_id(model_.states[invoke.state].id, ".");
    if (invoke.idlocation != kNoExpression) {
      if (auto assigned = data_->assign_value(invoke.idlocation, Value(invocation.id)); !assigned) return assigned;
    }
  }
  auto type = text_of(invoke.type);
  if (!type) return tl::unexpected(std::move(type.error()));
  auto src = text_of(invoke.src);
  if (!src) return tl::unexpected(std::move(src.error()));
  Payload parameters;
  parameters.namelist = invoke.payload.namelist;
  parameters.params = invoke.payload.params;
  auto params = payload_data(parameters, true);
  if (!params) return tl::unexpected(std::move(params.error()));
  Map data = *params ? std::move(*(*params)->as_map()) : Map();

  if (!is_scxml_type(*type)) {
    const auto& offered = run_.host.invoke_types;
    if (std::find(offered.begin(), offered.end(), *type) == offered.end()) {
      return fail("scxml.unknown-type", fmt::format("nothing here can be invoked with type \"{}\"", *type));
    }
    std::optional<Value> content;
    if (invoke.payload.has_content) {
      Payload only_content;
      only_content.has_content = true;
      only_content.content = invoke.payload.content;
      only_content.content_expr = invoke.payload.content_expr;
      auto value = payload_data(only_content, true);
      if (!value) return tl::unexpected(std::move(value.error()));
      content = *std::move(value);
    }
    run_.effects.emplace_back(StartInvoke{session_.id(), invocation.id, *std::move(type), *std::move(src),
                                          std::move(content), std::move(data), chart_.span(invoke.place)});
    session_.invocations_.push_back(std::move(invocation));
    return {};
  }

  auto chart = child_chart(invoke, *src);
  if (!chart) return tl::unexpected(std::move(chart.error()));
  const Chart child_model = *std::move(chart);
  invocation.child = ChildSession(child_model);
  Session& child = *invocation.child;
  reset_session(child_model, child, fmt::format("{}.{}", session_.id(), invocation.id), session_.rng_.next());
  child.identity_.edit().parent = session_.id();
  child.identity_.edit().invokeid = invocation.id;
  session_.invocations_.push_back(std::move(invocation));
  ++run_.depth;
  {
    Interpreter interpreter(run_, child_model, child, &session_);
    interpreter.start(data);
  }
  --run_.depth;
  return {};
}

Result<Chart> Interpreter::child_chart(const Invoke& invoke, const std::string& src) {
  if (invoke.child) return *invoke.child;
  const std::string file = src.empty() ? std::string() : seen_from(model_.folder, src);
  std::string source;
  if (!src.empty()) {
    if (invoke.src.expr == kNoExpression && !invoke.src_text.empty()) {
      source = invoke.src_text;
    } else if (!invoke.src_missing.empty()) {
      return fail("scxml.unreadable", fmt::format("\"{}\" cannot be read: {}", src, invoke.src_missing));
    } else if (!run_.host.read) {
      return fail("scxml.unreadable", fmt::format("\"{}\" cannot be read: no other documents are available here", src));
    } else {
      auto text = run_.host.read(file);
      if (!text) return fail("scxml.unreadable", std::move(text.error().message));
      source = *std::move(text);
    }
  } else if (invoke.payload.content_expr != kNoExpression) {
    auto value = data_->evaluate(invoke.payload.content_expr);
    if (!value) return tl::unexpected(std::move(value.error()));
    const std::string* xml = *value ? xml_text(**value) : nullptr;
    source = xml ? *xml : *value ? std::string((*value)->text()) : std::string();
  } else {
    source = invoke.payload.content_source;
  }
  LoadOptions options;
  options.read = run_.host.read;
  Loaded<Chart> loaded = load_in(src.empty() ? model_.folder : folder_of(file), source, file, options);
  if (loaded.value) return *std::move(loaded.value);
  const auto error = std::find_if(loaded.diagnostics.begin(), loaded.diagnostics.end(),
                                  [](const Diagnostic& d) { return d.severity == Severity::kError; });
  return fail("scxml.bad-invocation", fmt::format("the invoked chart cannot be loaded: {}", to_string(*error)));
}

void Interpreter::cancel_invocations_of(StateIndex state) {
  for (std::size_t i = session_.invocations_.size(); i-- > 0;) {
    if (session_.invocations_[i].state == state) cancel_invocation(i);
  }
}

void Interpreter::cancel_invocation(std::size_t position) {
  Invocation invocation = std::move(session_.invocations_[position]);
  session_.invocations_.erase(session_.invocations_.begin() + static_cast<std::ptrdiff_t>(position));
  if (invocation.child) {
    if (!invocation.child->running()) return;  // it ended by itself, and what it sent counts
    Interpreter interpreter(run_, invocation.child.chart(), *invocation.child, &session_);
    interpreter.cancel();
  } else {
    run_.effects.emplace_back(CancelInvoke{session_.id(), invocation.id});
  }
  // SCXML 6.4.3: nothing that a cancelled invocation has sent is processed.
  session_.external_.drop_from(invocation.id);
}

void Interpreter::apply_finalize_and_autoforward(const Event& event) {
  for (std::size_t i = 0; i < session_.invocations_.size(); ++i) {
    const Invocation& invocation = session_.invocations_[i];
    const Invoke& invoke = model_.invokes[invocation.invoke];
    if (!event.invokeid.empty() && event.invokeid == invocation.id && invoke.has_finalize) {
      if (invoke.finalize.empty())
        apply_default_finalize(invoke, event);
      else
        execute(invoke.finalize);
    }
    if (!invoke.autoforward || (invocation.child && !invocation.child->running())) continue;
    Event copy = event;
    if (invocation.child)
      send_to_session(*invocation.child, std::move(copy));
    else
      run_.effects.emplace_back(InvokeEvent{session_.id(), invocation.id, std::move(copy)});
  }
}

// SCXML 6.5.2: an empty <finalize> copies what came back under the names of namelist and <param location>.
void Interpreter::apply_default_finalize(const Invoke& invoke, const Event& event) {
  if (!event.data) return;
  for (const auto* list : {&invoke.payload.namelist, &invoke.payload.params}) {
    for (const Param& param : *list) {
      const Value* value = event.data->find(param.name);
      if (!value || param.location == kNoExpression) continue;
      if (auto assigned = data_->assign_value(param.location, *value); !assigned) {
        raise_error(std::move(assigned.error()));
      }
    }
  }
}

bool Interpreter::run_family(Run& run, const Chart& chart, Session& session, Session* parent) {
  const auto waits = [&](std::string_view invokeid) {
    const EventQueue& events = session.external_;
    return std::any_of(events.begin(), events.end(), [&](const Event& event) { return event.invokeid == invokeid; });
  };
  bool again = true;
  while (again && !must_yield(run)) {
    again = false;
    if (session.running() && !session.external_.empty()) {
      const Event event = session.external_.pop();
      Interpreter interpreter(run, chart, session, parent);
      interpreter.process_external_event(event);
      again = true;
      if (run.info.macrosteps > run.host.limits.macrosteps_max) {
        interpreter.fail_session(
            "scxml.endless-step",
            fmt::format(
                "sessions keep sending to each other: more than {} macrosteps in one step; the last event was {}",
                run.host.limits.macrosteps_max, event.name),
            run.place);
      }
    }
    if (session.status_ == SessionStatus::kFailed) return false;
    for (std::size_t i = 0; i < session.invocations_.size(); ++i) {
      Session* child = session.invocations_[i].child.get();
      if (!child) continue;
      const Chart child_model = session.invocations_[i].child.chart();
      const std::uint32_t before = run.info.macrosteps;
      ++run.depth;
      const bool ok = run_family(run, child_model, *child, &session);
      --run.depth;
      again |= run.info.macrosteps != before;
      if (!ok) {
        session.failure_ = child->failure_;
        session.status_ = SessionStatus::kFailed;
        return false;
      }
      // SCXML 6.5: what it sent before it ended is finalized too.
      const bool is_heard = session.running() && waits(session.invocations_[i].id);
      if (!child->running() && !is_heard)
        session.invocations_.erase(session.invocations_.begin() + static_cast<std::ptrdiff_t>(i--));
    }
    again |= session.running() && !session.external_.empty();
  }
  return true;
}

}  // namespace sentree::scxml
