#include "sentree/campaign/runner.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "sentree/monitor/quick.h"
#include "sentree/runtime/inside.h"

namespace sentree::campaign {

namespace {

// What makes a campaign impossible: parts that have a clock of their own.
void check_alone(const project::Plan& plan, Diagnostics& diagnostics) {
  const auto elsewhere = [&](const std::string& what, const SourceSpan& span) {
    diagnostics.push_back({Severity::kError, "campaign.elsewhere",
                           what + " is in another process, which has no virtual time; a campaign needs at: sim, at: "
                                  "model, or a skill of the project",
                           span});
  };
  for (const project::ServiceEntry& entry : plan.scenario.project.services) {
    if (!project::is_inside(entry.at)) elsewhere(fmt::format("service \"{}\"", entry.name), entry.span);
  }
  for (const project::SkillEntry& entry : plan.scenario.project.skills) {
    if (!entry.at.empty()) elsewhere(fmt::format("skill \"{}\"", entry.leaf), entry.span);
  }
  for (const project::ObserverEntry& entry : plan.scenario.project.observers)
    elsewhere(fmt::format("observer \"{}\"", entry.name), entry.span);
  for (const project::MonitorEntry& entry : plan.scenario.project.monitors) {
    if (!entry.at.empty()) elsewhere(fmt::format("monitor \"{}\"", entry.name), entry.span);
  }
  for (const project::ProcessEntry& entry : plan.scenario.processes)
    elsewhere(fmt::format("\"{}\"", entry.name), entry.span);
}

void check_areas(const Vary& vary, const sim::World* world, Diagnostics& diagnostics) {
  const auto check = [&](const Distribution& from, const std::string& what) {
    if (from.kind != Distribution::Kind::kPose) return;
    std::vector<std::string> names;
    if (world != nullptr) {
      for (const sim::NamedArea& area : world->areas) names.push_back(area.name);
    }
    if (world == nullptr)
      diagnostics.push_back(
          {Severity::kError, "campaign.area", what + " is a pose, and the project has no world", from.span});
    else if (!from.area.empty() && std::find(names.begin(), names.end(), from.area) == names.end())
      diagnostics.push_back({Severity::kError, "campaign.area",
                             fmt::format("{} lies in \"{}\", which is no area of the world{}", what, from.area,
                                         did_you_mean(from.area, names)),
                             from.span});
  };
  for (const Parameter& parameter : vary.parameters) check(parameter.from, fmt::format("\"{}\"", parameter.name));
  for (const Event& event : vary.events) {
    for (const Event::Part& part : event.parts) check(part.from, fmt::format("\"{}\"", event.name));
  }
}

// An entry that does not say when it comes may come at any time.
void complete(Vary& vary, Duration duration) {
  for (Event& event : vary.events) {
    if (event.entry.find("at") != nullptr) continue;
    Distribution from;
    from.b = seconds(duration);
    from.unit = "s";
    from.span = event.entry.span;
    event.parts.insert(event.parts.begin(), {{"at"}, std::move(from)});
  }
}

// When an event comes at the earliest; nothing: that is not known.
std::optional<Duration> earliest(const Event& event) {
  const text::YamlNode* const fixed = event.entry.find("at");
  for (const Event::Part& part : event.parts) {
    if (part.path != std::vector<std::string>{"at"}) continue;
    const Distribution& from = part.from;
    const bool is_bounded = from.kind == Distribution::Kind::kUniform || from.kind == Distribution::Kind::kInteger;
    const auto least = is_bounded ? std::optional(from.a) : from.min;
    return least ? project::parse_duration(fmt::format("{} {}", *least, from.unit)) : std::nullopt;
  }
  return fixed != nullptr && fixed->is_scalar() ? project::parse_duration(fixed->scalar) : std::nullopt;
}

void doubt_times(const Vary& vary, const project::Scenario& base, Duration before, Diagnostics& diagnostics) {
  const auto doubt = [&](const std::string& what, const SourceSpan& span) {
    diagnostics.push_back({Severity::kWarning, "campaign.too-late",
                           fmt::format("{} is behind the duration of a run, {} s, and never comes", what,
                                       shortest_decimal(seconds(base.duration))),
                           span});
  };
  for (const Event& event : vary.events) {
    if (const auto at = earliest(event); at && *at > base.duration)
      doubt(fmt::format("\"{}\"", event.name), event.entry.span);
  }
  for (const project::Injection& injection : base.timeline) {
    const Duration at = injection.at.time_since_epoch();
    if (at > base.duration && at <= before) doubt("this", injection.span);
  }
}

// What explains a violation is asked of a run of it alone.
void forgo_witnesses(project::Plan& plan) {
  for (monitor::Model& model : plan.monitors) model = monitor::without_witnesses(model);
}

// Every event at once and each alternative once: what is wrong there is wrong in each run that draws it.
constexpr std::size_t kProbesMax = 20;

bool is_of_world(const Parameter& parameter) { return parameter.name.starts_with("world."); }

enum class Probed : std::uint8_t { kAll, kButTheWorld };

std::size_t probes_of(const Vary& vary, Probed which) {
  std::size_t most = 1;
  for (const Parameter& parameter : vary.parameters) {
    if (which == Probed::kAll || !is_of_world(parameter)) most = std::max(most, parameter.from.alternatives.size());
  }
  for (const Event& event : vary.events) {
    for (const Event::Part& part : event.parts) most = std::max(most, part.from.alternatives.size());
  }
  return std::min(most, kProbesMax);
}

Vary probe(const Vary& vary, std::size_t number) {
  const auto fix = [&](Distribution& from) {
    if (from.alternatives.empty()) return;
    from.alternatives = {from.alternatives[number % from.alternatives.size()]};
    from.weights = {1.0};
  };
  Vary probed = vary;
  for (Parameter& parameter : probed.parameters) fix(parameter.from);
  for (Event& event : probed.events) {
    event.is_fault = false;
    event.probability = 1.0;
    for (Event::Part& part : event.parts) fix(part.from);
  }
  return probed;
}

// An end of what a number is drawn from.
struct DrawnEnd {
  std::size_t of = 0;  // of all distributions, in the order of the file
  double at = 0;
  double within = 0;  // hardly inside: what is drawn with probability 0 may be wrong
};

template <class Do>
void each_distribution(Vary& vary, const Do& what) {
  std::size_t number = 0;
  for (Parameter& parameter : vary.parameters) what(number++, parameter.from);
  for (Event& event : vary.events) {
    for (Event::Part& part : event.parts) what(number++, part.from);
  }
}

std::vector<DrawnEnd> ends_of(Vary vary) {
  using Drawn = Distribution::Kind;
  constexpr double kHardly = 1e-5;
  constexpr std::size_t kEndsMax = 100;
  std::vector<DrawnEnd> ends;
  each_distribution(vary, [&](std::size_t number, const Distribution& from) {
    if (from.kind == Drawn::kChoice || from.kind == Drawn::kPose) return;
    const bool is_range = from.kind == Drawn::kUniform || from.kind == Drawn::kInteger;
    const std::optional<double> low = is_range ? std::optional(from.a) : from.min;
    const std::optional<double> high = is_range ? std::optional(from.b) : from.max;
    double step = low && high ? *high - *low : std::max(std::abs(from.a), std::abs(from.b));
    step = from.kind == Drawn::kInteger ? 0 : step * kHardly;
    if (low) ends.push_back({number, *low, *low + step});
    if (high) ends.push_back({number, *high, *high - step});
  });
  ends.resize(std::min(ends.size(), kEndsMax));
  return ends;
}

void fix_at(Distribution& from, double value) {
  from.kind = Distribution::Kind::kUniform;
  from.a = from.b = value;
  from.min.reset();
  from.max.reset();
}

Vary at_end(const Vary& vary, std::size_t of, double value) {
  Vary probed = probe(vary, 0);
  each_distribution(probed, [&](std::size_t number, Distribution& from) {
    if (number == of) fix_at(from, value);
  });
  return probed;
}

enum class Ends : std::uint8_t { kFirst, kLast };

// What events draw, all hardly inside their first ends or their last: one knows nothing of the other.
Vary at_ends_of_events(const Vary& vary, const std::vector<DrawnEnd>& ends, Ends which) {
  Vary probed = probe(vary, 0);
  std::map<std::size_t, double> at;
  for (const DrawnEnd& end : ends) {
    if (end.of < vary.parameters.size()) continue;
    if (which == Ends::kLast)
      at[end.of] = end.within;
    else
      at.emplace(end.of, end.within);
  }
  each_distribution(probed, [&](std::size_t number, Distribution& from) {
    if (const auto found = at.find(number); found != at.end()) fix_at(from, found->second);
  });
  return probed;
}

double rounded(double value) { return std::round(value * 1e6) / 1e6; }

std::string first_error(const Diagnostics& diagnostics) {
  for (const Diagnostic& diagnostic : diagnostics) {
    if (diagnostic.severity == Severity::kError) return to_string(diagnostic);
  }
  return "it cannot be run";
}

}  // namespace

Runner::Runner(project::Plan plan, project::Scenario base, Vary vary)
    : vary_(std::move(vary)), base_(std::move(base)), world_(plan.world), plan_(std::move(plan)) {
  for (const Parameter& parameter : vary_.parameters) {
    if (!is_of_world(parameter) && !parameter.name.starts_with("deadlines.")) follows_files_ = true;
  }
  forgo_witnesses(plan_);
  for (const monitor::Model& model : plan_.monitors) requirements_.push_back(model.name());
  drawing_ = std::make_unique<Drawing>(vary_, world_.get(), base_.duration);
}

Loaded<std::unique_ptr<Runner>> Runner::load(const std::filesystem::path& project_path,
                                             const std::optional<std::filesystem::path>& vary) {
  project::PartCache parts;
  return load(project_path, vary, parts);
}

Loaded<std::unique_ptr<Runner>> Runner::load(const std::filesystem::path& project_path,
                                             const std::optional<std::filesystem::path>& vary,
                                             project::PartCache& parts) {
  Loaded<std::unique_ptr<Runner>> loaded;
  const auto append = [&](const Diagnostics& found) {
    loaded.diagnostics.insert(loaded.diagnostics.end(), found.begin(), found.end());
  };
  auto project = project::load_project(project_path);
  append(project.diagnostics);
  if (!project.ok()) return loaded;
  Vary varied;
  if (vary) {
    auto read = load_vary(*vary, *project.value);
    append(read.diagnostics);
    if (!read.ok()) return loaded;
    varied = std::move(*read.value);
  }
  project::Scenario base;
  if (varied.scenario) {
    auto scenario = project::load_scenario(*varied.scenario, &*project.value);
    if (!scenario.ok() && scenario.diagnostics.front().code.starts_with("file.") &&
        scenario.diagnostics.front().span.file == varied.scenario->string()) {
      // It can be mended where it is named.
      Diagnostic& why = scenario.diagnostics.front();
      why.message = fmt::format("the scenario {}: {}", why.span.file, why.message);
      why.span = varied.scenario_span;
    }
    append(scenario.diagnostics);
    if (!scenario.ok()) return loaded;
    base = std::move(*scenario.value);
  } else {
    base = project::plain_scenario(std::move(*project.value));
  }
  if (varied.changes) project::apply_overrides(*varied.changes, base, loaded.diagnostics);
  const Duration before = base.duration;
  base.duration = varied.duration.value_or(before);
  doubt_times(varied, base, before, loaded.diagnostics);
  complete(varied, base.duration);
  project::Scenario scenario = base;
  scenario.virtual_time = true;
  scenario.factor = 1.0;
  auto plan = project::prepare(std::move(scenario), parts);
  append(plan.diagnostics);
  if (!plan.ok()) return loaded;
  check_alone(*plan.value, loaded.diagnostics);
  check_areas(varied, plan.value->world.get(), loaded.diagnostics);
  if (has_errors(loaded.diagnostics)) return loaded;
  std::unique_ptr<Runner> runner(new Runner(std::move(*plan.value), std::move(base), std::move(varied)));
  if (runner->base_.project.world) {
    auto source = project::WorldSource::read(runner->base_.project);
    if (source) runner->source_ = std::move(*source);
  }
  enum class Looked : std::uint8_t { kAll, kWorld };
  const auto wrong_in = [&](const Vary& probed, Looked looked) {
    const Drawing drawing(probed, runner->world_.get(), runner->base_.duration);
    auto drawn = scenario_of(runner->base_, probed, drawing.draw(1));
    Diagnostics found;
    if (!drawn.ok())
      found = std::move(drawn.diagnostics);
    else if (looked == Looked::kWorld)
      found = runner->source_->with(drawn.value->project.world_overrides, runner->world_.get()).diagnostics;
    else
      found = project::prepare(std::move(*drawn.value), parts).diagnostics;
    std::erase_if(found, [&](const Diagnostic& one) {
      // What a draw makes of the world may be refused, and is counted; names may not.
      return one.severity != Severity::kError || one.code.starts_with("sim.bad-place") ||
             std::find(loaded.diagnostics.begin(), loaded.diagnostics.end(), one) != loaded.diagnostics.end();
    });
    return found;
  };
  const std::size_t whole = runner->source_ ? probes_of(runner->vary_, Probed::kButTheWorld) : kProbesMax;
  for (std::size_t i = 0; i < probes_of(runner->vary_, Probed::kAll); ++i)
    append(wrong_in(probe(runner->vary_, i), i < whole ? Looked::kAll : Looked::kWorld));
  if (!has_errors(loaded.diagnostics)) {
    const std::vector<Parameter>& numbers = runner->vary_.parameters;
    const std::vector<DrawnEnd> ends = ends_of(runner->vary_);
    const auto is_fine = [&](Ends which) {
      return wrong_in(at_ends_of_events(runner->vary_, ends, which), Looked::kAll).empty();
    };
    const bool events_are_fine = is_fine(Ends::kFirst) && is_fine(Ends::kLast);
    for (const DrawnEnd& end : ends) {
      if (events_are_fine && end.of >= numbers.size()) continue;
      const bool is_world = runner->source_ && end.of < numbers.size() && is_of_world(numbers[end.of]);
      const auto wrong_at = [&](double value) {
        return wrong_in(at_end(runner->vary_, end.of, value), is_world ? Looked::kWorld : Looked::kAll);
      };
      const Diagnostics found = wrong_at(end.at);
      if (!found.empty() && (end.within == end.at || !wrong_at(end.within).empty())) append(found);
    }
  }
  if (!has_errors(loaded.diagnostics)) loaded.value = std::move(runner);
  return loaded;
}

Runner::Executed Runner::execute(const Draw& draw) { return execute(draw, nullptr); }

Runner::Executed Runner::execute(const Draw& draw, const Coverage* things) {
  Executed out;
  auto scenario = scenario_of(base_, vary_, draw);
  if (!scenario.ok()) {
    out.invalid = first_error(scenario.diagnostics);
    return out;
  }
  if (follows_files_) {
    auto plan = project::prepare(std::move(*scenario.value));
    if (!plan.ok()) {
      out.invalid = first_error(plan.diagnostics);
      return out;
    }
    plan_ = std::move(*plan.value);
    forgo_witnesses(plan_);
  } else {
    const bool same_world =
        scenario.value->project.world_overrides.has_value() == base_.project.world_overrides.has_value() &&
        std::none_of(vary_.parameters.begin(), vary_.parameters.end(), is_of_world);
    plan_.world = world_;
    if (!same_world) {
      auto world = source_->with(scenario.value->project.world_overrides, world_.get());
      if (!world.ok()) {
        out.invalid = first_error(world.diagnostics);
        return out;
      }
      plan_.world = std::make_shared<const sim::World>(std::move(*world.value));
    }
    plan_.scenario = std::move(*scenario.value);
  }
  if (auto done = things == nullptr && !follows_files_ ? execute_quickly() : std::nullopt) {
    out.battery_least = rounded(done->battery_least);
    out.battery_end = rounded(done->battery_end);
    out.report = std::move(done->report);
    return out;
  }
  runtime::RunOptions options;
  runtime::SimHost* sim = nullptr;
  const auto least = [](const sim::State& state) {
    double charge = 1.0;
    for (const sim::RobotState& robot : state.robots) charge = std::min(charge, robot.battery.charge);
    return charge;
  };
  double lowest = 1.0;
  double last = 1.0;
  const auto look = [&] {
    sim->glance([&](const sim::State& state) { last = least(state); });
    lowest = std::min(lowest, last);
  };
  options.on_begin = [&](runtime::RunInside& inside) { sim = inside.sim(); };
  options.listeners_of.emplace_back("mission.tick", [&](const Message&) {
    if (sim != nullptr) look();
  });
  options.on_decision = [&](const runtime::MonitorReport& report) {
    if (report.verdict == monitor::Verdict::kViolated && report.decision)
      out.violated_at.emplace(report.name, rounded(seconds(report.decision->at)));
  };
  options.on_view = [&](runtime::RunView* view) {
    if (view == nullptr && sim != nullptr) look();
  };
  Coverage reached;
  std::optional<CoverageWatch> watch;
  if (things != nullptr) watch.emplace(plan_, reached, options);
  runtime::Run run(plan_, std::move(options));
  out.report = run.execute();
  if (watch) {
    watch->finish(*out.report);
    out.reached = reached.reached_of(*things);
  }
  if (sim != nullptr) {
    out.battery_least = rounded(lowest);
    out.battery_end = rounded(last);
  }
  spoilt_ = spoilt_ || !out.report->given_up.empty();
  return out;
}

std::optional<QuickRuns::Done> Runner::execute_quickly() {
  if (!remembers_) return std::nullopt;
  if (!quick_) quick_ = QuickRuns::of(plan_);
  return *quick_ ? (*quick_)->run(plan_.scenario, *plan_.world) : std::nullopt;
}

Row Runner::row(std::uint64_t run, std::uint64_t seed, const Executed& executed) const {
  Row row;
  row.run = run;
  row.seed = seed;
  row.requirements.resize(requirements_.size());
  if (!executed.report) {
    row.outcome = Outcome::kInvalid;
    row.reason = executed.invalid;
    return row;
  }
  const runtime::RunReport& report = *executed.report;
  row.time_s = rounded(seconds(report.ended));
  row.battery_least = executed.battery_least;
  row.battery_end = executed.battery_end;
  row.reason = report.reason;
  row.outcome = report.mission == bt::Status::kSuccess   ? Outcome::kSuccess
                : report.mission == bt::Status::kFailure ? Outcome::kFailure
                                                         : Outcome::kRunning;
  // A script may fail while a mission is halted that did not fail; what a leaf said on the way is no reason for
  // anything.
  const bool is_problem = std::any_of(report.problems.begin(), report.problems.end(),
                                      [&](const std::string& problem) { return problem.starts_with(row.reason); });
  if (row.outcome != Outcome::kFailure && !is_problem) row.reason.clear();
  if (!report.error.empty() || !report.given_up.empty()) {
    row.outcome = Outcome::kInvalid;
    row.reason = report.given_up.empty() ? report.error : report.given_up.front();
  }
  for (std::size_t i = 0; i < std::min(requirements_.size(), report.monitors.size()); ++i) {
    const runtime::MonitorReport& monitor = report.monitors[i];
    Row::Requirement& requirement = row.requirements[i];
    if (monitor.verdict == monitor::Verdict::kViolated || monitor.violations > 0) {
      requirement.verdict = Verdict::kViolated;
      if (const auto at = executed.violated_at.find(monitor.name); at != executed.violated_at.end())
        requirement.at_s = at->second;
    } else if (monitor.verdict == monitor::Verdict::kSatisfied) {
      requirement.verdict = Verdict::kSatisfied;
    } else {
      requirement.verdict = monitor.vacuity.empty() ? Verdict::kHeld : Verdict::kUntested;
    }
  }
  return row;
}

std::vector<std::string> Runner::factor_names() const {
  std::vector<std::string> names;
  for (const Factor& factor : drawing_->factors()) names.push_back(factor.name);
  return names;
}

Loaded<project::Scenario> load_drawn(const std::filesystem::path& project, const std::filesystem::path& vary,
                                     std::uint64_t seed) {
  Loaded<project::Scenario> out;
  auto runner = Runner::load(project, vary);
  out.diagnostics = std::move(runner.diagnostics);
  if (!runner.ok()) return out;
  const Runner& made = **runner.value;
  auto scenario = scenario_of(made.base(), made.vary(), made.drawing().draw(seed));
  out.diagnostics.insert(out.diagnostics.end(), scenario.diagnostics.begin(), scenario.diagnostics.end());
  out.value = std::move(scenario.value);
  return out;
}

std::uint64_t Runner::identity() const { return hash_combine(plan_.identity, vary_.content); }

}  // namespace sentree::campaign
