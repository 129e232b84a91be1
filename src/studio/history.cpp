#include "sentree/studio/history.h"

#include <fmt/format.h>

#include <charconv>
#include <variant>
#include <vector>

#include "sentree/base/json.h"
#include "sentree/studio/detail/history_impl.h"

namespace sentree::studio {

namespace {

Nanoseconds to_nanoseconds(TimePoint time) { return time.time_since_epoch().count(); }

// Violations whose story is kept, and problems.
constexpr std::size_t kStoriesMax = 1000;

// Where a message of a part is.
Place place_of(std::size_t part, const std::string& records, const record::RawMessage& raw) {
  return {static_cast<std::uint32_t>(part), static_cast<std::uint32_t>(raw.data.data() - records.data()),
          static_cast<std::uint32_t>(raw.data.size())};
}

}  // namespace

History::History(const Subject& subject, std::size_t bytes_max) : impl_(std::make_unique<Impl>(subject, bytes_max)) {
  auto texts = std::make_unique<LiveTexts>();
  impl_->live = texts.get();
  impl_->texts = std::move(texts);
  parts_ = {{Part::kMission}, {Part::kTree}, {Part::kBlackboard}, {Part::kOutputs}, {Part::kObstacles}, {Part::kDoors}};
  for (std::size_t i = 0; i < subject.charts.size(); ++i) parts_.push_back({Part::kChart, i});
  for (std::size_t i = 0; i < subject.monitors.size(); ++i) parts_.push_back({Part::kMonitor, i});
  for (std::size_t i = 0; i < subject.robots.size(); ++i) parts_.push_back({Part::kRobot, i});
}

History::History(const Subject& subject, record::Reader& reader) : History(subject) {
  impl_->live = nullptr;
  impl_->reader = &reader;
  impl_->texts = std::make_unique<RecordedTexts>(reader);
  for (const auto& [id, channel] : reader.channels()) impl_->topics[id] = topic_of(channel.topic);
  impl_->observations.load_by([impl = impl_.get()](std::uint32_t part) { return impl->observations_of(part); });
}

History::~History() = default;

void History::take(TimePoint time, const record::RunRecord& record) {
  const std::lock_guard lock(impl_->mutex);
  impl_->take(to_nanoseconds(time), record, nullptr);
  impl_->make_room();
}

void History::read_index(const std::function<bool()>& goes_on) {
  RecordReader reader;  // beside the one of those who look
  struct Read {
    Nanoseconds time = 0;
    Place place;
    record::RunRecord record;
  };
  std::vector<Read> reads;
  for (std::size_t part = 0; part < impl_->reader->parts() && goes_on(); ++part) {
    // The file is read by one at a time. What it says is made out in between, so that others get their turn.
    const auto records = [&] {
      const std::lock_guard lock(impl_->mutex);
      return impl_->reader->part(part);
    }();
    reads.clear();
    if (records) {
      impl_->reader->each_message(*records, [&](const record::RawMessage& raw) {
        const auto time = static_cast<Nanoseconds>(raw.log_time);
        auto record =
            reader.read(impl_->topics[raw.channel], TimePoint(Duration(time)), raw.data, RecordReader::Depth::kIndex);
        if (record) reads.push_back({time, place_of(part, *records, raw), std::move(*record)});
      });
    }
    const std::lock_guard lock(impl_->mutex);
    for (const Read& read : reads) impl_->take(read.time, read.record, &read.place);
    impl_->parts_read = part + 1;
  }
}

double History::read_so_far() const {
  const std::size_t parts = impl_->reader != nullptr ? impl_->reader->parts() : 0;
  return parts == 0 ? 1.0 : static_cast<double>(impl_->parts_read) / static_cast<double>(parts);
}

Observations::Entries History::Impl::observations_of(std::uint32_t part) {
  Observations::Entries entries;
  const auto unpacked = reader->part(part);
  if (!unpacked) return entries;
  reader->each_message(*unpacked, [&](const record::RawMessage& raw) {
    const Topic& topic = topics[raw.channel];
    if (topic.kind != Topic::Kind::kObservation) return;
    const auto time = static_cast<Nanoseconds>(raw.log_time);
    const auto record = records.read(topic, TimePoint(Duration(time)), raw.data, RecordReader::Depth::kIndex);
    const auto* message = record ? std::get_if<Message>(&*record) : nullptr;
    if (message == nullptr || message->sequence == 0) return;
    entries.push_back({time, seen_of(*message, place_of(part, *unpacked, raw))});
  });
  return entries;
}

Nanoseconds History::begin() const {
  const std::lock_guard lock(impl_->mutex);
  return impl_->begin;
}

Nanoseconds History::end() const { return impl_->end; }

void History::Impl::take(Nanoseconds time, const record::RunRecord& record, const Place* place) {
  if (time > end) end = time;
  std::visit([&](const auto& sort) { add(time, sort, place); }, record);
}

Place History::Impl::keep_text(Nanoseconds time) {
  const Place kept = live->append(text);
  if (block_times.size() < live->blocks()) block_times.push_back(time);
  return kept;
}

std::uint32_t History::Impl::shape_of(const Message& message) {
  const std::string_view kind = to_string(message.kind);
  key.clear();
  for (const std::string_view part :
       {std::string_view(message.name), kind, std::string_view(message.source), std::string_view(message.target)}) {
    key += part;
    key += '\0';
  }
  const auto known = shape_ids.find(key);
  if (known != shape_ids.end()) return known->second;
  if (shapes.size() < kShapesMax) {
    Shape shape{message.name, std::string(kind), message.source, message.target};
    Role role = Role::kPlain;
    if (shape.name == "node.status")
      role = Role::kNodeStatus;
    else if (shape.name == "mission.status")
      role = Role::kMissionStatus;
    else if (shape.name == "scenario.injection")
      role = Role::kInjection;
    else if (shape.name == "monitor.violated" || shape.name == "monitor.satisfied")
      role = Role::kDecision;
    else if (shape.name == "mission.resumed")
      role = Role::kResumed;
    else if (message.kind == MessageKind::kError)
      role = Role::kError;
    else if (shape.name.ends_with(".tick.reply") && leaf_indices.contains(shape.source))
      role = Role::kReply;
    shapes.push_back(std::move(shape));
    roles.push_back(role);
  }
  const auto id = static_cast<std::uint32_t>(shapes.size() - 1);
  shape_ids.emplace(key, id);
  return id;
}

void History::Impl::add(Nanoseconds time, const Message& message, const Place* place) {
  if (message.sequence == 0) return;
  const Seen seen = seen_of(message, keep(Shown::kObservation, message, time, place));
  observations.push(time, seen);
  if (roles[seen.shape] != Role::kPlain) add_effect(roles[seen.shape], shapes[seen.shape], time, message, seen, place);
}

void History::Impl::add_effect(Role role, const Shape& shape, Nanoseconds time, const Message& message,
                               const Seen& seen, const Place* place) {
  const auto text_at = [&](std::string_view name) {
    const Value* member = message.data.find(name);
    return member != nullptr ? member->text() : std::string_view();
  };
  switch (role) {
    case Role::kPlain: break;
    case Role::kNodeStatus: {
      const Value* member = message.data.find("node");
      const std::int64_t* node = member != nullptr ? member->as_int() : nullptr;
      const auto status = bt::parse_status(text_at("to"));
      if (node == nullptr || !status || *node < 0 || *node >= static_cast<std::int64_t>(nodes.size())) break;
      nodes[static_cast<std::size_t>(*node)].push(time, static_cast<std::uint8_t>(*status));
      ++tree_version;
      break;
    }
    case Role::kMissionStatus:
      if (const auto status = bt::parse_status(text_at("status")))
        mission.push(time, static_cast<std::uint8_t>(*status));
      break;
    case Role::kReply: {
      const Value* values = message.data.find("outputs");
      if (values == nullptr || values->as_map() == nullptr || values->as_map()->empty()) break;
      outputs[leaf_indices.at(shape.source)].push(time, keep(Shown::kOutputs, message, time, place));
      ++outputs_version;
      break;
    }
    case Role::kInjection: {
      take_over(time, message);
      const Value* args = message.data.find("args");
      const Map* given = args != nullptr ? args->as_map() : nullptr;
      mark(time, shape.source != "scenario" ? "intervention" : "injection",
           std::string(text_at("what")) + (given != nullptr && !given->empty() ? " " + to_json(*args) : ""),
           seen.sequence);
      break;
    }
    case Role::kDecision: {
      const bool violated = shape.name == "monitor.violated";
      if (violated) mark(time, "violation", std::string(text_at("monitor")), seen.sequence);
      const std::size_t monitor = subject.monitor_index(text_at("monitor"));
      if (monitor != Subject::kNone && subject.monitors[monitor].model == nullptr) {
        monitors[monitor].push(
            time, {keep(Shown::kMonitor, record::MonitorRecord(), time, place), 0, time,
                   violated ? monitor::Verdict::kViolated : monitor::Verdict::kSatisfied, violated ? 1 : 0});
      }
      break;
    }
    case Role::kResumed: {
      const auto count_of = [&](std::string_view name) {
        const Value* member = message.data.find(name);
        return member != nullptr && member->as_int() != nullptr ? *member->as_int() : std::int64_t{0};
      };
      mark(time, "gap",
           fmt::format("nobody was there for {} s", shortest_decimal(static_cast<double>(count_of("wall_ns")) * 1e-9)),
           seen.sequence, std::min<Nanoseconds>(count_of("from_ns"), time));
      break;
    }
    case Role::kError:
      if (text_at("kind") == "vetoed")
        mark(time, "veto", fmt::format("{}: {}", shape.name.substr(0, shape.name.rfind('.')), text_at("message")),
             seen.sequence);
      break;
  }
}

// Of a run that goes on with another project: what was at work when it began.
void History::Impl::take_over(Nanoseconds time, const Message& message) {
  const Value* given = message.data.find("nodes");
  if (given == nullptr || given->as_map() == nullptr) return;
  for (const auto& [name, value] : *given->as_map()) {
    std::size_t node = 0;
    const auto [rest, error] = std::from_chars(name.data(), name.data() + name.size(), node);
    const auto status = bt::parse_status(value.text());
    if (error != std::errc() || rest != name.data() + name.size() || node >= nodes.size() || !status) continue;
    nodes[node].push(time, static_cast<std::uint8_t>(*status));
  }
  mission.push(time, static_cast<std::uint8_t>(bt::Status::kRunning));
  ++tree_version;
  if (observations.size() == 1) begin = time;
}

void History::Impl::mark(Nanoseconds time, std::string_view kind, std::string what, std::uint64_t sequence,
                         std::optional<Nanoseconds> from) {
  if (marks.size() < kMarksMax) marks.push(time, {kind, std::move(what), sequence, from});
}

std::uint32_t History::Impl::configuration_of(std::size_t chart, const std::vector<std::string>& states) {
  key.assign(std::to_string(chart));
  for (const std::string& state : states) {
    key += '\0';
    key += state;
  }
  const auto known = configuration_ids.find(key);
  if (known != configuration_ids.end()) return known->second;
  if (configurations.size() >= kShapesMax) return 0;
  const ShownChart& shown_chart = subject.charts[chart];
  Configuration made;
  std::vector<scxml::StateIndex> active;
  made.active = "[";
  for (const std::string& name : states) {
    const auto drawn = shown_chart.drawn_states.find(name);
    const auto state = shown_chart.chart.find(name);
    if (drawn == shown_chart.drawn_states.end() || !state) continue;
    made.active += (made.active.size() > 1 ? "," : "") + std::to_string(drawn->second);
    active.push_back(*state);
  }
  made.active += "]";
  for (std::size_t i = 0; i < active.size(); ++i) {
    const scxml::State& state = shown_chart.chart.states()[active[i]];
    const bool innermost = i + 1 == active.size() || active[i + 1] <= active[i] || active[i + 1] >= state.end;
    if (innermost) made.label += (made.label.empty() ? "" : " + ") + state.id;
  }
  const auto id = static_cast<std::uint32_t>(configurations.size());
  configurations.push_back(std::move(made));
  configuration_ids.emplace(key, id);
  return id;
}

void History::Impl::add(Nanoseconds time, const record::ChartRecord& record, const Place* place) {
  const std::size_t chart = subject.skill_chart(record.leaf);
  if (chart == Subject::kNone) return;
  ChartMoment moment{keep(Shown::kChart, record, time, place), configuration_of(chart, record.states), record.running};
  const ChartMoment* before = charts[chart].back();
  const bool stays =
      before != nullptr && before->configuration == moment.configuration && before->running == moment.running;
  moment.since = stays ? before->since : time;
  charts[chart].push(time, moment);
}

void History::Impl::add(Nanoseconds time, const record::MonitorRecord& record, const Place* place) {
  const std::size_t index = subject.monitor_index(record.monitor);
  if (index == Subject::kNone) return;
  MonitorMoment moment;
  moment.place = keep(Shown::kMonitor, record, time, place);
  moment.chart = keep(Shown::kMonitorChart, record, time, place);
  moment.verdict = record.verdict == "violated"    ? monitor::Verdict::kViolated
                   : record.verdict == "satisfied" ? monitor::Verdict::kSatisfied
                                                   : monitor::Verdict::kUndecided;
  if (const auto chart = subject.charts_by_id.find("monitor:" + record.monitor); chart != subject.charts_by_id.end())
    moment.configuration = configuration_of(chart->second, record.states);
  moment.violations = record.violations.value_or(moment.verdict == monitor::Verdict::kViolated ? 1 : 0);
  const MonitorMoment* before = monitors[index].back();
  moment.since = before != nullptr && before->configuration == moment.configuration ? before->since : time;
  monitors[index].push(time, moment);
}

void History::Impl::add(Nanoseconds time, const record::LogRecord& record, const Place* /*place*/) {
  if (record.name != "run" || record.level == record::LogLevel::kInfo) return;
  mark(time, "problem", record.text, observations.last_sequence());
  if (problems.size() < kStoriesMax) problems.push_back({time, record.text});
}

void History::Impl::add(Nanoseconds time, const record::BlackboardRecord& record, const Place* place) {
  blackboard.push(time, keep(Shown::kBlackboard, record, time, place));
}

void History::Impl::add(Nanoseconds /*time*/, const record::ViolationRecord& record, const Place* /*place*/) {
  if (violations.size() >= kStoriesMax || record.violation.as_map() == nullptr) return;
  std::string message = R"({"type":"violation")";
  for (const auto& [name, value] : *record.violation.as_map()) {
    message += ',';
    append_json_string(message, name);
    message += ':';
    append_json(message, value);
  }
  violations.push_back(message + "}");
}

void History::Impl::add(Nanoseconds time, const record::SceneRecord& record, const Place* place) {
  constexpr std::string_view kDoor = "door.";
  SceneMoment moment{keep(Shown::kObstacles, record, time, place), {}};
  for (const record::SceneThing& thing : record.things) {
    if (thing.id.starts_with(kDoor)) moment.closed_doors.push_back(thing.id.substr(kDoor.size()));
  }
  scene.push(time, std::move(moment));
}

RobotTracks* History::Impl::robot_of(std::string_view name) {
  const std::size_t index = subject.robot_index(name);
  return index == Subject::kNone ? nullptr : &robots[index];
}

void History::Impl::add(Nanoseconds time, const record::PoseRecord& record, const Place* /*place*/) {
  if (RobotTracks* robot = robot_of(record.robot))
    (record.is_estimate ? robot->estimate : robot->pose).push(time, record.pose_map);
}

void History::Impl::add(Nanoseconds time, const record::ScanRecord& record, const Place* place) {
  if (RobotTracks* robot = robot_of(record.robot)) robot->scan.push(time, keep(Shown::kScan, record, time, place));
}

void History::Impl::add(Nanoseconds time, const record::PathRecord& record, const Place* place) {
  if (RobotTracks* robot = robot_of(record.robot)) robot->path.push(time, keep(Shown::kPath, record, time, place));
}

void History::Impl::add(Nanoseconds time, const record::ParticlesRecord& record, const Place* place) {
  if (RobotTracks* robot = robot_of(record.robot))
    robot->particles.push(time, keep(Shown::kParticles, record, time, place));
}

void History::Impl::add(Nanoseconds time, const record::MotionRecord& record, const Place* place) {
  if (RobotTracks* robot = robot_of(record.robot)) robot->motion.push(time, keep(Shown::kMotion, record, time, place));
}

void History::Impl::add(Nanoseconds time, const record::BatteryRecord& record, const Place* /*place*/) {
  RobotTracks* robot = robot_of(record.robot);
  if (robot == nullptr) return;
  robot->battery.push(time, {.percentage = record.percent / 100,
                             .current = record.current_A,
                             .voltage = record.voltage_V,
                             .plugged = record.plugged,
                             .charging = record.charging});
}

// ---- Forgetting ----

std::size_t History::Impl::index_bytes() const {
  std::size_t bytes = observations.bytes();
  for (const auto& node : nodes) bytes += node.size() * sizeof(Track<std::uint8_t>::Entry);
  for (const auto& chart : charts) bytes += chart.size() * sizeof(Track<ChartMoment>::Entry);
  for (const auto& monitor : monitors) bytes += monitor.size() * sizeof(Track<MonitorMoment>::Entry);
  for (const auto& output : outputs) bytes += output.size() * sizeof(Track<Place>::Entry);
  for (const RobotTracks& robot : robots) {
    bytes += (robot.pose.size() + robot.estimate.size()) * sizeof(Track<record::Pose>::Entry) +
             robot.battery.size() * sizeof(Track<BatteryValue>::Entry) +
             (robot.scan.size() + robot.path.size() + robot.motion.size() + robot.particles.size()) *
                 sizeof(Track<Place>::Entry);
  }
  return bytes;
}

std::size_t History::bytes() const {
  const std::lock_guard lock(impl_->mutex);
  return impl_->index_bytes() + (impl_->live != nullptr ? impl_->live->blocks() * LiveTexts::kBlockSize : 0);
}

void History::Impl::make_room() {
  // The index grows with the texts; both are looked at when a block is full.
  if (live == nullptr || live->blocks() * LiveTexts::kBlockSize <= bytes_max / 2) return;
  while (live->blocks() > 2 && live->blocks() * LiveTexts::kBlockSize + index_bytes() > bytes_max) forget_first_block();
}

void History::Impl::forget_first_block() {
  const std::uint32_t block = live->first_block();
  forgotten += observations.drop_first_while([&](const Seen& seen) { return seen.place.block == block; });
  // From the first observation on that is kept, so that there is one at the beginning.
  begin = std::max(begin, block_times[1]);
  if (observations.size() > 0) begin = std::max(begin, observations[0].time);
  // What holds at the new beginning stays known, wherever its text was.
  const auto carry = [&](auto& track, auto&& place_of) {
    track.drop_before(begin);
    for (std::size_t i = 0; i < track.size(); ++i) {
      Place& place = place_of(track[i].value);
      if (place.block != block) break;
      text = texts->read(place);
      place = keep_text(end);
    }
  };
  const auto itself = [](Place& place) -> Place& { return place; };
  const auto member_place = [](auto& value) -> Place& { return value.place; };
  for (auto& chart : charts) carry(chart, member_place);
  for (auto& monitor : monitors) {
    carry(monitor, member_place);
    carry(monitor, [](auto& value) -> Place& { return value.chart; });
  }
  for (auto& output : outputs) carry(output, itself);
  carry(scene, member_place);
  carry(blackboard, itself);
  for (RobotTracks& robot : robots) {
    carry(robot.scan, itself);
    carry(robot.path, itself);
    carry(robot.motion, itself);
    carry(robot.particles, itself);
    robot.pose.drop_before(begin);
    robot.estimate.drop_before(begin);
    robot.battery.drop_before(begin);
  }
  for (auto& node : nodes) node.drop_before(begin, 1);
  mission.drop_before(begin);
  marks.drop_before(begin);
  live->drop_first_block();
  block_times.pop_front();
}

}  // namespace sentree::studio
