#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "sentree/replay/recording.h"
#include "sentree/studio/live.h"

namespace sentree::cli {

using RecordingTap = decltype(replay::RecordingOptions::tap);

/// The recording that `sentree run` makes beside its run, and what it says about it.
class RunRecording {
 public:
  /// Begins one in `file`, or where none is given in the folder of recordings: $SENTREE_RUNS, by default runs/ (an
  /// empty $SENTREE_RUNS means no recording). The oldest recordings of that folder make room. Nothing comes back if
  /// there is to be none, or if it cannot be written; only with a `file` is that a failure, and `ok` false.
  /// @param tap  Sees what is recorded; may be empty.
  /// @param audience  Is given it too; may be null.
  /// @param facts  Kept in it beside those of the plan.
  static std::unique_ptr<RunRecording> begin(const std::string& file, const project::Plan& plan,
                                             const std::vector<text::ReadFile>& files, RecordingTap tap, bool& ok,
                                             std::vector<std::pair<std::string, std::string>> facts = {},
                                             record::Audience* audience = nullptr);
  /// Writes nothing, for those alone who follow it.
  static std::unique_ptr<RunRecording> unwritten(const project::Plan& plan, RecordingTap tap,
                                                 record::Audience* audience = nullptr);

  void install(runtime::RunOptions& options) { recorder_->install(options); }
  [[nodiscard]] replay::RunRecorder& recorder() { return *recorder_; }
  /// Opens the page of the run that is recorded. Errors: see `studio::Live::open`, studio.not-recorded.
  [[nodiscard]] Result<void> open(studio::Live& page, const studio::ServerOptions& options);
  /// The error of a run of which there is no recording.
  [[nodiscard]] static tl::unexpected<Diagnostic> not_recorded();
  /// The file; empty: none.
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }
  /// Ends it and says where it is, if it is anywhere, and whether something is missing.
  /// Whether it was recorded as a whole, if it was to be.
  bool finish(const runtime::RunReport& report);

 private:
  std::filesystem::path path_;  // empty: nothing is written
  std::unique_ptr<replay::RunRecorder> recorder_;
};

}  // namespace sentree::cli
