#include "sentree/studio/detail/run_beside.h"

#include <fmt/format.h>

#include <chrono>
#include <future>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>

#include "sentree/mission/carry.h"
#include "sentree/record/folder.h"
#include "sentree/replay/recording.h"
#include "sentree/runtime/inside.h"
#include "sentree/runtime/journal.h"
#include "sentree/runtime/steering.h"
#include "sentree/studio/detail/shadow.h"
#include "sentree/studio/live.h"

namespace sentree::studio {

namespace {

namespace fs = std::filesystem;

// The run as long as its project is the same.
struct Part {
  explicit Part(project::Plan to_run) : plan(std::move(to_run)) {}

  const project::Plan plan;
  std::string file;
  std::string continues;  // file of the part before; empty: none
  std::unique_ptr<Live> live = Live::beside(plan);
  RunAccess access = live->access();
  std::optional<mission::State> from;  // where it goes on
  std::optional<replay::RunRecorder> recorder;
  std::optional<runtime::Run> run;
};

// A part that is to take the place of the one that runs.
struct Successor {
  std::shared_ptr<Part> part;
  std::vector<text::ReadFile> files;
  std::unique_ptr<record::Sink> sink;
  runtime::Pace pace;
  std::vector<std::string> changes;
  std::promise<Diagnostics> answer;
};

// Who reads only this part's recording, or looks only at this page, learns what was at work.
Message reload_message(const Part& part, const std::vector<std::string>& changes) {
  Map nodes;
  const auto statuses = part.from->tree.tree.statuses();
  for (std::size_t node = 0; node < statuses.size(); ++node) {
    if (statuses[node] != bt::Status::kIdle) nodes.append(std::to_string(node), bt::to_string(statuses[node]));
  }
  List told(changes.begin(), changes.end());
  Message message;
  message.source = "studio";
  message.name = "scenario.injection";
  message.data = Map{{"what", "reload"}, {"changes", std::move(told)}, {"nodes", std::move(nodes)}};
  return message;
}

}  // namespace

struct RunBeside::Impl {
  // What a part of a run in real time has begun is done by then, or its script is far beyond its deadline.
  static constexpr std::chrono::seconds kRest{2};

  explicit Impl(Options given) : options(std::move(given)) {}

  void complain(const std::string& what) {
    const std::lock_guard lock(mutex);
    if (problem.empty()) problem = what;
  }

  std::shared_ptr<Part> current() const {
    const std::lock_guard lock(mutex);
    return part;
  }

  Result<std::unique_ptr<record::Sink>> name_and_open(Part& of) const {
    record::remove_old(options.folder, {}, runtime::waits_to_be_resumed);
    const fs::path path = record::new_recording(options.folder, of.plan.scenario.name);
    of.file = path.filename().string();
    return record::FileSink::create(path);
  }

  void prepare(Part& of, const std::vector<text::ReadFile>& files, std::unique_ptr<record::Sink> sink,
               runtime::RunOptions how, std::vector<std::pair<std::string, std::string>> facts = {}) {
    of.recorder.emplace(of.plan, files, std::move(sink),
                        replay::RecordingOptions{.library = options.library,
                                                 .on_failure = [this](const std::string& what) { complain(what); },
                                                 .story = options.story,
                                                 .tap = of.live->tap(),
                                                 .facts = std::move(facts)});
    of.live->install(how);
    how.on_begin = [this, next = std::move(how.on_begin)](runtime::RunInside& run) {
      next(run);
      const std::lock_guard lock(mutex);
      inside = &run;
    };
    how.on_view = [this, next = std::move(how.on_view)](runtime::RunView* view) {
      next(view);
      const std::lock_guard lock(mutex);
      if (view == nullptr) inside = nullptr;
    };
    of.recorder->install(how);
    of.run.emplace(of.plan, std::move(how));
  }

  // In the director's actor, the scheduler being held.
  void hand_over(runtime::RunInside& run, const std::shared_ptr<Successor>& to) {
    Loaded<mission::Carried> carried;
    if (auto settled = run.settle(kRest); !settled)
      carried.diagnostics.push_back(settled.error());
    else
      carried = mission::carry(current()->plan, run.capture(), to->part->plan);
    if (!carried.ok()) {
      {
        const std::lock_guard lock(mutex);
        asked.reset();
        run.scheduler().go_on();  // before the next one is asked for, which holds it again
      }
      to->answer.set_value(std::move(carried.diagnostics));
      return;
    }
    to->part->from = std::move(carried.value->state);
    to->changes = std::move(carried.value->changes);
    to->pace = run.scheduler().pace();
    {
      const std::lock_guard lock(mutex);
      follows = std::exchange(asked, nullptr);
    }
    run.end();
  }

  void go_on_with(Successor& successor, const std::string& before) {
    Part& next = *successor.part;
    next.continues = before;
    runtime::RunOptions how;
    how.from = &*next.from;
    how.paused = successor.pace.paused;
    how.pace = successor.pace.factor;
    how.on_begin = [&next, changes = successor.changes](runtime::RunInside& run) {
      // Also of a run that stands, which carries out commands only.
      run.scheduler().inject(run.director(), [&run, message = reload_message(next, changes)] { run.publish(message); });
    };
    prepare(next, successor.files, std::move(successor.sink), std::move(how),
            {{"continues", before}, {"continues_at_ns", std::to_string(next.from->now.time_since_epoch().count())}});
    const std::lock_guard lock(mutex);
    part = successor.part;
    if (is_ending) part->run->interrupt();
  }

  void execute() {
    for (;;) {
      const std::shared_ptr<Part> now = current();
      runtime::RunReport report = now->run->execute();
      std::shared_ptr<Successor> successor;
      {
        const std::lock_guard lock(mutex);
        successor = std::exchange(follows, nullptr);
      }
      // It did not end: the next recording has the rest.
      report.interrupted = report.interrupted || successor != nullptr;
      const record::RecorderReport written = now->recorder->finish(report);
      if (written.lost > 0)
        complain(fmt::format("the disk was too slow: {} messages are not in the recording", written.lost));
      if (!report.error.empty()) complain(report.error);
      now->live->ended(report);
      if (!successor) break;
      go_on_with(*successor, now->file);
      successor->answer.set_value({});
    }
    {
      const std::lock_guard lock(mutex);
      is_over = true;
      if (asked) asked->answer.set_value(has_ended());
      asked.reset();
    }
    options.on_end();
  }

  static Diagnostics has_ended() { return {{Severity::kError, "run.ended", "the run has ended", {}}}; }

  const Options options;
  mutable std::mutex mutex;
  std::string problem;
  std::shared_ptr<Part> part;            // that runs, or ran last
  std::shared_ptr<Successor> asked;      // until it is carried over, or refused
  std::shared_ptr<Successor> follows;    // once what runs has ended
  runtime::RunInside* inside = nullptr;  // of what runs
  bool is_ending = false;
  bool is_over = false;
  std::thread thread;
};

RunBeside::RunBeside(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

RunBeside::~RunBeside() { end(); }

void RunBeside::end() {
  if (!impl_->thread.joinable()) return;
  {
    const std::lock_guard lock(impl_->mutex);
    impl_->is_ending = true;
    impl_->part->run->interrupt();
  }
  impl_->thread.join();
}

Result<std::shared_ptr<RunBeside>> RunBeside::begin(project::Plan plan, const std::vector<text::ReadFile>& files,
                                                    Options options) {
  if (auto here = runs_here(plan); !here) return tl::unexpected(here.error());
  auto impl = std::make_unique<Impl>(std::move(options));
  impl->part = std::make_shared<Part>(std::move(plan));
  auto sink = impl->name_and_open(*impl->part);
  if (!sink) return tl::unexpected(sink.error());
  runtime::RunOptions how;
  if (impl->part->plan.scenario.virtual_time) how.pace = impl->options.factor;
  impl->prepare(*impl->part, files, std::move(*sink), std::move(how));
  impl->thread = std::thread([raw = impl.get()] { raw->execute(); });
  return std::shared_ptr<RunBeside>(new RunBeside(std::move(impl)));
}

Loaded<std::vector<std::string>> RunBeside::replace(project::Plan plan, std::vector<text::ReadFile> files) {
  const auto refuse = [](Diagnostics why) { return Loaded<std::vector<std::string>>{std::nullopt, std::move(why)}; };
  const std::shared_ptr<Part> before = impl_->current();
  if (auto here = runs_here(plan); !here) return refuse({here.error()});
  plan.scenario.virtual_time = before->plan.scenario.virtual_time;
  plan.scenario.factor = before->plan.scenario.factor;
  plan.scenario.seed = before->plan.scenario.seed;
  auto successor = std::make_shared<Successor>();
  successor->part = std::make_shared<Part>(std::move(plan));
  successor->files = std::move(files);
  auto sink = impl_->name_and_open(*successor->part);
  if (!sink) return refuse({sink.error()});
  successor->sink = std::move(*sink);
  auto answer = successor->answer.get_future();
  Diagnostics why;
  {
    const std::lock_guard lock(impl_->mutex);
    runtime::RunInside* const run = impl_->inside;
    if (impl_->is_over) {
      why = Impl::has_ended();
    } else if (run == nullptr) {
      why = {{Severity::kError, "run.busy", "the run begins or ends at this moment; try again", {}}};
    } else if (impl_->asked || impl_->follows) {
      why = {{Severity::kError, "run.busy", "the run is being replaced already", {}}};
    } else {
      impl_->asked = successor;
      run->scheduler().hold();
      if (!run->scheduler().inject(run->director(),
                                   [impl = impl_.get(), run, successor] { impl->hand_over(*run, successor); })) {
        impl_->asked.reset();
        run->scheduler().go_on();
        why = {{Severity::kError, "steering.busy", "too many commands wait", {}}};
      }
    }
  }
  if (why.empty()) why = answer.get();
  if (why.empty()) return {std::move(successor->changes), {}};
  successor->sink.reset();
  std::error_code unremoved;
  fs::remove(impl_->options.folder / successor->part->file, unremoved);
  return refuse(std::move(why));
}

std::string RunBeside::file() const { return impl_->current()->file; }

std::string RunBeside::continues() const { return impl_->current()->continues; }

std::string RunBeside::problem() const {
  const std::lock_guard lock(impl_->mutex);
  return impl_->problem;
}

std::shared_ptr<const RunAccess> RunBeside::access() const {
  auto part = impl_->current();
  return {part, &part->access};
}

Server::Shown RunBeside::shown() const {
  const auto part = impl_->current();
  return {.subject = std::shared_ptr<const Subject>(part, &part->live->subject()),
          .history = std::shared_ptr<const History>(part, &part->live->history()),
          .facts = [part] { return part->access.facts(); },
          .update = [part] { part->access.update(); },
          .steered = true};
}

}  // namespace sentree::studio
