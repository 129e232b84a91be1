#include "sentree/studio/workshop.h"

#include <fmt/format.h>

#include <pthread.h>
#include <signal.h>
#include <sys/eventfd.h>
#include <sys/inotify.h>
#include <unistd.h>

#include <algorithm>
#include <set>

#include "sentree/base/json.h"
#include "sentree/design/parts.h"
#include "sentree/studio/detail/asked_edit.h"
#include "sentree/studio/detail/design_values.h"
#include "sentree/studio/detail/sides.h"
#include "sentree/studio/detail/workshop.h"
#include "sentree/studio/reached.h"
#include "sentree/studio/verified.h"
#include "sentree/text/yaml_edit.h"

namespace sentree::studio {

namespace fs = std::filesystem;

namespace {

Value number(std::uint64_t value) { return static_cast<std::int64_t>(value); }

// Without what lets one steer.
std::string address_of(const Server& server) {
  const std::string url = server.url();
  return url.substr(0, url.find('#'));
}

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
  if (beside) beside->end();
  if (server) server->stop();  // whose threads ask it for its pages until then
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
                        {"conflict", document.has_conflict()},
                        {"errors", counts[file].first},
                        {"warnings", counts[file].second}});
  }
  const auto steps_of = [this](const std::string& page) {
    const auto [undo, undo_count, redo, redo_count] = workspace.own_steps(page);
    return Map{{"undo", undo_count == 0 ? Value() : Value(undo)},
               {"undo_count", number(undo_count)},
               {"redo", redo_count == 0 ? Value() : Value(redo)},
               {"redo_count", number(redo_count)}};
  };
  Map pages;
  for (const std::string& page : server->pages()) pages.append(page, steps_of(page));
  Value differences;
  if (shadow && baseline) {
    List list;
    constexpr std::size_t kShownMax = 20;
    for (const replay::Difference& difference :
         replay::differences(baseline->behaviour, shadow->behaviour, replay::Compared::kOrderAndTick, kNever)) {
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
  bool expects = false;
  List unmet;
  if (shadow) {
    const project::Scenario& ran = shadow->plan.scenario;
    expects = ran.mission || !ran.mission_reason.empty() || !ran.verdicts.empty();
    unmet.assign(shadow->report.unmet.begin(), shadow->report.unmet.end());
  }
  return Map{{"type", "design"},
             {"project", folder.filename().string()},
             {"files", std::move(files)},
             {"findings", std::move(found)},
             {"checked", checked == revision},
             {"steps", steps_of({})},
             {"pages", std::move(pages)},
             {"scenario", scenario},
             {"scenarios", std::move(names)},
             {"runs", runs()},
             {"held_by", workspace.held_by()},
             {"journal", workspace.journal_problem()},
             {"reached_by_all", all != nullptr && all_of == revision},
             {"shadow", Map{{"ready", shadow != nullptr},
                            {"current", shadow != nullptr && shadow_of == revision},
                            {"problem", shadow_problem},
                            {"ended", shadow ? shadow->report.ended.time_since_epoch().count() : std::int64_t{0}},
                            {"differences", std::move(differences)},
                            {"expects", expects},
                            {"unmet", std::move(unmet)}}}};
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

// Texts that were saved because files went: pages are told of them as well, and what is compared with is another.
void Workshop::Impl::saved_beside(const std::vector<std::string>& saved, std::vector<std::string>& files) {
  for (const std::string& file : saved) {
    if (std::find(files.begin(), files.end(), file) == files.end()) files.push_back(file);
  }
  if (!saved.empty()) baseline.reset();
}

// ---- What pages ask for ----

Result<Value> Workshop::Impl::carry_out(const std::string& op, const Value& request) {
  const AskedEdit asked(request);
  // What git or a recording has is read while others edit.
  if (op == "compare_sides") return other_sides();
  if (op == "compare_files" || op == "compare") return compare(op, asked);
  if (op == "simulate_chart" || op == "simulate_tree") return simulate(op, asked, request);
  if (op == "design_record") return begin_run(asked.number("factor", 1.0), asked.flag("real_time"));
  if (op == "design_apply") return apply_to_run();
  if (op == "design_show") return show_run(asked.text("recording"));
  if (!op.starts_with("design")) return steer(op, request);
  const std::lock_guard lock(mutex);
  const std::string file = asked.text("file");
  if (!server) return fail("studio.request", "not yet: the project is being opened");
  if (workspace.take_over()) {
    workspace.tell_address(address_of(*server));
    std::vector<std::string> texts;
    for (const auto& [name, document] : workspace.documents()) texts.push_back(name);
    changed(texts);
  }
  workspace.acts(asked.text("page"), server->pages());
  if (op == "design_pages") {
    tell_summary();
    return Value();
  }
  if (op == "design") {
    Value value = summary();
    value.as_map()->erase("type");
    return value;
  }
  if (op == "design_palette")
    return Value(
        Map{{"nodes", palette_value(kinds, own)}, {"places", places}, {"interfaces", interfaces}, {"charts", charts}});
  if (op == "design_read") {
    const design::Document* document = workspace.find(file);
    if (document == nullptr) return fail("design.no-such-file", fmt::format("\"{}\" is no file of this project", file));
    open.insert(file);
    if (file.ends_with(".req")) {
      past_wanted = true;
      news.notify_all();
    }
    return document_value(file, *document, kinds);
  }
  if (op == "design_fold") {
    const design::Document* document = workspace.find(file);
    if (document == nullptr) return fail("design.no-such-file", fmt::format("\"{}\" is no file of this project", file));
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
  if (op == "design_rename") return rename(asked);
  if (op == "design_rename_file") return rename_file(file, asked.text("to"));
  if (op == "design_uses") return uses_of(file);
  if (op == "design_complete" || op == "design_explain")
    return help_with(file, asked.count("byte"), op == "design_complete");
  if (op == "design_reached") return asked.flag("verification") ? verified() : reached(asked.flag("all"));
  if (op == "design_undo") return tell_reverted(workspace.undo());
  if (op == "design_redo") return tell_reverted(workspace.redo());
  if (op == "design_save") return save(asked);
  if (op == "design_resolve") return resolve(file, asked.text("keep"));
  if (op == "design_add") return add(asked);
  if (op == "design_init") return begin_project();
  if (op == "design_remove") return remove(file);
  if (op == "design_scenario") {
    const std::string name = asked.text("scenario");
    if (!name.empty() && std::find(scenarios.begin(), scenarios.end(), name) == scenarios.end())
      return fail("studio.request", fmt::format("there is no scenario \"{}\"", name));
    scenario = name;
    baseline.reset();
    changed({});
    return Value(Map());
  }
  return fail("studio.request", fmt::format("\"{}\" is not known here", op));
}

Result<Value> Workshop::Impl::tell_reverted(const Result<design::Workspace::Reverted>& reverted) {
  if (!reverted) {
    changed({});
    return tl::unexpected(reverted.error());
  }
  std::vector<std::string> told = reverted->files;
  saved_beside(reverted->saved, told);
  changed(told);
  const auto listed = [](const std::vector<std::string>& files) { return List(files.begin(), files.end()); };
  return Value(
      Map{{"files", listed(reverted->files)}, {"left", listed(reverted->left)}, {"saved", listed(reverted->saved)}});
}

Result<Value> Workshop::Impl::resolve(const std::string& file, std::string_view keep) {
  const design::Document* document = workspace.find(file);
  if (document == nullptr || !document->has_conflict()) return fail("design.bad-edit", file + " has no conflict");
  const auto resolved =
      workspace.resolve(file, keep == "theirs" ? document->theirs.value_or(std::string()) : document->text);
  changed({file});
  if (!resolved) return tl::unexpected(resolved.error());
  return Value(Map());
}

Result<Value> Workshop::Impl::begin_project() {
  if (!workspace.held_by().empty())
    return fail("design.held", workspace.held_by() + " edits this project; begin it there");
  if (auto begun = design::begin_project(folder); !begun) return tl::unexpected(begun.error());
  changed(workspace.refresh({""}));
  return Value(Map());
}

Result<Value> Workshop::Impl::remove(const std::string& file) {
  if (file == "sentree.yaml") return fail("design.bad-edit", "sentree.yaml is the project; it is not deleted here");
  const auto removed = workspace.remove(file);
  if (!removed) {
    changed({file});
    return tl::unexpected(removed.error());
  }
  std::vector<std::string> gone{file};
  saved_beside(*removed, gone);
  changed(gone);
  return Value(Map{{"saved", List(removed->begin(), removed->end())}});
}

Result<Value> Workshop::Impl::rename(const AskedEdit& asked) {
  using Kind = lsp::SymbolKind;
  const std::string to = asked.text("to");
  for (const auto& [what, kind] : {std::pair("location", Kind::kLocation), std::pair("tree", Kind::kTree),
                                   std::pair("node", Kind::kNode), std::pair("state", Kind::kState)}) {
    if (!asked.has(what)) continue;
    const std::string name = asked.text(what);
    const std::string file = (folder / asked.text("file")).string();
    auto done = rename(lsp::Symbol{kind, kind == Kind::kState ? fmt::format("{}#{}", file, name) : name}, name, to);
    const Value* const renamed = done ? done->find("places") : nullptr;
    if (renamed == nullptr || renamed->number() != 0 || !asked.has("gesture")) return done;
    if (auto edited = edit_by_gesture(asked); !edited) return edited;
    const Value* const left = done->find("left");
    return Value(
        Map{{"files", List{asked.text("file")}}, {"places", 0}, {"left", left != nullptr ? *left : Value(List())}});
  }
  return fail("studio.request", "what is to be renamed: a location, tree, node or state?");
}

Result<Value> Workshop::Impl::edit_by_gesture(const AskedEdit& asked) {
  const std::string file = asked.text("file");
  const design::Document* document = workspace.find(file);
  if (document == nullptr) return fail("design.no-such-file", fmt::format("\"{}\" is no file of this project", file));
  // It is done to the text that it is of, and joined with what happened since.
  const std::uint64_t base = asked.count("base");
  const std::string* const meant = document->at(base);
  if (meant == nullptr) return fail("design.conflict", file + " has changed too much since; look at it again");
  const Value* wanted = asked.find("gesture");
  auto result = edited_by(wanted != nullptr ? *wanted : Value(), file, *meant, kinds);
  if (!result) return tl::unexpected(result.error());
  if (base != document->version) {
    auto joined = design::joined(file, *meant, document->text, result->edits);
    if (!joined) return tl::unexpected(joined.error());
    result->edits = std::move(*joined);
    result->nodes.clear();  // other numbers by now
  }
  if (asked.flag("try")) {
    if (auto may = workspace.may_edit(); !may) return tl::unexpected(may.error());
    return Value(Map{{"name", result->name}});
  }
  if (auto edited = workspace.edit(file, document->version, result->edits, result->name); !edited)
    return tl::unexpected(edited.error());
  changed({file});
  List nodes;
  for (const std::uint32_t node : result->nodes) nodes.push_back(number(node));
  return Value(Map{{"version", number(workspace.find(file)->version)},
                   {"name", result->name},
                   {"at", number(place_after(result->edits))},
                   {"nodes", std::move(nodes)},
                   {"states", List(result->states.begin(), result->states.end())}});
}

// With the texts as they are now.
Result<Value> Workshop::Impl::verified() {
  return read_verified(folder / "verify" / kVerifiedFile, [this](const std::string& file) {
    const design::Document* const document = workspace.find(file);
    return document != nullptr ? std::optional(document->text) : std::nullopt;
  });
}

// What the shadow run reaches, or all scenarios do together; null: that is not known yet.
Result<Value> Workshop::Impl::reached(bool of_all) {
  if (!of_all) {
    all_wanted = false;
    return shadow ? coverage_value(shadow->coverage, folder) : Value();
  }
  if (!all_wanted) news.notify_all();
  all_wanted = true;
  return all && all_of == revision ? coverage_value(*all, folder) : Value();
}

Result<Value> Workshop::Impl::add(const AskedEdit& asked) {
  const std::string kind = asked.text("kind");
  const std::string name = asked.text("name");
  const design::Document* const yaml = workspace.find("sentree.yaml");
  if (yaml == nullptr) return fail("design.no-such-file", "there is no sentree.yaml; begin a project first");
  const auto part = design::new_part(kind, name, shadow ? &shadow->plan : nullptr);
  if (!part) return tl::unexpected(part.error());
  std::vector<design::Workspace::NewText> texts;
  for (const auto& [path, content] : part->files) {
    if (workspace.find(path) != nullptr)
      return fail("design.bad-name", path + " is there already; choose another name");
    texts.push_back({path, content});
  }
  if (!part->entries.empty()) {
    std::string source = yaml->text;
    for (const auto& [section, entry] : part->entries) {
      auto with = text::with_entry(source, section, entry, "sentree.yaml");
      if (!with) return tl::unexpected(with.error());
      source = std::move(*with);
    }
    texts.push_back({"sentree.yaml", std::move(source)});
  }
  if (auto put = workspace.put(texts, fmt::format("add {} {}", kind, name)); !put) return tl::unexpected(put.error());
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

}  // namespace

Value Workshop::Impl::other_sides() const {
  List sides{Map{{"id", kSavedSide}, {"title", "what is saved"}},
             Map{{"id", kCommitSide}, {"title", "the last commit (HEAD)"}}};
  for (const std::string& name : recordings_in(folder))
    sides.push_back(Map{{"id", std::string(kRunSide) + name}, {"title", fmt::format("the project that {} ran", name)}});
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
      return fail("studio.request", fmt::format("there is no recording \"{}\" in runs/", name));
    auto texts = texts_at(folder / "runs" / name);
    if (!texts) return tl::unexpected(texts.error());
    sides.before = std::move(*texts);
  } else if (with != kSavedSide) {
    return fail("studio.request", fmt::format("\"{}\" is nothing to compare with", with));
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
  if (with.starts_with(kRunSide)) keep_what_was_read(sides.before, sides.after);
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
    if (document == nullptr)
      return fail("design.no-such-file", fmt::format("\"{}\" is no file of this project", text.file));
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
      if (document.is_dirty() && !document.has_conflict()) files.push_back(file);
    }
  }
  for (const std::string& file : files) {
    const design::Document* document = workspace.find(file);
    const std::uint64_t before = document != nullptr ? document->version : 0;
    if (auto saved = workspace.save(file); !saved) {
      changed({file});
      return tl::unexpected(saved.error());
    }
    document = workspace.find(file);
    if (document == nullptr || document->version != before) changed({file});
  }
  // What goes with the saved texts is now what goes with the edited ones.
  if (is_saved() && shadow && shadow_of == revision) baseline = shadow;
  workspace.keep_journal();
  tell_summary();
  return Value(Map{{"saved", number(files.size())}});
}

// ---- Workshop ----

Workshop::Workshop(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Workshop::~Workshop() = default;
const Server& Workshop::server() const { return *impl_->server; }
std::string Workshop::held_by() const {
  const std::lock_guard lock(impl_->mutex);
  return impl_->workspace.held_by();
}

Result<std::unique_ptr<Workshop>> Workshop::start(const fs::path& folder, ServerOptions options,
                                                  std::function<std::string(const runtime::MonitorReport&)> story) {
  auto workspace = design::Workspace::open(folder);
  if (!workspace) return tl::unexpected(workspace.error());
  auto impl = std::make_unique<Impl>(std::move(*workspace), options.version, std::move(story));
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
       .steer = [raw](const std::string& op, const Value& request) { return raw->carry_out(op, request); },
       .coverage = [raw]() -> Result<Value> {
         std::function<Result<Value>()> other;
         {
           const std::lock_guard lock(raw->mutex);
           if (!raw->reached_on_show) return raw->reached(false);
           other = raw->reached_on_show;
         }
         return other();
       },
       .verified =
           [raw] {
             const std::lock_guard lock(raw->mutex);
             return raw->verified();
           }},
      std::move(options));
  if (!server) return tl::unexpected(server.error());
  {
    // A page may be there already.
    const std::lock_guard lock(impl->mutex);
    impl->server = std::move(*server);
    impl->workspace.tell_address(address_of(*impl->server));
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
