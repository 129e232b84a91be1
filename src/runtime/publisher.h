#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "sentree/runtime/stream.h"

namespace sentree::runtime {

/// Calls of skills in other processes have numbers from here on, those of the run's own process lower ones.
inline constexpr std::uint64_t kCallsElsewhere = std::uint64_t{1} << 40U;

/// Where a skill publishes what it does: the run's stream, or another process's.
class Publisher {
 public:
  virtual ~Publisher() = default;
  virtual void publish(Message message) = 0;
  /// Whether anybody, a gate too, would see an observation of that name; else it is to be passed.
  [[nodiscard]] virtual bool is_heard(mission::ObservationName& /*name*/) { return true; }
  virtual void pass() {}
  /// Publishes a request unless a gate refuses it. Returns what became of it; nothing: `decided` will be told, once,
  /// in any thread.
  virtual std::optional<mission::Admission> request(Message message, Stream::Decided decided) = 0;
  [[nodiscard]] virtual std::uint64_t next_call() = 0;
  /// Names of the calls that `request` may refuse; * stands for any characters.
  [[nodiscard]] virtual std::vector<std::string> gates() const { return {"*"}; }
};

}  // namespace sentree::runtime
