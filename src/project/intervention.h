#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <tuple>
#include <type_traits>
#include <variant>
#include <vector>

#include "sentree/base/diagnostic.h"
#include "sentree/base/message.h"
#include "sentree/base/result.h"
#include "sentree/base/time.h"
#include "sentree/base/value.h"

namespace sentree::text {
struct YamlNode;
}

namespace sentree::project {

class YamlReader;

// What a scenario's timeline, or a person who steers, may do to a run: a struct for each, and what is said of it here
// and beside it in intervention.cpp. From its members follow how entries of files, observations, requests of pages and
// saved states have it. What it may name is in check_intervention.cpp, how it is done in mission/apply.cpp: a kind
// without one of these does not compile.
//
// Calls are "SERVICE.METHOD". In those of messages '*' stands for any text. `count`: how many messages; 0: until it is
// cleared.
namespace intervention {

/// What is known of a kind.
struct Kind {
  std::string_view word;  ///< Its one spelling: in files, in recordings, on the wire and in pages.
  std::string_view does;  ///< For people: "messages are held back".
  bool stands = false;    ///< It stays until it is used up or cleared.
  bool fault = false;     ///< `verify: {faults: …}` may try it.
};

/// A member of a kind, and what it is called. An entry has the members below the kind's word, and a single one as the
/// word's value.
template <class Of, class Type>
struct Member {
  const char* name;
  Type Of::*of;
  bool may_lack;  ///< An entry may do without, and has none that says nothing.
};
inline constexpr bool kMayLack = true;
template <class Of, class Type>
constexpr Member<Of, Type> member(const char* name, Type Of::*of, bool may_lack = false) {
  return {name, of, may_lack};
}
/// visit(member, its value) for each.
template <class What, class Visit>
void each_member(What& what, const Visit& visit) {
  std::apply([&](const auto&... one) { (visit(one, what.*one.of), ...); }, std::remove_const_t<What>::members());
}

/// A call to a service, or to the simulator's test control.
struct Call {
  static constexpr Kind kKind{.word = "call", .does = "a call to a service, or to the simulator"};
  std::string method;
  Value args;  ///< By name.
  static constexpr auto members() { return std::tuple(member("call", &Call::method), member("args", &Call::args)); }
  friend bool operator==(const Call&, const Call&) = default;
};
/// The mission is halted.
struct Stop {
  static constexpr Kind kKind{.word = "stop", .does = "the mission is halted"};
  static constexpr auto members() { return std::tuple(); }
  friend bool operator==(const Stop&, const Stop&) = default;
};
/// A part ends as if its process had been killed.
struct Kill {
  static constexpr Kind kKind{.word = "kill", .does = "a part ends as a killed process does", .fault = true};
  std::string part;
  static constexpr auto members() { return std::tuple(member("part", &Kill::part)); }
  friend bool operator==(const Kill&, const Kill&) = default;
};
/// A part that was killed can be used again.
struct Restart {
  static constexpr Kind kKind{.word = "restart", .does = "what was killed can be used again"};
  std::string part;
  static constexpr auto members() { return std::tuple(member("part", &Restart::part)); }
  friend bool operator==(const Restart&, const Restart&) = default;
};
/// Messages are held back, as by a slow machine or network.
struct Delay {
  static constexpr Kind kKind{.word = "delay", .does = "messages are held back", .stands = true, .fault = true};
  std::string message;  ///< "LEAF.tick", "LEAF.halt", "SERVICE.METHOD" (the request) or "SERVICE.METHOD.reply".
  Duration by{0};
  std::uint64_t count = 0;
  static constexpr auto members() {
    return std::tuple(member("message", &Delay::message), member("by", &Delay::by),
                      member("count", &Delay::count, kMayLack));
  }
  friend bool operator==(const Delay&, const Delay&) = default;
};
/// A service's replies say something else.
struct Falsify {
  static constexpr Kind kKind{.word = "falsify", .does = "a reply says something else", .stands = true, .fault = true};
  std::string call;
  std::string path;  ///< A member of the result, "percentage" or "pose.x"; empty: the result itself.
  Value value;       ///< What it becomes.
  std::uint64_t count = 0;
  static constexpr auto members() {
    return std::tuple(member("call", &Falsify::call), member("path", &Falsify::path, kMayLack),
                      member("value", &Falsify::value), member("count", &Falsify::count, kMayLack));
  }
  friend bool operator==(const Falsify&, const Falsify&) = default;
};
/// A leaf answers something else.
struct Force {
  static constexpr Kind kKind{.word = "force", .does = "a leaf answers something else", .stands = true, .fault = true};
  std::string leaf;
  std::string status;  ///< SUCCESS, FAILURE or RUNNING.
  std::uint64_t count = 0;
  static constexpr auto members() {
    return std::tuple(member("leaf", &Force::leaf), member("status", &Force::status),
                      member("count", &Force::count, kMayLack));
  }
  friend bool operator==(const Force&, const Force&) = default;
};
/// When it is reached, that is observed, and a run that is steered pauses.
struct Breakpoint {
  static constexpr Kind kKind{.word = "breakpoint", .does = "reaching it is observed", .stands = true};
  enum class Point : std::uint8_t { kNode, kState, kMessage };
  Point point = Point::kMessage;
  std::string target;  ///< The node's path, the chart's name ("skill:LEAF", "monitor:NAME") or the observation's name.
  std::string status;  ///< Of a node: that status; empty: any.
  std::string state;   ///< Of a chart: id of the state that is entered.
  // An entry has the target under a name that says which it is.
  static constexpr auto members() {
    return std::tuple(member("target", &Breakpoint::target), member("status", &Breakpoint::status),
                      member("point", &Breakpoint::point), member("state", &Breakpoint::state));
  }
  friend bool operator==(const Breakpoint&, const Breakpoint&) = default;
};
/// One of those that stand ends.
struct Clear {
  static constexpr Kind kKind{.word = "clear", .does = "what stands ends; the first is 1"};
  std::uint64_t id = 0;  ///< Standing ones are numbered from 1 in the order they came.
  static constexpr auto members() { return std::tuple(member("id", &Clear::id)); }
  friend bool operator==(const Clear&, const Clear&) = default;
};
/// Calls fail at once, as if nobody were there.
struct Unreachable {
  static constexpr Kind kKind{.word = "unreachable", .does = "calls find nobody", .stands = true, .fault = true};
  std::string call;
  static constexpr auto members() { return std::tuple(member("call", &Unreachable::call)); }
  friend bool operator==(const Unreachable&, const Unreachable&) = default;
};
/// Calls are served, and what they answer comes too late for who has called.
struct Late {
  static constexpr Kind kKind{.word = "late", .does = "answers come too late", .stands = true, .fault = true};
  std::string call;
  static constexpr auto members() { return std::tuple(member("call", &Late::call)); }
  friend bool operator==(const Late&, const Late&) = default;
};

}  // namespace intervention

/// Something that is done to a run from outside: by a scenario's timeline, or by a person who steers it. The order is
/// that of saved states.
using Intervention =
    std::variant<intervention::Call, intervention::Stop, intervention::Kill, intervention::Restart, intervention::Delay,
                 intervention::Falsify, intervention::Force, intervention::Breakpoint, intervention::Clear,
                 intervention::Unreachable, intervention::Late>;

/// One of each kind, as it is before anything is said of it; in the order of the variant.
[[nodiscard]] const std::vector<Intervention>& every_kind();
[[nodiscard]] const intervention::Kind& kind_of(const Intervention& what);
/// Whether it stays until it is used up or cleared.
[[nodiscard]] inline bool stands(const Intervention& what) { return kind_of(what).stands; }
/// One word: "call", "kill", "delay", … as in a scenario's timeline.
[[nodiscard]] inline std::string_view word_of(const Intervention& what) { return kind_of(what).word; }

/// The keys that an entry has below the kind's word, or for a kind of one member what the word's value is:
/// {"message", "by", "count"}, {"part"}.
[[nodiscard]] std::vector<std::string> keys_of(const Intervention& kind);
/// How many messages it is for; 0: until it is cleared.
[[nodiscard]] std::uint64_t count_of(const Intervention& what);

/// What an entry of a timeline does. Codes: scenario.*, project.*.
[[nodiscard]] Intervention read_intervention(YamlReader& reader, const text::YamlNode& entry, Diagnostics& diagnostics);
/// Likewise of data that say what an entry does, as `to_entry` has them. Error: the first of those.
[[nodiscard]] Result<Intervention> from_entry(const Map& entry);

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
