#pragma once

#include <array>
#include <deque>
#include <mutex>

#include "sentree/studio/history.h"
#include "sentree/studio/json_scan.h"

// What the files of History share.

namespace sentree::studio {

struct PoseValue {
  double x = 0.0;
  double y = 0.0;
  double theta = 0.0;
};

struct BatteryValue {
  double percentage = 0.0;
  double current = 0.0;
  std::optional<double> voltage;
  std::optional<bool> plugged;
  bool charging = false;
};

/// A chart's active states, as they recur.
struct Configuration {
  std::string label;   ///< The innermost ones.
  std::string active;  ///< Places in the drawing, as JSON.
};

struct ChartMoment {
  Place place;
  std::uint32_t configuration = 0;
  bool running = false;
};

struct MonitorMoment {
  Place place;
  std::uint32_t configuration = 0;
  monitor::Verdict verdict = monitor::Verdict::kUndecided;
};

struct RobotTracks {
  Track<PoseValue> pose;
  Track<PoseValue> estimate;
  Track<BatteryValue> battery;
  Track<Place> scan;
  Track<Place> path;
  Track<Place> motion;
  Track<Place> particles;
};

/// What a topic feeds.
struct Feed {
  enum class Kind : std::uint8_t {
    kNone,
    kObservations,
    kCharts,
    kMonitors,
    kLog,
    kScene,
    kBlackboard,
    kViolations,
    kPose,
    kEstimate,
    kScan,
    kPath,
    kMotion,
    kParticles,
    kBattery
  };
  Kind kind = Kind::kNone;
  std::size_t robot = 0;
};

struct History::Impl {
  Impl(const Subject& shown, std::size_t max) : subject(shown), bytes_max(max) {
    nodes.resize(subject.plan.tree.size());
    charts.resize(subject.charts.size());
    monitors.resize(subject.monitors.size());
    robots.resize(subject.robots.size());
    for (const auto& [name, node] : subject.leaves) {
      leaf_indices[name] = leaf_names.size();
      leaf_names.push_back(name);
    }
    outputs.resize(leaf_names.size());
    configurations.push_back({"", "[]"});
  }

  // What an observation does beside being seen.
  enum class Role : std::uint8_t { kPlain, kNodeStatus, kMissionStatus, kReply, kInjection, kDecision, kError };

  Feed feed_of(std::string_view topic) const;
  void take(const Feed& feed, Nanoseconds time, std::string_view json, const Place* place);
  void take_observation(Nanoseconds time, std::string_view json, const Place* place);
  void take_effect(Role role, const Shape& shape, Nanoseconds time, std::string_view data, const Seen& seen);
  void take_chart(Nanoseconds time, std::string_view json, const Place* place);
  void take_monitor(Nanoseconds time, std::string_view json, const Place* place);
  void take_log(Nanoseconds time, std::string_view json);
  void take_robot(const Feed& feed, Nanoseconds time, std::string_view json, const Place* place);
  void mark(Nanoseconds time, std::string_view kind, std::string text, std::uint64_t sequence);
  Place keep(std::string_view json, Nanoseconds time, const Place* place);
  std::uint32_t shape_of(std::string_view name, std::string_view kind, std::string_view source,
                         std::string_view target);
  std::uint32_t configuration_of(std::size_t chart, std::string_view states);
  void make_room();
  void forget_first_block();
  std::size_t index_bytes() const;

  std::string read(const Place& place) const { return texts->read(place); }
  // JSON that may be shown: what comes from a file is read once more.
  std::string sound(std::string_view json) const;

  // Parts of a state (history_state.cpp).
  void append_tree(std::string& out, Nanoseconds time) const;
  void append_chart(std::string& out, std::size_t index, Nanoseconds time) const;
  void append_monitor(std::string& out, std::size_t index, Nanoseconds time) const;
  void append_robot(std::string& out, std::size_t index, Nanoseconds time) const;
  void append_outputs(std::string& out, Nanoseconds time) const;
  void append_obstacles(std::string& out, Nanoseconds time) const;
  void append_doors(std::string& out, Nanoseconds time) const;
  void append(std::string& out, const PartId& part, Nanoseconds time) const;
  std::uint64_t version(const PartId& part) const;
  Moment moment(Nanoseconds time) const;

  const Subject& subject;
  const std::size_t bytes_max;
  mutable std::mutex mutex;
  std::unique_ptr<Texts> texts;
  LiveTexts* live = nullptr;            // `texts` of a run that goes on
  record::Reader* reader = nullptr;     // of a recording
  std::deque<Nanoseconds> block_times;  // when each kept block began

  Nanoseconds begin = 0;
  std::atomic<Nanoseconds> end = 0;
  std::unordered_map<std::string, Feed> feeds;

  Track<Seen> observations;
  std::size_t forgotten = 0;  // observations
  std::vector<Shape> shapes;
  std::vector<Role> roles;
  std::unordered_map<std::string, std::uint32_t> shape_ids;
  std::string key;

  std::vector<Track<std::uint8_t>> nodes;
  std::uint64_t tree_version = 0;
  Track<std::uint8_t> mission;
  std::vector<Track<ChartMoment>> charts;
  std::vector<Track<MonitorMoment>> monitors;
  std::vector<RobotTracks> robots;
  Track<Place> scene;
  Track<Place> blackboard;
  std::vector<std::string> leaf_names;
  std::unordered_map<std::string, std::size_t> leaf_indices;
  std::vector<Track<Place>> outputs;
  std::uint64_t outputs_version = 0;
  std::vector<Configuration> configurations;
  std::unordered_map<std::string, std::uint32_t> configuration_ids;
  Track<Mark> marks;
  std::vector<std::string> violations;
  std::vector<History::Problem> problems;
};

}  // namespace sentree::studio
