#include "sentree/scxml/step.h"

#include <utility>

#include "sentree/base/assert.h"
#include "sentree/scxml/detail/interpreter.h"

namespace sentree::scxml {

namespace {

// Tells the watchdog that a step executes.
class Watched {
 public:
  explicit Watched(ExecutionWatch* watch) : watch_(watch), thread_(WatchThread::present()) {
    if (watch_) watch_->begin_step();
    if (thread_) thread_->begin_step();
  }
  ~Watched() {
    if (thread_) thread_->end_step();
    if (watch_) watch_->end_step();
  }
  Watched(const Watched&) = delete;
  Watched& operator=(const Watched&) = delete;

 private:
  ExecutionWatch* watch_;
  ExecutionWatch* thread_;
};

}  // namespace

/// The engine's way into a session.
struct SessionAccess {
  static bool ready(const Chart& chart, Session& session) {
    if (!session.running()) return false;
    SENTREE_ASSERT(session.fingerprint_ == chart.fingerprint());
    if (!session.heap_.data_lost) return true;
    give_up(
        session,
        session.heap_.unsaveable->value_or(Diagnostic{
            Severity::kError, "scxml.no-value-form", "the session is a copy of one whose data cannot be copied", {}}));
    return false;
  }

  static void settle(Run& run, const Chart& chart, Session& session) {
    if (session.external_.empty() && session.invocations_.empty()) return;
    Interpreter::run_family(run, chart, session, nullptr);
  }

  // The one whose timer is due first, at `now` at the latest.
  static void find_due(Session& session, const Chart& chart, Session* parent, TimePoint now,
                       Interpreter::Relative& best) {
    if (session.running() && !session.timers_->empty() && session.timers_->front().due <= now &&
        (!best.session || session.timers_->front().due < best.session->timers_->front().due)) {
      best = {&session, &chart, parent};
    }
    for (Invocation& invocation : session.invocations_) {
      if (invocation.child) find_due(*invocation.child, invocation.child.chart(), &session, now, best);
    }
  }
  static Timer take_timer(Session& session) { return session.timers_.edit().pop(); }
};

StepInfo start(const Chart& chart, Session& session, StartOptions options, TimePoint now, Effects& effects,
               const Host& host) {
  const Watched watched(host.watch);
  reset_session(chart, session, std::move(options.session_id), options.seed);
  Run run{session, now, effects, host, {}};
  if (chart.obstacle()) {
    give_up(session, *chart.obstacle());
    return run.info;
  }
  {
    Interpreter interpreter(run, chart, session, nullptr);
    interpreter.start(options.data);
  }
  SessionAccess::settle(run, chart, session);
  return run.info;
}

StepInfo step(const Chart& chart, Session& session, const Event& event, TimePoint now, Effects& effects,
              const Host& host) {
  const Watched watched(host.watch);
  Run run{session, now, effects, host, {}};
  if (!SessionAccess::ready(chart, session)) return run.info;
  const auto deliver = [&](const Chart& to_chart, Session& to, Session* parent, const Event& what) {
    Interpreter interpreter(run, to_chart, to, parent);
    if (what.type == EventType::kExternal)
      interpreter.process_external_event(what);
    else
      interpreter.process_platform_event(what);
  };
  if (event.session.empty()) {
    deliver(chart, session, nullptr, event);
  } else if (const auto child = Interpreter::find_invoked(session, session.id() + "." + event.session);
             child.session != nullptr && child.session->running()) {
    Event what = event;
    what.session.clear();
    const Chart held = *child.chart;  // the delivery may end the invocation whose chart this is
    deliver(held, *child.session, child.parent, what);
  }
  // What follows, events that the session sends to itself, was not enabled by this event.
  const bool enabled = run.info.enabled;
  SessionAccess::settle(run, chart, session);
  run.info.enabled = enabled;
  return run.info;
}

StepInfo step_timers(const Chart& chart, Session& session, TimePoint now, Effects& effects, const Host& host) {
  const Watched watched(host.watch);
  Run run{session, now, effects, host, {}};
  if (SessionAccess::ready(chart, session)) SessionAccess::settle(run, chart, session);
  while (SessionAccess::ready(chart, session) && !(run.sent && host.yield_after_send)) {
    Interpreter::Relative owner;
    SessionAccess::find_due(session, chart, nullptr, now, owner);
    if (!owner.session) break;
    {
      // Held here: the delivery may end the invocation whose chart this is.
      const Chart owner_chart = *owner.chart;
      Timer timer = SessionAccess::take_timer(*owner.session);
      Interpreter interpreter(run, owner_chart, *owner.session, owner.parent);
      interpreter.deliver(std::move(timer));
    }
    SessionAccess::settle(run, chart, session);
  }
  return run.info;
}

StepInfo cancel(const Chart& chart, Session& session, TimePoint now, Effects& effects, const Host& host) {
  const Watched watched(host.watch);
  Run run{session, now, effects, host, {}};
  if (!SessionAccess::ready(chart, session)) return run.info;
  Interpreter interpreter(run, chart, session, nullptr);
  interpreter.cancel();
  return run.info;
}

Result<std::optional<Value>> evaluate(const Chart& chart, const Session& session, std::string_view expression,
                                      TimePoint now, const Host& host) {
  if (auto reason = session.unsaveable()) return tl::unexpected(*std::move(reason));
  if (session.status() == SessionStatus::kNew) return fail("scxml.no-data", "the session has not been started");
  const Watched watched(host.watch);
  Session copy = session;
  Effects effects;
  Run run{copy, now, effects, host, {}};
  Interpreter interpreter(run, chart, copy, nullptr);
  return interpreter.evaluate(expression);
}

}  // namespace sentree::scxml
