#include <fmt/format.h>

#include <algorithm>

#include "sentree/base/json.h"
#include "sentree/studio/detail/workshop.h"
#include "sentree/studio/recorded.h"

namespace sentree::studio {

namespace fs = std::filesystem;

namespace {

constexpr std::string_view kRunsFolder = "runs";
constexpr std::size_t kRunsOfferedMax = 20;

}  // namespace

std::vector<std::string> recordings_in(const fs::path& folder) {
  std::vector<std::pair<fs::file_time_type, std::string>> found;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder / kRunsFolder, error)) {
    std::error_code each;
    if (entry.path().extension() == ".mcap" && !entry.is_symlink(each) && entry.is_regular_file(each))
      found.emplace_back(entry.last_write_time(each), entry.path().filename().string());
  }
  std::sort(found.rbegin(), found.rend());
  if (found.size() > kRunsOfferedMax) found.resize(kRunsOfferedMax);
  std::vector<std::string> names;
  for (auto& [time, name] : found) names.push_back(std::move(name));
  return names;
}

// `mutex` is held.
void Workshop::Impl::show_shadow(bool again) {
  on_show.clear();
  reached_on_show = {};
  if (!shadow) return;
  server->show({.subject = std::shared_ptr<const Subject>(shadow, &shadow->subject),
                .history = std::shared_ptr<const History>(shadow, &shadow->history),
                .facts = [facts = RunFacts{.state = "ended", .reason = shadow->report.reason}] { return facts; },
                .stays = again});
}

// `mutex` is held.
void Workshop::Impl::show_beside() {
  on_show = beside->file();
  reached_on_show = [run = beside] { return run->access()->coverage(); };
  server->show(beside->shown());
}

// `mutex` is held.
Value Workshop::Impl::runs() const {
  List names;
  for (std::string& name : recordings_in(folder)) names.emplace_back(std::move(name));
  return Map{{"recordings", std::move(names)},
             {"on_show", on_show},
             {"goes_on", goes_on && beside ? Value(beside->file()) : Value()},
             {"continues", beside && on_show == beside->file() ? beside->continues() : ""},
             {"outdated", goes_on && beside && beside_of != revision},
             {"problem", beside ? beside->problem() : ""}};
}

// The chosen scenario with the texts as they are, saved or not; the recording has them.
Result<Value> Workshop::Impl::begin_run(double factor, bool real_time) {
  constexpr double kFactorMax = 1000.0;
  if (!(factor > 0.0 && factor <= kFactorMax))
    return fail("studio.request", "a run that is recorded here is up to 1000 times as fast as the clock");
  Texts texts;
  {
    const std::lock_guard lock(mutex);
    if (!server) return fail("studio.request", "not yet: the project is being opened");
    if (goes_on) return fail("studio.request", "a run is being recorded; stop it first");
    goes_on = true;
    texts = texts_now();
  }
  auto begun = [&]() -> Result<std::shared_ptr<RunBeside>> {
    const text::ReadThrough through(texts.overlay);
    const text::ReadLog files;
    auto chosen = chosen_scenario(texts.scenario, project::load_project(folder));
    if (!chosen.ok()) return fail("studio.request", "the project has errors; mend them first");
    if (real_time) chosen.value->virtual_time = false;
    chosen.value->factor = chosen.value->virtual_time ? 1.0 : factor;
    auto plan = project::prepare(std::move(*chosen.value));
    if (!plan.ok()) return fail("studio.request", "the project has errors; mend them first");
    return RunBeside::begin(std::move(*plan.value), files.files(),
                            {.folder = folder / kRunsFolder,
                             .factor = factor,
                             .library = "sentree " + version,
                             .story = story,
                             .on_end = [this] {
                               const std::lock_guard lock(mutex);
                               goes_on = false;
                               if (!stopping) tell_summary();
                             }});
  }();
  const std::lock_guard lock(mutex);
  if (!begun) {
    goes_on = false;
    return tl::unexpected(begun.error());
  }
  beside = std::move(*begun);
  beside_scenario = texts.scenario;
  beside_of = texts.revision;
  show_beside();
  tell_summary();
  return Value(Map{{"recording", on_show}});
}

// The run beside goes on with the texts as they are, saved or not.
Result<Value> Workshop::Impl::apply_to_run() {
  Texts texts;
  std::shared_ptr<RunBeside> run;
  bool is_shown = false;
  {
    const std::lock_guard lock(mutex);
    if (!goes_on || !beside) return fail("studio.request", "no run goes on that could go on with what is edited");
    run = beside;
    is_shown = on_show == run->file();
    texts = texts_now();
    texts.scenario = beside_scenario;
  }
  auto applied = [&]() -> Loaded<std::vector<std::string>> {
    const text::ReadThrough through(texts.overlay);
    const text::ReadLog files;
    auto chosen = chosen_scenario(texts.scenario, project::load_project(folder));
    if (!chosen.ok()) return {std::nullopt, std::move(chosen.diagnostics)};
    auto plan = project::prepare(std::move(*chosen.value));
    if (!plan.ok()) return {std::nullopt, std::move(plan.diagnostics)};
    return run->replace(std::move(*plan.value), files.files());
  }();
  if (!applied.ok()) {
    List reasons;
    bool later = false;
    for (const Diagnostic& why : applied.diagnostics) {
      if (why.severity != Severity::kError) continue;
      later = later || why.code.ends_with(".cannot-carry");
      reasons.push_back(Map{{"file", design::file_inside(folder, why.span.file)},
                            {"line", static_cast<std::int64_t>(why.span.line)},
                            {"message", as_read(why.message)}});
    }
    return Value(Map{{"refused", std::move(reasons)}, {"later", later}});
  }
  const std::lock_guard lock(mutex);
  beside_of = texts.revision;
  if (run == beside && is_shown) show_beside();
  tell_summary();
  List changes;
  for (std::string& change : *applied.value) changes.emplace_back(std::move(change));
  return Value(Map{{"recording", run->file()}, {"changes", std::move(changes)}});
}

// A recording of this project; empty: the shadow run.
Result<Value> Workshop::Impl::show_run(const std::string& recording) {
  std::shared_ptr<Recorded> read;
  bool is_beside = false;
  {
    const std::lock_guard lock(mutex);
    if (!server) return fail("studio.request", "not yet: the project is being opened");
    is_beside = beside && beside->file() == recording;
  }
  if (!recording.empty() && !is_beside) {
    const auto names = recordings_in(folder);
    if (std::find(names.begin(), names.end(), recording) == names.end())
      return fail("studio.request", fmt::format("there is no recording \"{}\" in runs/", recording));
    Diagnostics unused;
    auto opened = Recorded::read((folder / kRunsFolder / recording).string(), replay::RecordedCode::kRefused, unused);
    if (!opened) return tl::unexpected(opened.error());
    read = std::move(*opened);
  }
  const std::lock_guard lock(mutex);
  if (recording.empty()) {
    show_shadow();
  } else {
    if (is_beside) {
      show_beside();
    } else {
      on_show = recording;
      reached_on_show = [read] { return read->access().coverage(); };
      server->show({.subject = std::shared_ptr<const Subject>(read, &read->subject()),
                    .history = std::shared_ptr<const History>(read, &read->history()),
                    .facts = [read] { return read->access().facts(); },
                    .recording = true});
    }
  }
  tell_summary();
  return Value(Map());
}

Result<Value> Workshop::Impl::steer(const std::string& op, const Value& request) {
  std::shared_ptr<RunBeside> run;
  {
    const std::lock_guard lock(mutex);
    if (beside && on_show == beside->file()) run = beside;
  }
  if (!run)
    return fail("studio.request", fmt::format("\"{}\" is not known here: a project is edited, no run goes on", op));
  return run->access()->steer(op, request);
}

}  // namespace sentree::studio
