#include "sentree/studio/history.h"

#include <cmath>

#include "sentree/base/json.h"
#include "sentree/record/observation.h"
#include "sentree/replay/recording.h"
#include "sentree/studio/detail/history_impl.h"
#include "sentree/text/json.h"

namespace sentree::studio {

namespace {

Nanoseconds to_nanoseconds(TimePoint time) { return time.time_since_epoch().count(); }

// Violations whose story is kept, and problems.
constexpr std::size_t kStoriesMax = 1000;

PoseValue pose_of(std::string_view pose) {
  const std::string_view position = member(pose, "position");
  const std::string_view turn = member(pose, "orientation");
  return {as_number(member(position, "x")).value_or(0.0), as_number(member(position, "y")).value_or(0.0),
          2 * std::atan2(as_number(member(turn, "z")).value_or(0.0), as_number(member(turn, "w")).value_or(1.0))};
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
}

History::~History() = default;

bool History::wants(std::string_view topic) const { return impl_->feed_of(topic).kind != Feed::Kind::kNone; }

void History::take(std::string_view topic, TimePoint time, std::string_view json) {
  const std::lock_guard lock(impl_->mutex);
  impl_->key.assign(topic);
  const auto [feed, is_new] = impl_->feeds.try_emplace(impl_->key);
  if (is_new) feed->second = impl_->feed_of(topic);
  if (feed->second.kind == Feed::Kind::kNone) return;
  impl_->take(feed->second, to_nanoseconds(time), json, nullptr);
  impl_->make_room();
}

void History::read_index() {
  std::map<record::ChannelId, Feed> feeds;
  bool has_violations = false;
  for (const auto& [id, channel] : impl_->reader->channels()) {
    feeds[id] = impl_->feed_of(channel.topic);
    has_violations = has_violations || feeds[id].kind == Feed::Kind::kViolations;
  }
  for (std::size_t part = 0; part < impl_->reader->parts(); ++part) {
    const auto records = impl_->reader->part(part);
    if (!records) continue;
    const std::lock_guard lock(impl_->mutex);
    impl_->reader->each_message(*records, [&](const record::RawMessage& raw) {
      const Feed feed = feeds[raw.channel];
      if (feed.kind == Feed::Kind::kNone) return;
      const Place place{static_cast<std::uint32_t>(part), static_cast<std::uint32_t>(raw.data.data() - records->data()),
                        static_cast<std::uint32_t>(raw.data.size())};
      impl_->take(feed, static_cast<Nanoseconds>(raw.log_time), raw.data, &place);
    });
  }
}

Nanoseconds History::begin() const {
  const std::lock_guard lock(impl_->mutex);
  return impl_->begin;
}

Nanoseconds History::end() const { return impl_->end; }

Feed History::Impl::feed_of(std::string_view topic) const {
  using Kind = Feed::Kind;
  if (topic == record::kObservationsTopic) return {Kind::kObservations};
  if (topic == "/charts") return {Kind::kCharts};
  if (topic == "/monitors") return {Kind::kMonitors};
  if (topic == "/log") return {Kind::kLog};
  if (topic == "/scene") return {Kind::kScene};
  if (topic == "/blackboard") return {Kind::kBlackboard};
  if (topic == "/violations") return {Kind::kViolations};
  const std::size_t slash = topic.rfind('/');
  if (slash == 0 || slash == std::string_view::npos) return {};
  const std::size_t robot = subject.robot_index(topic.substr(1, slash - 1));
  if (robot == Subject::kNone) return {};
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

void History::Impl::take(const Feed& feed, Nanoseconds time, std::string_view json, const Place* place) {
  if (time > end) end = time;
  switch (feed.kind) {
    case Feed::Kind::kNone: break;
    case Feed::Kind::kObservations: take_observation(time, json, place); break;
    case Feed::Kind::kCharts: take_chart(time, json, place); break;
    case Feed::Kind::kMonitors: take_monitor(time, json, place); break;
    case Feed::Kind::kLog: take_log(time, json); break;
    case Feed::Kind::kScene: scene.push(time, keep(json, time, place)); break;
    case Feed::Kind::kBlackboard: blackboard.push(time, keep(json, time, place)); break;
    case Feed::Kind::kViolations:
      if (violations.size() < kStoriesMax) {
        std::string message = sound(json);
        if (message.starts_with('{')) violations.push_back("{\"type\":\"violation\"," + message.substr(1));
      }
      break;
    default: take_robot(feed, time, json, place);
  }
}

Place History::Impl::keep(std::string_view json, Nanoseconds time, const Place* place) {
  if (place != nullptr) return *place;
  const Place kept = live->append(json);
  if (block_times.size() < live->blocks()) block_times.push_back(time);
  return kept;
}

std::uint32_t History::Impl::shape_of(std::string_view name, std::string_view kind, std::string_view source,
                                      std::string_view target) {
  key.clear();
  for (const std::string_view part : {name, kind, source, target}) {
    key += part;
    key += '\0';
  }
  const auto known = shape_ids.find(key);
  if (known != shape_ids.end()) return known->second;
  if (shapes.size() < kShapesMax) {
    const auto text = [](std::string_view raw) { return unquoted("\"" + std::string(raw) + "\""); };
    Shape shape{text(name), text(kind), text(source), text(target)};
    Role role = Role::kPlain;
    if (shape.name == "node.status")
      role = Role::kNodeStatus;
    else if (shape.name == "mission.status")
      role = Role::kMissionStatus;
    else if (shape.name == "scenario.injection")
      role = Role::kInjection;
    else if (shape.name == "monitor.violated" || shape.name == "monitor.satisfied")
      role = Role::kDecision;
    else if (shape.kind == "error")
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

void History::Impl::take_observation(Nanoseconds time, std::string_view json, const Place* place) {
  Seen seen;
  std::string_view name, kind, source, target, data;
  for (JsonWalk walk(json); walk.next();) {
    const std::string_view member = walk.name();
    if (member == "sequence")
      seen.sequence = static_cast<std::uint64_t>(as_integer(walk.value()).value_or(0));
    else if (member == "kind")
      kind = inside(walk.value());
    else if (member == "source")
      source = inside(walk.value());
    else if (member == "target")
      target = inside(walk.value());
    else if (member == "name")
      name = inside(walk.value());
    else if (member == "tick")
      seen.tick = static_cast<std::uint32_t>(as_integer(walk.value()).value_or(0));
    else if (member == "data")
      data = walk.value();
  }
  if (seen.sequence == 0) return;
  seen.place = keep(json, time, place);
  seen.shape = shape_of(name, kind, source, target);
  observations.push(time, seen);
  if (roles[seen.shape] != Role::kPlain) take_effect(roles[seen.shape], shapes[seen.shape], time, data, seen);
}

void History::Impl::take_effect(Role role, const Shape& shape, Nanoseconds time, std::string_view data,
                                const Seen& seen) {
  switch (role) {
    case Role::kPlain: break;
    case Role::kNodeStatus: {
      const auto node = as_integer(member(data, "node"));
      const auto status = bt::parse_status(inside(member(data, "to")));
      if (!node || !status || *node < 0 || *node >= static_cast<std::int64_t>(nodes.size())) break;
      nodes[static_cast<std::size_t>(*node)].push(time, static_cast<std::uint8_t>(*status));
      ++tree_version;
      break;
    }
    case Role::kMissionStatus:
      if (const auto status = bt::parse_status(inside(member(data, "status"))))
        mission.push(time, static_cast<std::uint8_t>(*status));
      break;
    case Role::kReply: {
      const std::string_view values = member(data, "outputs");
      if (values.size() <= 2) break;
      outputs[leaf_indices.at(shape.source)].push(time, seen.place);
      ++outputs_version;
      break;
    }
    case Role::kInjection: {
      const bool by_hand = shape.source != "scenario";
      const std::string_view args = member(data, "args");
      mark(time, by_hand ? "intervention" : "injection",
           unquoted(member(data, "what")) + (args.size() > 2 ? " " + sound(args) : ""), seen.sequence);
      break;
    }
    case Role::kDecision:
      if (shape.name == "monitor.violated") mark(time, "violation", unquoted(member(data, "monitor")), seen.sequence);
      if (const std::size_t monitor = subject.monitor_index(unquoted(member(data, "monitor")));
          monitor != Subject::kNone && subject.monitors[monitor].model == nullptr) {
        monitors[monitor].push(
            time, {seen.place, 0,
                   shape.name == "monitor.violated" ? monitor::Verdict::kViolated : monitor::Verdict::kSatisfied});
      }
      break;
    case Role::kError:
      if (inside(member(data, "kind")) == "vetoed") {
        mark(time, "veto", shape.name.substr(0, shape.name.rfind('.')) + ": " + unquoted(member(data, "message")),
             seen.sequence);
      }
      break;
  }
}

void History::Impl::mark(Nanoseconds time, std::string_view kind, std::string text, std::uint64_t sequence) {
  if (marks.size() < kMarksMax) marks.push(time, {kind, std::move(text), sequence});
}

std::uint32_t History::Impl::configuration_of(std::size_t chart, std::string_view states) {
  key.assign(std::to_string(chart));
  key += states;
  const auto known = configuration_ids.find(key);
  if (known != configuration_ids.end()) return known->second;
  if (configurations.size() >= kShapesMax) return 0;
  const ShownChart& shown = subject.charts[chart];
  Configuration made;
  std::vector<scxml::StateIndex> active;
  made.active = "[";
  for (JsonWalk walk(states); walk.next();) {
    const std::string id = unquoted(walk.value());
    const auto drawn = shown.drawn_states.find(id);
    const auto state = shown.chart.find(id);
    if (drawn == shown.drawn_states.end() || !state) continue;
    made.active += (made.active.size() > 1 ? "," : "") + std::to_string(drawn->second);
    active.push_back(*state);
  }
  made.active += "]";
  for (std::size_t i = 0; i < active.size(); ++i) {
    const scxml::State& state = shown.chart.states()[active[i]];
    const bool innermost = i + 1 == active.size() || active[i + 1] <= active[i] || active[i + 1] >= state.end;
    if (innermost) made.label += (made.label.empty() ? "" : " + ") + state.id;
  }
  const auto id = static_cast<std::uint32_t>(configurations.size());
  configurations.push_back(std::move(made));
  configuration_ids.emplace(key, id);
  return id;
}

void History::Impl::take_chart(Nanoseconds time, std::string_view json, const Place* place) {
  const std::size_t chart = subject.skill_chart(unquoted(member(json, "leaf")));
  if (chart == Subject::kNone) return;
  ChartMoment moment;
  moment.place = keep(json, time, place);
  moment.running = member(json, "running") == "true";
  moment.configuration = configuration_of(chart, member(json, "states"));
  charts[chart].push(time, moment);
}

void History::Impl::take_monitor(Nanoseconds time, std::string_view json, const Place* place) {
  const std::string name = unquoted(member(json, "monitor"));
  const std::size_t index = subject.monitor_index(name);
  if (index == Subject::kNone) return;
  MonitorMoment moment;
  moment.place = keep(json, time, place);
  const std::string_view verdict = inside(member(json, "verdict"));
  moment.verdict = verdict == "violated"    ? monitor::Verdict::kViolated
                   : verdict == "satisfied" ? monitor::Verdict::kSatisfied
                                            : monitor::Verdict::kUndecided;
  if (const auto chart = subject.charts_by_id.find("monitor:" + name); chart != subject.charts_by_id.end())
    moment.configuration = configuration_of(chart->second, member(json, "states"));
  monitors[index].push(time, moment);
}

void History::Impl::take_log(Nanoseconds time, std::string_view json) {
  constexpr std::int64_t kWarning = 3;
  if (inside(member(json, "name")) != "run" || as_integer(member(json, "level")).value_or(0) < kWarning) return;
  std::string text = unquoted(member(json, "message"));
  mark(time, "problem", text, observations.back() != nullptr ? observations.back()->sequence : 0);
  if (problems.size() < kStoriesMax) problems.push_back({time, std::move(text)});
}

void History::Impl::take_robot(const Feed& feed, Nanoseconds time, std::string_view json, const Place* place) {
  RobotTracks& robot = robots[feed.robot];
  switch (feed.kind) {
    case Feed::Kind::kPose: robot.pose.push(time, pose_of(member(json, "pose"))); break;
    case Feed::Kind::kEstimate: robot.estimate.push(time, pose_of(member(json, "pose"))); break;
    case Feed::Kind::kScan: robot.scan.push(time, keep(json, time, place)); break;
    case Feed::Kind::kPath: robot.path.push(time, keep(json, time, place)); break;
    case Feed::Kind::kMotion: robot.motion.push(time, keep(json, time, place)); break;
    case Feed::Kind::kParticles: robot.particles.push(time, keep(json, time, place)); break;
    default: {
      BatteryValue battery;
      battery.percentage = as_number(member(json, "percent")).value_or(0.0) / 100;
      battery.current = as_number(member(json, "current_A")).value_or(0.0);
      battery.voltage = as_number(member(json, "voltage_V"));
      battery.charging = member(json, "charging") == "true";
      if (const std::string_view plugged = member(json, "plugged"); !plugged.empty())
        battery.plugged = plugged == "true";
      robot.battery.push(time, battery);
    }
  }
}

std::string History::Impl::sound(std::string_view json) const {
  if (live != nullptr) return std::string(json);
  const auto value = text::parse_json(json);
  return value ? to_json(*value) : "null";
}

// ---- Forgetting ----

std::size_t History::Impl::index_bytes() const {
  std::size_t bytes = observations.size() * sizeof(Track<Seen>::Entry);
  for (const auto& node : nodes) bytes += node.size() * sizeof(Track<std::uint8_t>::Entry);
  for (const auto& chart : charts) bytes += chart.size() * sizeof(Track<ChartMoment>::Entry);
  for (const auto& monitor : monitors) bytes += monitor.size() * sizeof(Track<MonitorMoment>::Entry);
  for (const auto& output : outputs) bytes += output.size() * sizeof(Track<Place>::Entry);
  for (const RobotTracks& robot : robots) {
    bytes += (robot.pose.size() + robot.estimate.size()) * sizeof(Track<PoseValue>::Entry) +
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
      place = keep(read(place), end, nullptr);
    }
  };
  const auto itself = [](Place& place) -> Place& { return place; };
  const auto member_place = [](auto& value) -> Place& { return value.place; };
  for (auto& chart : charts) carry(chart, member_place);
  for (auto& monitor : monitors) carry(monitor, member_place);
  for (auto& output : outputs) carry(output, itself);
  carry(scene, itself);
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
