#include "sentree/design/workspace.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <iterator>
#include <set>
#include <system_error>
#include <utility>

#include "sentree/base/shown.h"
#include "sentree/design/detail/disk.h"
#include "sentree/design/detail/soundness.h"
#include "sentree/design/detail/step_order.h"
#include "sentree/text/encoding.h"
#include "sentree/text/xml.h"

namespace sentree::design {

namespace {

namespace fs = std::filesystem;

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

FileChange change_of(const std::string& file, const std::string& before, const TextEdits& edits,
                     const std::string& after) {
  return {file, edits, inverse(before, edits), false, false, hash_of(before), hash_of(after), {}};
}

// Paths, and what is called after its file, have the file's name without its ending.
bool has_word(std::string_view text, const std::string& word) {
  const auto is_letter = [](char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_'; };
  for (std::size_t at = text.find(word); at != std::string_view::npos; at = text.find(word, at + 1)) {
    const std::size_t end = at + word.size();
    if ((at == 0 || !is_letter(text[at - 1])) && (end == text.size() || !is_letter(text[end]))) return true;
  }
  return false;
}

FileChange removal_of(const std::string& file, const std::string& text, const std::string& begin) {
  return {file, {{0, text.size(), ""}}, {{0, 0, text}}, false, true, hash_of(text), 0, begin};
}

FileChange creation_of(const std::string& file, const std::string& text, const std::string& begin) {
  return {file, {{0, 0, text}}, {{0, text.size(), ""}}, true, false, 0, hash_of(text), begin};
}

tl::unexpected<Diagnostic> unreadable(const std::string& file, const std::string& problem) {
  return fail(
      "design.unreadable",
      fmt::format("{} on disk cannot be read: {}; nothing is written over it. Mend it there, or choose to write "
                  "what is edited here over it",
                  file, problem),
      SourceSpan{file});
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
    if (auto there = look_at(path, kDocumentBytesMax); there.text) {
      Document& document = workspace.documents_[inside(canonical, path)];
      document.text = document.saved = std::move(*there.text);
      document.begin = std::move(there.begin);
    }
  });
  if (!all)
    return fail("design.too-many-files", fmt::format("more than {} files; open a smaller folder", kFilesMax),
                SourceSpan{folder.string()});
  workspace.begin_journal();
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

const std::string* Document::at(std::uint64_t of) const {
  if (of == version) return &text;
  const auto found = std::find_if(earlier.begin(), earlier.end(), [&](const auto& one) { return one.first == of; });
  return found != earlier.end() ? &found->second : nullptr;
}

Result<void> Workspace::may_edit() const {
  if (held_by_.empty()) return {};
  return fail("design.held", fmt::format("{} edits this project; here it is only shown. Edit it there, or end that "
                                         "program: the next edit here then takes over what it has left",
                                         held_by_));
}

Result<Document*> Workspace::editable(const std::string& file) {
  if (auto may = may_edit(); !may) return tl::unexpected(may.error());
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
  document.due = journal_due_ = true;
}

Result<void> Workspace::edit(const std::string& file, std::uint64_t base, const TextEdits& edits,
                             const std::string& name, bool join) {
  const auto document = editable(file);
  if (!document) return tl::unexpected(document.error());
  const std::string& now = (*document)->text;
  const std::string* const from = (*document)->at(base);
  if (from == nullptr) return fail("design.conflict", file + " has changed too much since; look at it again");
  const bool is_of_newest = base == (*document)->version;
  auto edited = with_edits(*from, edits);
  if (!edited) return tl::unexpected(edited.error());
  TextEdits made = edits;
  if (from != &now) {
    auto merged = merged_soundly(file, *from, now, *edited);
    if (!merged)
      return fail(
          "design.conflict",
          fmt::format("the same lines of {} have been changed meanwhile, or both together could not be read", file));
    edited = std::move(*merged);
    made = edits_between(now, *edited);
  }
  if (edited->size() > kDocumentBytesMax)
    return fail("design.too-large", fmt::format("{} would be larger than {} bytes", file, kDocumentBytesMax));
  const auto bad = text::first_unreadable(*edited);
  if (bad && static_cast<unsigned char>((*edited)[bad->first]) >= 0x80U)
    return fail("design.not-text", "that is no UTF-8");
  if (*edited == now) return {};
  Step step{name, {change_of(file, now, made, *edited)}};
  set_text(**document, std::move(*edited));
  // What another did meanwhile lies between.
  did(std::move(step), join && is_of_newest);
  return {};
}

Result<fs::path> Workspace::place_of(const std::string& file) const {
  const fs::path relative(file);
  const auto outside = [&](const char* why = "leads out of the project's folder") {
    return fail("design.outside", fmt::format("\"{}\" {}", file, why));
  };
  if (std::any_of(file.begin(), file.end(), [](unsigned char c) { return std::iscntrl(c) != 0; }))
    return fail("design.bad-name", fmt::format("{} has a control character, which no name of a file may have",
                                               "\"" + sentree::shown(file) + "\""));
  if (relative.empty() || relative.is_absolute() || !is_project_text(relative)) return outside();
  fs::path at = folder_;
  for (const fs::path& part : relative) {
    if (part == ".." || part == "." || part.empty() || is_passed_over(part)) return outside();
    at /= part;
    std::error_code error;
    if (fs::is_symlink(fs::symlink_status(at, error)))
      return outside("is a link, or in a folder that is one; such files are not edited here");
  }
  return at;
}

Result<void> Workspace::put(const std::vector<NewText>& texts, const std::string& name) {
  if (auto may = may_edit(); !may) return may;
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
    if (find(text.file) != nullptr) continue;
    if (auto may = may_come(text.file); !may) return may;
    on_disk.push_back({text.file, text.text, std::nullopt, {}});
  }
  if (auto changed = change_disk(on_disk); !changed) return changed;
  for (const NewText& text : texts) {
    if (find(text.file) != nullptr) {
      rewrite(text, step);
      continue;
    }
    come(text.file, text.text, {});
    step.changes.push_back(creation_of(text.file, text.text, {}));
  }
  if (!step.changes.empty()) did(std::move(step), false);
  return {};
}

// What is on disk is what was saved, so that the file may go.
Result<void> Workspace::may_go(const std::string& file) {
  const auto document = editable(file);
  if (!document) return tl::unexpected(document.error());
  const auto there = look_at(folder_ / file, kDocumentBytesMax);
  if (!there.problem.empty()) return unreadable(file, there.problem);
  if (there.text && *there.text != (*document)->saved) {
    refresh({file});
    return fail("design.conflict", file + " has changed on disk meanwhile; look at what came of it, and try again");
  }
  return {};
}

Result<void> Workspace::may_come(const std::string& file) const {
  if (const auto place = place_of(file); !place) return tl::unexpected(place.error());
  const auto there = look_at(folder_ / file, kDocumentBytesMax);
  if (!there.text && there.problem.empty()) return {};
  return fail("design.there-already", fmt::format("{} is there already on disk{}{}; choose another name", file,
                                                  there.problem.empty() ? "" : ", but ", there.problem));
}

// A file that goes, with what is there now.
Workspace::DiskChange Workspace::going(const std::string& file) const {
  return {file, std::nullopt, look_at(folder_ / file, kDocumentBytesMax).text, documents_.at(file).begin};
}

Result<std::vector<std::string>> Workspace::remove(const std::string& file) {
  if (auto may = may_go(file); !may) return tl::unexpected(may.error());
  const Document& document = documents_[file];
  const FileChange removal = removal_of(file, document.text, document.begin);
  std::vector<DiskChange> on_disk;
  auto saved = add_unsaved({}, {going(file)}, on_disk);
  if (!saved) return saved;
  if (auto changed = change_disk(on_disk); !changed) return tl::unexpected(changed.error());
  documents_.erase(file);
  did({"delete " + file, {removal}}, false);
  for (const std::string& other : *saved) was_written(other);
  return saved;
}

Result<std::vector<std::string>> Workspace::rename(const std::string& file, const std::string& to,
                                                   const std::vector<NewText>& texts) {
  if (auto may = may_go(file); !may) return tl::unexpected(may.error());
  if (find(to) != nullptr)
    return fail("design.there-already", fmt::format("{} is there already; choose another name", to));
  if (auto may = may_come(to); !may) return tl::unexpected(may.error());
  std::map<std::string, std::string> left{{file, documents_[file].text}};
  for (const NewText& other : texts) {
    if (const auto document = editable(other.file); !document) return tl::unexpected(document.error());
    left[other.file] = other.text;
  }
  const std::string& text = left[file];
  const Document before = documents_[file];
  // First what is named, then who names it, last what is named no more.
  std::vector<DiskChange> on_disk{{to, text, std::nullopt, before.begin}};
  auto saved = add_unsaved(left, {going(file)}, on_disk);
  if (!saved) return saved;
  if (auto changed = change_disk(on_disk); !changed) return tl::unexpected(changed.error());
  Step step{fmt::format("rename {} to {}", file, to), {removal_of(file, before.text, before.begin)}};
  step.changes.push_back(creation_of(to, text, before.begin));
  documents_.erase(file);
  come(to, text, before.begin);
  for (const NewText& other : texts) {
    if (other.file != file) rewrite(other, step);
  }
  did(std::move(step), false);
  for (const std::string& other : *saved) was_written(other);
  return saved;
}

// A file that has been made on disk.
void Workspace::come(const std::string& file, const std::string& text, const std::string& begin) {
  Document& document = documents_[file];
  document.saved = text;
  set_text(document, text);
  document.saved_here = true;
  document.begin = begin;
}

void Workspace::rewrite(const NewText& text, Step& step) {
  Document& document = documents_[text.file];
  if (document.text == text.text) return;
  const TextEdits edits = edits_between(document.text, text.text);
  step.changes.push_back(change_of(text.file, document.text, edits, text.text));
  set_text(document, text.text);
}

// Makes files and takes files away, all of them or none.
Result<void> Workspace::change_disk(const std::vector<DiskChange>& changes) const {
  std::size_t done = 0;
  auto result = [&]() -> Result<void> {
    for (const DiskChange& change : changes) {
      if (change.text) {
        if (auto written = write(change.file, *change.text, change.begin); !written) return written;
      } else if (auto gone = take_away(folder_ / change.file, change.file); !gone) {
        return gone;
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
      (void)write(change.file, *change.before, change.begin);
    else
      (void)take_away(folder_ / change.file, change.file);
  }
  return result;
}

// Before files go: others that have their names on disk, with `texts` in place of what they have now; then the files
// that go. The others.
Result<std::vector<std::string>> Workspace::add_unsaved(const std::map<std::string, std::string>& texts,
                                                        const std::vector<DiskChange>& going,
                                                        std::vector<DiskChange>& changes) const {
  std::vector<std::string> files;
  for (const auto& known : documents_) {
    const std::string& file = known.first;
    const Document& document = known.second;
    const auto given = texts.find(file);
    const std::string& text = given != texts.end() ? given->second : document.text;
    const auto goes = [&](const DiskChange& gone) { return gone.file == file; };
    const auto is_named = [&](const DiskChange& gone) { return has_word(document.saved, fs::path(gone.file).stem()); };
    if (text == document.saved || std::any_of(going.begin(), going.end(), goes) ||
        std::none_of(going.begin(), going.end(), is_named) || (document.has_conflict() && given == texts.end()))
      continue;
    const auto there = look_at(folder_ / file, kDocumentBytesMax);
    if (!there.problem.empty()) return unreadable(file, there.problem);
    if (there.text && *there.text != document.saved)
      return fail("design.conflict", file + " has changed on disk meanwhile; look at what came of it, and try again");
    changes.push_back({file, text, there.text, document.begin});
    files.push_back(file);
  }
  changes.insert(changes.end(), going.begin(), going.end());
  return files;
}

Result<void> Workspace::write(const std::string& file, const std::string& text, const std::string& begin) const {
  const auto place = place_of(file);
  if (!place) return tl::unexpected(place.error());
  auto encoded = text::xml_encoded_as(begin, text);
  if (const auto declared = encoded ? std::nullopt : text::xml_declared_otherwise(text)) {
    encoded = text::xml_as_declared(text);
    const bool is_ascii = std::all_of(text.begin(), text.end(), [](char c) { return (c & 0x80) == 0; });
    if (!encoded && !is_ascii)
      return fail("design.encoding",
                  fmt::format("{} says encoding=\"{}\", in which this text cannot be written; write "
                              "encoding=\"UTF-8\" there, and save again",
                              file, *declared),
                  SourceSpan{file});
  }
  return write_safely(*place, file, encoded ? *encoded : text);
}

Result<void> Workspace::save(const std::string& file) {
  const auto document = editable(file);
  if (!document) return tl::unexpected(document.error());
  if (!(*document)->is_dirty()) return {};
  const auto there = look_at(folder_ / file, kDocumentBytesMax);
  if (!there.problem.empty()) {
    refresh({file});
    return unreadable(file, there.problem);
  }
  if (there.text && *there.text != (*document)->saved) {
    refresh({file});
    return fail("design.conflict", file + " has changed on disk meanwhile; look at what came of it, and save again");
  }
  if (auto written = write(file, (*document)->text, (*document)->begin); !written) return written;
  was_written(file);
  return {};
}

// What a document has is on disk now.
void Workspace::was_written(const std::string& file) {
  Document& document = documents_[file];
  document.saved = document.text;
  document.due = journal_due_ = true;
  if (text::xml_declared_otherwise(document.saved)) {
    // It is shown in UTF-8 from now on, as any file in that encoding.
    Step step{"show " + file + " in UTF-8", {}};
    if (take_from_disk(file, step) && !step.changes.empty()) did(std::move(step), false);
    if (find(file) == nullptr) return;
  }
  document.saved_here = true;
}

// True: the document is not as it was. What it did to the text is added to `step`.
bool Workspace::take_from_disk(const std::string& file, Step& step) {
  const auto [there, begin, problem] = look_at(folder_ / file, kDocumentBytesMax);
  const auto found = documents_.find(file);
  if (!problem.empty()) {
    // What is edited stays, and so does what is there.
    if (found == documents_.end() || found->second.unreadable == problem) return false;
    found->second.unreadable = problem;
    found->second.theirs.reset();
    return true;
  }
  const bool was_unreadable = found != documents_.end() && !std::exchange(found->second.unreadable, {}).empty();
  if (!there) {
    if (found == documents_.end()) return false;
    // What is not saved stays, and comes back by saving it.
    if (found->second.is_dirty()) {
      const bool news = was_unreadable || !found->second.saved.empty() || found->second.theirs;
      found->second.saved.clear();
      found->second.due = true;
      found->second.theirs.reset();
      return news;
    }
    step.changes.push_back(removal_of(file, found->second.text, found->second.begin));
    documents_.erase(found);
    return true;
  }
  if (found == documents_.end()) {
    // No step: to undo it would be to delete what somebody else has made.
    if (documents_.size() >= kFilesMax) return false;
    documents_[file].text = documents_[file].saved = *there;
    documents_[file].begin = begin;
    return true;
  }
  Document& document = found->second;
  if (*there == document.saved) {
    // Also where it was another text between: then nothing is to be chosen any more.
    const bool news = was_unreadable || document.theirs.has_value();
    document.theirs.reset();
    return news;
  }
  document.saved_here = false;
  document.begin = begin;
  document.due = true;
  if (*there == document.text) {
    document.saved = *there;
    document.theirs.reset();
    return true;
  }
  auto merged = merged_soundly(file, document.saved, document.text, *there);
  if (!merged || document.theirs) {
    document.theirs = *there;
    journal_due_ = true;
    return true;
  }
  document.saved = *there;
  if (*merged != document.text) {
    const TextEdits edits = edits_between(document.text, *merged);
    step.changes.push_back(change_of(file, document.text, edits, *merged));
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
  std::erase_if(files, [&](const std::string& file) {
    return (!place_of(file) && !documents_.contains(file)) || !take_from_disk(file, step);
  });
  take_step_from_disk(std::move(step));
  if (!files.empty()) journal_due_ = true;
  return {files.begin(), files.end()};
}

void Workspace::take_step_from_disk(Step step) {
  if (step.changes.empty()) return;
  step.name = name_from_disk(step.changes);
  const std::string who = std::exchange(who_, {});
  did(std::move(step), false);
  who_ = who;
}

Result<void> Workspace::resolve(const std::string& file, const std::string& text) {
  if (auto may = may_edit(); !may) return may;
  const auto found = documents_.find(file);
  if (found == documents_.end()) return fail("design.no-such-file", file + " is no file of this project");
  Document& document = found->second;
  if (!document.unreadable.empty()) {
    if (text != document.text)
      return fail("design.bad-edit", file + " on disk cannot be read; only what is edited here can be kept");
    if (look_at(folder_ / file, kDocumentBytesMax).text) {
      refresh({file});
      return fail("design.conflict",
                  file + " can be read on disk again; look at what came of it, and say again what is to be kept");
    }
    if (auto written = write(file, text, document.begin); !written) return written;
    document.unreadable.clear();
    document.saved = text;
    document.saved_here = true;
    document.due = journal_due_ = true;
    return {};
  }
  if (!document.theirs) return fail("design.bad-edit", file + " has no conflict");
  document.saved = std::move(*document.theirs);
  document.theirs.reset();
  document.due = journal_due_ = true;
  if (text == document.text) return {};
  const TextEdits edits = edits_between(document.text, text);
  Step step{"resolve " + file, {change_of(file, document.text, edits, text)}};
  set_text(document, text);
  did(std::move(step), false);
  return {};
}

}  // namespace sentree::design
