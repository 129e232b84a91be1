#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "sentree/runtime/recording.h"

namespace sentree::cli {

/// The recording that `sentree run` makes beside its run, and what it says about it.
class RunRecording {
 public:
  /// Begins one in `file`, or where none is given in the folder of recordings: $SENTREE_RUNS, by default runs/ (an
  /// empty $SENTREE_RUNS means no recording). The oldest recordings of that folder make room. Nothing comes back if
  /// there is to be none, or if it cannot be written; only with a `file` is that a failure, and `ok` false.
  static std::unique_ptr<RunRecording> begin(const std::string& file, const runtime::Plan& plan,
                                             const std::vector<text::ReadFile>& files, bool& ok);

  void install(runtime::RunOptions& options) { recorder_->install(options); }
  /// Ends it and says where it is, and whether something is missing.
  void finish(const runtime::RunReport& report);

 private:
  std::filesystem::path path_;
  std::unique_ptr<runtime::RunRecorder> recorder_;
};

}  // namespace sentree::cli
