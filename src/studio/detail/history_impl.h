#pragma once

#include <array>
#include <deque>
#include <map>
#include <mutex>

#include "sentree/studio/detail/record_reader.h"
#include "sentree/studio/history.h"

// What the files of History share.

namespace sentree::studio {

struct BatteryValue {
  double percentage = 0.0;
  double current = 0.0;
  std::optional<double> voltage;
  std::optional<bool> plugged;
  bool charging = false;
};

/// Texts that a page is sent, or members of one. Of a run that goes on they are kept as they are sent; of a recording
/// the record is kept, of which they are made anew.
enum class Shown : std::uint8_t {
  kObservation,
  kOutputs,       ///< Of the reply to a tick: an object.
  kChart,         ///< Members last, event, data.
  kMonitor,       ///< Members standing, deadline, states.
  kMonitorChart,  ///< Members event, data, each with a comma before it; nothing: it was recorded without.
  kBlackboard,
  kObstacles,
  kScan,  ///< Members scan_pose, scan.
  kPath,
  kParticles,
  kMotion,  ///< Members twist, goal, navigation.
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
  Nanoseconds since = 0;  ///< From which on it has been in this configuration.
};

struct MonitorMoment {
  Place place;
  std::uint32_t configuration = 0;
  Nanoseconds since = 0;  ///< As of a chart.
  monitor::Verdict verdict = monitor::Verdict::kUndecided;
  std::int64_t violations = 0;
  Place chart = {};
};

struct SceneMoment {
  Place place;
  std::vector<std::string> closed_doors;
};

struct RobotTracks {
  Track<record::Pose> pose;
  Track<record::Pose> estimate;
  Track<BatteryValue> battery;
  Track<Place> scan;
  Track<Place> path;
  Track<Place> motion;
  Track<Place> particles;
};

// The texts (history_state.cpp); nothing is appended where the record is of another sort.
void append_shown(std::string& out, Shown what, const Message& message);
void append_shown(std::string& out, Shown what, const record::ChartRecord& record);
void append_shown(std::string& out, Shown what, const record::MonitorRecord& record);
void append_shown(std::string& out, Shown what, const record::BlackboardRecord& record);
void append_shown(std::string& out, Shown what, const record::SceneRecord& record);
void append_shown(std::string& out, Shown what, const record::ScanRecord& record);
void append_shown(std::string& out, Shown what, const record::PathRecord& record);
void append_shown(std::string& out, Shown what, const record::ParticlesRecord& record);
void append_shown(std::string& out, Shown what, const record::MotionRecord& record);

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
  enum class Role : std::uint8_t {
    kPlain,
    kNodeStatus,
    kMissionStatus,
    kReply,
    kInjection,
    kDecision,
    kResumed,
    kError
  };

  void take(Nanoseconds time, const record::RunRecord& record, const Place* place);
  // One for each sort of record; `place` is where it is in the recording, null in a run that goes on.
  void add(Nanoseconds time, const Message& message, const Place* place);
  void add(Nanoseconds time, const record::ChartRecord& record, const Place* place);
  void add(Nanoseconds time, const record::MonitorRecord& record, const Place* place);
  void add(Nanoseconds time, const record::LogRecord& record, const Place* place);
  void add(Nanoseconds time, const record::BlackboardRecord& record, const Place* place);
  void add(Nanoseconds time, const record::ViolationRecord& record, const Place* place);
  void add(Nanoseconds time, const record::SceneRecord& record, const Place* place);
  void add(Nanoseconds time, const record::PoseRecord& record, const Place* place);
  void add(Nanoseconds time, const record::ScanRecord& record, const Place* place);
  void add(Nanoseconds time, const record::PathRecord& record, const Place* place);
  void add(Nanoseconds time, const record::ParticlesRecord& record, const Place* place);
  void add(Nanoseconds time, const record::MotionRecord& record, const Place* place);
  void add(Nanoseconds time, const record::BatteryRecord& record, const Place* place);
  void take_over(Nanoseconds time, const Message& message);
  void add_effect(Role role, const Shape& shape, Nanoseconds time, const Message& message, const Seen& seen,
                  const Place* place);
  void mark(Nanoseconds time, std::string_view kind, std::string text, std::uint64_t sequence,
            std::optional<Nanoseconds> from = {});
  RobotTracks* robot_of(std::string_view name);
  template <class Record>
  Place keep(Shown what, const Record& record, Nanoseconds time, const Place* place) {
    if (place != nullptr) return *place;
    text.clear();
    append_shown(text, what, record);
    return keep_text(time);
  }
  Place keep_text(Nanoseconds time);
  std::uint32_t shape_of(const Message& message);
  Seen seen_of(const Message& message, const Place& place) {
    return {message.sequence, place, shape_of(message), static_cast<std::uint32_t>(message.tick)};
  }
  // Of a part of a recording.
  Observations::Entries observations_of(std::uint32_t part);
  std::uint32_t configuration_of(std::size_t chart, const std::vector<std::string>& states);
  void make_room();
  void forget_first_block();
  std::size_t index_bytes() const;

  // What is kept at a place, of something that was at that time. Where it cannot be read, it says nothing, in its form.
  std::string shown(Shown what, const Place& place, Nanoseconds time) const;

  // Parts of a state (history_state.cpp).
  void append_tree(std::string& out, Nanoseconds time) const;
  void append_chart(std::string& out, std::size_t index, Nanoseconds time) const;
  void append_monitor(std::string& out, std::size_t index, Nanoseconds time) const;
  void append_robot(std::string& out, std::size_t index, Nanoseconds time) const;
  void append_outputs(std::string& out, Nanoseconds time) const;
  void append_doors(std::string& out, Nanoseconds time) const;
  void append(std::string& out, const PartId& part, Nanoseconds time) const;
  std::uint64_t version(const PartId& part) const;
  Moment moment(Nanoseconds time) const;

  const Subject& subject;
  const std::size_t bytes_max;
  mutable std::mutex mutex;
  std::unique_ptr<Texts> texts;
  LiveTexts* live = nullptr;                  // `texts` of a run that goes on
  record::Reader* reader = nullptr;           // of a recording
  std::map<record::ChannelId, Topic> topics;  // of a recording
  std::atomic<std::size_t> parts_read = 0;    // of a recording
  mutable RecordReader records;               // of a recording
  std::deque<Nanoseconds> block_times;        // when each kept block began

  Nanoseconds begin = 0;
  std::atomic<Nanoseconds> end = 0;
  Observations observations;
  std::size_t forgotten = 0;  // observations
  std::vector<Shape> shapes;
  std::vector<Role> roles;
  std::unordered_map<std::string, std::uint32_t> shape_ids;
  std::string key;
  std::string text;  // that is being made

  std::vector<Track<std::uint8_t>> nodes;
  std::uint64_t tree_version = 0;
  Track<std::uint8_t> mission;
  std::vector<Track<ChartMoment>> charts;
  std::vector<Track<MonitorMoment>> monitors;
  std::vector<RobotTracks> robots;
  Track<SceneMoment> scene;
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
