#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "sentree/base/result.h"
#include "sentree/bt/status.h"
#include "sentree/idl/schema.h"
#include "sentree/project/project.h"
#include "sentree/runtime/steering.h"

namespace sentree::runtime {

/// The delays, falsified replies, forced results and breakpoints that stand. From any thread. A question of a kind of
/// which none stands costs a load.
class StandingInterventions {
 public:
  static constexpr std::size_t kStandingMax = 256;

  StandingInterventions() = default;
  explicit StandingInterventions(const std::vector<project::DelayFault>& delays);

  /// The number of the next one. Error: steering.too-many.
  [[nodiscard]] Result<std::uint64_t> next_id();
  /// From now on it stands, with a number from `next_id`.
  void add(std::uint64_t id, project::Intervention what);
  /// Error: steering.unknown-id.
  Result<void> clear(std::uint64_t id);
  [[nodiscard]] std::vector<StandingIntervention> list() const;
  [[nodiscard]] bool any(project::Intervention::Kind kind) const { return count_of(kind) > 0; }

  /// In a replay services answer what they answered then, faults included: no call is delayed or falsified again.
  void spare_calls(bool spared) { calls_spared_ = spared; }
  [[nodiscard]] bool calls_spared() const { return calls_spared_; }

  /// How long a message "LEAF.tick", "LEAF.halt", "SERVICE.METHOD" or "SERVICE.METHOD.reply" is held back: the longest
  /// of the delays that match it, each of which is used once. 0: not at all.
  [[nodiscard]] Duration delay_of(std::string_view message);
  /// Changes a reply to "SERVICE.METHOD". What would not conform to the method stays as it is.
  void falsify(std::string_view call, const idl::Method& method, Value& result);
  /// What a leaf answers instead; nothing: the truth.
  [[nodiscard]] std::optional<bt::Status> forced(std::string_view leaf);

  /// Numbers of the breakpoints that an observation, or a node's new status, reaches.
  [[nodiscard]] std::vector<std::uint64_t> reached_by(const Message& message);
  /// Those on states of a chart that are active now and were not when it was looked at last.
  /// @param chart  "skill:LEAF" or "monitor:NAME".
  [[nodiscard]] std::vector<std::uint64_t> reached_in(std::string_view chart,
                                                      const std::function<bool(const std::string& state)>& is_active);

 private:
  struct Entry {
    StandingIntervention standing;
    bool seen = false;    // of a breakpoint on a state: its chart has been looked at
    bool active = false;  // and the state was active then
  };
  [[nodiscard]] std::size_t count_of(project::Intervention::Kind kind) const {
    return counts_[static_cast<std::size_t>(kind)];
  }
  template <class Matches, class Use>
  void each(project::Intervention::Kind kind, const Matches& matches, const Use& use_entry);

  mutable std::mutex mutex_;
  std::vector<Entry> entries_;
  std::uint64_t last_id_ = 0;
  std::array<std::atomic<std::size_t>, 9> counts_{};  // by kind
  std::atomic<bool> calls_spared_ = false;
};

}  // namespace sentree::runtime
