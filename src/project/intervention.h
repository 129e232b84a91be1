#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "sentree/base/message.h"
#include "sentree/base/time.h"
#include "sentree/base/value.h"

namespace sentree::project {

/// Something that is done to a run from outside: by a scenario's timeline, or by a person who steers it.
struct Intervention {
  enum class Kind : std::uint8_t {
    kCall,         ///< A call to a service, or to the simulator's test control.
    kStop,         ///< The mission is halted.
    kKill,         ///< A part ends as if its process had been killed.
    kRestart,      ///< A part that was killed can be used again.
    kDelay,        ///< Messages are held back, as by a slow machine or network.
    kFalsify,      ///< A service's replies say something else.
    kForce,        ///< A leaf answers something else.
    kBreakpoint,   ///< When it is reached, that is observed, and a run that is steered pauses.
    kClear,        ///< One of those that stand ends.
    kUnreachable,  ///< Calls fail at once, as if nobody were there.
    kLate,         ///< Calls are served, and what they answer comes too late for who has called.
  };
  enum class Point : std::uint8_t { kNode, kState, kMessage };

  Kind kind = Kind::kCall;
  /// kCall: "SERVICE.METHOD". kKill, kRestart: the part's name. kDelay: "LEAF.tick", "LEAF.halt", "SERVICE.METHOD" (the
  /// request) or "SERVICE.METHOD.reply". kFalsify, kUnreachable, kLate: "SERVICE.METHOD". kForce: the leaf.
  /// kBreakpoint: the node's path, the chart's name ("skill:LEAF", "monitor:NAME"), or the observation's name. In those
  /// of messages
  /// '*' stands for any text.
  std::string target;
  Value args;          ///< kCall: by name.
  Duration by{0};      ///< kDelay.
  std::string path;    ///< kFalsify: a member of the result, "percentage" or "pose.x"; empty: the result itself.
  Value value;         ///< kFalsify: what it becomes.
  std::string status;  ///< kForce: SUCCESS, FAILURE or RUNNING. kBreakpoint on a node: that status; empty: any.
  Point point = Point::kMessage;  ///< kBreakpoint: what it is on.
  std::string state;              ///< kBreakpoint on a chart: id of the state that is entered.
  std::uint64_t count = 0;        ///< kDelay, kFalsify, kForce: how many messages; 0: until it is cleared.
  std::uint64_t id = 0;           ///< kClear: which; standing ones are numbered from 1 in the order they came.

  friend bool operator==(const Intervention&, const Intervention&) = default;

  /// Whether it stays until it is used up or cleared.
  [[nodiscard]] bool stands() const {
    return kind == Kind::kDelay || kind == Kind::kFalsify || kind == Kind::kForce || kind == Kind::kBreakpoint ||
           kind == Kind::kUnreachable || kind == Kind::kLate;
  }
};

/// One word: "call", "kill", "delay", … as in a scenario's timeline.
[[nodiscard]] std::string_view to_string(Intervention::Kind kind);

/// What an entry of a timeline says of it: {"delay": {"message": "battery.*", "by": "2 s"}}.
[[nodiscard]] Map to_entry(const Intervention& what);

/// In one line: "delay battery.* by 2 s".
[[nodiscard]] std::string describe(const Intervention& what);

/// The observation "scenario.injection" that tells of it. Its data are `to_entry` and `what`: the call, else the kind;
/// `id`, if it stands. (Of a call: `what` and `args`.)
[[nodiscard]] Message injection_message(const Intervention& what, const std::string& source, std::uint64_t id);
/// What such an observation says was done; nothing if it is none, or says nothing that we know.
[[nodiscard]] std::optional<Intervention> intervention_of(const Message& message);

/// "12.5 s": as a scenario file has it, to the nanosecond.
[[nodiscard]] std::string exact_seconds(Duration duration);

}  // namespace sentree::project
