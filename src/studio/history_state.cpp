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

void append_pose(std::string& out, const PoseValue& pose) {
  out += '[';
  append_rounded(out, pose.x);
  out += ',';
  append_rounded(out, pose.y);
  out += ',';
  append_rounded(out, pose.theta);
  out += ']';
}

void append_number_of(std::string& out, std::string_view value) {
  append_rounded(out, as_number(value).value_or(std::nan("")));
}

PoseValue pose_in(std::string_view json) {
  const std::string_view position = member(json, "position");
  const std::string_view turn = member(json, "orientation");
  return {as_number(member(position, "x")).value_or(0.0), as_number(member(position, "y")).value_or(0.0),
          2 * std::atan2(as_number(member(turn, "z")).value_or(0.0), as_number(member(turn, "w")).value_or(1.0))};
}

void append_member(std::string& out, std::string_view name) {
  if (out.back() != '{') out += ',';
  out += '"';
  out += name;
  out += "\":";
}

// A string of a file that may hold anything.
void append_string_of(std::string& out, std::string_view value) { append_json_string(out, unquoted(value)); }

}  // namespace

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
      out += entry != nullptr ? sound(read(entry->value)) : "{}";
      break;
    }
    case Part::kOutputs: append_outputs(out, time); break;
    case Part::kObstacles: append_obstacles(out, time); break;
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
  out += "],\"last\":[" + last + "],\"since\":[" + since + "]}";
}

void History::Impl::append_chart(std::string& out, std::size_t index, Nanoseconds time) const {
  if (subject.charts[index].is_monitor) {
    // The monitor's own entry says which of its states are active.
    const std::size_t monitor = subject.monitor_index(subject.charts[index].name);
    const auto* entry = monitors[monitor].at(time);
    if (entry == nullptr) return;
    out += "{\"running\":true,\"active\":" + configurations[entry->value.configuration].active;
    const std::string text = read(entry->value.place);
    for (const std::string_view name : {"last", "event", "data"}) {
      const std::string_view value = member(text, name);
      if (value.empty()) continue;
      append_member(out, name);
      out += sound(value);
    }
    out += ",\"since\":";
    append_integer(out, entry->time);
    out += '}';
    return;
  }
  const auto* entry = charts[index].at(time);
  if (entry == nullptr) return;
  const std::string text = read(entry->value.place);
  out += entry->value.running ? "{\"running\":true,\"active\":" : "{\"running\":false,\"active\":";
  out += configurations[entry->value.configuration].active;
  const std::string_view last = member(text, "last");
  append_member(out, "last");
  if (const auto transition = as_integer(last))
    append_integer(out, *transition);
  else
    out += "null";
  append_member(out, "event");
  append_string_of(out, member(text, "event"));
  append_member(out, "data");
  const std::string_view data = member(text, "data");
  out += data.empty() ? "{}" : sound(data);
  append_member(out, "since");
  append_integer(out, entry->time);
  out += '}';
}

void History::Impl::append_monitor(std::string& out, std::size_t index, Nanoseconds time) const {
  const auto* entry = monitors[index].at(time);
  if (entry == nullptr) return;
  const std::string text = read(entry->value.place);
  out += "{\"verdict\":";
  append_json_string(out, to_string(entry->value.verdict));
  append_member(out, "standing");
  append_string_of(out, member(text, "standing"));
  append_member(out, "deadline");
  if (const auto deadline = as_integer(member(text, "deadline")))
    append_integer(out, *deadline);
  else
    out += "null";
  append_member(out, "states");
  const std::string_view states = member(text, "states");
  out += states.empty() ? "[]" : sound(states);
  append_member(out, "violations");
  append_integer(
      out,
      as_integer(member(text, "violations")).value_or(entry->value.verdict == monitor::Verdict::kViolated ? 1 : 0));
  append_member(out, "since");
  append_integer(out, entry->time);
  out += '}';
}

void History::Impl::append_robot(std::string& out, std::size_t index, Nanoseconds time) const {
  const RobotTracks& robot = robots[index];
  const auto* pose = robot.pose.at(time);
  if (pose == nullptr) return;
  out += '{';
  append_member(out, "pose");
  append_pose(out, pose->value);
  append_member(out, "estimate");
  if (const auto* estimate = robot.estimate.at(time))
    append_pose(out, estimate->value);
  else
    out += "null";
  if (const auto* motion = robot.motion.at(time)) {
    const std::string text = read(motion->value);
    append_member(out, "twist");
    out += '[';
    append_number_of(out, member(text, "speed"));
    out += ',';
    append_number_of(out, member(text, "turn"));
    out += ']';
    append_member(out, "goal");
    const std::string_view goal = member(text, "goal");
    if (goal.starts_with('[')) {
      out += '[';
      for (JsonWalk walk(goal); walk.next();) {
        if (out.back() != '[') out += ',';
        append_number_of(out, walk.value());
      }
      out += ']';
    } else {
      out += "null";
    }
    append_member(out, "navigation");
    append_string_of(out, member(text, "status"));
  }
  if (const auto* scan = robot.scan.at(time)) {
    const std::string text = read(scan->value);
    append_member(out, "scan_pose");
    append_pose(out, pose_in(member(text, "pose")));
    append_member(out, "scan");
    out += '[';
    for (JsonWalk walk(member(text, "ranges")); walk.next();) {
      if (out.back() != '[') out += ',';
      // 0 stands for nothing within range.
      if (walk.value() == "0" || walk.value() == "0.0")
        out += "null";
      else
        append_number_of(out, walk.value());
    }
    out += ']';
  }
  append_member(out, "path");
  out += '[';
  if (const auto* path = robot.path.at(time)) {
    const std::string text = read(path->value);
    for (JsonWalk walk(member(text, "poses")); walk.next();) {
      const std::string_view position = member(walk.value(), "position");
      if (out.back() != '[') out += ',';
      out += '[';
      append_number_of(out, member(position, "x"));
      out += ',';
      append_number_of(out, member(position, "y"));
      out += ']';
    }
  }
  out += ']';
  if (const auto* particles = robot.particles.at(time)) {
    const std::string text = read(particles->value);
    append_member(out, "particles");
    out += '[';
    for (JsonWalk walk(member(text, "poses")); walk.next();) {
      if (out.back() != '[') out += ',';
      append_pose(out, pose_in(walk.value()));
    }
    out += ']';
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
    const std::string text = read(entry->value);
    if (out.back() != '{') out += ',';
    append_json_string(out, leaf_names[leaf]);
    out += ':';
    const std::string_view values = member(member(text, "data"), "outputs");
    out += values.empty() ? "{}" : sound(values);
  }
  out += '}';
}

void History::Impl::append_obstacles(std::string& out, Nanoseconds time) const {
  out += '[';
  const auto* entry = scene.at(time);
  const std::string text = entry != nullptr ? read(entry->value) : "";
  for (JsonWalk walk(member(text, "entities")); walk.next();) {
    constexpr std::string_view kPrefix = "obstacle.";
    const std::string id = unquoted(member(walk.value(), "id"));
    if (!id.starts_with(kPrefix)) continue;
    JsonWalk cubes(member(walk.value(), "cubes"));
    JsonWalk cylinders(member(walk.value(), "cylinders"));
    const bool box = cubes.next();
    if (!box && !cylinders.next()) continue;
    const std::string_view thing = box ? cubes.value() : cylinders.value();
    const PoseValue pose = pose_in(member(thing, "pose"));
    const std::string_view size = member(thing, "size");
    const double length = as_number(member(size, "x")).value_or(0.0);
    const double width = as_number(member(size, "y")).value_or(0.0);
    if (out.back() != '[') out += ',';
    out += "{\"name\":";
    append_json_string(out, id.substr(kPrefix.size()));
    if (!box) {
      out += ",\"circle\":";
      append_pose(out, {pose.x, pose.y, length / 2});
      out += '}';
      continue;
    }
    out += ",\"polygon\":[";
    const double c = std::cos(pose.theta);
    const double s = std::sin(pose.theta);
    for (const auto& [along, across] : {std::pair{0.5, 0.5}, {-0.5, 0.5}, {-0.5, -0.5}, {0.5, -0.5}}) {
      if (out.back() != '[') out += ',';
      out += '[';
      append_rounded(out, pose.x + c * along * length - s * across * width);
      out += ',';
      append_rounded(out, pose.y + s * along * length + c * across * width);
      out += ']';
    }
    out += "]}";
  }
  out += ']';
}

void History::Impl::append_doors(std::string& out, Nanoseconds time) const {
  out += '[';
  const auto* entry = scene.at(time);
  const std::string text = entry != nullptr ? read(entry->value) : "";
  if (subject.plan.world) {
    for (const sim::Door& door : subject.plan.world->doors) {
      bool closed = entry == nullptr && !door.open;
      for (JsonWalk walk(member(text, "entities")); walk.next();)
        closed = closed || unquoted(member(walk.value(), "id")) == "door." + door.id;
      if (out.back() != '[') out += ',';
      out += "{\"name\":";
      append_json_string(out, door.id);
      out += closed ? ",\"open\":false}" : ",\"open\":true}";
    }
  }
  out += ']';
}

}  // namespace sentree::studio
