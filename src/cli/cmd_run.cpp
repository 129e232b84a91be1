#include <fmt/format.h>

#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "sentree/base/temporary_folder.h"
#include "sentree/cli/commands.h"
#include "sentree/cli/live_view.h"
#include "sentree/cli/output.h"
#include "sentree/cli/page.h"
#include "sentree/cli/progress.h"
#include "sentree/cli/report.h"
#include "sentree/cli/resume.h"
#include "sentree/cli/run_interrupts.h"
#include "sentree/cli/run_recording.h"
#include "sentree/cli/what_if.h"
#include "sentree/cli/yarp_network.h"
#include "sentree/processes/elsewhere.h"
#include "sentree/project/cpp_nodes.h"
#include "sentree/project/distribute.h"
#include "sentree/runtime/durable.h"
#include "sentree/studio/foxglove.h"
#include "sentree/studio/groot_run.h"
#include "sentree/studio/live.h"

namespace sentree::cli {

namespace {

int exit_code(const project::Scenario& scenario, const runtime::RunReport& report) {
  if (!report.given_up.empty()) return kFindings;
  if (!report.error.empty()) return kEnvironment;
  if (report.interrupted) return kInterrupted;
  if (report.any_violated()) return kFindings;
  if (scenario.mission) return report.unmet.empty() ? kOk : kFindings;
  if (report.timed_out) return kTimeLimit;
  return report.mission == bt::Status::kSuccess ? kOk : kFindings;
}

// For who attaches: the page that is there, else one as --studio=AT would make it.
Result<runtime::PageAt> open_page(studio::Live& page, RunRecording* recording, const runtime::AskedPage& asked) {
  const std::string& at = asked.at;
  if (!page.is_open()) {
    const auto where = page_options(at.empty() ? "true" : at, asked.insecure);
    if (!where) return fail("studio.bad-address", at + ": neither a port nor an address such as 127.0.0.1:4711");
    if (recording == nullptr) return RunRecording::not_recorded();
    const auto opened = start_page(*where, at.empty(), [&](const auto& there) { return recording->open(page, there); });
    if (!opened) return tl::unexpected(opened.error());
  }
  return runtime::PageAt{page.server().url(), recording != nullptr ? recording->path().string() : ""};
}

bool apply_options(const RunCommand& command, project::Scenario& scenario) {
  if (command.virtual_clock) scenario.virtual_time = *command.virtual_clock;
  if (command.factor) scenario.factor = *command.factor;
  if (scenario.virtual_time) scenario.factor = 1.0;
  if (command.seed) scenario.seed = *command.seed;
  if (const auto chosen = choose(command.choose, scenario); !chosen) {
    say(to_string(chosen.error()));
    return false;
  }
  if (command.duration) {
    const auto duration = project::parse_duration(*command.duration);
    if (!duration) {
      say(fmt::format("--duration {}: not a duration such as 90 s or 5 min", *command.duration));
      return false;
    }
    scenario.duration = *duration;
  }
  return true;
}

// What a page asked for: the run once more.
struct Again {
  std::mutex mutex;
  std::string at;  // where the page is
  std::optional<RunCommand> command;
};

// The same run but for what `request` says. Errors: studio.request.
Result<RunCommand> command_again(const RunCommand& command, const project::Plan& plan, const Value& request) {
  RunCommand next = command;
  if (const Value* seed = request.find("seed")) {
    if (seed->as_int() == nullptr || *seed->as_int() < 0) return fail("studio.request", "a seed is a number from 0 on");
    next.seed = static_cast<std::uint64_t>(*seed->as_int());
  }
  if (const Value* chosen = request.find("choose")) {
    next.choose.clear();
    const List* const list = chosen->as_list();
    if (list == nullptr) return fail("studio.request", "what models choose is a list of \"MODEL#NUMBER=VALUE\"");
    for (const Value& one : *list) next.choose.emplace_back(one.text());
    project::Scenario tried = plan.scenario;
    if (auto can_be = choose(next.choose, tried); !can_be) return fail("studio.request", can_be.error().message);
  }
  if (const Value* scenario = request.find("scenario")) {
    const auto files = project::scenario_files(plan.scenario.project);
    if (std::none_of(files.begin(), files.end(), [&](const auto& file) { return file.stem() == scenario->text(); }))
      return fail("studio.request", fmt::format("the project has no scenario \"{}\"", scenario->text()));
    next.scenario = scenario->text();
  }
  next.open = false;
  next.record.clear();  // what was named is not written over
  return next;
}

// Shows the run to Groot, where somebody wants that: the command, or of what one can follow the project. False: it
// cannot be, and the command asked for it.
bool show_to_groot(const RunCommand& command, const project::Plan& plan, std::unique_ptr<studio::GrootRun>& groot,
                   runtime::RunOptions& options) {
  const project::Project& project = plan.scenario.project;
  const bool is_asked = !command.groot.empty();
  const bool can_be_followed = !plan.scenario.virtual_time || options.pace > 0;
  if (!is_asked && (project.groot.empty() || !can_be_followed)) return true;
  if (!can_be_followed) options.pace = command.factor.value_or(1.0);
  const auto shown = [&]() -> Result<void> {
    if (!groot) {
      auto where = groot::parse_server_address(is_asked ? command.groot : project.groot);
      if (!where) {
        if (!is_asked) where.error().span = project.groot_span;
        return tl::unexpected(where.error());
      }
      where->insecure = command.insecure;
      where->on_problem = [](const std::string& what) { say("! " + what); };
      auto started = studio::GrootRun::start(plan, std::move(*where));
      if (!started) {
        if (!is_asked) started.error().span = project.groot_span;
        return tl::unexpected(started.error());
      }
      groot = std::move(*started);
      say(groot->server().told());
    }
    return groot->install(plan, options);
  }();
  if (shown) return true;
  say(to_string(shown.error()) + (is_asked ? "" : "; the run is not shown to Groot"));
  return !is_asked;
}

// What serves one run after the other, beside its page.
struct Viewers {
  std::unique_ptr<studio::GrootRun> groot;
  std::unique_ptr<studio::Foxglove> foxglove;
  std::unique_ptr<yarp::NameServer> names;  // of YARP, because the project wants one
};

// Shows the next run in Foxglove, where somebody wants that: as `show_to_groot`. Otherwise than kOk: it cannot be, and
// the command asked for it.
int show_in_foxglove(const RunCommand& command, const project::Plan& plan, std::unique_ptr<studio::Foxglove>& foxglove,
                     runtime::RunOptions& options) {
  const project::Project& project = plan.scenario.project;
  const bool is_asked = !command.foxglove.empty();
  const bool can_be_followed = !plan.scenario.virtual_time || options.pace > 0;
  if (!is_asked && (project.foxglove.empty() || !can_be_followed)) return kOk;
  if (!foxglove) {
    const auto at = listen_at("--foxglove", is_asked ? command.foxglove : project.foxglove, studio::kFoxglovePort);
    if (!at) return kUsage;
    auto started = studio::Foxglove::start(
        {.address = at->address, .port = at->port, .insecure = command.insecure, .version = SENTREE_VERSION});
    if (!started) {
      if (!is_asked) started.error().span = project.foxglove_span;
      say(to_string(started.error()) + (is_asked ? "" : "; the run is not shown in Foxglove"));
      return is_asked ? kEnvironment : kOk;
    }
    foxglove = std::move(*started);
    say(foxglove->told());
  }
  foxglove->begin(plan.scenario.name);
  if (!can_be_followed) options.pace = command.factor.value_or(1.0);
  return kOk;
}

bool is_plan_of(const project::Plan& plan, const runtime::Journaled& journaled) {
  const auto state = mission::restore(plan, journaled.state);
  return state.has_value() || state.error().code != "mission.other-plan";
}

// When the journal of the run reaches the disk; nothing: the run keeps none. False: that was not understood.
bool wants_journal(const RunCommand& command, const project::Project& project,
                   const std::optional<Resumption>& resumption, std::optional<project::JournalSync>& sync) {
  if (!command.durable.empty() && command.durable != "true") {
    sync = project::parse_journal_sync(command.durable);
    if (!sync) say(fmt::format("--durable={}: it is one of never, interval and each", command.durable));
    return sync.has_value();
  }
  sync = resumption ? resumption->sync() : project.durable;
  if (!sync && (!command.durable.empty() || command.resume)) sync = project::JournalSync::kInterval;
  return true;
}

// What was still to come of the scenario that the run had, and does not come in the one that it goes on with.
void tell_timeline(const project::Scenario& before, const project::Scenario& after, TimePoint reached) {
  const auto to_come = [&](const project::Scenario& scenario) {
    return std::count_if(scenario.timeline.begin(), scenario.timeline.end(),
                         [&](const project::Injection& injection) { return injection.at > reached; });
  };
  if (to_come(before) == 0 || to_come(after) > 0) return;
  say("what was still to come of the timeline of " + before.name + " does not come, since " + after.name +
      " has none (--project takes a scenario file as well)");
}

// The threads of plug-ins are waited for when their nodes go, and who works there may not listen.
void end_in_time(const std::string& nodes, int code) {
  if (nodes.empty()) return;
  std::thread([nodes, code] {
    constexpr std::chrono::seconds kPatience{2};
    std::this_thread::sleep_for(kPatience);
    say(fmt::format(
        "a thread of a node in C++ ({}) works on {} s after the run; the program ends without it. Work in a "
        "thread comes to an end when job.stop_requested() says so",
        nodes, kPatience.count()));
    std::fflush(nullptr);
    _exit(code);
  }).detach();
}

// A run from the files to what came of it. Its steps return kOk, or the exit code of a command that ends with them once
// they have said why.
class OneRun {
 public:
  OneRun(const RunCommand& command, Viewers& viewers) : command_(command), viewers_(viewers) {
    if (!command.no_record) files_.emplace();
  }

  int operator()() {
    for (const auto step :
         {&OneRun::find_resumption, &OneRun::load_scenario, &OneRun::prepare_plan, &OneRun::find_names,
          &OneRun::narrate, &OneRun::open_studio, &OneRun::show_elsewhere, &OneRun::record, &OneRun::keep_journal}) {
      if (const int code = (this->*step)(); code != kOk) return code;
    }
    return execute();
  }
  [[nodiscard]] std::string cpp_nodes() const { return plan_.ok() ? project::shown_cpp_nodes(*plan_.value) : ""; }
  // The run that the page asked for in its place.
  std::optional<RunCommand> again() {
    const std::lock_guard lock(wanted_.mutex);
    return std::move(wanted_.command);
  }

 private:
  [[nodiscard]] int invalid(const Diagnostics& diagnostics) const {
    if (command_.json) print(to_json(Value(Map{{"ok", false}, {"diagnostics", to_value(diagnostics)}})) + "\n");
    return kInvalidInput;
  }
  [[nodiscard]] const project::Project& project() const { return plan_.value->scenario.project; }
  [[nodiscard]] bool is_virtual() const { return plan_.value->scenario.virtual_time; }
  [[nodiscard]] bool is_shown() const { return !command_.studio.empty(); }

  int find_resumption() {
    if (!command_.resume) return kOk;
    auto found = Resumption::find(*command_.resume);
    if (!found) {
      say(to_string(found.error()));
      return found.error().code == "journal.in-use" ? kEnvironment : kInvalidInput;
    }
    resumption_ = std::move(*found);
    resumption_->recorded_code = command_.recorded_code;
    replaces_ = command_.project != RunCommand().project;
    return kOk;
  }

  int load_scenario() {
    auto loaded = replaces_     ? resumption_->scenario_of(command_.project)
                  : resumption_ ? resumption_->scenario()
                                : load(command_.project, command_.scenario);
    say(loaded.diagnostics, command_.project);
    if (!loaded.value) return invalid(loaded.diagnostics);
    if (command_.processes && command_.virtual_clock.value_or(false)) {
      say("--processes needs the real clock: other processes have no virtual time");
      return kUsage;
    }
    in_processes_ = command_.processes || (resumption_ && resumption_->in_processes());
    if (in_processes_) loaded.value->virtual_time = false;
    if (!resumption_ && !apply_options(command_, *loaded.value)) return kUsage;
    prepare(std::move(*loaded.value));
    return kOk;
  }

  void prepare(project::Scenario scenario) {
    plan_ = project::prepare(std::move(scenario));
    if (plan_.ok() && in_processes_) plan_ = project::prepare(project::in_processes(*plan_.value));
  }

  int prepare_plan() {
    if (replaces_) {
      say(plan_.diagnostics, command_.project);
      if (const int code = replace(); code != kOk) return code;
    } else if (resumption_ && resumption_->recorded &&
               (!plan_.ok() || !is_plan_of(*plan_.value, resumption_->journaled))) {
      if (const int code = go_on_as_recorded(); code != kOk) return code;
    }
    say(plan_.diagnostics, command_.project);
    if (!plan_.ok()) return invalid(plan_.diagnostics);
    RunInterrupts::block();
    return kOk;
  }

  // The run that was resumed goes on with another project.
  int replace() {
    const auto cannot = [this](const Diagnostics& why) {
      say(fmt::format("the mission cannot go on with {}; nothing was resumed", command_.project));
      return invalid(why);
    };
    if (!plan_.ok()) return cannot(plan_.diagnostics);
    auto before = resumption_->plan();
    if (!before.ok()) {
      say(before.diagnostics);
      return invalid(before.diagnostics);
    }
    auto replaced = runtime::replace_plan(*before.value, resumption_->journaled, resumption_->known, *plan_.value);
    if (!replaced.ok()) {
      say(replaced.diagnostics);
      return cannot(replaced.diagnostics);
    }
    for (const std::string& change : replaced.value->changes) say(change);
    tell_timeline(before.value->scenario, plan_.value->scenario, resumption_->journaled.reached);
    resumption_->journaled = std::move(replaced.value->journaled);
    untold_ = std::move(replaced.value->untold);
    return kOk;
  }

  // What it began with goes on, whatever has become of its files.
  int go_on_as_recorded() {
    if (files_) files_.emplace();
    auto recorded = resumption_->recorded_scenario();
    say_each(recorded.diagnostics);
    if (!recorded.value) return invalid(recorded.diagnostics);
    say(fmt::format("the project has changed since the run began; what is in {} goes on",
                    resumption_->recording.string()));
    prepare(std::move(*recorded.value));
    plan_.diagnostics = resumption_->recorded->errors_in(std::move(plan_.diagnostics));
    return kOk;
  }

  int find_names() {
    if (viewers_.names || !command_.yarp_server.empty() || project().yarp_server.empty() || is_virtual()) return kOk;
    auto names = ensure_name_server(project().yarp_server, command_.insecure);
    if (!names) {
      names.error().span = project().yarp_server_span;
      say(to_string(names.error()));
      return kEnvironment;
    }
    viewers_.names = std::move(*names);
    return kOk;
  }

  int narrate() {
    if (const std::string places = project::shown_places(*plan_.value); !command_.json && !places.empty())
      say(places);
    else if (in_processes_ && places.empty())
      say("--processes: all parts run in this process; a mission without skills has nothing else, and models of "
          "components serve only skills that run beside them");
    options_.elsewhere = processes::elsewhere({.listen = command_.listen, .insecure = command_.insecure});
    bool live = command_.live && !command_.headless && !command_.json;
    if (live && !wants_colour()) {
      say("--live needs a terminal with colours; the log follows instead");
      live = false;
    }
    if (live) {
      view_ = std::make_unique<LiveView>(*plan_.value);
      options_.listeners.push_back([this](const Message& message) { view_->observe(message); });
      options_.on_decision = [this](const runtime::MonitorReport& report) { view_->decided(report); };
      options_.on_problem = [this](const std::string& what) { view_->note("! " + what); };
      options_.on_view = [this](runtime::RunView* run_view) { view_->attach(run_view); };
    } else if (!command_.json) {
      options_.listeners.push_back([this](const Message& message) {
        const std::string text = command_.verbose ? line(message) : narrator_.tell(message);
        if (!text.empty()) print(text + "\n");
      });
      options_.on_decision = [](const runtime::MonitorReport& report) { print(story(report)); };
      options_.on_problem = [](const std::string& what) { say("! " + what); };
    }
    return kOk;
  }

  int open_studio() {
    if (!is_shown()) {
      // Not now, but `sentree studio --attach` may ask for one.
      page_ = std::make_unique<studio::Live>(*plan_.value);
      page_->install(options_);
      return kOk;
    }
    auto where = page_options(command_.studio, command_.insecure);
    if (!where) return kUsage;
    // With a token, the page could not steer the next run.
    if (!command_.insecure) where->again = [this](const Value& request) { return ask_again(request); };
    auto started = start_page(*where, command_.studio == "true",
                              [&](const auto& there) { return studio::Live::start(*plan_.value, there); });
    if (!started) {
      say(to_string(started.error()));
      return kEnvironment;
    }
    page_ = std::move(*started);
    page_->install(options_);
    // Virtual time, so that the run can be repeated exactly, at a pace that one can follow.
    if (is_virtual()) options_.pace = command_.factor.value_or(1.0);
    options_.paused = command_.paused;
    tap_ = page_->tap();
    {
      const std::lock_guard lock(wanted_.mutex);
      wanted_.at = fmt::format("{}:{}", where->address, page_->server().port());
    }
    announce(page_->server().url(), command_.open);
    return kOk;
  }

  // In a thread of the page.
  Result<void> ask_again(const Value& request) {
    auto next = command_again(command_, *plan_.value, request);
    if (!next) return tl::unexpected(next.error());
    const std::lock_guard lock(wanted_.mutex);
    if (wanted_.command || wanted_.at.empty()) return {};
    next->studio = wanted_.at;  // where the page looks for it
    wanted_.command = std::move(*next);
    // Ends the run in order, or the wait after it.
    ::kill(::getpid(), SIGINT);
    return {};
  }

  int show_elsewhere() {
    if (!show_to_groot(command_, *plan_.value, viewers_.groot, options_)) return kEnvironment;
    if (const int code = show_in_foxglove(command_, *plan_.value, viewers_.foxglove, options_); code != kOk)
      return code;
    // What one can follow in virtual time has a pace.
    if (command_.factor && is_virtual() && options_.pace <= 0)
      say("! --factor is ignored: in virtual time nothing is waited for, unless it is shown in a page");
    return kOk;
  }

  int record() {
    if (!wants_journal(command_, project(), resumption_, sync_)) return kUsage;
    if (files_) {
      bool ok = true;
      std::vector<std::pair<std::string, std::string>> facts;
      if (sync_ && !is_virtual()) facts.emplace_back("durable", "true");
      if (resumption_) {
        facts.emplace_back("continues", resumption_->recording.filename().string());
        facts.emplace_back("continues_at_ns",
                           std::to_string(resumption_->journaled.reached.time_since_epoch().count()));
      }
      recording_ = RunRecording::begin(command_.record, *plan_.value, files_->files(), tap_, ok, std::move(facts),
                                       viewers_.foxglove.get());
      if (!ok) return kEnvironment;
      files_.reset();
    }
    if (!recording_ && (is_shown() || viewers_.foxglove))
      recording_ = RunRecording::unwritten(*plan_.value, tap_, viewers_.foxglove.get());
    if (recording_) recording_->install(options_);
    return kOk;
  }

  int keep_journal() {
    if (!sync_) return kOk;
    if (!recording_ || recording_->path().empty()) {
      say("a durable run is recorded: leave --no-record out, or say with --record FILE where");
      return kUsage;
    }
    // Whoever finds the journal finds out from the recording what that continues.
    recording_->recorder().flush();
    options_.durable = runtime::DurableOptions{
        .journal = journal_of(recording_->path()),
        .sync = *sync_,
        .note = note_of(plan_.value->scenario, recording_->path(), in_processes_, *sync_),
        .known = resumption_ ? resumption_->known : 0,
        .settle = [this] { recording_->recorder().flush(); },
        .on_failure =
            [](const std::string& why) {
              say(fmt::format("! the journal cannot be written: {}; the run goes on, and cannot be resumed any more",
                              why));
            },
        .on_slow =
            [](const std::string& why) {
              say(
                  fmt::format("! the run does not keep up with its journal: {}; ticks are left out, and what answers "
                              "waits. --durable=interval waits for no disk",
                              why));
            }};
    if (resumption_) options_.resume = &resumption_->journaled;
    return kOk;
  }

  // For who attaches: from then on somebody else may steer, and the terminal says so.
  Result<runtime::PageAt> open_for(const runtime::AskedPage& asked) {
    auto there = open_page(*page_, recording_.get(), asked);
    if (there) {
      const std::string what = "somebody attached to this run; the page: " + there->url;
      if (view_)
        view_->note(what);
      else
        say(what);
    }
    return there;
  }

  int execute() {
    options_.open_page = [this](const runtime::AskedPage& asked) { return open_for(asked); };
    for (const auto& tell : untold_) tell(options_);
    // What was made before a run went on nobody has heard.
    ChoicesMade choices(resumption_ ? std::vector<std::string>() : command_.choose);
    choices.install(options_);
    auto progress = std::make_unique<Progress>(*plan_.value, options_);
    runtime::Run run(*plan_.value, std::move(options_));
    RunInterrupts interrupts(run);
    runtime::RunReport report = run.execute();
    for (std::string& never : choices.never_made()) report.problems.push_back(std::move(never));
    interrupts.run_is_over();
    progress.reset();
    const bool was_live = std::exchange(view_, nullptr) != nullptr;
    const bool is_recorded = !recording_ || recording_->finish(report);
    run.forget();
    page_->ended(report);
    const int code = exit_code(plan_.value->scenario, report);
    if (command_.json) {
      print(to_json(to_value(report, code == kOk ? Judged::kPassed : Judged::kFailed)) + "\n");
    } else {
      for (const auto& monitor : report.monitors) {
        if (was_live && monitor.decision) print(story(monitor));
      }
      print(summary(report) + undone(plan_.value->scenario, report));
    }
    if (!report.error.empty()) say(report.error);
    if (is_shown() && !command_.studio_exit && !report.interrupted && report.error.empty()) {
      say(fmt::format("the run is over; its page stays at {} until Ctrl-C", page_->server().url()));
      interrupts.wait_for_one();
    }
    // Who has asked for none is not told by it that the mission went wrong.
    return code == kOk && !is_recorded && !command_.record.empty() ? kEnvironment : code;
  }

  const RunCommand& command_;
  Viewers& viewers_;
  std::optional<text::ReadLog> files_;
  std::optional<Resumption> resumption_;
  bool replaces_ = false;  // the run that was resumed goes on with another project
  bool in_processes_ = false;
  std::vector<std::function<void(const runtime::RunOptions&)>> untold_;
  Loaded<project::Plan> plan_;
  std::unique_ptr<LiveView> view_;
  Narrator narrator_;
  runtime::RunOptions options_;
  Again wanted_;
  std::unique_ptr<studio::Live> page_;
  std::unique_ptr<RunRecording> recording_;
  RecordingTap tap_;
  std::optional<project::JournalSync> sync_;
};

}  // namespace

int run(const RunCommand& command) {
  // Of runs in real time that were killed: whoever only runs in virtual time makes none.
  clean_temporary_folders();
  std::optional<RunCommand> next = command;
  Viewers viewers;
  std::unique_ptr<yarp::NameServer> names;
  if (!command.yarp_server.empty()) {
    // Before its threads begin, so that they inherit it.
    RunInterrupts::block();
    auto started = start_name_server(command.yarp_server, command.insecure);
    if (!started) {
      say(to_string(started.error()));
      return kEnvironment;
    }
    names = std::move(*started);
  }
  for (;;) {
    const RunCommand now = *std::exchange(next, std::nullopt);
    OneRun one(now, viewers);
    const int code = one();
    next = one.again();
    if (!next) {
      if (viewers.foxglove) viewers.foxglove->end();
      end_in_time(one.cpp_nodes(), code);
      return code;
    }
    say("once more, as the page wants it");
  }
}

}  // namespace sentree::cli
