#include "sentree/studio/detail/record_reader.h"

#include <simdjson.h>

#include <algorithm>
#include <cmath>

#include "sentree/record/observation.h"
#include "sentree/text/json.h"

namespace sentree::studio {

namespace {

using simdjson::dom::element;
using simdjson::dom::element_type;
using Depth = RecordReader::Depth;

std::optional<std::int64_t> integer_of(const element& from) {
  std::int64_t number = 0;
  if (from.type() != element_type::INT64 || from.get_int64().get(number) != simdjson::SUCCESS) return std::nullopt;
  return number;
}

std::optional<double> number_of(const element& from) {
  double number = 0.0;
  if (from.get_double().get(number) != simdjson::SUCCESS) return std::nullopt;
  return number;
}

std::optional<bool> boolean_of(const element& from) {
  bool truth = false;
  if (from.get_bool().get(truth) != simdjson::SUCCESS) return std::nullopt;
  return truth;
}

std::string text_of(const element& from) {
  std::string_view text;
  return from.get_string().get(text) == simdjson::SUCCESS ? std::string(text) : std::string();
}

std::uint64_t count_of(const element& from) {
  const auto number = integer_of(from);
  return number && *number > 0 ? static_cast<std::uint64_t>(*number) : 0;
}

// Calls `take(name, value)` for each member; nothing happens if it is no object.
template <class Take>
void each_member(const element& from, Take&& take) {
  simdjson::dom::object members;
  if (from.get_object().get(members) != simdjson::SUCCESS) return;
  for (const auto& [name, member] : members) take(name, member);
}

template <class Take>
void each_item(const element& from, Take&& take) {
  simdjson::dom::array items;
  if (from.get_array().get(items) != simdjson::SUCCESS) return;
  for (const element item : items) take(item);
}

// Recursion is bounded by the depth that the parser accepts.
Value value_of(const element& from) {
  switch (from.type()) {
    case element_type::NULL_VALUE: return {};
    case element_type::BOOL: return *boolean_of(from);
    case element_type::INT64: return *integer_of(from);
    case element_type::UINT64:
    case element_type::DOUBLE: return *number_of(from);
    case element_type::STRING: return text_of(from);
    case element_type::ARRAY: {
      List list;
      each_item(from, [&](const element& item) { list.push_back(value_of(item)); });
      return list;
    }
    case element_type::OBJECT: {
      Map map;
      each_member(from, [&](std::string_view name, const element& member) { map[name] = value_of(member); });
      return map;
    }
  }
  return {};
}

std::vector<std::string> texts_of(const element& from) {
  std::vector<std::string> texts;
  each_item(from, [&](const element& item) { texts.push_back(text_of(item)); });
  return texts;
}

record::Pose pose_of(const element& from) {
  record::Pose pose;
  double z = 0.0;
  double w = 1.0;
  each_member(from, [&](std::string_view name, const element& member) {
    const bool is_position = name == "position";
    if (!is_position && name != "orientation") return;
    each_member(member, [&](std::string_view axis, const element& number) {
      if (axis.size() != 1) return;
      double* to = is_position ? (axis == "x"   ? &pose.x
                                  : axis == "y" ? &pose.y
                                                : nullptr)
                               : (axis == "z"   ? &z
                                  : axis == "w" ? &w
                                                : nullptr);
      if (to != nullptr) *to = number_of(number).value_or(*to);
    });
  });
  pose.theta = 2 * std::atan2(z, w);
  return pose;
}

std::vector<record::Pose> poses_of(const element& from) {
  std::vector<record::Pose> poses;
  each_item(from, [&](const element& item) { poses.push_back(pose_of(item)); });
  return poses;
}

// A box or a disc: the first one.
void read_body(const element& from, bool disc, record::SceneThing& thing, bool& has_body) {
  each_item(from, [&](const element& body) {
    if (has_body) return;
    has_body = true;
    thing.disc = disc;
    each_member(body, [&](std::string_view name, const element& member) {
      if (name == "pose") thing.pose_map = pose_of(member);
      if (name != "size") return;
      each_member(member, [&](std::string_view axis, const element& number) {
        if (axis == "x") thing.length_m = number_of(number).value_or(0.0);
        if (axis == "y") thing.width_m = number_of(number).value_or(0.0);
      });
    });
  });
}

Message read_observation(const element& from, TimePoint time, Depth depth) {
  Message message;
  message.time = time;
  each_member(from, [&](std::string_view name, const element& member) {
    if (name == "sequence")
      message.sequence = count_of(member);
    else if (name == "stamp")
      message.stamp = count_of(member);
    else if (name == "call")
      message.call = count_of(member);
    else if (name == "tick")
      message.tick = count_of(member);
    else if (name == "source")
      message.source = text_of(member);
    else if (name == "target")
      message.target = text_of(member);
    else if (name == "name")
      message.name = text_of(member);
    else if (name == "kind") {
      const std::string kind = text_of(member);
      for (const MessageKind known :
           {MessageKind::kRequest, MessageKind::kReply, MessageKind::kError, MessageKind::kEvent}) {
        if (to_string(known) == kind) message.kind = known;
      }
    } else if (name == "data" && (depth == Depth::kWhole || message.name.empty() || changes_state(message))) {
      message.data = value_of(member);
    }
  });
  return message;
}

record::ChartRecord read_chart(const element& from, Depth depth) {
  record::ChartRecord chart;
  each_member(from, [&](std::string_view name, const element& member) {
    if (name == "leaf")
      chart.leaf = text_of(member);
    else if (name == "running")
      chart.running = boolean_of(member).value_or(false);
    else if (name == "states")
      chart.states = texts_of(member);
    else if (name == "last")
      chart.last = integer_of(member);
    else if (name == "event")
      chart.event = text_of(member);
    else if (name == "data" && depth == Depth::kWhole)
      chart.data = value_of(member);
  });
  return chart;
}

record::MonitorRecord read_monitor(const element& from, Depth depth) {
  record::MonitorRecord monitor;
  each_member(from, [&](std::string_view name, const element& member) {
    if (name == "monitor")
      monitor.monitor = text_of(member);
    else if (name == "verdict")
      monitor.verdict = text_of(member);
    else if (name == "states")
      monitor.states = texts_of(member);
    else if (name == "standing")
      monitor.standing = text_of(member);
    else if (name == "deadline")
      monitor.deadline = integer_of(member);
    else if (name == "violations")
      monitor.violations = integer_of(member);
    else if (name == "event")
      monitor.event = text_of(member);
    else if (name == "data" && depth == Depth::kWhole)
      monitor.data = value_of(member);
  });
  return monitor;
}

record::LogRecord read_log(const element& from) {
  record::LogRecord line;
  each_member(from, [&](std::string_view name, const element& member) {
    if (name == "level") {
      const std::int64_t level = integer_of(member).value_or(0);
      line.level = level >= static_cast<std::int64_t>(record::LogLevel::kError)     ? record::LogLevel::kError
                   : level == static_cast<std::int64_t>(record::LogLevel::kWarning) ? record::LogLevel::kWarning
                                                                                    : record::LogLevel::kInfo;
    } else if (name == "name") {
      line.name = text_of(member);
    } else if (name == "message") {
      line.text = text_of(member);
    }
  });
  return line;
}

record::SceneRecord read_scene(const element& from) {
  record::SceneRecord scene;
  each_member(from, [&](std::string_view name, const element& entities) {
    if (name != "entities") return;
    each_item(entities, [&](const element& entity) {
      record::SceneThing thing;
      bool has_body = false;
      each_member(entity, [&](std::string_view key, const element& member) {
        if (key == "id") thing.id = text_of(member);
        if (key == "cubes" || key == "cylinders") read_body(member, key == "cylinders", thing, has_body);
      });
      if (has_body) scene.things.push_back(std::move(thing));
    });
  });
  return scene;
}

record::PoseRecord read_pose(const element& from, const Topic& topic) {
  record::PoseRecord made{topic.robot, topic.kind == Topic::Kind::kEstimate, {}};
  each_member(from, [&](std::string_view name, const element& member) {
    if (name == "pose") made.pose_map = pose_of(member);
  });
  return made;
}

record::ScanRecord read_scan(const element& from, const std::string& robot) {
  record::ScanRecord scan{robot, {}, {}};
  each_member(from, [&](std::string_view name, const element& member) {
    if (name == "pose") scan.laser_map = pose_of(member);
    if (name == "ranges")
      each_item(member, [&](const element& range) { scan.ranges.push_back(number_of(range).value_or(0.0)); });
  });
  return scan;
}

std::vector<record::Pose> read_poses(const element& from) {
  std::vector<record::Pose> poses;
  each_member(from, [&](std::string_view name, const element& member) {
    if (name == "poses") poses = poses_of(member);
  });
  return poses;
}

record::MotionRecord read_motion(const element& from, const std::string& robot) {
  record::MotionRecord motion;
  motion.robot = robot;
  each_member(from, [&](std::string_view name, const element& member) {
    if (name == "speed")
      motion.speed = number_of(member).value_or(0.0);
    else if (name == "turn")
      motion.turn = number_of(member).value_or(0.0);
    else if (name == "status")
      motion.status = text_of(member);
    else if (name == "goal" && member.is_array()) {
      std::vector<double> goal;
      each_item(member, [&](const element& number) { goal.push_back(number_of(number).value_or(0.0)); });
      goal.resize(3);
      motion.goal_map = record::Pose{goal[0], goal[1], goal[2]};
    }
  });
  return motion;
}

record::BatteryRecord read_battery(const element& from, const std::string& robot) {
  record::BatteryRecord battery;
  battery.robot = robot;
  each_member(from, [&](std::string_view name, const element& member) {
    if (name == "percent")
      battery.percent = number_of(member).value_or(0.0);
    else if (name == "current_A")
      battery.current_A = number_of(member).value_or(0.0);
    else if (name == "voltage_V")
      battery.voltage_V = number_of(member);
    else if (name == "charging")
      battery.charging = boolean_of(member).value_or(false);
    else if (name == "plugged")
      battery.plugged = boolean_of(member);
  });
  return battery;
}

std::optional<record::RunRecord> read_record(const element& from, const Topic& topic, TimePoint time, Depth depth) {
  switch (topic.kind) {
    case Topic::Kind::kNone: break;
    case Topic::Kind::kObservation: return read_observation(from, time, depth);
    case Topic::Kind::kChart: return read_chart(from, depth);
    case Topic::Kind::kMonitor: return read_monitor(from, depth);
    case Topic::Kind::kLog: return read_log(from);
    case Topic::Kind::kBlackboard: return record::BlackboardRecord{value_of(from)};
    case Topic::Kind::kViolation: return record::ViolationRecord{value_of(from)};
    case Topic::Kind::kScene: return read_scene(from);
    case Topic::Kind::kPose:
    case Topic::Kind::kEstimate: return read_pose(from, topic);
    case Topic::Kind::kScan: return read_scan(from, topic.robot);
    case Topic::Kind::kPath: return record::PathRecord{topic.robot, read_poses(from)};
    case Topic::Kind::kParticles: return record::ParticlesRecord{topic.robot, read_poses(from)};
    case Topic::Kind::kMotion: return read_motion(from, topic.robot);
    case Topic::Kind::kBattery: return read_battery(from, topic.robot);
  }
  return std::nullopt;
}

// Bytes of text that the parser is made for at least.
constexpr std::size_t kParsedMin = std::size_t{16} << 10U;

// The record of which only the robot is known.
std::optional<record::RunRecord> name_only(const Topic& topic) {
  switch (topic.kind) {
    case Topic::Kind::kScan: return record::ScanRecord{topic.robot, {}, {}};
    case Topic::Kind::kPath: return record::PathRecord{topic.robot, {}};
    case Topic::Kind::kParticles: return record::ParticlesRecord{topic.robot, {}};
    case Topic::Kind::kMotion: {
      record::MotionRecord motion;
      motion.robot = topic.robot;
      return motion;
    }
    default: return std::nullopt;
  }
}

// An observation that is nothing but one of many, without its data.
std::optional<record::RunRecord> plain_observation(std::string_view json, TimePoint time) {
  const auto head = record::observation_head(json);
  if (!head) return std::nullopt;
  Message message;
  message.kind = head->kind;
  message.name = head->name;
  if (changes_state(message)) return std::nullopt;
  message.sequence = head->sequence;
  message.time = time;
  message.stamp = head->stamp;
  message.source = head->source;
  message.target = head->target;
  message.call = head->call;
  message.tick = head->tick;
  return message;
}

}  // namespace

Topic topic_of(std::string_view topic) {
  using Kind = Topic::Kind;
  if (topic == record::kObservationsTopic) return {Kind::kObservation, {}};
  if (topic == "/charts") return {Kind::kChart, {}};
  if (topic == "/monitors") return {Kind::kMonitor, {}};
  if (topic == "/log") return {Kind::kLog, {}};
  if (topic == "/scene") return {Kind::kScene, {}};
  if (topic == "/blackboard") return {Kind::kBlackboard, {}};
  if (topic == "/violations") return {Kind::kViolation, {}};
  const std::size_t slash = topic.rfind('/');
  if (slash == 0 || slash == std::string_view::npos) return {};
  const std::string robot(topic.substr(1, slash - 1));
  const std::string_view what = topic.substr(slash + 1);
  if (what == "pose") return {Kind::kPose, robot};
  if (what == "pose_estimate") return {Kind::kEstimate, robot};
  if (what == "scan") return {Kind::kScan, robot};
  if (what == "path") return {Kind::kPath, robot};
  if (what == "motion") return {Kind::kMotion, robot};
  if (what == "particles") return {Kind::kParticles, robot};
  if (what == "battery") return {Kind::kBattery, robot};
  return {};
}

bool changes_state(const Message& message) {
  const std::string_view name = message.name;
  return message.kind == MessageKind::kError || name == "node.status" || name == "mission.status" ||
         name == "scenario.injection" || name == "monitor.violated" || name == "monitor.satisfied" ||
         name == "mission.resumed" || name.ends_with(".tick.reply");
}

struct RecordReader::Impl {
  simdjson::dom::parser parser;
  std::string padded;
};

RecordReader::RecordReader() : impl_(std::make_unique<Impl>()) {}
RecordReader::~RecordReader() = default;

std::optional<record::RunRecord> RecordReader::read(const Topic& topic, TimePoint time, std::string_view json,
                                                    Depth depth) {
  if (topic.kind == Topic::Kind::kNone) return std::nullopt;
  if (depth == Depth::kIndex) {
    if (auto named = name_only(topic)) return named;
    if (auto plain = topic.kind == Topic::Kind::kObservation ? plain_observation(json, time) : std::nullopt)
      return plain;
  }
  // The parser reads beyond the end of the text.
  std::string& padded = impl_->padded;
  padded.assign(json);
  padded.append(simdjson::SIMDJSON_PADDING, ' ');
  if (impl_->parser.capacity() < json.size() || impl_->parser.max_depth() != text::kNestingMax) {
    if (impl_->parser.allocate(std::max(json.size() * 2, kParsedMin), text::kNestingMax) != simdjson::SUCCESS)
      return std::nullopt;
  }
  element root;
  if (impl_->parser.parse(padded.data(), json.size(), false).get(root) != simdjson::SUCCESS || !root.is_object())
    return std::nullopt;
  return read_record(root, topic, time, depth);
}

}  // namespace sentree::studio
