#include <fmt/format.h>

#include <pthread.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>

#include "sentree/base/temporary_folder.h"
#include "sentree/cli/commands.h"
#include "sentree/cli/live_view.h"
#include "sentree/cli/output.h"
#include "sentree/cli/page.h"
#include "sentree/cli/progress.h"
#include "sentree/cli/report.h"
#include "sentree/cli/resume.h"
#include "sentree/cli/run_recording.h"
#include "sentree/cli/what_if.h"
#include "sentree/cli/yarp_network.h"
#include "sentree/processes/elsewhere.h"
#include "sentree/project/distribute.h"
#include "sentree/runtime/durable.h"
#include "sentree/studio/foxglove.h"
#include "sentree/studio/groot_run.h"
#include "sentree/studio/live.h"

namespace sentree::cli {

namespace {

// Turns Ctrl-C, SIGTERM and a terminal that goes away into an orderly end. The signals are blocked in all threads and
// awaited in one.
class RunInterrupts {
 public:
  /// Before anything that starts threads, which must not take the signals.
  static void block() {
    const sigset_t awaited = signals();
    pthread_sigmask(SIG_BLOCK, &awaited, nullptr);
  }

  explicit RunInterrupts(runtime::Run& run) : run_(&run) {
    block();
    thread_ = std::thread([this] { wait(); });
  }
  ~RunInterrupts() {
    done_ = true;
    pthread_kill(thread_.native_handle(), SIGUSR1);
    thread_.join();
  }

  /// The run is over: from now on a signal ends the waiting.
  void run_is_over() {
    const std::lock_guard lock(mutex_);
    run_ = nullptr;
  }
  /// Returns at the next signal.
  void wait_for_one() {
    std::unique_lock lock(mutex_);
    asked_.wait(lock, [this] { return asked_to_end_; });
  }

 private:
  static sigset_t signals() {
    sigset_t awaited;
    sigemptyset(&awaited);
    for (const int signal : {SIGINT, SIGTERM, SIGUSR1}) sigaddset(&awaited, signal);
    struct sigaction hangup {};
    sigaction(SIGHUP, nullptr, &hangup);
    if (hangup.sa_handler != SIG_IGN) sigaddset(&awaited, SIGHUP);  // unless nohup started it
    return awaited;
  }

  void wait() {
    const sigset_t awaited = signals();
    // Whoever starts a program may hand on the signal that it got itself too.
    constexpr std::chrono::milliseconds kSame{500};
    std::chrono::steady_clock::time_point last{};
    for (int received = 0;;) {
      int signal = 0;
      sigwait(&awaited, &signal);
      if (done_) return;
      if (signal == SIGUSR1) continue;
      if (signal == SIGHUP && received > 0) continue;  // shell and terminal both say it
      const auto now = std::chrono::steady_clock::now();
      if (received > 0 && now - last < kSame) continue;
      last = now;
      if (++received > 1) _exit(kInterrupted);  // asked twice: at once
      const std::lock_guard lock(mutex_);
      if (run_ != nullptr) run_->interrupt();
      asked_to_end_ = true;
      asked_.notify_one();
    }
  }

  std::mutex mutex_;
  std::condition_variable asked_;
  runtime::Run* run_;  // null: it is over
  bool asked_to_end_ = false;
  std::atomic<bool> done_ = false;
  std::thread thread_;
};

int exit_code(const project::Scenario& scenario, const runtime::RunReport& report) {
  if (!report.given_up.empty()) return kFindings;
  if (!report.error.empty()) return kEnvironment;
  if (report.interrupted) return kInterrupted;
  if (report.any_violated()) return kFindings;
  if (scenario.mission) return report.unmet.empty() ? kOk : kFindings;
  if (report.timed_out) return kTimeLimit;
  return report.mission == bt::Status::kSuccess ? kOk : kFindings;
}

// For who attaches: the page that is there, else one at `at`, as --studio=AT would make it.
Result<runtime::PageAt> open_page(studio::Live& page, RunRecording* recording, const std::string& at, bool insecure) {
  if (!page.is_open()) {
    const auto where = page_options(at.empty() ? "true" : at, insecure);
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

}  // namespace

namespace {

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
      if (!started) return tl::unexpected(started.error());
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

// `again` is set where the page asked for it; `run` then does so.
int run_once(const RunCommand& command, std::optional<RunCommand>& again, Viewers& viewers) {
  std::optional<text::ReadLog> files;
  if (!command.no_record) files.emplace();
  const auto invalid = [&](const Diagnostics& diagnostics) {
    if (command.json) print(to_json(Value(Map{{"ok", false}, {"diagnostics", to_value(diagnostics)}})) + "\n");
    return kInvalidInput;
  };
  std::optional<Resumption> resumption;
  std::vector<std::function<void(const runtime::RunOptions&)>> untold;
  if (command.resume) {
    auto found = Resumption::find(*command.resume);
    if (!found) {
      say(to_string(found.error()));
      return found.error().code == "journal.in-use" ? kEnvironment : kInvalidInput;
    }
    resumption = std::move(*found);
    resumption->allow_plugins = command.allow_plugins;
  }
  const bool replaces = resumption && command.project != RunCommand().project;
  auto loaded = replaces     ? resumption->scenario_of(command.project)
                : resumption ? resumption->scenario(false)
                             : load(command.project, command.scenario);
  say(loaded.diagnostics);
  std::optional<project::Scenario> scenario = std::move(loaded.value);
  if (!scenario) return invalid(loaded.diagnostics);
  if (command.processes && command.virtual_clock.value_or(false)) {
    say("--processes needs the real clock: other processes have no virtual time");
    return kUsage;
  }
  const bool in_processes = command.processes || (resumption && resumption->in_processes());
  if (in_processes) scenario->virtual_time = false;
  if (!resumption && !apply_options(command, *scenario)) return kUsage;
  const auto prepare = [&](project::Scenario what) {
    auto plan = project::prepare(std::move(what));
    return plan.ok() && in_processes ? project::prepare(project::in_processes(*plan.value)) : std::move(plan);
  };
  auto plan = prepare(std::move(*scenario));
  if (replaces && !plan.ok()) {
    say(plan.diagnostics);
    say(fmt::format("the mission cannot go on with {}; nothing was resumed", command.project));
    return invalid(plan.diagnostics);
  }
  if (replaces) {
    say(plan.diagnostics);
    auto before = resumption->plan();
    if (!before.ok()) {
      say(before.diagnostics);
      return invalid(before.diagnostics);
    }
    auto replaced = runtime::replace_plan(*before.value, resumption->journaled, resumption->known, *plan.value);
    if (!replaced.ok()) {
      say(replaced.diagnostics);
      say(fmt::format("the mission cannot go on with {}; nothing was resumed", command.project));
      return invalid(replaced.diagnostics);
    }
    for (const std::string& change : replaced.value->changes) say(change);
    tell_timeline(before.value->scenario, plan.value->scenario, resumption->journaled.reached);
    resumption->journaled = std::move(replaced.value->journaled);
    untold = std::move(replaced.value->untold);
  } else if (resumption && resumption->recorded && (!plan.ok() || !is_plan_of(*plan.value, resumption->journaled))) {
    // What it began with goes on, whatever has become of its files.
    if (files) files.emplace();
    auto recorded = resumption->scenario(true);
    say_each(recorded.diagnostics);
    if (!recorded.value) return invalid(recorded.diagnostics);
    say(fmt::format("the project has changed since the run began; what is in {} goes on",
                    resumption->recording.string()));
    plan = prepare(std::move(*recorded.value));
    plan.diagnostics = resumption->recorded->errors_in(std::move(plan.diagnostics));
  }
  say(plan.diagnostics);
  if (!plan.ok()) return invalid(plan.diagnostics);

  RunInterrupts::block();
  const project::Project& project = plan.value->scenario.project;
  if (!viewers.names && command.yarp_server.empty() && !project.yarp_server.empty() &&
      !plan.value->scenario.virtual_time) {
    auto names = ensure_name_server(project.yarp_server, command.insecure);
    if (!names) {
      names.error().span = project.yarp_server_span;
      say(to_string(names.error()));
      return kEnvironment;
    }
    viewers.names = std::move(*names);
  }
  bool live = command.live && !command.headless && !command.json;
  if (live && !wants_colour()) {
    say("--live needs a terminal with colours; the log follows instead");
    live = false;
  }
  std::unique_ptr<LiveView> view;
  Narrator narrator;
  runtime::RunOptions options;
  options.elsewhere = processes::elsewhere({.listen = command.listen, .insecure = command.insecure});
  if (live) {
    view = std::make_unique<LiveView>(*plan.value);
    options.listeners.push_back([&](const Message& message) { view->observe(message); });
    options.on_decision = [&](const runtime::MonitorReport& report) { view->decided(report); };
    options.on_problem = [&](const std::string& what) { view->note("! " + what); };
    options.on_view = [&](runtime::RunView* run_view) { view->attach(run_view); };
  } else if (!command.json) {
    options.listeners.push_back([&](const Message& message) {
      const std::string text = command.verbose ? line(message) : narrator.tell(message);
      if (!text.empty()) print(text + "\n");
    });
    options.on_decision = [](const runtime::MonitorReport& report) { print(story(report)); };
    options.on_problem = [](const std::string& what) { say("! " + what); };
  }
  Again wanted;
  std::unique_ptr<studio::Live> page;
  std::unique_ptr<RunRecording> recording;
  RecordingTap tap;
  const bool shown = !command.studio.empty();
  if (!shown) {
    // Not now, but `sentree studio --attach` may ask for one.
    page = std::make_unique<studio::Live>(*plan.value);
    page->install(options);
  } else {
    auto where = page_options(command.studio, command.insecure);
    if (!where) return kUsage;
    // With a token, the page could not steer the next run.
    if (!command.insecure)
      where->again = [&](const Value& request) -> Result<void> {
        auto next = command_again(command, *plan.value, request);
        if (!next) return tl::unexpected(next.error());
        const std::lock_guard lock(wanted.mutex);
        if (wanted.command || wanted.at.empty()) return {};
        next->studio = wanted.at;  // where the page looks for it
        wanted.command = std::move(*next);
        // Ends the run in order, or the wait after it.
        ::kill(::getpid(), SIGINT);
        return {};
      };
    auto started = start_page(*where, command.studio == "true",
                              [&](const auto& there) { return studio::Live::start(*plan.value, there); });
    if (!started) {
      say(to_string(started.error()));
      return kEnvironment;
    }
    page = std::move(*started);
    page->install(options);
    // Virtual time, so that the run can be repeated exactly, at a pace that one can follow.
    if (plan.value->scenario.virtual_time) options.pace = command.factor.value_or(1.0);
    options.paused = command.paused;
    tap = page->tap();
    {
      const std::lock_guard lock(wanted.mutex);
      wanted.at = fmt::format("{}:{}", where->address, page->server().port());
    }
    announce(page->server().url(), command.open);
  }
  if (!show_to_groot(command, *plan.value, viewers.groot, options)) return kEnvironment;
  if (const int code = show_in_foxglove(command, *plan.value, viewers.foxglove, options); code != kOk) return code;
  // What one can follow in virtual time has a pace.
  if (command.factor && plan.value->scenario.virtual_time && options.pace <= 0)
    say("! --factor is ignored: in virtual time nothing is waited for, unless it is shown in a page");
  std::optional<project::JournalSync> sync;
  if (!wants_journal(command, plan.value->scenario.project, resumption, sync)) return kUsage;
  if (files) {
    bool ok = true;
    std::vector<std::pair<std::string, std::string>> facts;
    if (sync && !plan.value->scenario.virtual_time) facts.emplace_back("durable", "true");
    if (resumption) {
      facts.emplace_back("continues", resumption->recording.filename().string());
      facts.emplace_back("continues_at_ns", std::to_string(resumption->journaled.reached.time_since_epoch().count()));
    }
    recording = RunRecording::begin(command.record, *plan.value, files->files(), tap, ok, std::move(facts),
                                    viewers.foxglove.get());
    if (!ok) return kEnvironment;
    files.reset();
  }
  if (!recording && (shown || viewers.foxglove))
    recording = RunRecording::unwritten(*plan.value, tap, viewers.foxglove.get());
  if (recording) recording->install(options);
  if (sync) {
    if (!recording || recording->path().empty()) {
      say("a durable run is recorded: leave --no-record out, or say with --record FILE where");
      return kUsage;
    }
    // Whoever finds the journal finds out from the recording what that continues.
    recording->recorder().flush();
    options.durable = runtime::DurableOptions{
        .journal = journal_of(recording->path()),
        .sync = *sync,
        .note = note_of(plan.value->scenario, recording->path(), in_processes, *sync),
        .known = resumption ? resumption->known : 0,
        .settle = [&recording] { recording->recorder().flush(); },
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
    if (resumption) options.resume = &resumption->journaled;
  }
  options.open_page = [&](const std::string& at, bool insecure) {
    auto there = open_page(*page, recording.get(), at, insecure);
    if (there) {
      // From now on somebody else may steer: the terminal says so.
      const std::string what = "somebody attached to this run; the page: " + there->url;
      if (view)
        view->note(what);
      else
        say(what);
    }
    return there;
  };
  for (const auto& tell : untold) tell(options);
  // What was made before a run went on nobody has heard.
  ChoicesMade choices(resumption ? std::vector<std::string>() : command.choose);
  choices.install(options);
  auto progress = std::make_unique<Progress>(*plan.value, options);
  runtime::Run run(*plan.value, std::move(options));
  RunInterrupts interrupts(run);
  runtime::RunReport report = run.execute();
  for (std::string& never : choices.never_made()) report.problems.push_back(std::move(never));
  interrupts.run_is_over();
  progress.reset();
  view.reset();
  if (recording) recording->finish(report);
  run.forget();
  page->ended(report);
  if (command.json) {
    print(to_json(to_value(report)) + "\n");
  } else {
    if (live) {
      for (const auto& monitor : report.monitors) {
        if (monitor.decision) print(story(monitor));
      }
    }
    print(summary(report) + undone(plan.value->scenario, report));
  }
  if (!report.error.empty()) say(report.error);
  if (shown && !command.studio_exit && !report.interrupted && report.error.empty()) {
    say(fmt::format("the run is over; its page stays at {} until Ctrl-C", page->server().url()));
    interrupts.wait_for_one();
  }
  const std::lock_guard lock(wanted.mutex);
  again = std::move(wanted.command);
  return exit_code(plan.value->scenario, report);
}

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
    const int code = run_once(now, next, viewers);
    if (!next) {
      if (viewers.foxglove) viewers.foxglove->end();
      return code;
    }
    say("once more, as the page wants it");
  }
}

}  // namespace sentree::cli
