#include "sentree/cli/run_recording.h"

#include <fmt/format.h>

#include <csignal>
#include <cstdlib>

#include "sentree/cli/output.h"
#include "sentree/cli/report.h"
#include "sentree/record/folder.h"
#include "sentree/runtime/journal.h"

namespace sentree::cli {

std::unique_ptr<RunRecording> RunRecording::begin(const std::string& file, const project::Plan& plan,
                                                  const std::vector<text::ReadFile>& files, RecordingTap tap, bool& ok,
                                                  std::vector<std::pair<std::string, std::string>> facts,
                                                  record::Audience* audience) {
  ok = true;
  std::filesystem::path path = file;
  if (!file.empty() && !may_write(path, record::kMagic, {plan.scenario.file})) {
    ok = false;
    return nullptr;
  }
  if (file.empty()) {
    const char* folder = std::getenv("SENTREE_RUNS");
    if (folder != nullptr && *folder == '\0') return nullptr;
    const std::filesystem::path runs = folder != nullptr ? folder : "runs";
    record::remove_old(runs, {}, runtime::waits_to_be_resumed);
    path = record::new_recording(runs, plan.scenario.name);
  }
  // A limit on the size of files is an error of the write, not the end of the run.
  std::signal(SIGXFSZ, SIG_IGN);
  auto sink = record::FileSink::create(path);
  if (!sink) {
    ok = file.empty();
    say(to_string(sink.error()) + (ok ? "; the run is not recorded (--record FILE puts it elsewhere)" : ""));
    return nullptr;
  }
  auto recording = std::make_unique<RunRecording>();
  recording->path_ = path;
  recording->recorder_ = std::make_unique<replay::RunRecorder>(
      plan, files, std::move(*sink),
      replay::RecordingOptions{.library = "sentree " SENTREE_VERSION,
                               .on_failure = [](const std::string& what) { say("! " + what); },
                               .story = story_without_witness,
                               .tap = std::move(tap),
                               .audience = audience,
                               .facts = std::move(facts)});
  return recording;
}

std::unique_ptr<RunRecording> RunRecording::unwritten(const project::Plan& plan, RecordingTap tap,
                                                      record::Audience* audience) {
  auto recording = std::make_unique<RunRecording>();
  recording->recorder_ =
      std::make_unique<replay::RunRecorder>(plan, std::vector<text::ReadFile>(), std::make_unique<record::NullSink>(),
                                            replay::RecordingOptions{.compression = record::Compression::kNone,
                                                                     .on_failure = {},
                                                                     .story = story_without_witness,
                                                                     .tap = std::move(tap),
                                                                     .audience = audience});
  return recording;
}

tl::unexpected<Diagnostic> RunRecording::not_recorded() {
  return fail("studio.not-recorded",
              "it is not recorded, so nobody knows what was before; start it without --no-record, or with --studio");
}

Result<void> RunRecording::open(studio::Live& page, const studio::ServerOptions& options) {
  if (path_.empty()) return not_recorded();
  return page.open(options, *recorder_, path_.string());
}

bool RunRecording::finish(const runtime::RunReport& report) {
  const record::RecorderReport written = recorder_->finish(report);
  if (path_.empty()) return true;
  if (written.lost > 0) say(fmt::format("! the disk was too slow: {} messages are not in the recording", written.lost));
  say((written.failed ? "recorded in part: " : "recorded: ") + path_.string());
  return !written.failed;
}

}  // namespace sentree::cli
