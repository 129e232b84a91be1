#pragma once

#include <string>

#include "sentree/base/result.h"
#include "sentree/scxml/step.h"

namespace sentree::scxml {

/// One call of a function of step.h, as a value: so that another process can make it.
struct StepOrder {
  enum class Kind : std::uint8_t { kStart, kEvent, kTimers, kCancel };

  Kind kind = Kind::kEvent;
  TimePoint now{};
  Event event;           ///< kEvent
  StartOptions options;  ///< kStart
  friend bool operator==(const StepOrder&, const StepOrder&) = default;
};
bool execute(const Chart& chart, Session& session, StepOrder&& order, Effects& effects, const Host& host);

[[nodiscard]] Value save(const StepOrder& order);
/// Error: scxml.bad-order.
[[nodiscard]] Result<StepOrder> restore_order(const Value& saved);

/// Executes a step and tells what came of it: the session, the effects, and what an observer of the chart itself saw.
/// The host's own observer sees nothing. Error: scxml.no-value-form, of data that cannot be saved.
[[nodiscard]] Result<Value> execute_and_tell(const Chart& chart, Session& session, const StepOrder& order, Host host);
/// The other end: does to the session what the step did, and says whether it was enabled. `observer` sees events,
/// transitions and states entered, in their order; it may be null.
/// Errors: scxml.bad-order, those of `restore`; then nothing has been done.
[[nodiscard]] Result<bool> take_step(const Chart& chart, const Value& told, Session& session, Effects& effects,
                                     Observer* observer);

}  // namespace sentree::scxml
