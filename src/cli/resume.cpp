#include "sentree/cli/resume.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <vector>

#include "sentree/cli/output.h"
#include "sentree/mission/state.h"
#include "sentree/project/distribute.h"

namespace sentree::cli {

namespace fs = std::filesystem;

namespace {

std::int64_t integer(const Value& note, std::string_view key) {
  const Value* value = note.find(key);
  const std::int64_t* number = value != nullptr ? value->as_int() : nullptr;
  return number != nullptr ? *number : 0;
}

bool flag(const Value& note, std::string_view key) {
  const Value* value = note.find(key);
  return value != nullptr && value->as_bool() != nullptr && *value->as_bool();
}

std::string text_of(const Value& note, std::string_view key) {
  const Value* value = note.find(key);
  return value != nullptr ? std::string(value->text()) : std::string();
}

Result<runtime::Journaled> newest() {
  const char* folder = std::getenv("SENTREE_RUNS");
  const fs::path runs = folder != nullptr && *folder != '\0' ? folder : "runs";
  std::vector<fs::path> journals;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(runs, error)) {
    if (entry.path().extension() == ".journal") journals.push_back(entry.path());
  }
  std::sort(journals.begin(), journals.end(), [&](const fs::path& a, const fs::path& b) {
    return fs::last_write_time(a, error) > fs::last_write_time(b, error);
  });
  std::optional<Diagnostic> why;
  for (const fs::path& journal : journals) {
    auto journaled = runtime::read_journal(journal);
    if (journaled) {
      // Whoever means another one hears it before anything goes on.
      if (why) say(to_string(*why));
      say(fmt::format("goes on with {}, of the runs in {} that can be resumed the last one that was killed",
                      text_of(journaled->note, "recording"), runs.string()));
      return journaled;
    }
    if (!why) why = journaled.error();
  }
  if (why) return tl::unexpected(*why);
  return fail("journal.none",
              fmt::format("no run in {} waits to be resumed; only runs with --durable can be", runs.string()));
}

}  // namespace

fs::path journal_of(fs::path recording) { return recording.replace_extension(".journal"); }

Value note_of(const project::Scenario& scenario, const fs::path& recording, bool in_processes,
              project::JournalSync sync) {
  std::string word;
  for (const char* each : {"never", "interval", "each"}) {
    if (project::parse_journal_sync(each) == sync) word = each;
  }
  std::error_code error;
  return Map{{"recording", recording.filename().string()},
             {"source", fs::absolute(scenario.file, error).lexically_normal().string()},
             {"virtual", scenario.virtual_time},
             {"processes", in_processes},
             {"sync", word},
             {"factor", scenario.factor},
             {"seed", static_cast<std::int64_t>(scenario.seed)},
             {"duration_ns", scenario.duration.count()}};
}

Result<Resumption> Resumption::find(const std::string& recording) {
  auto journaled = recording.empty() ? newest() : runtime::read_journal(journal_of(recording));
  if (!journaled) return tl::unexpected(journaled.error());
  Resumption found;
  found.journaled = std::move(*journaled);
  found.recording = found.journaled.file.parent_path() / text_of(found.journaled.note, "recording");
  auto recorded = replay::RecordedRun::open(found.recording.string());
  if (!recorded) return found;
  found.recorded = std::make_shared<replay::RecordedRun>(std::move(*recorded));
  if (!found.recorded->fact("mission").empty()) {
    std::error_code unremoved;
    fs::remove(found.journaled.file, unremoved);
    return fail("run.ended", found.recording.string() + ": this run has ended; sentree info says how");
  }
  // The last ones are at the end, but something else may have been recorded long after them.
  TimePoint late{};
  Duration back = std::chrono::seconds(1);
  do {
    late = std::max(TimePoint{}, found.recorded->ended() - back);
    (void)found.recorded->each(
        [&](const Message& message) {
          found.known = std::max(found.known, message.sequence);
          return true;
        },
        late);
    back *= 10;
  } while (found.known == 0 && late > TimePoint{});
  return found;
}

Loaded<project::Scenario> Resumption::scenario() const {
  Loaded<project::Scenario> loaded;
  loaded.value = load_file(text_of(journaled.note, "source"));
  if (loaded.value) set_pace(*loaded.value);
  return loaded;
}

Loaded<project::Scenario> Resumption::recorded_scenario() const {
  if (!recorded) return scenario();
  auto loaded = recorded->scenario(recorded_code);
  if (loaded.value) set_pace(*loaded.value);
  return loaded;
}

Loaded<project::Scenario> Resumption::scenario_of(const std::string& project) const {
  // A run of a scenario goes on with the other project's scenario of that name: what is still to come of its timeline.
  const std::string name = fs::path(text_of(journaled.note, "source")).stem().string();
  bool has_that = false;
  if (fs::is_directory(project)) {
    if (const auto other = project::load_project(project); other.ok()) {
      const std::vector<fs::path> scenarios = project::scenario_files(*other.value);
      has_that =
          std::any_of(scenarios.begin(), scenarios.end(), [&](const fs::path& file) { return file.stem() == name; });
    }
  }
  Loaded<project::Scenario> loaded = load(project, has_that ? name : std::string());
  if (loaded.value) set_pace(*loaded.value);
  return loaded;
}

bool Resumption::in_processes() const { return flag(journaled.note, "processes"); }
std::optional<project::JournalSync> Resumption::sync() const {
  return project::parse_journal_sync(text_of(journaled.note, "sync"));
}

Loaded<project::Plan> Resumption::plan() const {
  for (const bool from_recording : {false, true}) {
    auto loaded = from_recording ? recorded_scenario() : scenario();
    if (!loaded.value) {
      if (from_recording) return {std::nullopt, std::move(loaded.diagnostics)};
      continue;
    }
    auto plan = project::prepare(std::move(*loaded.value));
    if (plan.ok() && in_processes()) plan = project::prepare(project::in_processes(*plan.value));
    const bool is_last = from_recording || !recorded;
    if (!plan.ok() && is_last) return plan;
    if (!plan.ok()) continue;
    const auto state = mission::restore(*plan.value, journaled.state);
    if (state || state.error().code != "mission.other-plan") return plan;
    if (is_last) return {std::nullopt, {state.error()}};
  }
  return {};
}

void Resumption::set_pace(project::Scenario& scenario) const {
  const Value* factor = journaled.note.find("factor");
  scenario.virtual_time = flag(journaled.note, "virtual");
  if (factor != nullptr && factor->as_double() != nullptr) scenario.factor = *factor->as_double();
  scenario.seed = static_cast<std::uint64_t>(integer(journaled.note, "seed"));
  scenario.duration = Duration(integer(journaled.note, "duration_ns"));
}

}  // namespace sentree::cli
