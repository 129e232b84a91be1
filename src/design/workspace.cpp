#include "sentree/design/workspace.h"

#include <fmt/format.h>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <set>
#include <system_error>

#include "sentree/base/json.h"
#include "sentree/base/value.h"
#include "sentree/text/file.h"
#include "sentree/text/json.h"
#include "sentree/text/xml.h"

namespace sentree::design {

namespace {

namespace fs = std::filesystem;

constexpr const char* kJournalFolder = ".sentree";
constexpr const char* kJournal = "journal";
constexpr std::int64_t kJournalForm = 1;

// What another editor, or git, did at once.
std::string name_from_disk(const std::vector<FileChange>& changes) {
  if (changes.size() > 1) return std::to_string(changes.size()) + " files changed on disk";
  return changes.front().file + (changes.front().removed ? " deleted on disk" : " changed on disk");
}

// The path inside the folder, with '/'.
std::string inside(const fs::path& folder, const fs::path& path) {
  return path.lexically_relative(folder).generic_string();
}

bool is_passed_over(const fs::path& name) {
  const std::string text = name.filename().string();
  return text.starts_with('.') || text == "runs" || text == "node_modules" || text == "build";
}

std::optional<std::string> text_of(const fs::path& path) {
  std::error_code error;
  if (!fs::is_regular_file(fs::symlink_status(path, error))) return std::nullopt;
  auto content = text::read_file(path, {}, kDocumentBytesMax);
  // Control characters may be typed any moment; what is no UTF-8 cannot be shown.
  if (!content) return std::nullopt;
  const auto bad = text::first_unreadable(*content);
  if (bad && static_cast<unsigned char>((*content)[bad->first]) >= 0x80U) return std::nullopt;
  return std::move(*content);
}

tl::unexpected<Diagnostic> unwritable(const std::string& file) {
  return fail("file.unwritable", "cannot be written: " + std::generic_category().message(errno), SourceSpan{file});
}

// A descriptor that is closed, and a temporary file that is gone, whatever happens.
class Temporary {
 public:
  Temporary(fs::path path, int descriptor) : path_(std::move(path)), descriptor_(descriptor) {}
  ~Temporary() {
    if (descriptor_ >= 0) close(descriptor_);
    if (!path_.empty()) unlink(path_.c_str());
  }
  Temporary(const Temporary&) = delete;
  Temporary& operator=(const Temporary&) = delete;

  bool write(std::string_view text) const {
    while (!text.empty()) {
      const ssize_t done = ::write(descriptor_, text.data(), text.size());
      if (done < 0 && errno == EINTR) continue;
      if (done <= 0) return false;
      text.remove_prefix(static_cast<std::size_t>(done));
    }
    return true;
  }
  bool finish(const fs::path& as) {
    const int descriptor = std::exchange(descriptor_, -1);
    const bool synchronised = fsync(descriptor) == 0;
    if (close(descriptor) != 0 || !synchronised || rename(path_.c_str(), as.c_str()) != 0) return false;
    path_.clear();
    return true;
  }
  [[nodiscard]] int descriptor() const { return descriptor_; }

 private:
  fs::path path_;
  int descriptor_;
};

bool synchronise_folder(const fs::path& folder) {
  const int descriptor = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor < 0) return false;
  const bool done = fsync(descriptor) == 0;
  close(descriptor);
  return done;
}

Value to_value(const TextEdits& edits) {
  List list;
  for (const TextEdit& edit : edits)
    list.push_back(List{static_cast<std::int64_t>(edit.from), static_cast<std::int64_t>(edit.to), edit.text});
  return list;
}

Value to_value(const Step& step) {
  List changes;
  for (const FileChange& change : step.changes) {
    changes.push_back(Map{{"file", change.file},
                          {"edits", to_value(change.edits)},
                          {"back", to_value(change.back)},
                          {"created", change.created},
                          {"removed", change.removed}});
  }
  return Map{{"name", step.name}, {"changes", std::move(changes)}};
}

const List& list_of(const Value& value, std::string_view name) {
  static const List kNone;
  const Value* found = value.find(name);
  return found != nullptr && found->as_list() != nullptr ? *found->as_list() : kNone;
}

std::string string_of(const Value& value, std::string_view name) {
  const Value* found = value.find(name);
  return found != nullptr && found->as_string() != nullptr ? *found->as_string() : std::string();
}

bool flag_of(const Value& value, std::string_view name) {
  const Value* found = value.find(name);
  return found != nullptr && found->as_bool() != nullptr && *found->as_bool();
}

TextEdits edits_of(const List& list) {
  TextEdits edits;
  for (const Value& entry : list) {
    const List* parts = entry.as_list();
    if (parts == nullptr || parts->size() != 3 || (*parts)[0].as_int() == nullptr || (*parts)[1].as_int() == nullptr ||
        (*parts)[2].as_string() == nullptr)
      continue;
    edits.push_back({static_cast<std::size_t>(*(*parts)[0].as_int()), static_cast<std::size_t>(*(*parts)[1].as_int()),
                     *(*parts)[2].as_string()});
  }
  return edits;
}

Step step_of(const Value& value) {
  Step step{string_of(value, "name"), {}};
  for (const Value& change : list_of(value, "changes")) {
    step.changes.push_back({string_of(change, "file"), edits_of(list_of(change, "edits")),
                            edits_of(list_of(change, "back")), flag_of(change, "created"), flag_of(change, "removed")});
  }
  return step;
}

}  // namespace

bool is_project_text(const fs::path& path) {
  static const char* const kEndings[] = {".xml", ".scxml", ".req", ".yaml", ".yml", ".thrift"};
  const std::string ending = path.extension().string();
  return std::any_of(std::begin(kEndings), std::end(kEndings), [&](const char* known) { return ending == known; });
}

bool each_project_text(const fs::path& folder, const std::function<void(const fs::path&)>& visit) {
  std::size_t count = 0;
  std::error_code error;
  fs::recursive_directory_iterator it(folder, fs::directory_options::skip_permission_denied, error);
  for (; !error && it != fs::recursive_directory_iterator(); it.increment(error)) {
    const fs::path& path = it->path();
    std::error_code unknown;
    const auto status = it->symlink_status(unknown);
    if (fs::is_directory(status)) {
      if (is_passed_over(path) || it.depth() >= kFoldersDeepMax) it.disable_recursion_pending();
      continue;
    }
    if (!fs::is_regular_file(status) || is_passed_over(path) || !is_project_text(path)) continue;
    if (++count > kFilesMax) return false;
    visit(path);
  }
  return true;
}

Result<Workspace> Workspace::open(const fs::path& folder) {
  std::error_code error;
  const fs::path canonical = fs::canonical(folder, error);
  if (error || !fs::is_directory(canonical, error))
    return fail("file.not-found", "no such folder", SourceSpan{folder.string()});
  Workspace workspace(canonical);
  const bool all = each_project_text(canonical, [&](const fs::path& path) {
    if (auto text = text_of(path)) {
      Document& document = workspace.documents_[inside(canonical, path)];
      document.text = document.saved = std::move(*text);
    }
  });
  if (!all)
    return fail("design.too-many-files", fmt::format("more than {} files; open a smaller folder", kFilesMax),
                SourceSpan{folder.string()});
  workspace.read_journal();
  return workspace;
}

const Document* Workspace::find(std::string_view file) const {
  const auto found = documents_.find(std::string(file));
  return found != documents_.end() ? &found->second : nullptr;
}

text::Overlay Workspace::overlay() const {
  text::Overlay overlay;
  for (const auto& [file, document] : documents_) {
    if (document.is_dirty()) overlay[folder_ / file] = document.text;
  }
  return overlay;
}

Result<Document*> Workspace::editable(const std::string& file) {
  const auto found = documents_.find(file);
  if (found == documents_.end()) return fail("design.no-such-file", file + " is no file of this project");
  if (found->second.theirs)
    return fail("design.unresolved", file + " was changed on disk where it is edited here; choose one of both first");
  return &found->second;
}

void Workspace::set_text(Document& document, std::string text) {
  document.earlier.emplace_back(document.version, std::move(document.text));
  if (document.earlier.size() > kVersionsMax) document.earlier.pop_front();
  document.text = std::move(text);
  ++document.version;
  journal_due_ = true;
}

void Workspace::did(Step step, bool join) {
  redo_.clear();
  journal_due_ = true;
  // Two changes of one file become one from what was before both to what is now.
  if (std::exchange(may_join_, true) && join && !undo_.empty() && undo_.back().name == step.name &&
      undo_.back().changes.size() == 1 && step.changes.size() == 1 &&
      undo_.back().changes.front().file == step.changes.front().file) {
    FileChange& last = undo_.back().changes.front();
    const std::string& now = documents_[last.file].text;
    const auto middle = with_edits(now, step.changes.front().back);
    const auto before = middle ? with_edits(*middle, last.back) : tl::unexpected(middle.error());
    if (before) {
      last.edits = edits_between(*before, now);
      last.back = inverse(*before, last.edits);
      return;
    }
  }
  undo_.push_back(std::move(step));
  if (undo_.size() > kStepsMax) undo_.pop_front();
}

Result<void> Workspace::edit(const std::string& file, std::uint64_t base, const TextEdits& edits,
                             const std::string& name, bool join) {
  const auto document = editable(file);
  if (!document) return tl::unexpected(document.error());
  const std::string& now = (*document)->text;
  const std::string* from = &now;
  if (base != (*document)->version) {
    const auto& earlier = (*document)->earlier;
    const auto found = std::find_if(earlier.begin(), earlier.end(), [&](const auto& e) { return e.first == base; });
    if (found == earlier.end()) return fail("design.conflict", file + " has changed too much since; look at it again");
    from = &found->second;
  }
  auto edited = with_edits(*from, edits);
  if (!edited) return tl::unexpected(edited.error());
  TextEdits made = edits;
  if (from != &now) {
    auto merged = merge(*from, now, *edited);
    if (!merged) return fail("design.conflict", fmt::format("the same lines of {} have been changed meanwhile", file));
    edited = std::move(*merged);
    made = edits_between(now, *edited);
  }
  if (edited->size() > kDocumentBytesMax)
    return fail("design.too-large", fmt::format("{} would be larger than {} bytes", file, kDocumentBytesMax));
  const auto bad = text::first_unreadable(*edited);
  if (bad && static_cast<unsigned char>((*edited)[bad->first]) >= 0x80U)
    return fail("design.not-text", "that is no UTF-8");
  if (*edited == now) return {};
  Step step{name, {{file, made, inverse(now, made)}}};
  set_text(**document, std::move(*edited));
  did(std::move(step), join);
  return {};
}

Result<fs::path> Workspace::place_of(const std::string& file) const {
  const fs::path relative(file);
  const auto outside = [&] {
    return fail("design.outside", fmt::format("\"{}\" leads out of the project's folder", file));
  };
  if (relative.empty() || relative.is_absolute() || !is_project_text(relative)) return outside();
  fs::path at = folder_;
  for (const fs::path& part : relative) {
    if (part == ".." || part == "." || part.empty() || is_passed_over(part)) return outside();
    at /= part;
    std::error_code error;
    if (fs::is_symlink(fs::symlink_status(at, error))) return outside();
  }
  return at;
}

Result<void> Workspace::put(const std::vector<NewText>& texts, const std::string& name) {
  Step step{name, {}};
  for (const NewText& text : texts) {
    const auto place = place_of(text.file);
    if (!place) return tl::unexpected(place.error());
    if (find(text.file) != nullptr) {
      if (const auto document = editable(text.file); !document) return tl::unexpected(document.error());
    }
  }
  std::vector<DiskChange> on_disk;
  for (const NewText& text : texts) {
    if (find(text.file) == nullptr) on_disk.push_back({text.file, text.text, std::nullopt});
  }
  if (auto changed = change_disk(on_disk); !changed) return changed;
  for (const NewText& text : texts) {
    if (find(text.file) == nullptr) {
      documents_[text.file].saved = text.text;
      set_text(documents_[text.file], text.text);
      step.changes.push_back({text.file, {{0, 0, text.text}}, {{0, text.text.size(), ""}}, true});
      continue;
    }
    Document& document = documents_[text.file];
    if (document.text == text.text) continue;
    const TextEdits edits = edits_between(document.text, text.text);
    step.changes.push_back({text.file, edits, inverse(document.text, edits)});
    set_text(document, text.text);
  }
  if (!step.changes.empty()) did(std::move(step), false);
  return {};
}

Result<void> Workspace::remove(const std::string& file) {
  const auto document = editable(file);
  if (!document) return tl::unexpected(document.error());
  const std::string text = (*document)->text;
  if (unlink((folder_ / file).c_str()) != 0 && errno != ENOENT) return unwritable(file);
  documents_.erase(file);
  did({"delete " + file, {{file, {{0, text.size(), ""}}, {{0, 0, text}}, false, true}}}, false);
  return {};
}

// Makes files and takes files away, all of them or none.
Result<void> Workspace::change_disk(const std::vector<DiskChange>& changes) const {
  std::size_t done = 0;
  auto result = [&]() -> Result<void> {
    for (const DiskChange& change : changes) {
      if (change.text) {
        if (auto written = write(change.file, *change.text); !written) return written;
      } else if (unlink((folder_ / change.file).c_str()) != 0 && errno != ENOENT) {
        return unwritable(change.file);
      }
      ++done;
    }
    return {};
  }();
  if (result) return result;
  // As far as the disk lets us; what stays is seen by `refresh`.
  while (done-- > 0) {
    const DiskChange& change = changes[done];
    if (change.before)
      (void)write(change.file, *change.before);
    else
      unlink((folder_ / change.file).c_str());
  }
  return result;
}

Result<std::vector<std::string>> Workspace::revert(const Step& step, bool back) {
  // Everything is tried before any text is changed.
  std::vector<DiskChange> on_disk;
  for (const FileChange& change : step.changes) {
    const auto found = documents_.find(change.file);
    if (back ? change.removed : change.created) {
      const TextEdits& edits = back ? change.back : change.edits;
      if (found == documents_.end()) on_disk.push_back({change.file, with_edits("", edits).value_or(""), std::nullopt});
      continue;
    }
    const auto document = editable(change.file);
    if (!document) return tl::unexpected(document.error());
    const auto text = with_edits((*document)->text, back ? change.back : change.edits);
    if (!text) return tl::unexpected(text.error());
    if (back ? change.created : change.removed)
      on_disk.push_back({change.file, std::nullopt, text_of(folder_ / change.file)});
  }
  if (auto changed = change_disk(on_disk); !changed) return tl::unexpected(changed.error());
  std::vector<std::string> files;
  for (const FileChange& change : step.changes) {
    files.push_back(change.file);
    const TextEdits& edits = back ? change.back : change.edits;
    if (back ? change.removed : change.created) {
      std::string text = with_edits("", edits).value_or("");
      const auto [at, is_new] = documents_.try_emplace(change.file);
      if (is_new) at->second.saved = text;
      set_text(at->second, std::move(text));
    } else if (back ? change.created : change.removed) {
      documents_.erase(change.file);
    } else {
      Document& document = documents_[change.file];
      set_text(document, *with_edits(document.text, edits));
    }
  }
  journal_due_ = true;
  may_join_ = false;
  return files;
}

Result<std::vector<std::string>> Workspace::undo() {
  if (undo_.empty()) return fail("design.nothing-to-undo", "there is nothing to undo");
  auto files = revert(undo_.back(), true);
  if (!files) return files;
  redo_.push_back(std::move(undo_.back()));
  undo_.pop_back();
  return files;
}

Result<std::vector<std::string>> Workspace::redo() {
  if (redo_.empty()) return fail("design.nothing-to-undo", "there is nothing to do again");
  auto files = revert(redo_.back(), false);
  if (!files) return files;
  undo_.push_back(std::move(redo_.back()));
  redo_.pop_back();
  return files;
}

Result<void> Workspace::write(const std::string& file, const std::string& text) const {
  const auto place = place_of(file);
  if (!place) return tl::unexpected(place.error());
  std::error_code error;
  fs::create_directories(place->parent_path(), error);
  constexpr mode_t kNewFile = 0644;
  constexpr mode_t kPermissions = 07777;
  struct stat before {};
  const bool is_there = stat(place->c_str(), &before) == 0;
  const mode_t mode = is_there ? before.st_mode & kPermissions : kNewFile;
  // A file beside it could take its place all the same, against the will of who protected it.
  if (is_there && ((mode & (S_IWUSR | S_IWGRP | S_IWOTH)) == 0 || access(place->c_str(), W_OK) != 0))
    return fail("file.read-only",
                fmt::format("{} is read-only; what is edited is kept: make it writable (chmod u+w {}), and save again",
                            file, file),
                SourceSpan{file});
  const fs::path beside = place->parent_path() / fmt::format(".{}.part", place->filename().string());
  unlink(beside.c_str());  // what a machine that stopped has left
  const int descriptor = ::open(beside.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC | O_NOFOLLOW, mode);
  if (descriptor < 0) return unwritable(file);
  Temporary temporary(beside, descriptor);
  if (fchmod(descriptor, mode) != 0 || !temporary.write(text) || !temporary.finish(*place)) return unwritable(file);
  // The file is there; whether its name would survive a crash of the machine, a file system may not be able to say.
  (void)synchronise_folder(place->parent_path());
  return {};
}

Result<void> Workspace::save(const std::string& file) {
  const auto document = editable(file);
  if (!document) return tl::unexpected(document.error());
  if (!(*document)->is_dirty()) return {};
  const auto there = text_of(folder_ / file);
  if (there && *there != (*document)->saved) {
    refresh({file});
    return fail("design.conflict", file + " has changed on disk meanwhile; look at what came of it, and save again");
  }
  if (auto written = write(file, (*document)->text); !written) return written;
  (*document)->saved = (*document)->text;
  journal_due_ = true;
  return {};
}

// True: the document is not as it was. What it did to the text is added to `step`.
bool Workspace::take_from_disk(const std::string& file, Step& step) {
  const auto there = text_of(folder_ / file);
  const auto found = documents_.find(file);
  if (!there) {
    if (found == documents_.end()) return false;
    // What is not saved stays, and comes back by saving it.
    if (found->second.is_dirty()) {
      const bool news = !found->second.saved.empty() || found->second.theirs;
      found->second.saved.clear();
      found->second.theirs.reset();
      return news;
    }
    const std::string text = found->second.text;
    step.changes.push_back({file, {{0, text.size(), ""}}, {{0, 0, text}}, false, true});
    documents_.erase(found);
    return true;
  }
  if (found == documents_.end()) {
    // No step: to undo it would be to delete what somebody else has made.
    if (documents_.size() >= kFilesMax) return false;
    documents_[file].text = documents_[file].saved = *there;
    return true;
  }
  Document& document = found->second;
  if (*there == document.saved) {
    // Also where it was another text between: then nothing is to be chosen any more.
    const bool news = document.theirs.has_value();
    document.theirs.reset();
    return news;
  }
  if (*there == document.text) {
    document.saved = *there;
    document.theirs.reset();
    return true;
  }
  auto merged = merge(document.saved, document.text, *there);
  if (!merged || document.theirs) {
    document.theirs = *there;
    journal_due_ = true;
    return true;
  }
  document.saved = *there;
  if (*merged != document.text) {
    const TextEdits edits = edits_between(document.text, *merged);
    step.changes.push_back({file, edits, inverse(document.text, edits)});
    set_text(document, std::move(*merged));
  }
  return true;
}

std::vector<std::string> Workspace::refresh(const std::vector<std::string>& paths) {
  std::set<std::string> files;
  for (const std::string& path : paths) {
    if (documents_.contains(path) || is_project_text(path)) {
      files.insert(path);
      continue;
    }
    const fs::path below = path.empty() ? folder_ : folder_ / path;
    each_project_text(below, [&](const fs::path& file) { files.insert(inside(folder_, file)); });
    for (const auto& [file, document] : documents_) {
      if (path.empty() || file.starts_with(path + "/")) files.insert(file);
    }
  }
  Step step;
  std::erase_if(files, [&](const std::string& file) { return !place_of(file) || !take_from_disk(file, step); });
  take_step_from_disk(std::move(step));
  if (!files.empty()) journal_due_ = true;
  return {files.begin(), files.end()};
}

void Workspace::take_step_from_disk(Step step) {
  if (step.changes.empty()) return;
  step.name = name_from_disk(step.changes);
  did(std::move(step), false);
}

Result<void> Workspace::resolve(const std::string& file, const std::string& text) {
  const auto found = documents_.find(file);
  if (found == documents_.end()) return fail("design.no-such-file", file + " is no file of this project");
  Document& document = found->second;
  if (!document.theirs) return fail("design.bad-edit", file + " has no conflict");
  document.saved = std::move(*document.theirs);
  document.theirs.reset();
  journal_due_ = true;
  if (text == document.text) return {};
  const TextEdits edits = edits_between(document.text, text);
  Step step{"resolve " + file, {{file, edits, inverse(document.text, edits)}}};
  set_text(document, text);
  did(std::move(step), false);
  return {};
}

// ---- The journal ----

void Workspace::keep_journal() {
  if (!journal_due_) return;
  journal_due_ = false;
  List steps;
  List undone;
  std::map<std::string, bool> touched;
  for (const Step& step : undo_) {
    steps.push_back(to_value(step));
    for (const FileChange& change : step.changes) touched[change.file] = true;
  }
  for (const Step& step : redo_) {
    undone.push_back(to_value(step));
    for (const FileChange& change : step.changes) touched[change.file] = true;
  }
  Map files;
  for (const auto& [file, document] : documents_) {
    if (!touched.contains(file) && !document.is_dirty()) continue;
    Map kept{{"text", document.text}};
    if (document.is_dirty()) kept.append("saved", document.saved);
    files.append(file, std::move(kept));
  }
  const fs::path folder = folder_ / kJournalFolder;
  std::error_code error;
  fs::create_directory(folder, error);
  // The folder is nobody's business but this machine's.
  if (!fs::exists(folder / ".gitignore", error)) (void)text::write_file(folder / ".gitignore", "*\n");
  (void)text::write_file(folder / kJournal, to_json(Value(Map{{"form", kJournalForm},
                                                              {"files", std::move(files)},
                                                              {"undo", std::move(steps)},
                                                              {"redo", std::move(undone)}})));
}

void Workspace::read_journal() {
  const auto source = text::read_file(folder_ / kJournalFolder / kJournal);
  if (!source) return;
  const auto journal = text::parse_json(*source);
  if (!journal) return;
  const Value* form = journal->find("form");
  const Value* files = journal->find("files");
  if (form == nullptr || form->as_int() == nullptr || *form->as_int() != kJournalForm || files == nullptr ||
      files->as_map() == nullptr)
    return;
  for (const Value& step : list_of(*journal, "undo")) undo_.push_back(step_of(step));
  for (const Value& step : list_of(*journal, "redo")) redo_.push_back(step_of(step));
  // First as it was when the journal was written; what happened on disk since then comes as a step of its own.
  std::map<std::string, std::string> on_disk;
  for (const auto& [file, kept] : *files->as_map()) {
    if (!place_of(file)) continue;
    Document& document = documents_[file];
    document.text = string_of(kept, "text");
    document.saved = kept.find("saved") != nullptr ? string_of(kept, "saved") : document.text;
  }
  Step step;
  std::vector<std::string> known;
  for (const auto& [file, document] : documents_) known.push_back(file);
  for (const std::string& file : known) (void)take_from_disk(file, step);
  take_step_from_disk(std::move(step));
}

}  // namespace sentree::design
