#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "sentree/base/message.h"
#include "sentree/base/result.h"
#include "sentree/project/plan.h"
#include "sentree/record/reader.h"
#include "sentree/replay/recorded_code.h"

namespace sentree::replay {

/// A recording of a run, opened: its facts, its observations, and the project that it ran.
class RecordedRun {
 public:
  /// Errors: record.*, file.*; record.not-a-run (an MCAP file without observations of ours).
  [[nodiscard]] static Result<RecordedRun> open(const std::string& path);
  RecordedRun(RecordedRun&&) noexcept;
  RecordedRun& operator=(RecordedRun&&) noexcept;
  ~RecordedRun();

  [[nodiscard]] record::Reader& reader() { return *reader_; }
  [[nodiscard]] const std::string& path() const { return path_; }
  /// A fact of the run ("scenario", "clock", "seed", …) or of its result ("mission", "ended_ns", …); empty: not known.
  [[nodiscard]] std::string fact(std::string_view name) const;
  /// Of a run that was resumed, once or more often: the recording in which it began, beside this one, or the first on
  /// the way there that cannot be read. Empty: it was not resumed.
  [[nodiscard]] std::string begun_in() const;
  [[nodiscard]] bool is_virtual() const { return fact("clock") == "virtual"; }
  /// Run time of its end; of a recording that was cut off, of its last message.
  [[nodiscard]] TimePoint ended() const;
  /// Until when its monitors have judged: see `mission::judged_until`.
  [[nodiscard]] TimePoint judged_until() const;

  /// All observations in order, until `take` returns false. Errors: record.*, json.*.
  [[nodiscard]] Result<void> each(const std::function<bool(Message)>& take, TimePoint from = TimePoint{},
                                  TimePoint to = kNever);
  [[nodiscard]] Result<std::vector<Message>> observations(TimePoint to = kNever);

  /// The last snapshot that was taken at `time` or before it, with its time; nothing if there is none.
  struct Snapshot {
    TimePoint time{};
    std::uint64_t sequence = 0;  ///< Of the last observation before it.
    Value value;
    /// Of a run in virtual time: all of it, for `mission::restore`; empty: the snapshot has parts only.
    std::string state;
  };
  [[nodiscard]] Result<std::optional<Snapshot>> snapshot(TimePoint time);
  /// The observations "scenario.injection" from then on. Recordings that keep them apart have a fact "plan".
  [[nodiscard]] Result<std::vector<Message>> interventions(TimePoint from);

  /// Writes the recorded project below a private folder, which goes when this goes, and returns the scenario or project
  /// file there. Names that would lead out of it are refused. Errors: record.no-project, record.bad-name, file.*.
  [[nodiscard]] Result<std::filesystem::path> extract();
  /// The recorded scenario as it ran: with its seed, clock and limits. Nobody vouches for the code of a recording: one
  /// whose project names plug-ins is refused, or given with a note for each; both tell the hash.
  /// Codes: those of `extract` and of `load_scenario`; record.plugin.
  [[nodiscard]] Loaded<project::Scenario> scenario(RecordedCode code = RecordedCode::kRefused);
  /// A text that names files of the recorded project, with places as "RUN.mcap/skills/A.scxml:8:3": its private folder
  /// is gone when one reads that.
  [[nodiscard]] std::string named(std::string text) const;
  /// What is wrong with the recorded project, likewise. Its warnings were told when it was recorded.
  [[nodiscard]] Diagnostics errors_in(Diagnostics found) const;
  /// The scenario that lies in another project where the recorded one lay in its own (scenarios/, verify/ …); where
  /// there is none, the recorded one over that project, with a note replay.scenario. The plain project if the recorded
  /// one was plain.
  [[nodiscard]] Loaded<project::Scenario> scenario_in(const std::string& project);

 private:
  struct Folder;
  RecordedRun();
  void apply_facts(project::Scenario& scenario) const;
  /// The recorded scenario over a project that has no file `missing`.
  [[nodiscard]] Loaded<project::Scenario> attached_over(const std::filesystem::path& folder,
                                                        const std::string& missing);
  [[nodiscard]] Result<void> each_of(std::string_view topic, const std::function<bool(Message)>& take, TimePoint from,
                                     TimePoint to);

  std::string path_;
  std::unique_ptr<record::Reader> reader_;
  std::map<std::string, std::string, std::less<>> facts_;
  std::unique_ptr<Folder> folder_;
};

/// A scenario file that does what the recorded run did, with what came out of it as what is expected (see
/// project/scenario_text.h). Errors: those of `RecordedRun::scenario`, and record.*.
[[nodiscard]] Result<std::string> recorded_scenario_text(RecordedRun& run, const std::string& project = {});

/// A service's reply as recorded, with the numbers that JSON cannot hold ("Infinity") made numbers again.
void restore_numbers(const project::Plan& plan, Message& message);

}  // namespace sentree::replay
