#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "sentree/base/flat_map.h"
#include "sentree/base/hash128.h"
#include "sentree/monitor/monitor.h"
#include "sentree/monitor/monitor_set.h"
#include "sentree/verify/explore.h"

namespace sentree::verify {

/// Whether a monitor owes something without a bound, which is never done if nothing follows.
[[nodiscard]] bool owes_without_bound(const monitor::Model& model, const monitor::Core& core);
/// Whether something that has to come, with a bound or without, has not come yet. That something comes again (at least
/// every …) is due at all times.
[[nodiscard]] bool is_to_come(const monitor::Model& model, const monitor::Core& core);
/// Whether a run of that length is over before a bound of the requirement can be. How often something comes within
/// one, and what is to come before, is known in any run.
[[nodiscard]] bool outlasts(const monitor::Model& model, Duration run, Duration period);
/// Whether a run of that length that ends where something `is_to_come` tells nothing of the requirement. What has to
/// come again and again does so wherever the run ends: it has been kept if it was due before.
[[nodiscard]] bool leaves_open(const monitor::Model& model, Duration run, Duration period);

/// What a monitor does with the periods of a graph: its states are numbers, and what a sequence of observations does to
/// each of them is found out once.
class MonitorMemory {
 public:
  /// A state of the monitor as it was found first.
  struct Kept {
    monitor::Core core;
    TimePoint at{};           ///< Means nothing but what its own times are relative to.
    bool owes = false;        ///< Something without a bound.
    bool owes_until = false;  ///< With one.
    bool to_come = false;     ///< As `is_to_come` has it.
    bool violated = false;    ///< In the period that led here.
  };
  /// What a period does to it.
  struct Outcome {
    std::uint32_t core = 0;
    bool violated = false;
    bool discharged = false;  ///< At some time it owed nothing without a bound.
    Duration after{};         ///< When it was violated, since the beginning of the period,
    std::string observation;  ///< and by what; empty: time that passed.
    std::string state;
  };

  /// @param graph  May grow. Both are borrowed.
  MonitorMemory(const Graph& graph, const monitor::Model& model);

  /// Its first state; nothing: see `error`.
  [[nodiscard]] std::optional<std::uint32_t> begin();
  /// What the monitor hears of a sequence of the graph: a number, the same for all of which it hears the same.
  [[nodiscard]] std::uint32_t heard(std::uint32_t sequence);
  /// Null: see `error`. Valid for the life of the memory.
  /// @param heard  Of `heard`.
  [[nodiscard]] const Outcome* after(std::uint32_t core, std::uint32_t heard, Duration period);
  /// What of a period that is before `end` of it does to it, likewise.
  [[nodiscard]] const Outcome* before(std::uint32_t core, std::uint32_t heard, Duration end);

  [[nodiscard]] const Kept& kept(std::uint32_t core) const { return cores_[core]; }
  [[nodiscard]] const std::vector<Kept>& all() const { return cores_; }
  [[nodiscard]] bool ever_heard() const { return ever_heard_; }
  /// Why it cannot be judged.
  [[nodiscard]] const std::optional<Diagnostic>& error() const { return error_; }
  /// About.
  [[nodiscard]] std::uint64_t bytes() const { return bytes_ + outcome_of_.bytes(); }

 private:
  std::optional<std::uint32_t> intern(monitor::Core core, TimePoint at, bool violated);
  [[nodiscard]] std::uint32_t cut_short(std::uint32_t heard, Duration period);

  const Graph& graph_;
  const monitor::Model& model_;
  monitor::Dispatch dispatch_;
  // Observations, by what this monitor looks at.
  std::map<std::string, std::uint32_t> alike_;
  std::vector<std::uint32_t> listened_;
  // Of each sequence what it listens to; equal ones are one.
  std::unordered_map<Hash128, std::uint32_t, Hash128Hash> known_;
  std::vector<std::vector<Seen>> heard_;
  std::vector<std::uint32_t> of_sequence_;
  std::map<std::pair<std::uint32_t, Duration>, std::uint32_t> before_;     // what is heard of a period before an end
  std::map<std::pair<std::uint32_t, Duration>, std::uint32_t> cut_short_;  // what is heard of a period that ends early
  std::vector<Kept> cores_;
  std::unordered_map<std::string, std::uint32_t> core_of_;
  std::deque<Outcome> outcomes_;
  FlatMap<std::uint64_t, WordHash> outcome_of_;  // by its state, what it hears, and whether time passes
  bool ever_heard_ = false;
  std::uint64_t bytes_ = 0;
  std::optional<Diagnostic> error_;
  std::vector<std::uint64_t> words_;
  std::string form_;
  Message message_;
};

}  // namespace sentree::verify
