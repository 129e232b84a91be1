#include <fmt/format.h>

#include <signal.h>

#include <chrono>
#include <thread>

#include "sentree/cli/commands.h"
#include "sentree/cli/output.h"
#include "sentree/cli/page.h"
#include "sentree/cli/report.h"
#include "sentree/cli/run_recording.h"
#include "sentree/studio/live.h"
#include "sentree/studio/watch.h"

namespace sentree::cli {

namespace {

using SteadyClock = std::chrono::steady_clock;

// One tree of the program. Nothing: there is another one now.
std::optional<int> watch_once(const WatchCommand& command, const sigset_t& signals, SteadyClock::time_point until) {
  auto watch = studio::Watch::start(command.address);
  if (!watch) {
    say(to_string(watch.error()));
    return watch.error().code.starts_with("groot.") ? kEnvironment : kInvalidInput;
  }
  const project::Plan& plan = (*watch)->plan();
  say(fmt::format("watching the tree {}, {} nodes, of {}", plan.tree.id(), plan.tree.size(), command.address));
  std::unique_ptr<studio::Live> page;
  RecordingTap tap;
  if (!command.studio.empty()) {
    const auto where = page_options(command.studio, command.insecure);
    if (!where) return kUsage;
    auto started = start_page(*where, command.studio == "true",
                              [&](const auto& there) { return studio::Live::start(plan, there); });
    if (!started) {
      say(to_string(started.error()));
      return kEnvironment;
    }
    page = std::move(*started);
    tap = page->tap();
    announce(page->server().url(), command.open);
  }
  std::unique_ptr<RunRecording> recording;
  if (!command.no_record) {
    bool ok = true;
    recording = RunRecording::begin(command.record, plan, (*watch)->files(), tap, ok);
    if (!ok) return kEnvironment;
  }
  if (!recording && page) recording = RunRecording::unwritten(plan, tap);

  Narrator narrator(&plan.tree);
  studio::WatchListeners listeners;
  listeners.observations.emplace_back([&](const Message& message) {
    const std::string text = command.verbose ? line(message) : narrator.tell(message);
    if (!text.empty()) print(text + "\n");
  });
  listeners.problem = [](const std::string& what) { say("! " + what); };
  if (recording) {
    // What a run would call is called here.
    runtime::RunOptions options;
    recording->install(options);
    for (auto& listener : options.listeners) listeners.observations.push_back(std::move(listener));
    listeners.blackboard = [&](TimePoint time, const Value& entries) {
      recording->recorder().blackboard(time, entries);
    };
  }
  if (page) page->steer_by(&(*watch)->steering());
  runtime::RunReport report;
  std::atomic<bool> over = false;
  std::thread follower([&] {
    report = (*watch)->follow(listeners);
    over = true;
  });
  bool is_asked_to_end = false;
  bool is_interrupted = false;
  while (!over) {
    const timespec turn{.tv_sec = 0, .tv_nsec = 50'000'000};
    is_interrupted = sigtimedwait(&signals, nullptr, &turn) > 0 || is_interrupted;
    const bool ends = is_interrupted || SteadyClock::now() >= until;
    if (ends && !is_asked_to_end) (*watch)->stop();
    is_asked_to_end = is_asked_to_end || ends;
  }
  follower.join();
  if (is_asked_to_end && !is_interrupted) {
    report.interrupted = false;
    report.timed_out = true;  // --duration
  }
  if (page) page->steer_by(nullptr);
  if (recording) recording->finish(report);
  if (page) page->ended(report);
  print(summary(report));
  if ((*watch)->other_tree() && !is_asked_to_end) return std::nullopt;
  return kOk;
}

}  // namespace

int watch(const WatchCommand& command) {
  sigset_t signals;
  sigemptyset(&signals);
  for (const int signal : {SIGINT, SIGTERM}) sigaddset(&signals, signal);
  struct sigaction hangup {};
  sigaction(SIGHUP, nullptr, &hangup);
  if (hangup.sa_handler != SIG_IGN) sigaddset(&signals, SIGHUP);  // unless nohup started it
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  auto until = SteadyClock::time_point::max();
  if (!command.duration.empty()) {
    const auto duration = project::parse_duration(command.duration);
    if (!duration) {
      say(fmt::format("--duration {}: not a duration such as 90 s or 5 min", command.duration));
      return kUsage;
    }
    until = SteadyClock::now() + *duration;
  }
  WatchCommand next = command;
  for (;;) {
    if (const auto code = watch_once(next, signals, until)) return *code;
    say("the program executes another tree; once more");
    next.open = false;
    next.record.clear();  // what was named is not written over
  }
}

}  // namespace sentree::cli
