#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "sentree/base/message.h"
#include "sentree/base/value.h"
#include "sentree/record/foxglove.h"

namespace sentree::record {

// What is recorded of a run, before it is JSON: one struct for each sort of message of docs/recording.md. Numbers are
// as a reader of the recording finds them, rounded where it rounds.

/// A skill's chart whose configuration changed; topic "/charts".
struct ChartRecord {
  std::string leaf;
  bool running = false;
  std::vector<std::string> states;   ///< The active ones, in document order.
  std::optional<std::int64_t> last;  ///< The transition taken last, by its place in the document.
  std::string event;                 ///< The event that it got last.
  Value data;                        ///< A map; null while it does not run.
};

/// A monitor whose configuration or data changed; topic "/monitors".
struct MonitorRecord {
  std::string monitor;
  std::string verdict;  ///< "undecided", "violated" or "satisfied".
  std::vector<std::string> states;
  std::string standing;                  ///< Why it is undecided.
  std::optional<std::int64_t> deadline;  ///< When silence will decide [ns].
  std::optional<std::int64_t> violations;
  std::string event;  ///< The observation that it got; empty: time passed.
  Value data;         ///< A map; null: it was recorded without.
};

/// A line of the log; topic "/log".
struct LogRecord {
  LogLevel level = LogLevel::kInfo;
  std::string name;
  std::string text;
};

/// The tree's entries; topic "/blackboard".
struct BlackboardRecord {
  Value entries;
};

/// A violation with its witness; topic "/violations".
struct ViolationRecord {
  Value violation;
};

/// What stands in the world; topic "/scene".
struct SceneRecord {
  std::vector<SceneThing> things;
};

/// Where a robot is, or thinks that it is; topics "/<robot>/pose", "/<robot>/pose_estimate".
struct PoseRecord {
  std::string robot;
  bool is_estimate = false;
  Pose pose_map;
};

/// Topic "/<robot>/scan".
struct ScanRecord {
  std::string robot;
  Pose laser_map;
  std::vector<double> ranges;  ///< [m]; 0: nothing within range.
};

/// Topic "/<robot>/path".
struct PathRecord {
  std::string robot;
  std::vector<Pose> poses_map;
};

/// Some particles of a robot's localization; topic "/<robot>/particles".
struct ParticlesRecord {
  std::string robot;
  std::vector<Pose> poses_map;
};

/// Topic "/<robot>/motion".
struct MotionRecord {
  std::string robot;
  double speed = 0.0;  ///< [m/s]
  double turn = 0.0;   ///< [rad/s]
  std::string status;  ///< Of its navigation.
  std::optional<Pose> goal_map;
};

/// Topic "/<robot>/battery".
struct BatteryRecord {
  std::string robot;
  double percent = 0.0;
  double current_A = 0.0;
  bool charging = false;
  std::optional<double> voltage_V;
  std::optional<bool> plugged;
};

/// One message of a run's recording; a `Message` is an observation.
using RunRecord =
    std::variant<Message, ChartRecord, MonitorRecord, LogRecord, BlackboardRecord, ViolationRecord, SceneRecord,
                 PoseRecord, ScanRecord, PathRecord, ParticlesRecord, MotionRecord, BatteryRecord>;

}  // namespace sentree::record
