#include <fmt/format.h>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstddef>
#include <span>
#include <system_error>
#include <utility>

#include "sentree/base/json.h"
#include "sentree/base/lock_file.h"
#include "sentree/base/value.h"
#include "sentree/base/write_all.h"
#include "sentree/design/workspace.h"
#include "sentree/text/file.h"
#include "sentree/text/json.h"

// The journal: a line with all there is, then a line for each change since. A line that is not whole, as of a program
// that was killed, and what follows it are not there.

namespace sentree::design {

namespace {

namespace fs = std::filesystem;

constexpr const char* kJournalFolder = ".sentree";
constexpr const char* kJournal = "journal";
constexpr const char* kLock = "lock";
constexpr std::int64_t kJournalForm = 1;
// It is written anew once the changes are as long as all there is, and so long.
constexpr std::size_t kAppendedMin = std::size_t{1} << 20U;

Value to_value(const TextEdits& edits) {
  List list;
  for (const TextEdit& edit : edits)
    list.push_back(List{static_cast<std::int64_t>(edit.from), static_cast<std::int64_t>(edit.to), edit.text});
  return list;
}

// Bytes of any encoding.
std::string as_base64(const std::string& bytes) {
  std::string out;
  append_base64(out, std::as_bytes(std::span(bytes)));
  return out;
}

Value to_value(const Step& step) {
  List changes;
  for (const FileChange& change : step.changes) {
    Map value{{"file", change.file},       {"edits", to_value(change.edits)}, {"back", to_value(change.back)},
              {"created", change.created}, {"removed", change.removed},       {"before", change.before},
              {"after", change.after}};
    if (!change.begin.empty()) value.append("begin", as_base64(change.begin));
    changes.push_back(std::move(value));
  }
  Map value{{"name", step.name}, {"changes", std::move(changes)}};
  if (!step.by.empty()) value.append("by", step.by);
  return value;
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

std::string bytes_of(const Value& value, std::string_view name) {
  const auto bytes = decode_base64(string_of(value, name));
  std::string out;
  if (bytes) {
    for (const std::byte byte : *bytes) out += static_cast<char>(byte);
  }
  return out;
}

bool flag_of(const Value& value, std::string_view name) {
  const Value* found = value.find(name);
  return found != nullptr && found->as_bool() != nullptr && *found->as_bool();
}

std::int64_t number_of(const Value& value, std::string_view name) {
  const Value* found = value.find(name);
  return found != nullptr && found->as_int() != nullptr ? *found->as_int() : 0;
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
  Step step{string_of(value, "name"), {}, string_of(value, "by")};
  for (const Value& change : list_of(value, "changes")) {
    step.changes.push_back({string_of(change, "file"), edits_of(list_of(change, "edits")),
                            edits_of(list_of(change, "back")), flag_of(change, "created"), flag_of(change, "removed"),
                            number_of(change, "before"), number_of(change, "after"), bytes_of(change, "begin")});
  }
  return step;
}

// A descriptor that is closed with the last who has it.
std::shared_ptr<const int> owned(int descriptor) {
  return {new int(descriptor), [](const int* held) {
            close(*held);
            delete held;
          }};
}

std::string append_to(const fs::path& path, std::string_view line) {
  const int descriptor = ::open(path.c_str(), O_WRONLY | O_APPEND | O_CLOEXEC);
  if (descriptor < 0) return std::generic_category().message(errno);
  const auto held = owned(descriptor);
  return write_all(descriptor, line) ? std::string() : std::generic_category().message(errno);
}

template <typename Steps>
List steps_from(const Steps& steps, std::size_t from, std::set<std::string>& touched) {
  List list;
  for (std::size_t i = from; i < steps.size(); ++i) {
    list.push_back(to_value(steps[i]));
    for (const FileChange& change : steps[i].changes) touched.insert(change.file);
  }
  return list;
}

}  // namespace

std::size_t Step::bytes() const {
  std::size_t sum = name.size() + by.size();
  for (const FileChange& change : changes) {
    sum += change.file.size() + change.begin.size();
    for (const TextEdits* edits : {&change.edits, &change.back}) {
      for (const TextEdit& edit : *edits) sum += sizeof edit + edit.text.size();
    }
  }
  return sum;
}

// ---- Who edits ----

void Workspace::make_journal_folder() const {
  const fs::path folder = folder_ / kJournalFolder;
  std::error_code error;
  fs::create_directory(folder, error);
  // The folder is nobody's business but this machine's.
  if (!fs::exists(folder / ".gitignore", error)) (void)text::write_file(folder / ".gitignore", "*\n");
}

void Workspace::begin_journal() {
  make_journal_folder();
  if (take_lock()) read_journal();
  // Nothing is to be kept yet.
  journal_problem_.clear();
}

// False: another has it, or may have it. True without `lock_`: none can be made here, and no journal is to be written,
// as `journal_problem_` says.
bool Workspace::take_lock() {
  lock_.reset();
  held_by_.clear();
  LockFile lock = LockFile::take(folder_ / kJournalFolder / kLock);
  const auto why = [&] { return std::generic_category().message(lock.why()); };
  switch (lock.state()) {
    case LockFile::State::kHeld:
      lock_ = lock.descriptor();
      tell_address(address_);
      return true;
    case LockFile::State::kTaken: held_by_ = lock.other(); return false;
    case LockFile::State::kNoAccess: break;
  }
  constexpr std::array kNeverThere{EROFS, ENOENT, ENOTDIR, ENOLCK, EOPNOTSUPP};
  if (std::find(kNeverThere.begin(), kNeverThere.end(), lock.why()) == kNeverThere.end()) {
    held_by_ = fmt::format("somebody whose {}/{} cannot be opened ({})", kJournalFolder, kLock, why());
    return false;
  }
  journal_problem_ = "cannot be written: " + why();
  return true;
}

// It may have been removed, as by `git clean`, and made by another.
bool Workspace::has_lock() const {
  struct stat ours {
  }, there{};
  return lock_ && fstat(*lock_, &ours) == 0 && stat((folder_ / kJournalFolder / kLock).c_str(), &there) == 0 &&
         ours.st_dev == there.st_dev && ours.st_ino == there.st_ino;
}

void Workspace::tell_address(const std::string& address) {
  address_ = address;
  if (!lock_) return;
  tell_holder(*lock_, fmt::format("sentree studio (process {}{}{})", getpid(), address.empty() ? "" : ", ", address));
}

bool Workspace::take_over() {
  if (held_by_.empty() || !take_lock()) return false;
  // What was seen here without editing is no step of the other's.
  undo_.clear();
  redo_.clear();
  read_journal();
  return true;
}

// ---- Writing ----

void Workspace::keep_journal() {
  if (!journal_due_ || !held_by_.empty()) return;
  if (!has_lock()) {
    journaled_.whole = true;
    make_journal_folder();
    if (!take_lock()) {
      // What is edited here is not given up for that; it can still be saved.
      journal_problem_ = fmt::format("is {}'s by now", std::exchange(held_by_, {}));
    }
    if (!lock_) return;
  }
  const bool whole = journaled_.whole || journaled_.appended > std::max(kAppendedMin, journaled_.size);
  if (whole) journaled_ = {};
  std::set<std::string> touched;
  List undo = steps_from(undo_, journaled_.undo, touched);
  List redo = steps_from(redo_, journaled_.redo, touched);
  Map files;
  std::size_t bytes = 0;
  for (auto& [file, document] : documents_) {
    const bool is_in = journaled_.files.contains(file);
    const bool wanted = touched.contains(file) || document.is_dirty();
    if (!(is_in ? document.due : wanted)) continue;
    Map kept{{"text", document.text}};
    if (document.is_dirty()) kept.append("saved", document.saved);
    if (document.saved_here) kept.append("here", true);
    if (!document.begin.empty()) kept.append("begin", as_base64(document.begin));
    bytes += document.text.size() + (document.is_dirty() ? document.saved.size() : 0);
    files.append(file, std::move(kept));
    journaled_.files.insert(file);
    document.due = false;
  }
  for (auto at = journaled_.files.begin(); at != journaled_.files.end();) {
    if (documents_.contains(*at)) {
      ++at;
      continue;
    }
    files.append(*at, Value());
    at = journaled_.files.erase(at);
  }
  Map line{{"files", std::move(files)}, {"undo", std::move(undo)}, {"redo", std::move(redo)}};
  if (whole) {
    line.append("form", kJournalForm);
  } else {
    line.append("drop", static_cast<std::int64_t>(journaled_.dropped));
    line.append("undo_from", static_cast<std::int64_t>(journaled_.undo));
    line.append("redo_from", static_cast<std::int64_t>(journaled_.redo));
  }
  const bool is_too_large = bytes > kJournalBytesMax;
  const std::string written = is_too_large ? std::string() : to_json(Value(std::move(line))) + "\n";
  const fs::path path = folder_ / kJournalFolder / kJournal;
  if (is_too_large || written.size() + (whole ? 0 : journaled_.size + journaled_.appended) > kJournalBytesMax) {
    journal_problem_ = fmt::format("would be larger than {} bytes", kJournalBytesMax);
  } else if (whole) {
    const auto done = text::write_file(path, written);
    journal_problem_ = done ? std::string() : done.error().message;
  } else {
    const std::string why = append_to(path, written);
    journal_problem_ = why.empty() ? why : "cannot be written: " + why;
  }
  journaled_.whole = !journal_problem_.empty();
  journal_due_ = journaled_.whole;
  (whole ? journaled_.size : journaled_.appended) += written.size();
  journaled_.dropped = 0;
  journaled_.undo = undo_.size();
  journaled_.redo = redo_.size();
}

// ---- Reading ----

void Workspace::read_journal() {
  const auto source = text::read_file(folder_ / kJournalFolder / kJournal, {}, kJournalBytesMax);
  if (!source) return;
  std::map<std::string, Value> files;
  std::string_view left = *source;
  for (bool first = true; !left.empty(); first = false) {
    const std::size_t end = std::min(left.find('\n'), left.size());
    const auto line = text::parse_json(std::string(left.substr(0, end)));
    left.remove_prefix(std::min(end + 1, left.size()));
    const Value* changed = line ? line->find("files") : nullptr;
    if (changed == nullptr || changed->as_map() == nullptr || (first && number_of(*line, "form") != kJournalForm))
      break;
    const auto count = [&](std::string_view name) { return static_cast<std::size_t>(number_of(*line, name)); };
    if (!first) {
      if (count("drop") > undo_.size()) break;
      undo_.erase(undo_.begin(), undo_.begin() + static_cast<std::ptrdiff_t>(count("drop")));
      if (count("undo_from") > undo_.size() || count("redo_from") > redo_.size()) break;
      undo_.resize(count("undo_from"));
      redo_.resize(count("redo_from"));
    }
    for (const Value& step : list_of(*line, "undo")) undo_.push_back(step_of(step));
    for (const Value& step : list_of(*line, "redo")) redo_.push_back(step_of(step));
    for (const auto& [file, kept] : *changed->as_map()) {
      if (kept.is_null())
        files.erase(file);
      else
        files[file] = kept;
    }
  }
  // First as it was when the journal was written; what happened on disk since then comes as a step of its own.
  for (const auto& [file, kept] : files) {
    if (!place_of(file)) continue;
    const auto [at, is_new] = documents_.try_emplace(file);
    Document& document = at->second;
    // On disk it may be in another by now.
    if (is_new) document.begin = bytes_of(kept, "begin");
    if (std::string text = string_of(kept, "text"); text != document.text) set_text(document, std::move(text));
    document.saved = kept.find("saved") != nullptr ? string_of(kept, "saved") : document.text;
    document.saved_here = flag_of(kept, "here");
  }
  Step step;
  std::vector<std::string> known;
  for (const auto& [file, document] : documents_) known.push_back(file);
  for (const std::string& file : known) (void)take_from_disk(file, step);
  take_step_from_disk(std::move(step));
  journaled_ = {};
}

}  // namespace sentree::design
