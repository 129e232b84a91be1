#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "sentree/scxml/chart.h"
#include "sentree/scxml/session.h"

namespace sentree::scxml {

/// Charts that are larger have no plain steps.
inline constexpr std::size_t kPlainStatesMax = 128;
inline constexpr std::size_t kPlainVariablesMax = 64;
/// Events in one plain step, and delayed ones that wait; what has more is left to `step`.
inline constexpr std::size_t kPlainEventsMax = 16;
inline constexpr std::size_t kPlainTimersMax = 1'000;

/// What an expression reads of an event, or computes. Texts are borrowed.
struct PlainValue {
  enum class Kind : std::uint8_t {
    kUnknown,  ///< Only `step` can tell.
    kUndefined,
    kNull,
    kBool,
    kNumber,
    kText,
    kObject,  ///< Some object or list; nothing more is known of it.
  };
  Kind kind;
  bool of_variable;  ///< kText: borrowed of the session.
  std::uint32_t size;
  union {
    bool boolean;
    double number;
    const char* characters;
  };

  static PlainValue of(Kind kind) { return {.kind = kind, .of_variable = false, .size = 0, .number = 0}; }
  static PlainValue of(bool v) { return {.kind = Kind::kBool, .of_variable = false, .size = 0, .boolean = v}; }
  static PlainValue of(double v) { return {.kind = Kind::kNumber, .of_variable = false, .size = 0, .number = v}; }
  static PlainValue of(std::string_view text);
  /// As expressions see it.
  static PlainValue of(const Value& value);
  [[nodiscard]] std::string_view text() const { return {characters, size}; }
  [[nodiscard]] bool truthy() const;
};

/// Members of `_event.data` that plans read, each once, as written: "result.percentage".
class PlainPaths {
 public:
  /// Its place among them.
  std::uint32_t add(std::string path);
  [[nodiscard]] const std::vector<std::string>& all() const { return paths_; }
  /// Of each, the names of the members on the way.
  [[nodiscard]] std::vector<std::vector<std::string>> members() const;

 private:
  std::vector<std::string> paths_;
};

/// What the members of `map` at `members` are: undefined where the last is missing, unknown where one before it is.
/// `hint`: where each was found last, looked at first; may be null.
[[nodiscard]] PlainValue plain_member(const Value* map, const std::vector<std::string>& members, std::uint32_t* hint);

/// Steps of one chart that take an external event of one name, as far as all that happens in them is plain: data are
/// assigned and events raised, timers set and cancelled, one atomic state left for another. Most steps of a chart that
/// watches are such, and they need nothing of what Appendix D does with sets of states.
///
/// A plan is what is known of them beforehand: for each state the transitions that the event may enable, where they
/// lead, and conditions and executable content as code over data and members of the event. Immutable; threads can share
/// it.
class PlainPlan {
 public:
  struct Content;

  /// Nothing: no such step can be plain. `paths`: gets what the plan reads of events.
  [[nodiscard]] static std::optional<PlainPlan> make(const Chart& chart, std::string_view event, PlainPaths& paths);

  /// Takes the step if it is plain: the session is then what `step` would have made of it. False: the session is as it
  /// was, and `step` must be called.
  /// @param members   The event's data at the places of `paths`, in their order.
  /// @param observer  Is told of the states that were entered, when the step is done, and of nothing else.
  bool step(Session& session, const PlainValue* members, TimePoint now, Observer& observer) const;
  /// The transitions that the event enables, whether or not a step that takes them is plain; see `enabled_by`. Nothing:
  /// only that can tell.
  [[nodiscard]] std::optional<std::vector<TransitionIndex>> enabled(const Session& session,
                                                                    const PlainValue* members) const;
  /// No step changes timers.
  [[nodiscard]] bool keeps_timers() const;

 private:
  explicit PlainPlan(std::shared_ptr<const Content> content) : content_(std::move(content)) {}
  std::shared_ptr<const Content> content_;
};

}  // namespace sentree::scxml
