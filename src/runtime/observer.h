#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "sentree/runtime/stream.h"

namespace sentree::runtime {

/// Somebody outside this process who is given a run's stream in its order, and may be asked before requests.
class Observer {
 public:
  virtual ~Observer() = default;
  /// Hands a message on, if the observer wants it. Never waits. Called in the stream's order.
  virtual void observe(const Message& message) = 0;
  /// Whether it must be asked before this call, "<service>.<method>".
  [[nodiscard]] virtual bool is_gate_of(std::string_view call) const = 0;
  [[nodiscard]] virtual const std::vector<std::string>& gates() const = 0;
  /// Asks it, after all messages handed on before. `decided` is called once, in its thread or before this returns; one
  /// that cannot be asked refuses.
  virtual void ask(const Message& request, Stream::Decided decided) = 0;
  /// Of a durable run: what it is when it has seen everything that was handed on, for `recall`. Nothing: it did not say
  /// so within `patience` [wall time].
  [[nodiscard]] virtual std::optional<Value> remember(Duration patience) = 0;
  /// Begins as it was then, or anew with null, before anything is handed on. Errors: observer.unreachable.
  [[nodiscard]] virtual Result<void> recall(const Value& memory) = 0;
  /// Waits until it has seen everything, tells it that time has passed until `end`, and stops.
  virtual void finish(TimePoint end) = 0;
};

}  // namespace sentree::runtime
