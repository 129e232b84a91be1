#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "sentree/base/result.h"
#include "sentree/base/time.h"
#include "sentree/scxml/chart.h"
#include "sentree/scxml/event.h"
#include "sentree/scxml/host.h"
#include "sentree/scxml/session.h"

namespace sentree::scxml {

/// What one step did.
struct StepInfo {
  bool enabled =
      false;  ///< The event enabled at least one transition (of this session; for a timer: any of its events).
  std::uint32_t microsteps = 0;
  std::uint32_t macrosteps = 0;
};

// Each of these runs to a stable configuration of the session and its children, and appends to `effects`. `now` must
// not run backwards. A session that does not run ignores all but `start`.
// If a bound is exceeded the session ends: status kFailed, `Session::failure` says what and where.

/// Puts `session` at its beginning: a new session of `chart`, whatever it was before.
StepInfo start(const Chart& chart, Session& session, StartOptions options, TimePoint now, Effects& effects,
               const Host& host = {});

/// Delivers one event. Events of type kPlatform and kInternal go the way of the internal queue (error.communication of
/// a send that the host could not deliver), others are external events. An event from a service that `StartInvoke`
/// started carries its invokeid; its end is the event done.invoke.<id>. What is for an invoked chart (`Event::session`)
/// that has gone does nothing.
StepInfo step(const Chart& chart, Session& session, const Event& event, TimePoint now, Effects& effects,
              const Host& host = {});

/// Delivers every delayed send that is due at `now`, in order of due time, each with its own macrostep.
StepInfo step_timers(const Chart& chart, Session& session, TimePoint now, Effects& effects, const Host& host = {});

/// Ends the session as SCXML ends an invocation: the <onexit> of all active states run, invocations are cancelled.
StepInfo cancel(const Chart& chart, Session& session, TimePoint now, Effects& effects, const Host& host = {});

/// Ends the session at once, as one of which a bound was exceeded: `Session::failure` is `why` from then on. For bounds
/// that only its surroundings can know of.
void give_up(Session& session, Diagnostic why);

/// The value of an expression in a stable configuration, for people and tools that look at a session; nothing:
/// undefined. The session stays as it is, whatever the expression does. Errors: scxml.script (it fails or does not
/// parse), scxml.no-data (null data model), scxml.no-value-form.
[[nodiscard]] Result<std::optional<Value>> evaluate(const Chart& chart, const Session& session,
                                                    std::string_view expression, TimePoint now, const Host& host = {});

}  // namespace sentree::scxml
