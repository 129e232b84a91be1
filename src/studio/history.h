#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "sentree/base/time.h"
#include "sentree/base/value.h"
#include "sentree/bt/status.h"
#include "sentree/monitor/monitor.h"
#include "sentree/record/run_record.h"
#include "sentree/studio/observations.h"
#include "sentree/studio/subject.h"
#include "sentree/studio/track.h"

namespace sentree::studio {

/// Bytes that the history of a run that goes on may take; beyond it the oldest is forgotten.
inline constexpr std::size_t kHistoryBytesMax = std::size_t{256} << 20U;
/// Names, sources and targets of observations, and configurations of charts, that are told apart; what comes beyond is
/// counted as the last one.
inline constexpr std::size_t kShapesMax = std::size_t{1} << 18U;
/// Marks of the timeline that are kept.
inline constexpr std::size_t kMarksMax = 100'000;

/// What one sort of observation has in common; there are few, whatever the run's length.
struct Shape {
  std::string name;
  std::string kind;
  std::string source;
  std::string target;
};

/// What is wanted of the observations; an empty text wants all.
struct Filter {
  std::string text;     ///< Somewhere in the JSON of the observation, in any case.
  std::string service;  ///< Calls of it.
  std::string leaf;     ///< From it or to it.
  std::string kind;
  std::string name;  ///< With '*' for any text.
  [[nodiscard]] bool matches(const Shape& shape) const;
};

/// One lane of the timeline, or one mark on it.
struct Mark {
  std::string_view kind;  ///< "violation", "injection", "intervention", "veto", "problem", "gap".
  std::string text;
  std::uint64_t sequence = 0;
  std::optional<Nanoseconds> from = {};  ///< Of a gap: when it began.
};

/// Everything that a page can show of a run, now or at any time before: what was recorded of it, by the time at which
/// it held. A run that goes on is taken in record by record, as its recorder makes them; of a recording, an index is
/// made, and the rest read when it is asked for.
///
/// From any thread. What is asked for takes microseconds, but for `find`, `messages` and `lanes`, which take a lock for
/// a slice of their work at a time.
class History {
 public:
  /// Of a run that goes on; `subject` is borrowed.
  explicit History(const Subject& subject, std::size_t bytes_max = kHistoryBytesMax);
  /// Of a recording; `reader` is borrowed. Empty until `read_index`.
  History(const Subject& subject, record::Reader& reader);
  ~History();

  /// What was recorded of a run that goes on.
  void take(TimePoint time, const record::RunRecord& record);
  /// Reads the whole recording once, or until `goes_on` returns false; others may look at what has been read. What is
  /// wrong with the file is left out. One thread.
  void read_index(const std::function<bool()>& goes_on = [] { return true; });
  /// How much of the recording has been read: from 0 to 1.
  [[nodiscard]] double read_so_far() const;

  // ---- What there is ----
  [[nodiscard]] Nanoseconds begin() const;  ///< From when on it knows everything.
  [[nodiscard]] Nanoseconds end() const;    ///< Of the newest thing.

  /// The parts that a state consists of; `index` tells charts, monitors and robots apart.
  enum class Part : std::uint8_t {
    kMission,
    kTree,
    kBlackboard,
    kOutputs,
    kObstacles,
    kDoors,
    kChart,
    kMonitor,
    kRobot
  };
  struct PartId {
    Part part = Part::kMission;
    std::size_t index = 0;
  };
  [[nodiscard]] const std::vector<PartId>& parts() const { return parts_; }
  /// The part at `time` as JSON at the end of `out`. Nothing is appended where nothing is known.
  void append(std::string& out, const PartId& part, Nanoseconds time) const;

  /// What the last observation at `time` or before says.
  struct Moment {
    std::uint64_t sequence = 0;
    std::uint64_t tick = 0;
    std::size_t observations = 0;  ///< Observations up to there that are kept or were forgotten.
  };
  [[nodiscard]] Moment moment(Nanoseconds time) const;

  /// A part as it is now; renewed by `refresh` when its version has changed.
  struct Fragment {
    std::uint64_t version = static_cast<std::uint64_t>(-1);
    std::string json;
  };
  struct Present {
    Nanoseconds time = 0;
    Nanoseconds begin = 0;
    Moment moment;
  };
  /// All parts at one and the same moment, the present one, in the order of `parts`.
  Present refresh(std::vector<Fragment>& fragments) const;

  // ---- Observations; positions count from the first of the run, also those that were forgotten ----
  [[nodiscard]] std::size_t first_observation() const;
  [[nodiscard]] std::size_t end_observation() const;
  /// Position of the first with that sequence number or a greater one.
  [[nodiscard]] std::size_t find_sequence(std::uint64_t sequence) const;
  /// Position of the first later than `time`.
  [[nodiscard]] std::size_t after_time(Nanoseconds time) const;
  /// The observation as the page gets it; empty if it is not kept.
  [[nodiscard]] std::string observation(std::size_t position) const;
  /// That observations have had so far, each once.
  [[nodiscard]] std::vector<std::string> names() const;
  /// Goes from `position` up to `budget` observations forwards or backwards, until one matches.
  struct Found {
    std::optional<std::size_t> position;
    std::size_t next = 0;  ///< Where to go on.
    bool at_end = false;   ///< There are no more.
  };
  [[nodiscard]] Found find(const Filter& filter, std::size_t position, bool forwards, std::size_t budget) const;

  // ---- The timeline ----
  /// {lanes, marks} of a stretch of time, drawn that many pixels wide.
  [[nodiscard]] Value lanes(Nanoseconds from, Nanoseconds to, int width) const;

  /// What became of a node when: {rows: [[time, status]], the newest `max`; left_out: how many came before}.
  [[nodiscard]] Value transitions(bt::NodeId node, std::size_t max) const;

  /// The `violation` messages so far, and how many.
  [[nodiscard]] std::size_t violations() const;
  [[nodiscard]] std::string violation(std::size_t index) const;
  /// The problems so far.
  struct Problem {
    Nanoseconds time = 0;
    std::string text;
  };
  [[nodiscard]] std::size_t problems() const;
  [[nodiscard]] Problem problem(std::size_t index) const;

  [[nodiscard]] std::size_t bytes() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
  std::vector<PartId> parts_;
};

}  // namespace sentree::studio
