#include "sentree/studio/run_beside.h"

#include <mutex>
#include <optional>
#include <thread>

#include "sentree/record/folder.h"
#include "sentree/replay/recording.h"
#include "sentree/studio/live.h"
#include "sentree/studio/shadow.h"

namespace sentree::studio {

struct RunBeside::Impl {
  Impl(project::Plan to_run, Options given) : plan(std::move(to_run)), options(std::move(given)) {}

  void complain(const std::string& what) {
    const std::lock_guard lock(mutex);
    if (problem.empty()) problem = what;
  }

  void execute() {
    const runtime::RunReport report = run->execute();
    const record::RecorderReport written = recorder->finish(report);
    if (written.lost > 0)
      complain("the disk was too slow: " + std::to_string(written.lost) + " messages are not in the recording");
    if (!report.error.empty()) complain(report.error);
    live->ended(report);
    options.on_end();
  }

  const project::Plan plan;
  const Options options;
  std::string file;
  std::unique_ptr<Live> live = Live::beside(plan);
  RunAccess access = live->access();
  mutable std::mutex mutex;
  std::string problem;
  std::optional<replay::RunRecorder> recorder;
  std::optional<runtime::Run> run;
  std::thread thread;
};

RunBeside::RunBeside(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

RunBeside::~RunBeside() { end(); }

void RunBeside::end() {
  if (!impl_->thread.joinable()) return;
  impl_->run->interrupt();
  impl_->thread.join();
}

Result<std::shared_ptr<RunBeside>> RunBeside::begin(project::Plan plan, const std::vector<text::ReadFile>& files,
                                                    Options options) {
  if (auto here = runs_here(plan); !here) return tl::unexpected(here.error());
  record::remove_old(options.folder, {});
  const std::filesystem::path path = record::new_recording(options.folder, plan.scenario.name);
  auto sink = record::FileSink::create(path);
  if (!sink) return tl::unexpected(sink.error());
  auto impl = std::make_unique<Impl>(std::move(plan), std::move(options));
  Impl* const raw = impl.get();
  raw->file = path.filename().string();
  raw->recorder.emplace(raw->plan, files, std::move(*sink),
                        replay::RecordingOptions{.library = raw->options.library,
                                                 .on_failure = [raw](const std::string& what) { raw->complain(what); },
                                                 .story = raw->options.story,
                                                 .tap = raw->live->tap()});
  runtime::RunOptions how;
  if (raw->plan.scenario.virtual_time) how.pace = raw->options.factor;
  raw->live->install(how);
  raw->recorder->install(how);
  raw->run.emplace(raw->plan, std::move(how));
  raw->thread = std::thread([raw] { raw->execute(); });
  return std::shared_ptr<RunBeside>(new RunBeside(std::move(impl)));
}

const std::string& RunBeside::file() const { return impl_->file; }

std::string RunBeside::problem() const {
  const std::lock_guard lock(impl_->mutex);
  return impl_->problem;
}

const RunAccess& RunBeside::access() const { return impl_->access; }

Server::Shown RunBeside::shown(const std::shared_ptr<RunBeside>& run) {
  return {.subject = std::shared_ptr<const Subject>(run, &run->impl_->live->subject()),
          .history = std::shared_ptr<const History>(run, &run->impl_->live->history()),
          .facts = [run] { return run->impl_->access.facts(); },
          .update = [run] { run->impl_->access.update(); },
          .steered = true};
}

}  // namespace sentree::studio
