#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <set>
#include <string>

#include "sentree/base/json.h"
#include "sentree/project/check_unnamed.h"
#include "sentree/project/interface_file.h"
#include "sentree/project/mission_tree.h"
#include "sentree/project/skill_models.h"
#include "sentree/studio/detail/design_values.h"
#include "sentree/studio/detail/workshop.h"

namespace sentree::studio {

namespace fs = std::filesystem;

Workshop::Impl::Texts Workshop::Impl::texts_now() const {
  Texts now{.overlay = workspace.overlay(), .texts = {}, .scenario = scenario, .saved = false, .revision = revision};
  now.saved = now.overlay.empty();
  for (const auto& [file, document] : workspace.documents()) now.texts.emplace(file, document.text);
  return now;
}

// Empty: the mission as it stands.
Loaded<project::Scenario> Workshop::Impl::chosen_scenario(const std::string& name,
                                                          const Loaded<project::Project>& project) const {
  Loaded<project::Scenario> chosen;
  if (!name.empty()) {
    const auto file = folder / "scenarios" / (name + ".yaml");
    if (!project.ok()) return project::load_scenario(file);
    chosen = project::load_scenario(file, &*project.value);
  } else if (project.value) {
    chosen.value = project::plain_scenario(*project.value);
  }
  chosen.diagnostics.insert(chosen.diagnostics.begin(), project.diagnostics.begin(), project.diagnostics.end());
  return chosen;
}

// By ID, and by name where `skills:` has that; of those whose chart is a file of the project.
Map Workshop::Impl::charts_of(const project::Project& project, const std::vector<bt::NodeModel>& skills,
                              const Texts& texts) const {
  Map found;
  const auto add = [&](const std::string& leaf) {
    const project::FileRef file = project::skill_file(project, project.skill(leaf, leaf), leaf);
    const std::string inside = design::file_inside(folder, (folder / file.path).lexically_normal().string());
    if (texts.texts.contains(inside)) found[leaf] = inside;
  };
  for (const bt::NodeModel& skill : skills) add(skill.id);
  for (const project::SkillEntry& entry : project.skills) add(entry.leaf);
  return found;
}

// What pages are offered.
void Workshop::Impl::learn(const Texts& texts, const project::Project& project) {
  const auto models = project::skill_models(project);
  List named;
  if (project.world) {
    if (const auto world = project::load_project_world(project); world.value) {
      for (const auto& location : world.value->locations) named.emplace_back(location.name);
      for (const auto& area : world.value->areas) named.emplace_back(area.name);
    }
  }
  List services = interfaces_value(folder, texts.texts);
  const std::lock_guard lock(mutex);
  interfaces = std::move(services);
  if (models.value) {
    own = *models.value;
    charts = charts_of(project, own, texts);
    kinds = design::Kinds(own);
    std::string told = to_json(palette_value(kinds, own));
    if (told != palette) {
      palette = std::move(told);
      ++palettes;
    }
  }
  places = std::move(named);
}

Loaded<project::Plan> Workshop::Impl::prepared(Loaded<project::Scenario> chosen) {
  Loaded<project::Plan> plan;
  if (chosen.ok()) plan = project::prepare(std::move(*chosen.value), parts);
  plan.diagnostics.insert(plan.diagnostics.begin(), chosen.diagnostics.begin(), chosen.diagnostics.end());
  return plan;
}

// People read paths inside the project.
std::string Workshop::Impl::as_read(std::string message) const {
  const std::string before = folder.string() + "/";
  for (std::size_t at = message.find(before); at != std::string::npos; at = message.find(before, at))
    message.erase(at, before.size());
  return message;
}

// Those of the whole project, or of one scenario: then what was found in others stays.
void Workshop::Impl::keep_findings(const Texts& texts, const Diagnostics& found, bool whole) {
  std::vector<design::Finding> located;
  const std::string own_scenario = fmt::format("scenarios/{}.yaml", texts.scenario);
  std::set<std::string> told;
  for (const Diagnostic& diagnostic : found) {
    if (diagnostic.severity == Severity::kNote || !told.insert(to_string(diagnostic)).second) continue;
    const auto text = texts.texts.find(design::file_inside(folder, diagnostic.span.file));
    located.push_back(
        design::locate(diagnostic, folder, text != texts.texts.end() ? std::string_view(text->second) : ""));
    located.back().diagnostic.message = as_read(std::move(located.back().diagnostic.message));
  }
  const std::lock_guard lock(mutex);
  if (!whole) {
    for (design::Finding& finding : findings) {
      if (finding.file.starts_with("scenarios/") && finding.file != own_scenario) located.push_back(std::move(finding));
    }
  }
  findings = std::move(located);
}

void Workshop::Impl::add_unread(const Texts& texts, Diagnostics& found) const {
  std::set<std::string> told;
  for (const Diagnostic& diagnostic : found) {
    const bool is_broken = diagnostic.severity != Severity::kNote && diagnostic.span.line > 0;
    if (is_broken) told.insert(design::file_inside(folder, diagnostic.span.file));
  }
  for (const auto& [file, text] : texts.texts) {
    if (told.contains(file)) continue;
    // YAML of others may have more in it than is read here.
    if (kind_of_file(file, text) == "other" && !file.ends_with(".xml")) continue;
    std::optional<Diagnostic> why = unreadable(file, text, kinds);
    if (!why && file.ends_with(".thrift")) {
      const auto schema = project::load_interface(folder / file, file);
      const auto error = std::find_if(schema.diagnostics.begin(), schema.diagnostics.end(),
                                      [](const Diagnostic& d) { return d.severity == Severity::kError; });
      if (error != schema.diagnostics.end()) why = *error;
    }
    if (!why) continue;
    // Nothing that runs rests on it.
    why->severity = Severity::kWarning;
    found.push_back(std::move(*why));
  }
}

// What the open requirements say of the last runs.
void Workshop::Impl::judge_past(const Texts& texts, const project::Plan& plan) {
  std::vector<std::string> files;
  {
    const std::lock_guard lock(mutex);
    std::copy_if(open.begin(), open.end(), std::back_inserter(files),
                 [](const std::string& file) { return file.ends_with(".req"); });
  }
  for (const std::string& file : files) {
    const auto text = texts.texts.find(file);
    if (text == texts.texts.end()) continue;
    const Value judged = past.judge(file, text->second, plan);
    const std::lock_guard lock(mutex);
    server->tell(to_json(judged));
  }
}

void Workshop::Impl::run_shadow(project::Plan to_run, bool as_baseline, bool and_show, std::uint64_t of_revision) {
  outdated = false;
  {
    const std::lock_guard lock(mutex);
    if (stopping || revision != of_revision) return;
  }
  auto run = Shadow::run(std::move(to_run), outdated);
  const std::lock_guard lock(mutex);
  if (outdated || stopping) return;
  if (!run) {
    shadow_problem = run.error().message;
    if (and_show) shadow.reset();
    return;
  }
  shadow_problem = (*run)->whole ? "" : "the scenario makes too many observations: it was ended early";
  // It may have been saved while it ran.
  if (as_baseline || (and_show && is_saved())) baseline = *run;
  if (!and_show) return;
  const bool again = shadow != nullptr && shadow_scenario == scenario;
  shadow = *run;
  shadow_scenario = scenario;
  shadow_of = of_revision;
  if (on_show.empty()) show_shadow(again);
}

// Runs all scenarios, one after the other.
void Workshop::Impl::reach_all(std::uint64_t of_revision) {
  Texts texts;
  std::vector<std::string> names;
  auto together = std::make_shared<campaign::Coverage>();
  {
    const std::lock_guard lock(mutex);
    if (revision != of_revision) return;
    outdated = false;
    texts = texts_now();
    names = scenarios;
    all_of = of_revision;  // what is tried and fails is not tried again
    all.reset();
    if (names.empty()) together = std::make_shared<campaign::Coverage>(shadow->coverage);
  }
  const text::ReadThrough through(texts.overlay);
  for (const std::string& name : names) {
    auto loaded = project::load_scenario(folder / "scenarios" / (name + ".yaml"));
    if (!loaded.ok()) continue;
    auto plan = project::prepare(std::move(*loaded.value), parts);
    if (!plan.ok()) continue;
    const auto run = Shadow::run(std::move(*plan.value), outdated);
    if (outdated) return;
    if (run) together->add((*run)->coverage);
  }
  const std::lock_guard lock(mutex);
  if (stopping || revision != of_revision) return;
  all = std::move(together);
  tell_summary();
}

void Workshop::Impl::check_and_run() {
  std::uint64_t done = 0;
  for (;;) {
    Texts texts;
    std::uint64_t at = 0;
    bool needs_baseline = false;
    bool only_past = false;
    {
      std::unique_lock lock(mutex);
      const auto lacks_all = [&] { return all_wanted && all_of != revision && shadow_of == revision; };
      news.wait(lock, [&] { return stopping || revision != done || past_wanted || lacks_all(); });
      if (stopping) return;
      if (revision == done && !past_wanted) {
        lock.unlock();
        reach_all(done);
        continue;
      }
      only_past = revision == done;
      past_wanted = false;
      at = revision;
      texts = texts_now();
      needs_baseline = !baseline;
    }
    const auto is_current = [&] {
      const std::lock_guard lock(mutex);
      return !stopping && revision == at;
    };
    const text::ReadThrough through(texts.overlay);
    if (only_past) {
      const auto plan = prepared(chosen_scenario(texts.scenario, project::load_project(folder)));
      if (plan.ok()) judge_past(texts, *plan.value);
      continue;
    }
    const Loaded<project::Project> project = project::load_project(folder);
    {
      std::vector<std::string> names;
      if (project.value) {
        for (const fs::path& file : project::scenario_files(*project.value)) names.push_back(file.stem().string());
      }
      const std::lock_guard lock(mutex);
      scenarios = std::move(names);
      if (!scenario.empty() && std::find(scenarios.begin(), scenarios.end(), scenario) == scenarios.end()) {
        scenario.clear();
        texts.scenario.clear();
        baseline.reset();
      }
    }
    const std::uint64_t palette_before = palettes;
    auto chosen = chosen_scenario(texts.scenario, project);
    if (chosen.ok()) learn(texts, chosen.value->project);
    auto plan = prepared(std::move(chosen));
    keep_findings(texts, plan.diagnostics, false);
    if (!is_current()) {
      done = at;
      continue;
    }
    {
      const std::lock_guard lock(mutex);
      checked = at;
      // The kinds of nodes are part of the pictures.
      for (const std::string& file : open) {
        if (palettes == palette_before) break;
        const design::Document* document = workspace.find(file);
        if (document != nullptr && kind_of_file(file, document->text) == "mission") tell_document(file);
      }
      tell_summary();
    }
    if (plan.ok()) judge_past(texts, *plan.value);
    if (plan.ok()) {
      if (needs_baseline && !texts.saved) {
        const text::Overlay nothing;
        const text::ReadThrough saved(nothing);
        auto before = prepared(chosen_scenario(texts.scenario, project::load_project(folder)));
        if (before.ok()) run_shadow(std::move(*before.value), true, false, at);
      }
      run_shadow(std::move(*plan.value), texts.saved, true, at);
      const std::lock_guard lock(mutex);
      tell_summary();
    }
    if (is_current()) {
      // A scope in between may have taken the texts away from this thread.
      const text::ReadThrough again(texts.overlay);
      Diagnostics whole = project::check_project(project, parts);
      if (project.ok()) project::check_unnamed(*project.value, whole);
      add_unread(texts, whole);
      if (is_current()) {
        keep_findings(texts, whole, true);
        const std::lock_guard lock(mutex);
        tell_summary();
      }
    }
    done = at;
  }
}

}  // namespace sentree::studio
