#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "sentree/base/result.h"
#include "sentree/base/time.h"
#include "sentree/base/value.h"
#include "sentree/project/project.h"
#include "sentree/runtime/scheduler.h"

namespace sentree::runtime {

/// A time during which a durable run had no executive.
struct Gap {
  TimePoint from{};  ///< Run time: the last instant before it.
  TimePoint to{};    ///< Run time at which it went on.
  Duration wall{};   ///< How long nobody was there.
};

/// A moment by the clocks of the machine.
struct WallTime {
  std::string boot;       ///< Which start of which machine `up` counts from.
  std::int64_t up = 0;    ///< Since then, also while it slept [ns]; nobody sets this clock.
  std::int64_t date = 0;  ///< Since 1970 [ns].
};
[[nodiscard]] WallTime wall_time();
/// How long after `a` is `b`; nothing where that is not known: another start of the machine, and a date that went back.
[[nodiscard]] std::optional<Duration> between(const WallTime& a, const WallTime& b);

/// A run that waits longer for its disk does not keep up; looked at after the first second.
inline constexpr double kWaitShareMax = 0.25;

/// What a run pays for its journal.
struct JournalCost {
  std::uint64_t bytes = 0;
  std::uint64_t writes = 0;
  std::uint64_t syncs = 0;
  std::uint64_t snapshots = 0;
  Duration spent{};      ///< Of the run's thread, on all of it.
  Duration waited{};     ///< Of it, for the disk.
  std::string given_up;  ///< Why the run cannot be resumed any more; empty: it could be.
};

struct DurableOptions {
  std::filesystem::path journal;
  /// That of the run that is resumed, in the same folder; empty: none is. What is left of a killed attempt to take its
  /// place goes with it, see `end_journal`.
  std::filesystem::path resumed = {};
  project::JournalSync sync = project::JournalSync::kInterval;
  /// What whoever resumes the run has to know, beside the run itself: kept as it is.
  Value note = {};
  /// The last observation that the recording of the resumed run holds: those behind it are heard again.
  std::uint64_t known = 0;
  /// Returns when what the recording heard so far outlives the process; empty: there is none.
  std::function<void()> settle = {};
  /// Told once, when the journal cannot be written; the run goes on.
  std::function<void(const std::string&)> on_failure = {};
  /// Told once, in the run's thread, when that waits for the disk for more than `kWaitShareMax` of its time.
  std::function<void(const std::string&)> on_slow = {};
  std::function<WallTime()> clock = wall_time;
  /// Wall time between two states of the whole run.
  Duration snapshot_period = std::chrono::seconds(5);
};

/// What a journal says of a run.
struct Journaled {
  std::filesystem::path file;
  Value note;
  std::vector<Gap> gaps;  ///< Of the runs that it resumed.
  std::string state;      ///< Of the whole run, for `mission::restore`.
  // Since then, as `mission::save` made them, in the order written.
  std::vector<std::pair<Place, Value>> inputs;
  std::vector<std::pair<Place, Value>> interventions;  ///< {what, source}.
  /// At the time of `state`: calls that were on their way, {call, sent}, {chart_steps}, how many were executed
  /// elsewhere, {observer, memory} of observers, {decided, decision} of monitors elsewhere, and {timeline_to}.
  std::vector<Value> open;
  List parts;                    ///< Processes that the run has started, as `Journal::parts` was told.
  std::set<std::uint64_t> sent;  ///< Calls that have left since, of methods that must not be asked twice.
  std::set<std::uint64_t> lost;  ///< Steps of charts since, by their number, that nobody executed.
  TimePoint reached{};           ///< The last instant that began.
  WallTime at;                   ///< When that was.
  bool torn = false;             ///< It ends in the middle of a record, which is left out.
  /// Where a record is damaged that whole ones stand behind, in bytes from the file's beginning.
  std::optional<std::size_t> damaged_at;
  std::shared_ptr<void> lock;  ///< While somebody has it, nobody else reads it.
};

/// Reads the journal of a run that is over without having ended.
/// Errors: journal.none (no such file), journal.in-use (the run goes on, or somebody else resumes it),
/// journal.given-up (it could not be written), journal.continued (it was resumed already), journal.damaged.
[[nodiscard]] Result<Journaled> read_journal(const std::filesystem::path& file);
/// Whether a run can go on from it, as far as its head says.
[[nodiscard]] bool waits_to_be_resumed(const std::filesystem::path& file);
/// The name of the recording by which a run was continued, from what is left of its journal; empty: by none.
[[nodiscard]] std::string continued_by(const std::filesystem::path& file);
/// Leaves of a journal only that its run was continued by that recording.
void end_journal(const Journaled& journal, const std::string& continued_by);

/// Writes the journal of one run: records behind a state of the whole run. Each further state makes a new file in the
/// place of the old one, which begins with the state before it: so a journal always reaches back further than what a
/// recording may not have written yet. Written by one thread. What is written has left the process when a call returns.
///
/// When it cannot be written, that is told once and noted in the file if that can be; all else then does nothing.
class Journal {
 public:
  /// Nothing is written before the first `snapshot`.
  explicit Journal(const DurableOptions& options);
  ~Journal();
  Journal(const Journal&) = delete;
  Journal& operator=(const Journal&) = delete;

  void snapshot(TimePoint now, std::string_view state, List open, const std::vector<Gap>& gaps);
  void instant(TimePoint now);
  void input(const Place& where, Value delivery);
  void intervention(const Place& where, Value what, const std::string& source);
  void sent(std::uint64_t call);
  /// Nobody has executed that step of a chart.
  void lost(std::uint64_t step);
  /// The processes that the run has started, from now on.
  void parts(List parts);
  /// Something is about to leave the run that follows from what was written.
  void before_leaving();
  /// The run cannot be resumed any more, and why.
  void give_up(const std::string& why);
  /// The run has ended as it should: there is nothing to resume.
  void remove();
  /// Of what is done outside, for the same account.
  void spent(Duration time);
  [[nodiscard]] JournalCost cost() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace sentree::runtime
