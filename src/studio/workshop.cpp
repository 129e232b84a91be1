#include "sentree/studio/workshop.h"

#include <poll.h>
#include <pthread.h>
#include <signal.h>
#include <sys/eventfd.h>
#include <sys/inotify.h>
#include <unistd.h>

#include <algorithm>
#include <condition_variable>
#include <set>
#include <thread>

#include "sentree/base/json.h"
#include "sentree/design/parts.h"
#include "sentree/project/part_cache.h"
#include "sentree/project/skill_models.h"
#include "sentree/studio/design_values.h"
#include "sentree/studio/nothing.h"
#include "sentree/studio/past.h"
#include "sentree/studio/shadow.h"
#include "sentree/studio/sides.h"
#include "sentree/studio/simulations.h"
#include "sentree/text/yaml_edit.h"

namespace sentree::studio {

namespace {

namespace fs = std::filesystem;

Value number(std::uint64_t value) { return static_cast<std::int64_t>(value); }

class AskedEdit {
 public:
  explicit AskedEdit(const Value& request) : request_(request) {}
  [[nodiscard]] std::string text(std::string_view name) const {
    const Value* value = request_.find(name);
    return value != nullptr && value->as_string() != nullptr ? *value->as_string() : std::string();
  }
  [[nodiscard]] bool has(std::string_view name) const {
    const Value* value = request_.find(name);
    return value != nullptr && !value->is_null();
  }
  [[nodiscard]] std::uint64_t count(std::string_view name) const { return count_of(request_.find(name)); }
  [[nodiscard]] bool flag(std::string_view name) const {
    const Value* value = request_.find(name);
    return value != nullptr && value->as_bool() != nullptr && *value->as_bool();
  }
  [[nodiscard]] std::set<std::string> texts(std::string_view name) const {
    std::set<std::string> texts;
    const Value* list = request_.find(name);
    if (list == nullptr || list->as_list() == nullptr) return texts;
    for (const Value& text : *list->as_list()) texts.emplace(text.text());
    return texts;
  }
  [[nodiscard]] design::TextEdits edits() const {
    design::TextEdits edits;
    const Value* list = request_.find("edits");
    if (list == nullptr || list->as_list() == nullptr) return edits;
    for (const Value& edit : *list->as_list()) {
      const Value* text = edit.find("text");
      edits.push_back({count_of(edit.find("from")), count_of(edit.find("to")),
                       text != nullptr ? std::string(text->text()) : std::string()});
    }
    return edits;
  }
  [[nodiscard]] const Value* find(std::string_view name) const { return request_.find(name); }

 private:
  static std::uint64_t count_of(const Value* value) {
    constexpr double kExact = 9007199254740992.0;
    return value != nullptr && value->is_number() && value->number() >= 0 && value->number() <= kExact
               ? static_cast<std::uint64_t>(value->number())
               : 0;
  }
  const Value& request_;
};

// Where the element that a gesture is about stands afterwards.
std::size_t place_after(const design::TextEdits& edits) {
  std::size_t best = 0;
  std::size_t size = 0;
  std::ptrdiff_t shift = 0;
  for (const design::TextEdit& edit : edits) {
    const auto at = static_cast<std::size_t>(static_cast<std::ptrdiff_t>(edit.from) + shift);
    const std::size_t open = edit.text.find('<');
    if (edit.text.size() >= size) {
      size = edit.text.size();
      best = at + (open != std::string::npos ? open : 0);
    }
    shift += static_cast<std::ptrdiff_t>(edit.text.size()) - static_cast<std::ptrdiff_t>(edit.to - edit.from);
  }
  return best;
}

}  // namespace

struct Workshop::Impl {
  explicit Impl(design::Workspace opened) : workspace(std::move(opened)), folder(workspace.folder()) {}
  ~Impl();

  Result<Value> carry_out(const std::string& op, const Value& request);
  Result<Value> edit_by_gesture(const AskedEdit& asked);
  Result<Value> add(const AskedEdit& asked);
  [[nodiscard]] Value other_sides() const;
  [[nodiscard]] Result<Value> simulate(const std::string& op, const AskedEdit& asked, const Value& request);
  [[nodiscard]] Result<Value> compare(const std::string& op, const AskedEdit& asked);
  Result<Value> save(const AskedEdit& asked);
  void changed(const std::vector<std::string>& files);
  [[nodiscard]] Value summary() const;
  void tell_summary() { server->tell(to_json(summary())); }
  void tell_document(const std::string& file);
  [[nodiscard]] bool is_saved() const {
    const auto& documents = workspace.documents();
    return std::none_of(documents.begin(), documents.end(), [](const auto& d) { return d.second.is_dirty(); });
  }

  void check_and_run();
  struct Texts {
    text::Overlay overlay;
    std::map<std::string, std::string> texts;
    std::string scenario;
    bool saved = false;
  };
  [[nodiscard]] Texts texts_now() const;
  Loaded<project::Plan> look(const Texts& texts, Diagnostics& found);
  void keep_findings(const Texts& texts, const Diagnostics& found, bool whole);
  void judge_past(const Texts& texts, const project::Plan& plan);
  void run_shadow(project::Plan plan, bool as_baseline, bool and_show, std::uint64_t of_revision);

  void watch();
  void read_events(std::set<std::string>& paths);
  void add_watches(const fs::path& below);

  mutable std::mutex mutex;
  std::condition_variable news;
  design::Workspace workspace;
  const fs::path folder;
  design::Kinds kinds{{}};
  std::vector<bt::NodeModel> own;
  List places;                 // of the world, for completion
  List interfaces;             // of services, too
  std::set<std::string> open;  // files whose text some page has asked for
  std::vector<design::Finding> findings;
  std::string scenario;  // file; empty: the mission as it stands
  std::vector<std::string> scenarios;
  std::uint64_t revision = 1;              // of the texts
  std::uint64_t checked = 0;               // revision whose findings are known
  std::shared_ptr<const Shadow> baseline;  // as it goes with what is saved
  std::shared_ptr<const Shadow> shadow;    // as it goes with what is edited
  std::uint64_t shadow_of = 0;             // its revision
  std::string shadow_problem;
  bool stopping = false;
  bool past_wanted = false;            // requirements have been opened
  std::atomic<bool> outdated = false;  // what the shadow runs is not the newest any more

  const Nothing no_run;  // shown until there is something to run
  std::unique_ptr<Server> server;
  int inotify = -1;
  int wake = -1;
  std::map<int, std::string> watched;  // folder inside the project, by watch; of the watching thread
  Simulations simulations{folder};     // of the thread that steers
  project::PartCache parts;            // of the worker
  Past past{folder};                   // of the worker
  std::thread worker;
  std::thread watcher;
};

Workshop::Impl::~Impl() {
  {
    const std::lock_guard lock(mutex);
    stopping = true;
    outdated = true;
    news.notify_all();
  }
  if (worker.joinable()) worker.join();
  if (watcher.joinable()) {
    const std::uint64_t one = 1;
    (void)!write(wake, &one, sizeof one);
    watcher.join();
  }
  server.reset();
  if (inotify >= 0) close(inotify);
  if (wake >= 0) close(wake);
  workspace.keep_journal();
}

// ---- What pages are told ----

Value Workshop::Impl::summary() const {
  std::map<std::string, std::pair<std::int64_t, std::int64_t>> counts;  // errors, warnings
  List found;
  for (const design::Finding& finding : findings) {
    found.push_back(finding_value(finding));
    if (finding.diagnostic.severity == Severity::kError) ++counts[finding.file].first;
    if (finding.diagnostic.severity == Severity::kWarning) ++counts[finding.file].second;
  }
  List files;
  for (const auto& [file, document] : workspace.documents()) {
    files.push_back(Map{{"file", file},
                        {"kind", kind_of_file(file, document.text)},
                        {"version", number(document.version)},
                        {"dirty", document.is_dirty()},
                        {"conflict", document.theirs.has_value()},
                        {"errors", counts[file].first},
                        {"warnings", counts[file].second}});
  }
  const auto& undo = workspace.undo_steps();
  const auto& redo = workspace.redo_steps();
  Value differences;
  if (shadow && baseline) {
    List list;
    constexpr std::size_t kShownMax = 20;
    for (const replay::Difference& difference :
         replay::differences(baseline->behaviour, shadow->behaviour, true, kNever)) {
      list.push_back(Map{{"time", difference.time.time_since_epoch().count()},
                         {"who", difference.who},
                         {"before", difference.recorded},
                         {"after", difference.replayed}});
      if (list.size() == kShownMax) break;
    }
    differences = std::move(list);
  }
  List names;
  for (const std::string& name : scenarios) names.emplace_back(name);
  return Map{{"type", "design"},
             {"project", folder.filename().string()},
             {"files", std::move(files)},
             {"findings", std::move(found)},
             {"checked", checked == revision},
             {"undo", undo.empty() ? Value() : Value(undo.back().name)},
             {"undo_count", number(undo.size())},
             {"redo", redo.empty() ? Value() : Value(redo.back().name)},
             {"redo_count", number(redo.size())},
             {"scenario", scenario},
             {"scenarios", std::move(names)},
             {"shadow", Map{{"ready", shadow != nullptr},
                            {"current", shadow != nullptr && shadow_of == revision},
                            {"problem", shadow_problem},
                            {"ended", shadow ? shadow->report.ended.time_since_epoch().count() : std::int64_t{0}},
                            {"differences", std::move(differences)}}}};
}

void Workshop::Impl::tell_document(const std::string& file) {
  const design::Document* document = workspace.find(file);
  Value value =
      document != nullptr ? document_value(file, *document, kinds) : Value(Map{{"file", file}, {"gone", true}});
  value.as_map()->append("type", document != nullptr ? "design_document" : "design_gone");
  if (document == nullptr) value.as_map()->erase("gone");
  server->tell(to_json(value));
}

// `mutex` is held.
void Workshop::Impl::changed(const std::vector<std::string>& files) {
  ++revision;
  outdated = true;
  // Before anybody is told: what a page has seen is there again after the program was killed.
  workspace.keep_journal();
  for (const std::string& file : files) {
    if (open.contains(file)) tell_document(file);
  }
  tell_summary();
  news.notify_all();
}

// ---- What pages ask for ----

Result<Value> Workshop::Impl::carry_out(const std::string& op, const Value& request) {
  const AskedEdit asked(request);
  // What git or a recording has is read while others edit.
  if (op == "compare_sides") return other_sides();
  if (op == "compare_files" || op == "compare") return compare(op, asked);
  if (op == "simulate_chart" || op == "simulate_tree") return simulate(op, asked, request);
  const std::lock_guard lock(mutex);
  const std::string file = asked.text("file");
  if (!server) return fail("studio.request", "not yet: the project is being opened");
  if (op == "design") {
    Value value = summary();
    value.as_map()->erase("type");
    return value;
  }
  if (op == "design_palette")
    return Value(Map{{"nodes", palette_value(kinds, own)}, {"places", places}, {"interfaces", interfaces}});
  if (op == "design_read") {
    const design::Document* document = workspace.find(file);
    if (document == nullptr) return fail("design.no-such-file", "\"" + file + "\" is no file of this project");
    open.insert(file);
    if (file.ends_with(".req")) {
      past_wanted = true;
      news.notify_all();
    }
    return document_value(file, *document, kinds);
  }
  if (op == "design_fold") {
    const design::Document* document = workspace.find(file);
    if (document == nullptr) return fail("design.no-such-file", "\"" + file + "\" is no file of this project");
    return folded_value(file, *document, asked.texts("closed"));
  }
  if (op == "design_edit") {
    const std::uint64_t before = workspace.find(file) != nullptr ? workspace.find(file)->version : 0;
    if (auto edited = workspace.edit(file, asked.count("base"), asked.edits(), asked.text("cause"), asked.flag("join"));
        !edited)
      return tl::unexpected(edited.error());
    if (workspace.find(file)->version != before) changed({file});
    return Value(Map{{"version", number(workspace.find(file)->version)}});
  }
  if (op == "design_gesture") return edit_by_gesture(asked);
  if (op == "design_undo" || op == "design_redo") {
    auto files = op == "design_undo" ? workspace.undo() : workspace.redo();
    if (!files) return tl::unexpected(files.error());
    changed(*files);
    List list;
    for (const std::string& name : *files) list.emplace_back(name);
    return Value(Map{{"files", std::move(list)}});
  }
  if (op == "design_save") return save(asked);
  if (op == "design_resolve") {
    const design::Document* document = workspace.find(file);
    if (document == nullptr || !document->theirs) return fail("design.bad-edit", file + " has no conflict");
    const std::string text = asked.text("keep") == "theirs" ? *document->theirs : document->text;
    if (auto resolved = workspace.resolve(file, text); !resolved) return tl::unexpected(resolved.error());
    changed({file});
    return Value(Map());
  }
  if (op == "design_add") return add(asked);
  if (op == "design_remove") {
    if (auto removed = workspace.remove(file); !removed) return tl::unexpected(removed.error());
    changed({file});
    return Value(Map());
  }
  if (op == "design_scenario") {
    const std::string name = asked.text("scenario");
    if (!name.empty() && std::find(scenarios.begin(), scenarios.end(), name) == scenarios.end())
      return fail("studio.request", "there is no scenario \"" + name + "\"");
    scenario = name;
    baseline.reset();
    changed({});
    return Value(Map());
  }
  return fail("studio.request", "\"" + op + "\" is not known here: a project is edited, no run goes on");
}

Result<Value> Workshop::Impl::edit_by_gesture(const AskedEdit& asked) {
  const std::string file = asked.text("file");
  const design::Document* document = workspace.find(file);
  if (document == nullptr) return fail("design.no-such-file", "\"" + file + "\" is no file of this project");
  if (asked.count("base") != document->version)
    return fail("design.conflict", "the text has changed meanwhile; try again");
  const Value* wanted = asked.find("gesture");
  const auto result = edited_by(wanted != nullptr ? *wanted : Value(), file, document->text, kinds);
  if (!result) return tl::unexpected(result.error());
  if (asked.flag("try")) return Value(Map{{"name", result->name}});
  if (auto edited = workspace.edit(file, document->version, result->edits, result->name); !edited)
    return tl::unexpected(edited.error());
  changed({file});
  return Value(Map{{"version", number(workspace.find(file)->version)},
                   {"name", result->name},
                   {"at", number(place_after(result->edits))}});
}

Result<Value> Workshop::Impl::add(const AskedEdit& asked) {
  const std::string kind = asked.text("kind");
  const std::string name = asked.text("name");
  const auto part = design::new_part(kind, name, shadow ? &shadow->plan : nullptr);
  if (!part) return tl::unexpected(part.error());
  std::vector<design::Workspace::NewText> texts;
  for (const auto& [path, content] : part->files) {
    if (workspace.find(path) != nullptr)
      return fail("design.bad-name", path + " is there already; choose another name");
    texts.push_back({path, content});
  }
  if (!part->entries.empty()) {
    const design::Document* yaml = workspace.find("sentree.yaml");
    if (yaml == nullptr) return fail("design.no-such-file", "there is no sentree.yaml");
    std::string source = yaml->text;
    for (const auto& [section, entry] : part->entries) {
      auto with = text::with_entry(source, section, entry, "sentree.yaml");
      if (!with) return tl::unexpected(with.error());
      source = std::move(*with);
    }
    texts.push_back({"sentree.yaml", std::move(source)});
  }
  if (auto put = workspace.put(texts, "add " + kind + " " + name); !put) return tl::unexpected(put.error());
  std::vector<std::string> files;
  for (const auto& text : texts) files.push_back(text.file);
  changed(files);
  return Value(Map{{"file", part->files.front().first}});
}

// ---- Comparing with what was ----

namespace {

constexpr std::string_view kSavedSide = "saved";
constexpr std::string_view kCommitSide = "HEAD";
constexpr std::string_view kRunSide = "runs/";
constexpr std::size_t kRunsOfferedMax = 20;

std::vector<std::string> recordings_in(const fs::path& folder) {
  std::vector<std::pair<fs::file_time_type, std::string>> found;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder / "runs", error)) {
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

}  // namespace

Value Workshop::Impl::other_sides() const {
  List sides{Map{{"id", kSavedSide}, {"title", "what is saved"}},
             Map{{"id", kCommitSide}, {"title", "the last commit (HEAD)"}}};
  for (const std::string& name : recordings_in(folder))
    sides.push_back(Map{{"id", std::string(kRunSide) + name}, {"title", "the project that " + name + " ran"}});
  return Map{{"sides", std::move(sides)}};
}

Result<Value> Workshop::Impl::compare(const std::string& op, const AskedEdit& asked) {
  const std::string with = asked.text("with");
  Sides sides;
  if (with == kCommitSide) {
    auto texts = texts_of_commit(folder, with);
    if (!texts) return tl::unexpected(texts.error());
    sides.before = std::move(*texts);
  } else if (with.starts_with(kRunSide)) {
    const auto names = recordings_in(folder);
    const std::string name = with.substr(kRunSide.size());
    if (std::find(names.begin(), names.end(), name) == names.end())
      return fail("studio.request", "there is no recording \"" + name + "\" in runs/");
    auto texts = texts_at(folder / "runs" / name);
    if (!texts) return tl::unexpected(texts.error());
    sides.before = std::move(*texts);
  } else if (with != kSavedSide) {
    return fail("studio.request", "\"" + with + "\" is nothing to compare with");
  }
  design::Kinds known{{}};
  {
    const std::lock_guard lock(mutex);
    known = kinds;
    for (const auto& [name, document] : workspace.documents()) {
      sides.after.emplace(name, document.text);
      if (with == kSavedSide) sides.before.emplace(name, document.saved);
    }
  }
  // A recording holds only what the run read.
  if (with.starts_with(kRunSide))
    std::erase_if(sides.after, [&](const auto& one) { return !sides.before.contains(one.first); });
  if (op == "compare") return comparison_of(sides, asked.text("file"), known);
  return Value(Map{{"before", with}, {"after", folder.filename().string()}, {"files", changed_files(sides)}});
}

// ---- Running a chart or a tree by hand ----

Result<Value> Workshop::Impl::simulate(const std::string& op, const AskedEdit& asked, const Value& request) {
  Simulations::Text text{.file = asked.text("file"), .text = {}, .version = 0};
  text::Overlay overlay;
  design::Kinds known{{}};
  {
    const std::lock_guard lock(mutex);
    const design::Document* document = workspace.find(text.file);
    if (document == nullptr) return fail("design.no-such-file", "\"" + text.file + "\" is no file of this project");
    text.text = document->text;
    text.version = document->version;
    overlay = workspace.overlay();
    known = kinds;
  }
  const text::ReadThrough through(overlay);
  return op == "simulate_chart" ? simulations.chart(text, request) : simulations.tree(text, known.palette(), request);
}

// ---- Saving ----

Result<Value> Workshop::Impl::save(const AskedEdit& asked) {
  std::vector<std::string> files;
  if (asked.has("file")) {
    files.push_back(asked.text("file"));
  } else {
    for (const auto& [file, document] : workspace.documents()) {
      if (document.is_dirty() && !document.theirs) files.push_back(file);
    }
  }
  for (const std::string& file : files) {
    if (auto saved = workspace.save(file); !saved) {
      changed({file});
      return tl::unexpected(saved.error());
    }
  }
  // What goes with the saved texts is now what goes with the edited ones.
  if (is_saved() && shadow && shadow_of == revision) baseline = shadow;
  workspace.keep_journal();
  tell_summary();
  return Value(Map{{"saved", number(files.size())}});
}

// ---- Checking, and running again ----

Workshop::Impl::Texts Workshop::Impl::texts_now() const {
  Texts now{.overlay = workspace.overlay(), .texts = {}, .scenario = scenario, .saved = false};
  now.saved = now.overlay.empty();
  for (const auto& [file, document] : workspace.documents()) now.texts.emplace(file, document.text);
  return now;
}

Loaded<project::Plan> Workshop::Impl::look(const Texts& texts, Diagnostics& found) {
  Loaded<project::Plan> prepared;
  Loaded<project::Scenario> chosen;
  if (!texts.scenario.empty()) {
    chosen = project::load_scenario(folder / "scenarios" / (texts.scenario + ".yaml"));
  } else {
    auto project = project::load_project(folder);
    chosen.diagnostics = std::move(project.diagnostics);
    if (project.value) chosen.value = project::plain_scenario(std::move(*project.value));
  }
  found = chosen.diagnostics;
  if (!chosen.ok()) return prepared;
  {
    const auto models = project::skill_models(chosen.value->project);
    List named;
    if (chosen.value->project.world) {
      if (const auto world = project::load_project_world(chosen.value->project); world.value) {
        for (const auto& location : world.value->locations) named.emplace_back(location.name);
        for (const auto& area : world.value->areas) named.emplace_back(area.name);
      }
    }
    List services = interfaces_value(folder, texts.texts);
    const std::lock_guard lock(mutex);
    interfaces = std::move(services);
    if (models.value) {
      own = *models.value;
      kinds = design::Kinds(own);
    }
    places = std::move(named);
  }
  prepared = project::prepare(std::move(*chosen.value), parts);
  found.insert(found.end(), prepared.diagnostics.begin(), prepared.diagnostics.end());
  return prepared;
}

// Those of the whole project, or of one scenario: then what was found in others stays.
void Workshop::Impl::keep_findings(const Texts& texts, const Diagnostics& found, bool whole) {
  std::vector<design::Finding> located;
  const std::string own_scenario = "scenarios/" + texts.scenario + ".yaml";
  std::set<std::string> told;
  for (const Diagnostic& diagnostic : found) {
    if (diagnostic.severity == Severity::kNote || !told.insert(to_string(diagnostic)).second) continue;
    const auto text = texts.texts.find(design::file_inside(folder, diagnostic.span.file));
    located.push_back(
        design::locate(diagnostic, folder, text != texts.texts.end() ? std::string_view(text->second) : ""));
    // People read paths inside the project.
    std::string& message = located.back().diagnostic.message;
    const std::string before = folder.string() + "/";
    for (std::size_t at = message.find(before); at != std::string::npos; at = message.find(before, at))
      message.erase(at, before.size());
  }
  const std::lock_guard lock(mutex);
  if (!whole) {
    for (design::Finding& finding : findings) {
      if (finding.file.starts_with("scenarios/") && finding.file != own_scenario) located.push_back(std::move(finding));
    }
  }
  findings = std::move(located);
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
  shadow = *run;
  shadow_of = of_revision;
  RunFacts facts{.state = "ended", .reason = shadow->report.reason};
  server->show({std::shared_ptr<const Subject>(shadow, &shadow->subject),
                std::shared_ptr<const History>(shadow, &shadow->history), facts});
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
      news.wait(lock, [&] { return stopping || revision != done || past_wanted; });
      if (stopping) return;
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
      Diagnostics unused;
      if (const auto prepared = look(texts, unused); prepared.ok()) judge_past(texts, *prepared.value);
      continue;
    }
    {
      const Loaded<project::Project> project = project::load_project(folder);
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
    Diagnostics found;
    auto prepared = look(texts, found);
    keep_findings(texts, found, false);
    if (!is_current()) {
      done = at;
      continue;
    }
    {
      const std::lock_guard lock(mutex);
      checked = at;
      // The kinds of nodes are part of the pictures.
      for (const std::string& file : open) {
        const design::Document* document = workspace.find(file);
        if (document != nullptr && kind_of_file(file, document->text) == "mission") tell_document(file);
      }
      tell_summary();
    }
    if (prepared.ok()) judge_past(texts, *prepared.value);
    if (prepared.ok()) {
      if (needs_baseline && !texts.saved) {
        const text::Overlay nothing;
        const text::ReadThrough saved(nothing);
        Diagnostics unused;
        auto before = look({{}, {}, texts.scenario, true}, unused);
        if (before.ok()) run_shadow(std::move(*before.value), true, false, at);
      }
      run_shadow(std::move(*prepared.value), texts.saved, true, at);
      const std::lock_guard lock(mutex);
      tell_summary();
    }
    if (is_current()) {
      // A scope in between may have taken the texts away from this thread.
      const text::ReadThrough again(texts.overlay);
      const Diagnostics all = project::check_project(folder, parts);
      if (is_current()) {
        keep_findings(texts, all, true);
        const std::lock_guard lock(mutex);
        tell_summary();
      }
    }
    done = at;
  }
}

// ---- Files that others write ----

void Workshop::Impl::add_watches(const fs::path& below) {
  constexpr std::uint32_t kWhat = IN_CLOSE_WRITE | IN_MOVED_TO | IN_MOVED_FROM | IN_CREATE | IN_DELETE | IN_ONLYDIR;
  std::vector<fs::path> folders{below};
  for (std::size_t i = 0; i < folders.size() && watched.size() < kWatchesMax; ++i) {
    const int id = inotify_add_watch(inotify, folders[i].c_str(), kWhat);
    if (id < 0) continue;
    const std::string inside = folders[i].lexically_relative(folder).generic_string();
    watched[id] = inside == "." ? "" : inside;
    std::error_code error;
    for (const auto& entry : fs::directory_iterator(folders[i], error)) {
      const std::string name = entry.path().filename().string();
      if (entry.is_symlink(error) || !entry.is_directory(error) || name.starts_with('.') || name == "runs" ||
          name == "node_modules" || name == "build")
        continue;
      folders.push_back(entry.path());
    }
  }
}

void Workshop::Impl::watch() {
  add_watches(folder);
  // Editors replace a file in several moves, of which only the last says what it is.
  constexpr int kQuiet_ms = 15;
  constexpr int kMovesMax = 10;
  for (;;) {
    pollfd waiting[] = {{inotify, POLLIN, 0}, {wake, POLLIN, 0}};
    std::set<std::string> paths;
    for (int move = 0; poll(waiting, 2, move == 0 ? -1 : kQuiet_ms) > 0 && move < kMovesMax; ++move) {
      if ((waiting[1].revents & POLLIN) != 0) return;
      read_events(paths);
    }
    const std::lock_guard lock(mutex);
    std::vector<std::string> files;
    for (const std::string& path : paths) {
      const auto more = workspace.refresh(path);
      files.insert(files.end(), more.begin(), more.end());
    }
    if (files.empty()) continue;
    baseline.reset();
    changed(files);
  }
}

void Workshop::Impl::read_events(std::set<std::string>& paths) {
  alignas(inotify_event) char buffer[16 * 1024];
  const ssize_t size = read(inotify, buffer, sizeof buffer);
  for (ssize_t at = 0; at < size;) {
    const auto* event = reinterpret_cast<const inotify_event*>(buffer + at);
    at += static_cast<ssize_t>(sizeof(inotify_event) + event->len);
    if ((event->mask & IN_Q_OVERFLOW) != 0) paths.insert("");
    const auto below = watched.find(event->wd);
    if (below == watched.end()) continue;
    if ((event->mask & IN_IGNORED) != 0) {
      watched.erase(below);
      continue;
    }
    const std::string path = (below->second.empty() ? "" : below->second + "/") + (event->len > 0 ? event->name : "");
    if ((event->mask & IN_ISDIR) != 0) {
      if ((event->mask & (IN_CREATE | IN_MOVED_TO)) != 0) add_watches(folder / path);
      paths.insert(path);
    } else if (design::is_project_text(path) && (event->mask & IN_CREATE) == 0) {
      paths.insert(path);
    }
  }
}

// ---- Workshop ----

Workshop::Workshop(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Workshop::~Workshop() = default;
const Server& Workshop::server() const { return *impl_->server; }

Result<std::unique_ptr<Workshop>> Workshop::start(const fs::path& folder, ServerOptions options) {
  auto workspace = design::Workspace::open(folder);
  if (!workspace) return tl::unexpected(workspace.error());
  auto impl = std::make_unique<Impl>(std::move(*workspace));
  Impl* const raw = impl.get();
  impl->inotify = inotify_init1(IN_CLOEXEC);
  impl->wake = eventfd(0, EFD_CLOEXEC);
  if (impl->inotify < 0 || impl->wake < 0) return fail("studio.no-watch", "this machine lets no more files be watched");
  options.design = true;
  options.live = true;
  auto server = Server::start(
      impl->no_run.subject, impl->no_run.history,
      {.update = {},
       .facts = [] { return RunFacts{.state = "ended"}; },
       .steer = [raw](const std::string& op, const Value& request) { return raw->carry_out(op, request); }},
      std::move(options));
  if (!server) return tl::unexpected(server.error());
  {
    // A page may be there already.
    const std::lock_guard lock(impl->mutex);
    impl->server = std::move(*server);
  }
  sigset_t all, before;
  sigfillset(&all);
  pthread_sigmask(SIG_SETMASK, &all, &before);
  impl->worker = std::thread([raw] { raw->check_and_run(); });
  impl->watcher = std::thread([raw] { raw->watch(); });
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
  return std::unique_ptr<Workshop>(new Workshop(std::move(impl)));
}

}  // namespace sentree::studio
