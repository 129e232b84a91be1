#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "sentree/base/message.h"
#include "sentree/base/result.h"
#include "sentree/bt/status.h"
#include "sentree/idl/schema.h"
#include "sentree/project/project.h"

namespace sentree::mission {

/// How a fault lets calls fail.
enum class Failing : std::uint8_t { kUnreachable, kLate };
/// What a call hears that a fault makes late.
inline constexpr std::string_view kMadeLate = "a fault: the answer comes too late";

/// A fault, a forced result or a breakpoint that stands.
struct StandingIntervention {
  std::uint64_t id = 0;
  project::Intervention what;
  std::uint64_t used = 0;  ///< Messages that it has changed, or times that it was reached.
  friend bool operator==(const StandingIntervention&, const StandingIntervention&) = default;
};

/// The delays, falsified replies, failing calls, forced results and breakpoints that stand. A plain value.
class Faults {
 public:
  static constexpr std::size_t kStandingMax = 256;

  Faults() = default;
  explicit Faults(const std::vector<project::DelayFault>& delays);

  /// The number of the next one. Error: steering.too-many.
  [[nodiscard]] Result<std::uint64_t> next_id();
  /// From now on it stands, with a number from `next_id`.
  void add(std::uint64_t id, project::Intervention what);
  /// Error: steering.unknown-id.
  Result<void> clear(std::uint64_t id);
  [[nodiscard]] std::vector<StandingIntervention> list() const;
  /// Whether one of a kind stands.
  template <class Kind>
  [[nodiscard]] bool any() const {
    return std::any_of(entries_.begin(), entries_.end(),
                       [](const Entry& entry) { return std::holds_alternative<Kind>(entry.standing.what); });
  }
  [[nodiscard]] bool empty() const { return entries_.empty(); }

  /// How long a message "LEAF.tick", "LEAF.halt", "SERVICE.METHOD" or "SERVICE.METHOD.reply" is held back: the longest
  /// of the delays that match it, each of which is used once. 0: not at all.
  [[nodiscard]] Duration delay_of(std::string_view message);
  /// Changes a reply to "SERVICE.METHOD". What would not conform to the method stays as it is.
  void falsify(std::string_view call, const idl::Method& method, Value& result);
  /// Whether a call of "SERVICE.METHOD" is unreachable, or late.
  [[nodiscard]] bool fails(Failing how, std::string_view call);
  /// What a leaf answers instead; nothing: the truth.
  [[nodiscard]] std::optional<bt::Status> forced(std::string_view leaf);

  /// Numbers of the breakpoints that an observation, or a node's new status, reaches.
  [[nodiscard]] std::vector<std::uint64_t> reached_by(const Message& message);
  /// Those on states of a chart that are active now and were not when it was looked at last.
  /// @param chart  "skill:LEAF" or "monitor:NAME".
  [[nodiscard]] std::vector<std::uint64_t> reached_in(std::string_view chart,
                                                      const std::function<bool(const std::string& state)>& is_active);

  friend bool operator==(const Faults&, const Faults&) = default;

 private:
  friend struct FaultsMembers;
  struct Entry {
    StandingIntervention standing;
    bool seen = false;    // of a breakpoint on a state: its chart has been looked at
    bool active = false;  // and the state was active then
    friend bool operator==(const Entry&, const Entry&) = default;
  };
  template <class Kind, class Matches, class Use>
  void each(const Matches& matches, const Use& use_entry);

  std::vector<Entry> entries_;
  std::uint64_t last_id_ = 0;
};

}  // namespace sentree::mission
