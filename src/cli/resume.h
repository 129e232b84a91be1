#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "sentree/project/plan.h"
#include "sentree/replay/recorded_run.h"
#include "sentree/runtime/journal.h"

namespace sentree::cli {

/// The journal beside a recording.
[[nodiscard]] std::filesystem::path journal_of(std::filesystem::path recording);
/// What `sentree run --resume` has to know of a run.
/// @param in_processes  Its parts were given processes of their own (`--processes`).
[[nodiscard]] Value note_of(const project::Scenario& scenario, const std::filesystem::path& recording,
                            bool in_processes, project::JournalSync sync);

/// A run that ended without an end, as its journal and its recording say.
struct Resumption {
  std::filesystem::path recording;
  runtime::Journaled journaled;
  std::shared_ptr<replay::RecordedRun> recorded;                        ///< Null: nothing of the recording can be read.
  std::uint64_t known = 0;                                              ///< The last observation in it.
  replay::RecordedCode recorded_code = replay::RecordedCode::kRefused;  ///< Those of the recording.

  /// Of a recording, or the newest of the folder of recordings that can be resumed. Errors: journal.*; run.ended (it
  /// was killed when it had said how it ended: its journal goes).
  [[nodiscard]] static Result<Resumption> find(const std::string& recording);
  /// The scenario from where it was, as it ran.
  [[nodiscard]] Loaded<project::Scenario> scenario() const;
  /// From the recording, if it has changed since.
  [[nodiscard]] Loaded<project::Scenario> recorded_scenario() const;
  /// The scenario of another project, or another scenario, at the pace of this run.
  [[nodiscard]] Loaded<project::Scenario> scenario_of(const std::string& project) const;
  /// See `note_of`.
  [[nodiscard]] bool in_processes() const;
  [[nodiscard]] std::optional<project::JournalSync> sync() const;
  /// The plan with which it ran: from where it was, or from the recording.
  [[nodiscard]] Loaded<project::Plan> plan() const;

 private:
  void set_pace(project::Scenario& scenario) const;
};

}  // namespace sentree::cli
