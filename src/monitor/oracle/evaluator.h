#pragma once

#include <optional>
#include <vector>

#include "sentree/base/message.h"
#include "sentree/monitor/requirement.h"

/// The semantics of requirements over finite traces, as simple as they can be said: no charts, no timers, every
/// position looked at again for every obligation. The judge of what is synthesized; shares nothing with it but the
/// parser.
namespace sentree::monitor::oracle {

struct Outcome {
  bool violated = false;  ///< Else satisfied, for good.
  TimePoint at{};
  std::uint64_t deciding = 0;  ///< Sequence of the observation; 0: silence.
  friend bool operator==(const Outcome&, const Outcome&) = default;
};

/// What is decided of `requirement` over `trace`, which begins at time 0 and ends at `end`, inclusive; in order.
/// A re-arming requirement can be violated several times.
[[nodiscard]] std::vector<Outcome> evaluate(const Requirement& requirement, const std::vector<Message>& trace,
                                            TimePoint end);

}  // namespace sentree::monitor::oracle
