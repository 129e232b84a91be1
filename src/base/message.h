#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "sentree/base/time.h"
#include "sentree/base/value.h"

namespace sentree {

enum class MessageKind { kRequest, kReply, kError, kEvent };

[[nodiscard]] std::string_view to_string(MessageKind kind);

/// Lamport's logical clock (Lamport 1978): an effect has a greater stamp than its cause, whatever the hosts' clocks
/// say.
using CausalStamp = std::uint64_t;

/// Everything that passes between layers: what monitors, recorder and studio observe.
///
/// `name` is the full name of the observation, e.g. "battery.getBatteryState.reply", "mission.tick".
/// `data` holds what is particular to it: `args` of a call, `result` of a reply, `kind` and
/// `message` of an error, `status` of a leaf.
struct Message {
  std::uint64_t sequence = 0;  ///< Place in the run's total order, from 1; 0 before it is published.
  TimePoint time{};            ///< When it was published, on the run's clock.
  CausalStamp stamp = 0;
  MessageKind kind = MessageKind::kEvent;
  std::string source;  ///< Who sent it: a leaf, a service, "mission", "scenario".
  std::string target;  ///< Whom it is for; empty for events.
  std::string name;
  std::uint64_t call = 0;  ///< Joins a request with its outcome; 0 for events.
  std::uint64_t tick = 0;  ///< Number of the root tick during which it was published, from 1; 0 before the first.
  Value data;

  friend bool operator==(const Message&, const Message&) = default;
};

/// The message as one map, as a chart sees it in `_event.data`: source, target, call, tick, time [s],
/// then the members of `data`; those cannot replace the facts before them.
[[nodiscard]] Value event_data(const Message& message);

/// One line of JSON; the same message gives the same text.
[[nodiscard]] std::string to_json(const Message& message);

}  // namespace sentree
