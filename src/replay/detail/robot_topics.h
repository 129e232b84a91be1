#pragma once

#include <optional>
#include <string>
#include <vector>

#include "sentree/base/time.h"
#include "sentree/record/recorder.h"
#include "sentree/sim/state.h"
#include "sentree/sim/world.h"

namespace sentree::replay {

/// Writes the simulated robot and its world into a recording, in Foxglove's schemas: pose, scan, path, motion,
/// particles and battery of each robot, the map, and what stands in the world.
class RobotTopics {
 public:
  RobotTopics(record::Recorder& recorder, const sim::World& world);

  /// What has changed since the last sample. A pose that stays is repeated once a second.
  void sample(const sim::State& state, TimePoint now);

 private:
  struct Motion {
    sim::Twist2 twist;
    std::optional<sim::Pose2> goal;  // while it is pursued
    sim::NavigationStatus status = sim::NavigationStatus::kIdle;
    friend bool operator==(const Motion&, const Motion&) = default;
  };
  struct Robot {
    record::ChannelId truth = 0;
    record::ChannelId estimate = 0;
    record::ChannelId scan = 0;
    record::ChannelId path = 0;
    record::ChannelId battery = 0;
    record::ChannelId motion = 0;
    record::ChannelId particles = 0;
    sim::Pose2 last_truth;
    sim::Pose2 last_estimate;
    TimePoint posed = TimePoint::min();
    TimePoint scanned = TimePoint::min();
    std::vector<sim::Vec2> last_path;
    sim::Battery last_battery;
    std::optional<Motion> last_motion;
    TimePoint particles_at = TimePoint::min();
    std::optional<sim::Pose2> filtered;  // odometry at the filter's last turn that was written
  };
  void sample_robot(const sim::RobotSpec& spec, const sim::RobotState& state, Robot& robot, TimePoint now);
  void sample_motion(const sim::RobotSpec& spec, const sim::RobotState& state, Robot& robot, TimePoint now);
  void sample_particles(const sim::RobotSpec& spec, const sim::RobotState& state, Robot& robot, TimePoint now);
  void write_map(TimePoint now);
  void write_scene(const sim::State& state, TimePoint now);

  record::Recorder& recorder_;
  const sim::World& world_;
  std::vector<Robot> robots_;
  record::ChannelId map_ = 0;
  record::ChannelId scene_ = 0;
  bool begun_ = false;
  std::vector<sim::Obstacle> obstacles_;
  std::vector<sim::Door> doors_;
};

}  // namespace sentree::replay
