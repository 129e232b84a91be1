#include "sentree/replay/recording.h"

#include <algorithm>
#include <cctype>
#include <ctime>
#include <map>

#include <fmt/format.h>

#include "sentree/base/json.h"
#include "sentree/record/compression.h"
#include "sentree/record/foxglove.h"
#include "sentree/record/observation.h"
#include "sentree/record/schemas.h"
#include "sentree/replay/detail/robot_topics.h"
#include "sentree/replay/detail/snapshot.h"
#include "sentree/runtime/local_skill.h"
#include "sentree/runtime/monitors.h"

namespace sentree::replay {

namespace {

namespace fs = std::filesystem;
namespace schemas = record::schemas;

std::string decimal(std::int64_t number) { return std::to_string(number); }

fs::path resolved(const fs::path& path) {
  std::error_code error;
  return fs::absolute(path, error).lexically_normal();
}

bool is_below(const fs::path& path, const fs::path& folder) {
  const auto [end, unused] = std::mismatch(folder.begin(), folder.end(), path.begin(), path.end());
  return !folder.empty() && end == folder.end();
}

// The deepest folder that holds both.
fs::path common(const fs::path& a, const fs::path& b) {
  fs::path shared;
  for (auto x = a.begin(), y = b.begin(); x != a.end() && y != b.end() && *x == *y; ++x, ++y) shared /= *x;
  return shared;
}

std::string wall_clock() {
  const std::time_t now = std::time(nullptr);
  std::tm utc{};
  gmtime_r(&now, &utc);
  char text[32];
  (void)std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", &utc);
  return text;
}

void pack_state_ids(record::PackedJson& out, const scxml::Chart& chart, const scxml::Session& session) {
  out.raw("[");
  bool first = true;
  session.configuration().for_each([&](scxml::StateIndex state) {
    const std::string& id = chart.states()[state].id;
    if (id.empty()) return;
    if (!first) out.raw(",");
    first = false;
    out.text(id);
  });
  out.raw("]");
}

std::vector<std::string> state_ids(const scxml::Chart& chart, const scxml::Session& session) {
  std::vector<std::string> ids;
  session.configuration().for_each([&](scxml::StateIndex state) {
    const std::string& id = chart.states()[state].id;
    if (!id.empty()) ids.push_back(id);
  });
  return ids;
}

Value data_of(const scxml::Chart& chart, const scxml::Session& session) {
  Map data;
  session.visit_data(chart, [&](const std::string& name, const Value& value) { data.append(name, value); });
  return data;
}

void pack_data(record::PackedJson& out, const scxml::Chart& chart, const scxml::Session& session) {
  char separator = '{';
  session.visit_data(chart, [&](const std::string& name, const Value& value) {
    out.mark(separator);
    out.text(name);
    out.mark(':');
    out.value(value);
    separator = ',';
  });
  if (separator == '{') out.mark('{');
  out.mark('}');
}

bool is_of_path(char c) {
  return std::isalnum(static_cast<unsigned char>(c)) != 0 || std::string_view("/._-").find(c) != std::string_view::npos;
}

// A text in which places in the project are named from its folder on, however that was named.
std::string in_project(const project::Plan& plan, std::string text) {
  const fs::path above = fs::path(plan.scenario.project.file).parent_path();
  const fs::path normal = above.lexically_normal();
  for (std::string folder : {above.string(), normal.string(), ("." / normal).string()}) {
    if (folder.empty() || folder == "/") continue;
    folder += '/';
    for (auto at = text.find(folder); at != std::string::npos; at = text.find(folder, at + 1)) {
      if (at == 0 || !is_of_path(text[at - 1])) text.erase(at, folder.size());
    }
  }
  return text;
}

// In real time a run is tried to be met at rest that often, with so much of the machine's time in between.
constexpr int kRestTriesMax = 40;
constexpr Duration kRestTry = std::chrono::milliseconds(3);

}  // namespace

struct RunRecorder::Impl {
  Impl(const project::Plan& recorded, std::unique_ptr<record::Sink> sink, record::RecorderOptions options)
      : plan(recorded), recorder(std::move(sink), std::move(options)), charts(recorded.leaves.size()) {
    observations =
        recorder.add_channel(std::string(record::kObservationsTopic), "sentree.Observation", schemas::kObservation);
    tree = recorder.add_channel("/tree", "sentree.Tree", schemas::kTree);
    chart_states = recorder.add_channel("/charts", "sentree.Chart", schemas::kChart);
    monitor_states = recorder.add_channel("/monitors", "sentree.Monitor", schemas::kMonitor);
    log = recorder.add_channel("/log", "foxglove.Log", schemas::kLog);
    blackboard = recorder.add_channel("/blackboard", "sentree.Blackboard", schemas::kBlackboard);
    violations = recorder.add_channel("/violations", "sentree.Violation", schemas::kViolation);
    snapshots = recorder.add_channel(std::string(kSnapshotTopic), "sentree.Snapshot", schemas::kSnapshot);
    interventions =
        recorder.add_channel(std::string(kInterventionsTopic), "sentree.Observation", schemas::kObservation);
    statuses.assign(plan.tree.size(), bt::Status::kIdle);
    monitors.resize(plan.monitors.size());
  }

  void attach_files(const std::vector<text::ReadFile>& files, const RecordingOptions& options) {
    const fs::path shipped = project::shipped_folder("interfaces");
    const fs::path skills = project::shipped_folder("skills") / "nav2";
    const fs::path source = resolved(plan.scenario.file);
    const fs::path project = resolved(plan.scenario.project.file);
    fs::path root = common(source.parent_path(), project.parent_path());
    for (const text::ReadFile& file : files) {
      if (!is_below(resolved(file.path), shipped) && !is_below(resolved(file.path), skills))
        root = common(root, resolved(file.path).parent_path());
    }
    const fs::path project_folder = project.parent_path().lexically_relative(root);
    const std::string place = project.parent_path().string();
    // Texts that name each other by where they are say so of the machine anyway.
    bool is_placed = false;
    std::map<std::string, const text::ReadFile*> named;  // in an order that does not say who was read first
    for (const text::ReadFile& file : files) {
      is_placed = is_placed || file.content.find(place) != std::string::npos;
      const fs::path path = resolved(file.path);
      // An interface or a skill of Sentree's becomes one of the project's, so that the recording means the same with a
      // later version.
      const fs::path name = is_below(path, shipped)  ? project_folder / "interfaces" / path.lexically_relative(shipped)
                            : is_below(path, skills) ? project_folder / "skills" / path.lexically_relative(skills)
                                                     : path.lexically_relative(root);
      const std::string shown = name.lexically_normal().generic_string();
      if (file.content.size() <= kAttachedFileMax) named.emplace(shown, &file);
    }
    for (const auto& [name, file] : named) {
      recorder.attach({.name = std::string(kProjectPrefix) + name,
                       .media_type = "application/octet-stream",
                       .data = file->content});
    }
    const project::Scenario& scenario = plan.scenario;
    record::Metadata facts{std::string(kRunMetadata), {}};
    const auto fact = [&](const char* key, std::string value) { facts.entries.emplace_back(key, std::move(value)); };
    fact("format", "1");
    fact("scenario", scenario.name);
    fact("source", source.lexically_relative(root).generic_string());
    fact("project", project.lexically_relative(root).generic_string());
    if (is_placed) fact("root", root.string());
    fact("clock", scenario.virtual_time ? "virtual" : "real");
    fact("factor", shortest_decimal(scenario.factor));
    fact("seed", std::to_string(scenario.seed));
    fact("plan", std::to_string(plan.identity));
    fact("duration_ns", decimal(scenario.duration.count()));
    fact("period_ns", decimal(scenario.project.period.count()));
    if (!scenario.virtual_time) {
      fact("started", wall_clock());
      fact(kTellsDelays, "true");
      List elsewhere;
      for (const project::LeafPlan& leaf : plan.leaves) {
        if (!leaf.at.empty()) elsewhere.emplace_back(leaf.name);
      }
      fact(kLeavesElsewhere, to_json(elsewhere));
    }
    for (const auto& [key, value] : options.facts) fact(key.c_str(), value);
    recorder.add(std::move(facts));
  }

  template <class... PackAndMake>
  void write(record::ChannelId channel, TimePoint time, PackAndMake&&... pack_and_make) {
    recorder.pack(channel, time, std::forward<PackAndMake>(pack_and_make)...);
  }

  void say(TimePoint time, record::LogLevel level, std::string_view name, const std::string& what) {
    const std::string text = in_project(plan, what);
    recorder.message(
        log, time, [&](std::string& out) { record::append_log(out, time, level, name, text); },
        [&] {
          return record::LogRecord{level, std::string(name), text};
        });
  }

  // In the observer's actor.
  void observe(const Message& message) {
    last_time = message.time;
    write(
        observations, message.time, [&](record::PackedJson& out) { record::pack_observation(out, message); },
        [&] { return message; });
    switch (meaning_of(message)) {
      case What::kTick:
        write_tree(message.time);
        tick = message.tick;
        break;
      case What::kStatus: take_status(message); break;
      case What::kLog: {
        const Value* label = message.data.find("label");
        const Value* text = message.data.find("text");
        std::string line(label != nullptr ? label->text() : "");
        if (!line.empty()) line += ": ";
        say(message.time, record::LogLevel::kInfo, message.source,
            line + std::string(text != nullptr ? text->text() : ""));
        break;
      }
      case What::kInjection:
        write(interventions, message.time, [&](record::PackedJson& out) { record::pack_observation(out, message); });
        if (inside != nullptr) sample_after_command();
        break;
      case What::kOther: break;
    }
    if (inside == nullptr) return;
    for (const std::size_t index : inside->monitors().reached()) look_at_monitor(index, message.time, message.name);
  }

  void take_status(const Message& message) {
    const Value* node = message.data.find("node");
    const Value* to = message.data.find("to");
    const std::int64_t* index = node != nullptr ? node->as_int() : nullptr;
    if (index == nullptr || to == nullptr || *index < 0 || *index >= static_cast<std::int64_t>(statuses.size())) return;
    statuses[static_cast<std::size_t>(*index)] = bt::parse_status(to->text()).value_or(bt::Status::kIdle);
  }

  // The tree as the last tick left it, if that differs from the one before.
  void write_tree(TimePoint time) {
    if (statuses == written_statuses) return;
    written_statuses = statuses;
    Map status;
    for (std::size_t node = 0; node < statuses.size(); ++node) {
      if (statuses[node] == bt::Status::kIdle) continue;
      status.append(plan.tree.path(static_cast<bt::NodeId>(node)), bt::to_string(statuses[node]));
    }
    write(tree, time, [&](record::PackedJson& out) {
      out.value(Map{{"tick", static_cast<std::int64_t>(tick)}, {"status", std::move(status)}});
    });
  }

  // What an observation means here.
  enum class What : std::uint8_t { kOther, kTick, kStatus, kLog, kInjection };

  static What meaning_of(const Message& message) {
    using namespace std::string_view_literals;
    if (message.kind != MessageKind::kEvent) return What::kOther;
    const std::string_view name = message.name;
    if (name == "node.status"sv) return What::kStatus;
    if (name == "mission.tick"sv) return What::kTick;
    if (name == "scenario.injection"sv) return What::kInjection;
    return name.ends_with(".log"sv) ? What::kLog : What::kOther;
  }

  // In the observer's actor.
  void look_at_monitor(std::size_t index, TimePoint time, std::string_view event = {}) {
    const monitor::State* state = inside != nullptr ? inside->monitors().state(index) : nullptr;
    if (state == nullptr) return;
    Seen& seen = monitors[index];
    const monitor::Model& model = plan.monitors[index];
    const bool stays = seen.known && seen.verdict == state->verdict && seen.violations == state->trail.violations &&
                       seen.configuration == state->session.configuration();
    // Only an observation that it listens to, or a timer, which leads to another state, changes its data.
    if (stays && (model.chart().data().empty() || seen.observations == state->trail.seen)) return;
    Value data = data_of(model.chart(), state->session);
    seen.observations = state->trail.seen;
    if (stays && seen.data == data) return;
    seen.known = true;
    seen.verdict = state->verdict;
    seen.violations = state->trail.violations;
    seen.configuration = state->session.configuration();
    seen.data = std::move(data);
    std::optional<monitor::Standing> standing;
    if (state->verdict == monitor::Verdict::kUndecided && !state->failure())
      standing = monitor::standing(model, *state);
    const auto pack = [&](record::PackedJson& out) {
      out.raw(R"({"monitor":)");
      out.text(model.name());
      out.raw(R"(,"verdict":)");
      out.text(monitor::to_string(state->verdict));
      out.raw(R"(,"states":)");
      pack_state_ids(out, model.chart(), state->session);
      if (standing) {
        out.raw(R"(,"standing":)");
        out.text(standing->text());
        if (standing->deadline) {
          out.raw(R"(,"deadline":)");
          out.integer(standing->deadline->time_since_epoch().count());
        }
      }
      if (state->trail.violations > 0) {
        out.raw(R"(,"violations":)");
        out.integer(static_cast<std::int64_t>(state->trail.violations));
      }
      if (!event.empty()) {
        out.raw(R"(,"event":)");
        out.text(event);
      }
      out.raw(R"(,"data":)");
      out.value(seen.data);
      out.raw("}");
    };
    write(monitor_states, time, pack, [&] {
      record::MonitorRecord made{.monitor = model.name(),
                                 .verdict = std::string(monitor::to_string(state->verdict)),
                                 .states = state_ids(model.chart(), state->session),
                                 .standing = standing ? standing->text() : std::string(),
                                 .deadline = {},
                                 .violations = {},
                                 .event = std::string(event),
                                 .data = seen.data};
      if (standing && standing->deadline) made.deadline = standing->deadline->time_since_epoch().count();
      if (state->trail.violations > 0) made.violations = static_cast<std::int64_t>(state->trail.violations);
      return made;
    });
  }

  // In the skill's actor.
  void stepped(std::size_t leaf, const runtime::Skill& skill) {
    Charted& seen = charts[leaf];
    const mission::SkillState::Latest& latest = skill.latest();
    if (seen.known && seen.running == skill.running() && seen.transitions == latest.transitions &&
        (!skill.running() || seen.configuration == skill.session().configuration()))
      return;
    seen.known = true;
    seen.running = skill.running();
    seen.transitions = latest.transitions;
    if (skill.running()) seen.configuration = skill.session().configuration();
    const TimePoint time = inside->scheduler().now();
    const auto pack = [&](record::PackedJson& out) {
      out.raw(R"({"leaf":)");
      out.text(plan.leaves[leaf].name);
      out.raw(R"(,"running":)");
      out.boolean(skill.running());
      out.raw(R"(,"states":)");
      if (skill.running())
        pack_state_ids(out, skill.chart(), skill.session());
      else
        out.raw("[]");
      if (latest.transition) {
        out.raw(R"(,"last":)");
        out.integer(static_cast<std::int64_t>(*latest.transition));
      }
      out.raw(R"(,"event":)");
      out.text(latest.event);
      if (skill.running()) {
        out.raw(R"(,"data":)");
        pack_data(out, skill.chart(), skill.session());
      }
      out.raw("}");
    };
    write(chart_states, time, pack, [&] {
      record::ChartRecord made{.leaf = plan.leaves[leaf].name,
                               .running = skill.running(),
                               .states = {},
                               .last = latest.transition,
                               .event = latest.event,
                               .data = {}};
      if (skill.running()) {
        made.states = state_ids(skill.chart(), skill.session());
        made.data = data_of(skill.chart(), skill.session());
      }
      return made;
    });
  }

  void begin(runtime::RunInside& run) {
    inside = &run;
    // Of a run that goes on from somewhere.
    const auto begun = run.mission().state().tree.statuses();
    statuses.assign(begun.begin(), begun.end());
    for (std::size_t leaf = 0; run.scheduler().is_virtual() && leaf < charts.size(); ++leaf) {
      runtime::SkillActor* const skill = run.skill(leaf);
      if (skill != nullptr && skill->state().running())
        stepped(leaf, {mission::skill_model(plan, leaf), skill->state()});
    }
    if (run.sim() != nullptr) robots = std::make_unique<RobotTopics>(recorder, run.sim()->world());
    sample_at(TimePoint{});
    snapshot_at(TimePoint(kSnapshotPeriod));
  }

  // In the director's actor.
  void sample_robots() {
    const TimePoint now = inside->scheduler().now();
    if (robots) inside->sim()->inspect([&](const sim::State& state) { robots->sample(state, now); });
  }

  // What was done is seen at once, also where no time passes: a run in virtual time that stands executes commands only.
  void sample_after_command() {
    runtime::Scheduler& scheduler = inside->scheduler();
    if (scheduler.is_virtual())
      scheduler.at(inside->director(), scheduler.now(), mission::Rank::kInjection, [this] { sample_robots(); });
    else
      scheduler.post(inside->director(), [this] { sample_robots(); });
  }

  // In the mission's actor. The blackboard, if it is not as it was written last.
  void write_blackboard(TimePoint now) {
    write_blackboard(now, bt::export_blackboard(plan.tree, inside->mission().state().tree));
  }
  void write_blackboard(TimePoint now, const Value& entries) {
    std::string json = to_json(entries);
    if (json == written_blackboard || (written_blackboard.empty() && json == "{}")) return;
    written_blackboard = std::move(json);
    recorder.message(
        blackboard, now, [&](std::string& out) { out += written_blackboard; },
        [&] { return record::BlackboardRecord{entries}; });
  }

  void write_violation(const runtime::MonitorReport& report) {
    const monitor::Decision& decision = *report.decision;
    List witness;
    for (const Message& message : decision.witness) {
      witness.push_back(Map{{"sequence", static_cast<std::int64_t>(message.sequence)},
                            {"time", message.time.time_since_epoch().count()},
                            {"tick", static_cast<std::int64_t>(message.tick)},
                            {"kind", to_string(message.kind)},
                            {"name", message.name},
                            {"source", message.source},
                            {"target", message.target},
                            {"call", static_cast<std::int64_t>(message.call)},
                            {"data", message.data}});
    }
    Map violation{{"monitor", report.name},
                  {"time", decision.at.time_since_epoch().count()},
                  {"sequence", decision.deciding ? static_cast<std::int64_t>(decision.deciding->sequence) : 0},
                  {"story", story ? in_project(plan, story(report)) : ""},
                  {"witness", std::move(witness)},
                  {"witness_complete", decision.witness_complete},
                  {"witness_minimal", decision.witness_minimal},
                  {"explanation", nullptr}};
    if (report.explanation) {
      monitor::Explanation explanation = *report.explanation;
      explanation.place.file = in_project(plan, explanation.place.file);
      violation["explanation"] = monitor::to_value(explanation);
    }
    const Value made(std::move(violation));
    write(
        violations, decision.at, [&](record::PackedJson& out) { out.value(made); },
        [&] { return record::ViolationRecord{made}; });
  }

  void sample_at(TimePoint when) {
    inside->scheduler().at(inside->director(), when, mission::Rank::kSimulator, [this, when] {
      const TimePoint now = inside->scheduler().now();
      sample_robots();
      inside->scheduler().post(inside->mission().actor(), [this, now] { write_blackboard(now); });
      // Silence moves monitors too.
      inside->scheduler().post(inside->observer(), [this, now] {
        for (std::size_t i = 0; i < monitors.size(); ++i) look_at_monitor(i, now);
      });
      sample_at(std::max(when + kSamplePeriod, now));
    });
  }

  void snapshot_at(TimePoint when) {
    inside->scheduler().at(inside->director(), when, mission::Rank::kInjection,
                           [this, when] { snapshot(when, kRestTriesMax); });
  }

  // In the director's actor. In real time a part may be at work, and soon is not.
  void snapshot(TimePoint when, int tries) {
    if (!can_be_whole) return snapshot_parts(when);
    // What takes its time, before the others have to wait for it.
    if (inside->sim() != nullptr && !inside->scheduler().is_virtual()) inside->sim()->inspect([](const sim::State&) {});
    inside->capture_at_rest([this, when, tries](tl::expected<mission::State, runtime::RunInside::Uncaptured> state) {
      if (state) {
        // A durable run is executed as in virtual time, but its replay knows what happened only from the observations.
        if (plan.scenario.virtual_time || mission::is_at_rest(*state)) return snapshot_whole(when, std::move(*state));
      } else if (!state.error().is_at_work) {
        can_be_whole = false;
        say(inside->scheduler().now(), record::LogLevel::kInfo, "run",
            fmt::format("moments of this run are replayed from its beginning ({})", state.error().why_never));
      }
      if (!can_be_whole || tries == 0) return snapshot_parts(when);
      const auto soon =
          Duration(static_cast<std::int64_t>(static_cast<double>(kRestTry.count()) * plan.scenario.factor));
      runtime::Scheduler& scheduler = inside->scheduler();
      scheduler.at(inside->director(), add_saturating(scheduler.now(), soon), mission::Rank::kInjection,
                   [this, when, tries] { snapshot(when, tries - 1); });
    });
  }

  // Those that run here.
  void snapshot_parts(TimePoint when) {
    take_snapshot(*inside, plan, [this](TimePoint time, const Map& snapshot) {
      write(snapshots, time, [&](record::PackedJson& out) { out.value(snapshot); });
    });
    snapshot_at(std::max(when + kSnapshotPeriod, inside->scheduler().now()));
  }

  // The run as one value, unless something of it has no saved form.
  void snapshot_whole(TimePoint when, mission::State state) {
    mission::forget_history(state, kSnapshotTrailMax);
    const auto saved = mission::save(plan, state);
    if (!saved) return snapshot_parts(when);
    // Base64 hides from a chunk's compression what repeats.
    std::string packed;
    record::compress(record::Compression::kZstd, *saved, packed);
    const auto* octets = reinterpret_cast<const std::byte*>(packed.data());
    const Value snapshot = Map{{"sequence", static_cast<std::int64_t>(state.published)},
                               {"tick", static_cast<std::int64_t>(state.tick)},
                               {"size", static_cast<std::int64_t>(saved->size())},
                               {"state", Bytes{{octets, octets + packed.size()}}}};
    write(snapshots, state.now, [&](record::PackedJson& out) { out.value(snapshot); });
    snapshot_at(std::max(when + kSnapshotPeriod, inside->scheduler().now()));
  }

  struct Seen {
    bool known = false;
    monitor::Verdict verdict = monitor::Verdict::kUndecided;
    std::uint64_t violations = 0;
    scxml::StateSet configuration;
    std::uint64_t observations = 0;
    Value data;
  };
  struct Charted {
    bool known = false;
    bool running = false;
    std::uint64_t transitions = 0;
    scxml::StateSet configuration;
  };

  const project::Plan& plan;
  record::Recorder recorder;
  record::ChannelId observations = 0;
  record::ChannelId tree = 0;
  record::ChannelId chart_states = 0;
  record::ChannelId monitor_states = 0;
  record::ChannelId log = 0;
  record::ChannelId blackboard = 0;
  record::ChannelId violations = 0;
  record::ChannelId snapshots = 0;
  record::ChannelId interventions = 0;
  std::function<std::string(const runtime::MonitorReport&)> story;
  std::string written_blackboard;  // of the mission's actor
  runtime::RunInside* inside = nullptr;
  bool can_be_whole = true;  // as one value, as far as is known. Of the director's actor
  std::unique_ptr<RobotTopics> robots;
  TimePoint last_time{};
  std::uint64_t tick = 0;
  std::vector<bt::Status> statuses;
  std::vector<bt::Status> written_statuses;
  std::vector<Seen> monitors;
  std::vector<Charted> charts;  // each belongs to its skill's actor
};

RunRecorder::RunRecorder(const project::Plan& plan, const std::vector<text::ReadFile>& files,
                         std::unique_ptr<record::Sink> sink, RecordingOptions options) {
  record::RecorderOptions recorder;
  recorder.compression = options.compression;
  recorder.library = std::move(options.library);
  recorder.tap = std::move(options.tap);
  recorder.audience = options.audience;
  if (plan.scenario.virtual_time) {
    recorder.flush_every = Duration(0);
    recorder.wait_when_full = true;
  }
  if (options.on_failure) {
    recorder.on_failure = [told = std::move(options.on_failure)](const Diagnostic& why) {
      told(fmt::format("recording stopped: {}; the run goes on", to_string(why)));
    };
  }
  impl_ = std::make_unique<Impl>(plan, std::move(sink), std::move(recorder));
  impl_->story = std::move(options.story);
  impl_->attach_files(files, options);
}

RunRecorder::~RunRecorder() = default;

void RunRecorder::flush() { impl_->recorder.flush(); }

void RunRecorder::install(runtime::RunOptions& options) {
  Impl* impl = impl_.get();
  options.listeners.push_back([impl](const Message& message) { impl->observe(message); });
  options.on_begin = [impl, next = std::move(options.on_begin)](runtime::RunInside& inside) {
    if (next) next(inside);
    impl->begin(inside);
  };
  options.on_skill_step = [impl, next = std::move(options.on_skill_step)](std::size_t leaf,
                                                                          const runtime::Skill& skill) {
    if (next) next(leaf, skill);
    impl->stepped(leaf, skill);
  };
  options.on_problem = [impl, next = std::move(options.on_problem)](const std::string& what) {
    if (next) next(what);
    const TimePoint now = impl->inside != nullptr ? impl->inside->scheduler().now() : TimePoint{};
    impl->say(now, record::LogLevel::kWarning, "run", what);
  };
  options.on_decision = [impl, next = std::move(options.on_decision)](const runtime::MonitorReport& report) {
    if (next) next(report);
    if (!report.decision) return;
    const bool violated = report.verdict == monitor::Verdict::kViolated;
    if (violated) impl->write_violation(report);
    impl->say(report.decision->at, violated ? record::LogLevel::kError : record::LogLevel::kInfo, report.name,
              fmt::format("{}: state {}", to_string(report.verdict), report.decision->state));
  };
}

Map vacuities(const runtime::RunReport& report) {
  Map all;
  for (const runtime::MonitorReport& monitor : report.monitors) {
    if (!monitor.vacuity.empty()) all[monitor.name] = monitor.vacuity;
  }
  return all;
}

void RunRecorder::blackboard(TimePoint time, const Value& entries) { impl_->write_blackboard(time, entries); }

Result<std::uint32_t> RunRecorder::follow(decltype(RecordingOptions::tap) tap) {
  return impl_->recorder.follow(std::move(tap));
}

record::RecorderReport RunRecorder::finish(const runtime::RunReport& report) {
  impl_->inside = nullptr;
  impl_->write_tree(std::max(report.ended, impl_->last_time));
  record::Metadata result{std::string(kResultMetadata), {}};
  const auto fact = [&](const char* key, std::string value) { result.entries.emplace_back(key, std::move(value)); };
  fact("mission", std::string(to_string(report.mission)));
  fact("reason", in_project(impl_->plan, report.reason));
  fact("ended_ns", decimal(report.ended.time_since_epoch().count()));
  fact("observations", std::to_string(report.observations));
  fact("ticks", std::to_string(report.timing.ticks));
  fact("ended_by", report.interrupted      ? "interrupt"
                   : report.timed_out      ? "time limit"
                   : !report.error.empty() ? "error"
                                           : "mission");
  if (!report.error.empty()) fact("error", in_project(impl_->plan, report.error));
  Map verdicts;
  for (const runtime::MonitorReport& monitor : report.monitors)
    verdicts[monitor.name] = monitor::to_string(monitor.verdict);
  fact("verdicts", to_json(Value(std::move(verdicts))));
  fact("vacuous", to_json(Value(vacuities(report))));
  impl_->recorder.add(std::move(result));
  impl_->recorder.close();
  return impl_->recorder.report();
}

}  // namespace sentree::replay
