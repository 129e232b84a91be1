#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <utility>

#include "sentree/design/detail/disk.h"
#include "sentree/design/detail/step_order.h"
#include "sentree/design/workspace.h"

// What was done, what is undone, and by whom.

namespace sentree::design {

void Workspace::acts(std::string who, std::set<std::string> present) {
  who_ = std::move(who);
  present_ = std::move(present);
}

// Who is there undoes it, nobody else.
bool Workspace::is_anothers(const Step& step, const std::string& who) const {
  return !step.by.empty() && step.by != who && present_.contains(step.by);
}

Workspace::Own Workspace::own_steps(const std::string& who) const {
  const auto look = [&](const auto& steps, std::string& name, std::size_t& count) {
    for (const Step& step : steps) {
      if (is_anothers(step, who)) continue;
      name = step.name;
      ++count;
    }
  };
  Own own;
  look(undo_, own.undo, own.undo_count);
  look(redo_, own.redo, own.redo_count);
  return own;
}

// Those files of a step that are there, as they are.
FileTexts Workspace::texts_of(const Step& step) const {
  FileTexts texts;
  for (const FileChange& change : step.changes) {
    if (const auto found = documents_.find(change.file); found != documents_.end())
      texts[change.file] = found->second.text;
  }
  return texts;
}

// What could be done again, after a step that has been done since: what others can stays, as far as it is of other
// places.
void Workspace::keep_redo(const Step& step) {
  journaled_.redo = 0;
  std::vector<Step> row(redo_.rbegin(), redo_.rend());
  redo_.clear();
  for (std::size_t i = 0; i < row.size();) {
    if (is_anothers(row[i], step.by)) {
      ++i;
      continue;
    }
    FileTexts texts = texts_of(row[i]);
    bool known = step_over(step, true, texts);
    for (std::size_t k = 0; k < i; ++k) known = known && step_over(row[k], false, texts);
    // What lies behind it was of what it made.
    row.resize(known ? carry(row, i, row.size() - 1, std::move(texts)) : i);
  }
  if (row.empty()) return;
  std::vector<Step> undone;
  std::transform(row.rbegin(), row.rend(), std::back_inserter(undone), undoing);
  undone.push_back(step);
  FileTexts texts = texts_of(step);
  if (!step_over(step, true, texts)) return;
  const std::size_t at = carry(undone, undone.size() - 1, 0, std::move(texts));
  std::transform(undone.begin() + static_cast<std::ptrdiff_t>(at) + 1, undone.end(), std::back_inserter(redo_),
                 undoing);
}

void Workspace::did(Step step, bool join) {
  step.by = who_;
  keep_redo(step);
  journal_due_ = true;
  // Two changes of one file become one from what was before both to what is now.
  if (std::exchange(may_join_, true) && join && !undo_.empty() && undo_.back().name == step.name &&
      undo_.back().by == step.by && undo_.back().changes.size() == 1 && step.changes.size() == 1 &&
      undo_.back().changes.front().file == step.changes.front().file) {
    FileChange& last = undo_.back().changes.front();
    const std::string& now = documents_[last.file].text;
    const auto middle = with_edits(now, step.changes.front().back);
    const auto before = middle ? with_edits(*middle, last.back) : tl::unexpected(middle.error());
    if (before) {
      last.edits = edits_between(*before, now);
      last.back = inverse(*before, last.edits);
      last.after = step.changes.front().after;
      journaled_.undo = std::min(journaled_.undo, undo_.size() - 1);
      return;
    }
  }
  undo_.push_back(std::move(step));
  std::size_t bytes = 0;
  for (const Step& each : undo_) bytes += each.bytes();
  while (undo_.size() > kStepsMax || (bytes > kStepsBytesMax && undo_.size() > 1)) {
    bytes -= undo_.front().bytes();
    undo_.pop_front();
    if (journaled_.undo > 0) {
      --journaled_.undo;
      ++journaled_.dropped;
    }
  }
}

// How a file stands to what a step is about to do to it.
Workspace::Standing Workspace::standing_of(const FileChange& change, bool back) const {
  const auto found = documents_.find(change.file);
  const auto there = look_at(folder_ / change.file, kDocumentBytesMax);
  const std::int64_t from = back ? change.after : change.before;
  const auto is = [](std::int64_t hash, const std::string& text) { return hash == 0 || hash == hash_of(text); };
  if (back ? change.removed : change.created) {
    const std::string text = with_edits("", back ? change.back : change.edits).value_or("");
    if (found != documents_.end()) return found->second.text == text ? Standing::kDone : Standing::kOther;
    const bool may_come = there.problem.empty() && (!there.text || *there.text == text);
    return may_come && place_of(change.file) ? Standing::kAsKnown : Standing::kOther;
  }
  if (found == documents_.end()) return (back ? change.created : change.removed) ? Standing::kDone : Standing::kOther;
  const Document& document = found->second;
  if (!is(from, document.text)) return Standing::kOther;
  if (!(back ? change.created : change.removed))
    return with_edits(document.text, back ? change.back : change.edits) ? Standing::kAsKnown : Standing::kOther;
  const bool may_go = there.problem.empty() && (!there.text || *there.text == document.text ||
                                                (document.saved_here && *there.text == document.saved));
  return may_go ? Standing::kAsKnown : Standing::kOther;
}

Result<Workspace::Reverted> Workspace::revert(const Step& step, bool back) {
  Reverted reverted;
  std::vector<const FileChange*> doing;
  std::vector<DiskChange> on_disk;
  std::vector<DiskChange> gone;
  std::map<std::string, std::string> left;
  // Everything is tried before any text is changed.
  for (const FileChange& change : step.changes) {
    const auto found = documents_.find(change.file);
    if (found != documents_.end() && found->second.theirs) {
      const auto waits = editable(change.file);
      return tl::unexpected(waits.error());
    }
    switch (standing_of(change, back)) {
      case Standing::kDone: reverted.files.push_back(change.file); continue;
      case Standing::kOther: reverted.left.push_back(change.file); continue;
      case Standing::kAsKnown: doing.push_back(&change);
    }
    const TextEdits& edits = back ? change.back : change.edits;
    if (back ? change.removed : change.created)
      on_disk.push_back({change.file, with_edits("", edits).value_or(""), std::nullopt, change.begin});
    else if (back ? change.created : change.removed)
      gone.push_back(going(change.file));
    else
      left[change.file] = with_edits(found->second.text, edits).value_or("");
  }
  if (doing.empty() && reverted.files.empty()) return reverted;
  if (!gone.empty()) {
    auto saved = add_unsaved(left, gone, on_disk);
    if (!saved) return tl::unexpected(saved.error());
    reverted.saved = std::move(*saved);
  }
  if (auto changed = change_disk(on_disk); !changed) return tl::unexpected(changed.error());
  for (const FileChange* const change : doing) {
    reverted.files.push_back(change->file);
    const TextEdits& edits = back ? change->back : change->edits;
    if (back ? change->created : change->removed) {
      documents_.erase(change->file);
      continue;
    }
    const auto [at, is_new] = documents_.try_emplace(change->file);
    std::string text = with_edits(at->second.text, edits).value_or("");
    if (is_new) {
      at->second.saved = text;
      at->second.saved_here = true;
      at->second.begin = change->begin;
    }
    set_text(at->second, std::move(text));
  }
  for (const std::string& file : reverted.saved) {
    Document& document = documents_[file];
    document.saved = document.text;
    document.saved_here = document.due = true;
  }
  return reverted;
}

Result<Workspace::Reverted> Workspace::undo() { return take_back(true); }
Result<Workspace::Reverted> Workspace::redo() { return take_back(false); }

Result<Workspace::Reverted> Workspace::take_back(bool back) {
  if (auto may = may_edit(); !may) return tl::unexpected(may.error());
  // The one that is next on top.
  std::vector<Step> row;
  back ? row.assign(undo_.begin(), undo_.end()) : row.assign(redo_.begin(), redo_.end());
  const auto own = std::find_if(row.rbegin(), row.rend(), [&](const Step& step) { return !is_anothers(step, who_); });
  if (own == row.rend())
    return fail("design.nothing-to-undo", back ? "there is nothing to undo" : "there is nothing to do again");
  row.erase(row.begin(), std::prev(own.base()));
  const std::size_t kept = (back ? undo_.size() : redo_.size()) - row.size();
  if (auto lifted = lift(row, back); !lifted) return tl::unexpected(lifted.error());
  Step step = row.back();
  row.pop_back();
  auto reverted = revert(step, back);
  if (!reverted) return reverted;
  if (back) {
    undo_.resize(kept);
    undo_.insert(undo_.end(), row.begin(), row.end());
    journaled_.undo = std::min(journaled_.undo, kept);
  } else {
    redo_.resize(kept);
    redo_.insert(redo_.end(), row.begin(), row.end());
    journaled_.redo = std::min(journaled_.redo, kept);
  }
  journal_due_ = true;
  may_join_ = false;
  if (reverted->files.empty()) {
    // Else what lies behind it could never be reached.
    return fail("design.not-as-known",
                fmt::format("\"{}\" cannot be {}: {} is not as it was then, and stays as it is. The step is forgotten; "
                            "those behind it are not",
                            step.name, back ? "undone" : "done again", fmt::join(reverted->left, ", ")));
  }
  step.by = who_;
  if (back)
    redo_.push_back(std::move(step));
  else
    undo_.push_back(std::move(step));
  return reverted;
}

// Brings the first of these steps, next on top at the end, there, past those of others.
Result<void> Workspace::lift(std::vector<Step>& row, bool back) const {
  if (row.size() == 1) return {};
  // As they follow each other.
  if (!back) std::reverse(row.begin(), row.end());
  const std::size_t from = back ? 0 : row.size() - 1;
  const std::size_t to = back ? row.size() - 1 : 0;
  const std::string name = row[from].name;
  FileTexts texts = texts_of(row[from]);
  bool known = true;
  if (back) {
    for (std::size_t i = row.size(); i-- > 0;) known = known && step_over(row[i], true, texts);
  } else {
    for (std::size_t i = 0; i < from; ++i) known = known && step_over(row[i], false, texts);
  }
  const std::size_t at = known ? carry(row, from, to, std::move(texts)) : from;
  if (at != to) {
    return fail(
        "design.covered",
        fmt::format("\"{}\" cannot be {} here: \"{}\", which another page has {} since, changes the same place. "
                    "{} that there first, or edit the place",
                    name, back ? "undone" : "done again", row[back ? at + 1 : at - 1].name, back ? "done" : "undone",
                    back ? "Undo" : "Redo"));
  }
  if (!back) std::reverse(row.begin(), row.end());
  return {};
}

}  // namespace sentree::design
