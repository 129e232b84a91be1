#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "sentree/base/json.h"
#include "sentree/studio/detail/history_impl.h"

// A state of the run at one moment, part by part.

namespace sentree::studio {

namespace {

void append_integer(std::string& out, std::int64_t number) { out += std::to_string(number); }

// Millimetres and tenths of a milliradian are enough for a picture.
void append_rounded(std::string& out, double number) {
  if (!std::isfinite(number)) {
    out += "null";
    return;
  }
  const double scaled = std::round(number * 1e4);
  if (std::abs(scaled) > 9e15) {
    append_json(out, Value(number));
    return;
  }
  auto units = static_cast<std::int64_t>(scaled);
  if (units < 0) out += '-';
  units = std::abs(units);
  out += std::to_string(units / 10'000);
  int rest = static_cast<int>(units % 10'000);
  if (rest == 0) return;
  out += '.';
  for (int digit = 1000; rest > 0; digit /= 10) {
    out += static_cast<char>('0' + rest / digit);
    rest %= digit;
  }
}

void append_pose(std::string& out, const record::Pose& pose) {
  out += '[';
  append_rounded(out, pose.x);
  out += ',';
  append_rounded(out, pose.y);
  out += ',';
  append_rounded(out, pose.theta);
  out += ']';
}

void append_member(std::string& out, std::string_view name) {
  if (out.back() != '{') out += ',';
  out += '"';
  out += name;
  out += "\":";
}

template <class List, class Append>
void append_list(std::string& out, const List& list, Append&& append) {
  out += '[';
  for (const auto& item : list) {
    if (out.back() != '[') out += ',';
    append(item);
  }
  out += ']';
}

void append_optional(std::string& out, const std::optional<std::int64_t>& number) {
  if (number)
    append_integer(out, *number);
  else
    out += "null";
}

// Which topic holds the record that a text is made of, and such a record that says nothing.
std::pair<Topic::Kind, record::RunRecord> source_of(Shown what) {
  switch (what) {
    case Shown::kObservation:
    case Shown::kOutputs: break;
    case Shown::kChart: return {Topic::Kind::kChart, record::ChartRecord()};
    case Shown::kMonitor:
    case Shown::kMonitorChart: return {Topic::Kind::kMonitor, record::MonitorRecord()};
    case Shown::kBlackboard: return {Topic::Kind::kBlackboard, record::BlackboardRecord{Map()}};
    case Shown::kObstacles: return {Topic::Kind::kScene, record::SceneRecord()};
    case Shown::kScan: return {Topic::Kind::kScan, record::ScanRecord()};
    case Shown::kPath: return {Topic::Kind::kPath, record::PathRecord()};
    case Shown::kParticles: return {Topic::Kind::kParticles, record::ParticlesRecord()};
    case Shown::kMotion: return {Topic::Kind::kMotion, record::MotionRecord()};
  }
  return {Topic::Kind::kObservation, Message()};
}

void append_obstacle(std::string& out, const record::SceneThing& thing, std::string_view name) {
  const record::Pose& pose = thing.pose_map;
  if (out.back() != '[') out += ',';
  out += "{\"name\":";
  append_json_string(out, name);
  if (thing.disc) {
    out += ",\"circle\":";
    append_pose(out, {pose.x, pose.y, thing.length_m / 2});
    out += '}';
    return;
  }
  out += ",\"polygon\":[";
  const double c = std::cos(pose.theta);
  const double s = std::sin(pose.theta);
  for (const auto& [along, across] : {std::pair{0.5, 0.5}, {-0.5, 0.5}, {-0.5, -0.5}, {0.5, -0.5}}) {
    if (out.back() != '[') out += ',';
    out += '[';
    append_rounded(out, pose.x + c * along * thing.length_m - s * across * thing.width_m);
    out += ',';
    append_rounded(out, pose.y + s * along * thing.length_m + c * across * thing.width_m);
    out += ']';
  }
  out += "]}";
}

}  // namespace

void append_shown(std::string& out, Shown what, const Message& message) {
  if (what == Shown::kOutputs) {
    const Value* values = message.data.find("outputs");
    append_json(out, values != nullptr ? *values : Value(Map()));
    return;
  }
  out += fmt::format("{{\"sequence\":{},\"time\":{},\"tick\":{},\"kind\":\"", message.sequence,
                     message.time.time_since_epoch().count(), message.tick);
  out += to_string(message.kind);
  out += "\",\"name\":";
  append_json_string(out, message.name);
  out += ",\"source\":";
  append_json_string(out, message.source);
  out += ",\"target\":";
  append_json_string(out, message.target);
  out += fmt::format(",\"call\":{},\"data\":", message.call);
  append_json(out, message.data);
  out += '}';
}

void append_shown(std::string& out, Shown /*what*/, const record::ChartRecord& record) {
  out += "\"last\":";
  append_optional(out, record.last);
  out += ",\"event\":";
  append_json_string(out, record.event);
  out += ",\"data\":";
  append_json(out, record.data.is_null() ? Value(Map()) : record.data);
}

void append_shown(std::string& out, Shown what, const record::MonitorRecord& record) {
  if (what == Shown::kMonitorChart) {
    if (record.data.is_null()) return;
    out += ",\"event\":";
    append_json_string(out, record.event);
    out += ",\"data\":";
    append_json(out, record.data);
    return;
  }
  out += "\"standing\":";
  append_json_string(out, record.standing);
  out += ",\"deadline\":";
  append_optional(out, record.deadline);
  out += ",\"states\":";
  append_list(out, record.states, [&](const std::string& state) { append_json_string(out, state); });
}

void append_shown(std::string& out, Shown /*what*/, const record::BlackboardRecord& record) {
  append_json(out, record.entries);
}

void append_shown(std::string& out, Shown /*what*/, const record::SceneRecord& record) {
  constexpr std::string_view kObstacle = "obstacle.";
  out += '[';
  for (const record::SceneThing& thing : record.things) {
    if (thing.id.starts_with(kObstacle)) append_obstacle(out, thing, thing.id.substr(kObstacle.size()));
  }
  out += ']';
}

void append_shown(std::string& out, Shown /*what*/, const record::ScanRecord& record) {
  out += "\"scan_pose\":";
  append_pose(out, record.laser_map);
  out += ",\"scan\":";
  // 0 stands for nothing within range.
  append_list(out, record.ranges, [&](double range) { append_rounded(out, range == 0.0 ? std::nan("") : range); });
}

void append_shown(std::string& out, Shown /*what*/, const record::PathRecord& record) {
  append_list(out, record.poses_map, [&](const record::Pose& pose) {
    out += '[';
    append_rounded(out, pose.x);
    out += ',';
    append_rounded(out, pose.y);
    out += ']';
  });
}

void append_shown(std::string& out, Shown /*what*/, const record::ParticlesRecord& record) {
  append_list(out, record.poses_map, [&](const record::Pose& pose) { append_pose(out, pose); });
}

void append_shown(std::string& out, Shown /*what*/, const record::MotionRecord& record) {
  out += "\"twist\":[";
  append_rounded(out, record.speed);
  out += ',';
  append_rounded(out, record.turn);
  out += "],\"goal\":";
  if (record.goal_map)
    append_pose(out, *record.goal_map);
  else
    out += "null";
  out += ",\"navigation\":";
  append_json_string(out, record.status);
}

std::string History::Impl::shown(Shown what, const Place& place, Nanoseconds time) const {
  std::string kept = texts->read(place);
  if (live != nullptr) return kept;
  auto [kind, nothing] = source_of(what);
  const auto record = records.read({kind, {}}, TimePoint(Duration(time)), kept, RecordReader::Depth::kWhole);
  std::string out;
  std::visit(
      [&](const auto& sort) {
        if constexpr (requires { append_shown(out, what, sort); }) append_shown(out, what, sort);
      },
      record ? *record : nothing);
  return out;
}

std::uint64_t History::Impl::version(const PartId& part) const {
  switch (part.part) {
    case Part::kMission: return mission.version();
    case Part::kTree: return tree_version;
    case Part::kBlackboard: return blackboard.version();
    case Part::kOutputs: return outputs_version;
    case Part::kObstacles:
    case Part::kDoors: return scene.version();
    case Part::kChart:
      return subject.charts[part.index].is_monitor
                 ? monitors[subject.monitor_index(subject.charts[part.index].name)].version()
                 : charts[part.index].version();
    case Part::kMonitor: return monitors[part.index].version();
    case Part::kRobot: {
      const RobotTracks& robot = robots[part.index];
      return robot.pose.version() + robot.estimate.version() + robot.battery.version() + robot.scan.version() +
             robot.path.version() + robot.motion.version() + robot.particles.version();
    }
  }
  return 0;
}

void History::Impl::append(std::string& out, const PartId& part, Nanoseconds time) const {
  switch (part.part) {
    case Part::kMission:
      if (const auto* entry = mission.at(time))
        append_json_string(out, to_string(static_cast<bt::Status>(entry->value)));
      else
        out += "\"IDLE\"";
      break;
    case Part::kTree: append_tree(out, time); break;
    case Part::kBlackboard: {
      const auto* entry = blackboard.at(time);
      out += entry != nullptr ? shown(Shown::kBlackboard, entry->value, entry->time) : "{}";
      break;
    }
    case Part::kOutputs: append_outputs(out, time); break;
    case Part::kObstacles: {
      const auto* entry = scene.at(time);
      out += entry != nullptr ? shown(Shown::kObstacles, entry->value.place, entry->time) : "[]";
      break;
    }
    case Part::kDoors: append_doors(out, time); break;
    case Part::kChart: append_chart(out, part.index, time); break;
    case Part::kMonitor: append_monitor(out, part.index, time); break;
    case Part::kRobot: append_robot(out, part.index, time); break;
  }
}

void History::append(std::string& out, const PartId& part, Nanoseconds time) const {
  const std::lock_guard lock(impl_->mutex);
  impl_->append(out, part, time);
}

History::Present History::refresh(std::vector<Fragment>& fragments) const {
  fragments.resize(parts_.size());
  const std::lock_guard lock(impl_->mutex);
  const Nanoseconds now = impl_->end;
  for (std::size_t i = 0; i < parts_.size(); ++i) {
    Fragment& fragment = fragments[i];
    const std::uint64_t version = impl_->version(parts_[i]);
    if (fragment.version == version) continue;
    fragment.version = version;
    fragment.json.clear();
    impl_->append(fragment.json, parts_[i], now);
  }
  return {now, impl_->begin, impl_->moment(now)};
}

void History::Impl::append_tree(std::string& out, Nanoseconds time) const {
  std::string last;
  std::string since;
  out += "{\"status\":[";
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const Track<std::uint8_t>& node = nodes[i];
    const std::size_t now = node.position(time);
    const bool known = now != Track<std::uint8_t>::npos;
    std::size_t before = now;
    while (known && before > 0 && node[before].value == 0) --before;
    if (i > 0) {
      out += ',';
      last += ',';
      since += ',';
    }
    append_integer(out, known ? node[now].value : 0);
    append_integer(last, known ? node[before].value : 0);
    append_integer(since, known ? node[now].time : 0);
  }
  out += fmt::format("],\"last\":[{}],\"since\":[{}]}}", last, since);
}

void History::Impl::append_chart(std::string& out, std::size_t index, Nanoseconds time) const {
  if (subject.charts[index].is_monitor) {
    // The monitor's own entry says which of its states are active.
    const std::size_t monitor = subject.monitor_index(subject.charts[index].name);
    const auto* entry = monitors[monitor].at(time);
    if (entry == nullptr) return;
    out +=
        fmt::format("{{\"running\":true,\"active\":{},\"since\":", configurations[entry->value.configuration].active);
    append_integer(out, entry->value.since);
    out += shown(Shown::kMonitorChart, entry->value.chart, entry->time);
    out += '}';
    return;
  }
  const auto* entry = charts[index].at(time);
  if (entry == nullptr) return;
  out += entry->value.running ? "{\"running\":true,\"active\":" : "{\"running\":false,\"active\":";
  out += configurations[entry->value.configuration].active + ',';
  out += shown(Shown::kChart, entry->value.place, entry->time);
  append_member(out, "since");
  append_integer(out, entry->value.since);
  out += '}';
}

void History::Impl::append_monitor(std::string& out, std::size_t index, Nanoseconds time) const {
  const auto* entry = monitors[index].at(time);
  if (entry == nullptr) return;
  out += "{\"verdict\":";
  append_json_string(out, to_string(entry->value.verdict));
  out += ',';
  out += shown(Shown::kMonitor, entry->value.place, entry->time);
  append_member(out, "violations");
  append_integer(out, entry->value.violations);
  append_member(out, "since");
  append_integer(out, entry->time);
  out += '}';
}

void History::Impl::append_robot(std::string& out, std::size_t index, Nanoseconds time) const {
  const RobotTracks& robot = robots[index];
  const auto* pose = robot.pose.at(time);
  if (pose == nullptr) return;
  const auto append_text = [&](Shown what, const Track<Place>& track) {
    const auto* entry = track.at(time);
    if (entry != nullptr) out += shown(what, entry->value, entry->time);
    return entry != nullptr;
  };
  out += '{';
  append_member(out, "pose");
  append_pose(out, pose->value);
  append_member(out, "estimate");
  if (const auto* estimate = robot.estimate.at(time))
    append_pose(out, estimate->value);
  else
    out += "null";
  out += ',';
  if (append_text(Shown::kMotion, robot.motion)) out += ',';
  if (append_text(Shown::kScan, robot.scan)) out += ',';
  out += "\"path\":";
  if (!append_text(Shown::kPath, robot.path)) out += "[]";
  if (robot.particles.at(time) != nullptr) {
    append_member(out, "particles");
    append_text(Shown::kParticles, robot.particles);
  }
  append_member(out, "battery");
  if (const auto* battery = robot.battery.at(time)) {
    const BatteryValue& value = battery->value;
    out += "{\"percentage\":";
    append_rounded(out, value.percentage);
    append_member(out, "voltage");
    append_rounded(out, value.voltage.value_or(std::nan("")));
    append_member(out, "current");
    append_rounded(out, value.current);
    append_member(out, "charging");
    out += value.charging ? "true" : "false";
    append_member(out, "plugged");
    out += value.plugged ? (*value.plugged ? "true" : "false") : "null";
    out += '}';
  } else {
    out += "null";
  }
  out += '}';
}

void History::Impl::append_outputs(std::string& out, Nanoseconds time) const {
  out += '{';
  for (std::size_t leaf = 0; leaf < outputs.size(); ++leaf) {
    const auto* entry = outputs[leaf].at(time);
    if (entry == nullptr) continue;
    if (out.back() != '{') out += ',';
    append_json_string(out, leaf_names[leaf]);
    out += ':';
    out += shown(Shown::kOutputs, entry->value, entry->time);
  }
  out += '}';
}

void History::Impl::append_doors(std::string& out, Nanoseconds time) const {
  out += '[';
  const auto* entry = scene.at(time);
  if (subject.plan.world) {
    for (const sim::Door& door : subject.plan.world->doors) {
      const bool closed = entry == nullptr
                              ? !door.open
                              : std::find(entry->value.closed_doors.begin(), entry->value.closed_doors.end(),
                                          door.id) != entry->value.closed_doors.end();
      if (out.back() != '[') out += ',';
      out += "{\"name\":";
      append_json_string(out, door.id);
      out += closed ? ",\"open\":false}" : ",\"open\":true}";
    }
  }
  out += ']';
}

}  // namespace sentree::studio
