#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "sentree/record/recorder.h"
#include "sentree/runtime/run.h"
#include "sentree/text/file.h"

namespace sentree::replay {

/// Between two samples of the robot, and between two snapshots of everything [run time].
inline constexpr Duration kSamplePeriod = std::chrono::milliseconds(100);
inline constexpr Duration kSnapshotPeriod = std::chrono::seconds(5);
/// Observations of each monitor's trail that a snapshot keeps, the latest: the recording has them all, and they decide
/// nothing.
inline constexpr std::size_t kSnapshotTrailMax = 64;
/// Octets of a larger saved run are not read.
inline constexpr std::int64_t kSnapshotStateMax = 64 << 20;
/// Larger project files are not attached.
inline constexpr std::size_t kAttachedFileMax = 64U << 20U;

/// Names in a recording of ours.
inline constexpr std::string_view kRunMetadata = "sentree.run";
inline constexpr std::string_view kResultMetadata = "sentree.result";
inline constexpr std::string_view kSnapshotTopic = "/snapshots";
/// The observations "scenario.injection" once more, so that they are found without reading the others.
inline constexpr std::string_view kInterventionsTopic = "/interventions";
/// In `kRunMetadata` of a run in real time: what faults hold back of leaves is observed ("<leaf>.tick.delayed").
inline constexpr const char* kTellsDelays = "tells_delays";
/// Likewise: a JSON list of the leaves whose skills are executed elsewhere. Of the others it is observed when a timer
/// rings ("<leaf>.timer.taken"), unless the run is durable.
inline constexpr const char* kLeavesElsewhere = "leaves_elsewhere";
/// Before the names of attached project files.
inline constexpr std::string_view kProjectPrefix = "project/";

struct RecordingOptions {
  std::string library = "sentree";
  record::Compression compression = record::Compression::kZstd;
  /// Told once when the disk is full or fails; the run goes on without recording.
  std::function<void(const std::string&)> on_failure;
  /// A violation as people read it; empty: without.
  std::function<std::string(const runtime::MonitorReport&)> story = {};
  /// See record::RecorderOptions.
  std::function<void(TimePoint, record::RunRecord)> tap = {};
  /// The same.
  record::Audience* audience = nullptr;
  /// Of the run, beside what is known of its plan.
  std::vector<std::pair<std::string, std::string>> facts = {};
};

/// By monitor, why it says nothing that it is undecided (`monitor::vacuity`); only those of which that is so.
[[nodiscard]] Map vacuities(const runtime::RunReport& report);

/// Records one run: every observation, the states of tree, charts, monitors and robot, the log, and what is needed to
/// run it again (project files, options, a snapshot every 5 s of run time).
///
/// In virtual time the same run gives the same bytes: times are the run's, and nothing else is recorded of the machine.
class RunRecorder {
 public:
  /// @param files  What the project consists of, as a `text::ReadLog` kept it while the plan was made.
  RunRecorder(const project::Plan& plan, const std::vector<text::ReadFile>& files, std::unique_ptr<record::Sink> sink,
              RecordingOptions options);
  /// Returns when what was recorded so far is in the sink.
  void flush();
  ~RunRecorder();

  /// Makes a run with these options be recorded. Call it last: it wraps the callbacks that are there.
  void install(runtime::RunOptions& options);
  /// The tree's entries at a time, as `bt::export_blackboard` gives them: of a mission that is not executed here. What
  /// is as it was written last is not written again.
  void blackboard(TimePoint time, const Value& entries);
  /// See record::Recorder; from any thread.
  [[nodiscard]] Result<std::uint32_t> follow(decltype(RecordingOptions::tap) tap);
  /// Ends the recording with what came out.
  record::RecorderReport finish(const runtime::RunReport& report);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace sentree::replay
