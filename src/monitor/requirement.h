#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "sentree/base/result.h"
#include "sentree/base/time.h"

namespace sentree::monitor {

/// What a requirement file may be at most. Beyond: requirement.too-large, requirement.too-deep.
inline constexpr std::size_t kRequirementBytesMax = 1U << 20U;
inline constexpr std::size_t kRequirementsMax = 1'000;
inline constexpr int kConditionNestingMax = 64;
/// Parts of one condition after its definitions have been put in.
inline constexpr std::size_t kConditionPartsMax = 2'000;
/// Of "at most N times".
inline constexpr std::int64_t kTimesMax = 1'000;
/// Of "at most N times per D ticks (events)", which keeps the number of each.
inline constexpr std::int64_t kCountedTimesMax = 32;
/// Of bounds: ten years, or as many ticks or events.
inline constexpr Duration kBoundMax = std::chrono::hours(24 * 3653);
inline constexpr std::int64_t kCountMax = 1'000'000'000;

struct Condition;
/// Immutable and shared: definitions are put in where they are used.
using ConditionPtr = std::shared_ptr<const Condition>;

/// Which observations something is about.
struct Source {
  enum class Kind : std::uint8_t {
    kRequest,      ///< request(service.method)
    kReply,        ///< reply(service.method)
    kError,        ///< error(service.method)
    kLate,         ///< late(service.method)
    kNode,         ///< node(NAME): node.status of that node
    kObservation,  ///< observation(NAME)
  };
  Kind kind = Kind::kObservation;
  std::string observation;  ///< Full name: "battery.getBatteryState.reply".
  std::string service;      ///< Of a call.
  std::string method;
  std::string from;    ///< Only observations of that source (a leaf, a node); empty: of all.
  ConditionPtr where;  ///< Over the observation's members; null: all.
  SourceSpan span;     ///< Of the name.
  SourceSpan from_span;

  /// "reply(battery.getBatteryState from X where …)", as written.
  [[nodiscard]] std::string text() const;
  friend bool operator==(const Source& a, const Source& b);
};

/// A node of a condition or of a value.
///
/// Three-valued (Kleene): a value is unknown until an observation has set it, and what depends on it may be.
struct Condition {
  enum class Kind : std::uint8_t {
    kNumber,   ///< `number` `unit`
    kText,     ///< `text`; a bare word if `is_word`
    kTruth,    ///< true, false: `number` is 1 or 0
    kName,     ///< A name not resolved yet (`unit` is "event": an event's); only between parser and resolution
    kDefined,  ///< A definition's name `text`; operand 0 is its content
    kValue,    ///< What the latest observation of `source` holds at `path`
    kMember,   ///< Inside where: the observation's member at `path`
    kEvent,    ///< An observation of `source`, at its instant
    kUpdated,  ///< An observation that sets a value of operand 0
    kRises,    ///< Operand 0 was known false before this observation and is true now
    kFalls,
    kNot,
    kAnd,
    kOr,
    kImplies,
    kEqual,
    kNotEqual,
    kLess,
    kLessEqual,
    kGreater,
    kGreaterEqual,
    kNegate,
    kAdd,
    kSubtract,
    kMultiply,
    kDivide,
  };
  Kind kind = Kind::kTruth;
  std::string text;
  double number = 0;
  std::string unit;  ///< kNumber, and kDefined whose definition declares one.
  bool is_word = false;
  std::vector<ConditionPtr> operands;
  std::optional<Source> source;
  std::vector<std::string> path;
  SourceSpan span;
};
/// Where a value or member is in the data of its observation: "args.name", "result.level".
[[nodiscard]] std::vector<std::string> path_in_data(const Condition& value);
/// What a chain of definitions' names stands for in the end; anything else itself.
[[nodiscard]] const Condition& inside(const Condition& condition);

/// As written, normalised: one space, no superfluous parentheses, definitions by name.
[[nodiscard]] std::string to_text(const Condition& condition);
/// True if it can hold only at an instant: it contains an event, updated, rises or falls.
[[nodiscard]] bool is_momentary(const Condition& condition);
/// True if a part of it is true or false whatever is observed.
[[nodiscard]] bool has_constant(const Condition& condition);
/// Every observation that it depends on, each once, in order of appearance. (Same source, other path: once.)
void collect_sources(const Condition& condition, std::vector<Source>& sources);

/// How long: closed at its end.
struct Bound {
  enum class Unit : std::uint8_t {
    kTime,
    kTicks,   ///< Root ticks (mission.tick) after the start; the bound is over at the one after the last.
    kEvents,  ///< Observations that the requirement mentions, after the start; over with the last.
  };
  Unit unit = Unit::kTime;
  Duration time{};
  std::int64_t count = 0;
  SourceSpan span;

  /// "500 ms", "10 ticks".
  [[nodiscard]] std::string text() const;
  friend bool operator==(const Bound& a, const Bound& b) {
    return a.unit == b.unit && a.time == b.time && a.count == b.count;
  }
};

/// Where a requirement applies. The observation that opens it belongs to it, the one that closes it does not.
struct Scope {
  enum class Kind : std::uint8_t {
    kGlobally,
    kBefore,      ///< `close`: from the start until it holds for the first time.
    kAfter,       ///< `open`: from when it first holds.
    kBetween,     ///< As kAfterUntil, but only what is closed counts: violations are told at its end.
    kAfterUntil,  ///< Again and again.
    kWhile,       ///< `open`: whenever it holds.
  };
  Kind kind = Kind::kGlobally;
  ConditionPtr open;
  ConditionPtr close;
  /// It can end, and begin again.
  [[nodiscard]] bool can_reopen() const {
    return kind == Kind::kBetween || kind == Kind::kAfterUntil || kind == Kind::kWhile;
  }
};

enum class Pattern : std::uint8_t {
  kAlways,        ///< always P
  kNever,         ///< never P
  kEventually,    ///< eventually P [within D]
  kRespond,       ///< whenever P, Q within D; without bound: eventually
  kImmediately,   ///< whenever P, Q immediately
  kKeepFor,       ///< whenever P, keep Q for D
  kKeepUntil,     ///< whenever P, keep Q until R
  kNotFor,        ///< whenever P, not Q for D
  kPrecedes,      ///< P precedes Q [by at most D]
  kAtLeastEvery,  ///< P at least every D
  kAtMost,        ///< P at most N times [per D]
  kHoldsFor,      ///< P holds for at least D
};

enum class Importance : std::uint8_t { kInfo, kMinor, kMajor, kCritical };
/// "info", "minor", "major", "critical".
[[nodiscard]] std::string_view to_string(Importance importance);

struct Requirement {
  std::string name;
  Importance importance = Importance::kMajor;
  bool re_arming = false;  ///< Starts over after a violation, and counts.
  std::string prose;       ///< The sentence for people; may be empty.
  Scope scope;
  Pattern pattern = Pattern::kAlways;
  ConditionPtr p;
  ConditionPtr q;
  ConditionPtr r;
  std::optional<Bound> bound;
  std::int64_t times = 0;  ///< kAtMost.
  ConditionPtr assuming;   ///< Null: nothing.
  SourceSpan span;         ///< Of the name.

  /// The formal part, as written, normalised: "globally, always level >= 20 %".
  [[nodiscard]] std::string text() const;
};

struct Definition {
  std::string name;
  std::vector<std::string> parameters;
  bool is_event = false;
  std::string unit;      ///< Declared; empty: none.
  ConditionPtr content;  ///< With other definitions put in where there are no parameters.
  bool is_used = false;  ///< By a requirement, or by a definition that is.
  SourceSpan span;
};

/// A `.req` file.
struct RequirementFile {
  std::string file;
  std::vector<Definition> definitions;  ///< In the order written.
  std::vector<Requirement> requirements;
};

/// Reads a requirement file; the grammar is in docs/requirements.md. All problems at once.
/// Codes: requirement.syntax, requirement.unknown-name, requirement.unknown-member, requirement.constant,
/// requirement.duplicate, requirement.bound, requirement.momentary, requirement.too-large, requirement.too-deep.
/// Cost: O(size).
[[nodiscard]] Loaded<RequirementFile> parse_requirements(std::string_view source, const std::string& file = {});

/// Every observation that a requirement listens to, each once; mission.tick if it counts ticks.
[[nodiscard]] std::vector<Source> sources_of(const Requirement& requirement);

/// Units that numbers can have: "%", "ratio", "m", "rad", …
[[nodiscard]] std::vector<std::string_view> units();
[[nodiscard]] bool is_unit(std::string_view text);

}  // namespace sentree::monitor
