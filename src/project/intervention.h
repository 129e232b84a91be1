#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <variant>

#include "sentree/base/diagnostic.h"
#include "sentree/base/message.h"
#include "sentree/base/time.h"
#include "sentree/base/value.h"

namespace sentree::text {
struct YamlNode;
}

namespace sentree::project {

class YamlReader;

// What a scenario's timeline, or a person who steers, may do to a run: a struct for each, with its one spelling in
// files, on the wire and in pages. How it is written, read and told is beside it in intervention.cpp, what it may name
// in check_intervention.cpp: a kind without one of these does not compile.
//
// Calls are "SERVICE.METHOD". In those of messages '*' stands for any text. `count`: how many messages; 0: until it is
// cleared.
namespace intervention {

/// A call to a service, or to the simulator's test control.
struct Call {
  static constexpr std::string_view kWord = "call";
  std::string method;
  Value args;  ///< By name.
  friend bool operator==(const Call&, const Call&) = default;
};
/// The mission is halted.
struct Stop {
  static constexpr std::string_view kWord = "stop";
  friend bool operator==(const Stop&, const Stop&) = default;
};
/// A part ends as if its process had been killed.
struct Kill {
  static constexpr std::string_view kWord = "kill";
  std::string part;
  friend bool operator==(const Kill&, const Kill&) = default;
};
/// A part that was killed can be used again.
struct Restart {
  static constexpr std::string_view kWord = "restart";
  std::string part;
  friend bool operator==(const Restart&, const Restart&) = default;
};
/// Messages are held back, as by a slow machine or network.
struct Delay {
  static constexpr std::string_view kWord = "delay";
  std::string message;  ///< "LEAF.tick", "LEAF.halt", "SERVICE.METHOD" (the request) or "SERVICE.METHOD.reply".
  Duration by{0};
  std::uint64_t count = 0;
  friend bool operator==(const Delay&, const Delay&) = default;
};
/// A service's replies say something else.
struct Falsify {
  static constexpr std::string_view kWord = "falsify";
  std::string call;
  std::string path;  ///< A member of the result, "percentage" or "pose.x"; empty: the result itself.
  Value value;       ///< What it becomes.
  std::uint64_t count = 0;
  friend bool operator==(const Falsify&, const Falsify&) = default;
};
/// A leaf answers something else.
struct Force {
  static constexpr std::string_view kWord = "force";
  std::string leaf;
  std::string status;  ///< SUCCESS, FAILURE or RUNNING.
  std::uint64_t count = 0;
  friend bool operator==(const Force&, const Force&) = default;
};
/// When it is reached, that is observed, and a run that is steered pauses.
struct Breakpoint {
  static constexpr std::string_view kWord = "breakpoint";
  enum class Point : std::uint8_t { kNode, kState, kMessage };
  Point point = Point::kMessage;
  std::string target;  ///< The node's path, the chart's name ("skill:LEAF", "monitor:NAME") or the observation's name.
  std::string status;  ///< Of a node: that status; empty: any.
  std::string state;   ///< Of a chart: id of the state that is entered.
  friend bool operator==(const Breakpoint&, const Breakpoint&) = default;
};
/// One of those that stand ends.
struct Clear {
  static constexpr std::string_view kWord = "clear";
  std::uint64_t id = 0;  ///< Standing ones are numbered from 1 in the order they came.
  friend bool operator==(const Clear&, const Clear&) = default;
};
/// Calls fail at once, as if nobody were there.
struct Unreachable {
  static constexpr std::string_view kWord = "unreachable";
  std::string call;
  friend bool operator==(const Unreachable&, const Unreachable&) = default;
};
/// Calls are served, and what they answer comes too late for who has called.
struct Late {
  static constexpr std::string_view kWord = "late";
  std::string call;
  friend bool operator==(const Late&, const Late&) = default;
};

}  // namespace intervention

/// Something that is done to a run from outside: by a scenario's timeline, or by a person who steers it. The order is
/// that of saved states.
using Intervention =
    std::variant<intervention::Call, intervention::Stop, intervention::Kill, intervention::Restart, intervention::Delay,
                 intervention::Falsify, intervention::Force, intervention::Breakpoint, intervention::Clear,
                 intervention::Unreachable, intervention::Late>;

/// Whether it stays until it is used up or cleared.
[[nodiscard]] bool stands(const Intervention& what);

/// How many messages it is for; 0: until it is cleared.
[[nodiscard]] std::uint64_t count_of(const Intervention& what);

/// One word: "call", "kill", "delay", … as in a scenario's timeline.
[[nodiscard]] std::string_view word_of(const Intervention& what);

/// What an entry of a timeline does. Codes: scenario.*, project.*.
[[nodiscard]] Intervention read_intervention(YamlReader& reader, const text::YamlNode& entry, Diagnostics& diagnostics);

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
