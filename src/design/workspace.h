#pragma once

#include <cstdint>
#include <deque>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "sentree/base/result.h"
#include "sentree/design/text_edit.h"
#include "sentree/text/overlay.h"

namespace sentree::design {

/// Files of a project that are edited, and the size of one.
inline constexpr std::size_t kFilesMax = 2'000;
inline constexpr std::size_t kDocumentBytesMax = std::size_t{4} << 20U;
/// Steps that can be undone; older ones are forgotten.
inline constexpr std::size_t kStepsMax = 500;
inline constexpr std::size_t kStepsBytesMax = std::size_t{16} << 20U;
/// The journal. More is not written, which is told; steps take a part of it, texts that are not saved the rest.
inline constexpr std::size_t kJournalBytesMax = std::size_t{256} << 20U;
/// Earlier texts of a file that a late edit may still be based on.
inline constexpr std::size_t kVersionsMax = 32;
/// Folders inside each other that are looked into.
inline constexpr int kFoldersDeepMax = 16;

/// A file that is edited.
struct Document {
  std::string text;           ///< As edited.
  std::string saved;          ///< As it is on disk, as far as is known.
  std::uint64_t version = 1;  ///< Of `text`; grows with each change.
  /// What somebody else has written, where it cannot be joined with what is edited here: one of both must be chosen.
  std::optional<std::string> theirs;
  /// Why what is on disk by now cannot be edited ("it is no UTF-8"); empty: it can. `text` and `saved` are as before;
  /// it is written over only by `resolve`.
  std::string unreadable;
  std::string begin;        ///< Of a file in another encoding than UTF-8: its first bytes; it is saved in that again.
  bool due = true;          ///< The journal has it otherwise.
  bool saved_here = false;  ///< `saved` was written by the workspace, so its steps have it.
  std::deque<std::pair<std::uint64_t, std::string>> earlier;  ///< Versions before, newest last.

  [[nodiscard]] bool is_dirty() const { return text != saved; }
  /// As it was at a version; null: that is not kept any more, or never was.
  [[nodiscard]] const std::string* at(std::uint64_t of) const;
  /// One of what is edited and what is on disk must be chosen before it can be saved.
  [[nodiscard]] bool has_conflict() const { return theirs.has_value() || !unreadable.empty(); }
};

/// What one step did to one file.
struct FileChange {
  std::string file;
  TextEdits edits;
  TextEdits back;        ///< What undoes them.
  bool created = false;  ///< The file came with it; `edits` are of an empty text.
  bool removed = false;  ///< The file went with it; `back` is of an empty text.
  /// Hashes of the texts between which it lies; 0: not known.
  std::int64_t before = 0;
  std::int64_t after = 0;
  std::string begin;  ///< `Document::begin` of a file that came or went with it.
};

/// What is undone at once.
struct Step {
  std::string name;  ///< "move GoToKitchen under Recharge".
  std::vector<FileChange> changes;
  std::string by = {};  ///< Who did it, or undid it; empty: nobody in particular.

  [[nodiscard]] std::size_t bytes() const;
};

/// The texts of a project while they are edited, with one stack of undo over all files, from which each who edits takes
/// what is theirs. Texts are UTF-8; a byte order
/// mark, kinds of line ends, and whether the last line has one stay as they are.
///
/// What is edited waits for `save`. Files that come and go do so on disk at once. Where one goes, also by undoing or by
/// its new name, the others that have its name on disk and are edited are saved with it, all or nothing: else they
/// would name there what is not there any more. Undoing restores identical bytes. The stack and what is not saved are
/// kept in `.sentree/journal` of the folder, and found there again. One workspace at a time edits a folder, as long as
/// it lives or its process does; others follow what is on disk.
class Workspace {
 public:
  /// The texts of a folder: sentree.yaml, trees, charts, requirements, scenarios, worlds, interfaces. Left out are what
  /// is hidden, `runs`, links, and files that are no text or larger than `kDocumentBytesMax`.
  /// What changed on disk since the journal was written is one step more.
  /// Errors: file.not-found, design.too-many-files.
  [[nodiscard]] static Result<Workspace> open(const std::filesystem::path& folder);

  [[nodiscard]] const std::filesystem::path& folder() const { return folder_; }
  /// By path inside the folder, with '/'.
  [[nodiscard]] const std::map<std::string, Document>& documents() const { return documents_; }
  [[nodiscard]] const Document* find(std::string_view file) const;
  [[nodiscard]] const std::deque<Step>& undo_steps() const { return undo_; }
  [[nodiscard]] const std::vector<Step>& redo_steps() const { return redo_; }
  /// Texts that are not saved, by absolute path.
  [[nodiscard]] text::Overlay overlay() const;

  /// Edits a file. `base` is the version that the edits are of; from an earlier one they are joined with what happened
  /// since. `join`: part of the step before, if that did the same (`name`) to the same file and `base` is what it left,
  /// as while one types. Errors: design.no-such-file, design.bad-edit, design.not-text, design.too-large,
  /// design.conflict (both changed the same lines: nothing is changed), design.unresolved (a conflict with the file on
  /// disk waits).
  Result<void> edit(const std::string& file, std::uint64_t base, const TextEdits& edits, const std::string& name,
                    bool join = false);
  struct NewText {
    std::string file;
    std::string text;
  };
  /// Several files become `texts` in one step; those that are not there are made, on disk too: all of them or none.
  /// Errors: those of `edit`; design.outside (a path that leads out of the folder), design.there-already (on disk is
  /// something that is no text of the project), file.unwritable.
  Result<void> put(const std::vector<NewText>& texts, const std::string& name);
  /// Deletes a file, on disk too. The others that were saved with it. Errors: those of `save`.
  Result<std::vector<std::string>> remove(const std::string& file);
  /// Gives a file another name, on disk too, and others `texts`, in one step; a text for `file` is what it has under
  /// its new name. The others that were saved with it. Errors: those of `put` and `remove`.
  Result<std::vector<std::string>> rename(const std::string& file, const std::string& to,
                                          const std::vector<NewText>& texts);

  /// In whose name edits are from now on, and who is there. What one of these did last only they undo; what others did,
  /// who are not there, anybody.
  void acts(std::string who, std::set<std::string> present);
  /// What `who` can undo and do again: the name of the next, and how many.
  struct Own {
    std::string undo;
    std::size_t undo_count = 0;
    std::string redo;
    std::size_t redo_count = 0;
  };
  [[nodiscard]] Own own_steps(const std::string& who) const;

  /// Of a step that was undone, or done again.
  struct Reverted {
    std::vector<std::string> files;  ///< That it changed.
    /// That somebody else has changed so that the step is not of them: they stay as they are, in the folder too.
    std::vector<std::string> left;
    std::vector<std::string> saved;  ///< Because files went.
  };
  /// All of the step but what is `left`, or nothing where a file cannot be written. No file is deleted or written over
  /// whose bytes the steps do not have.
  /// The last that the one who acts may undo; what others did since stays.
  /// Errors: design.nothing-to-undo, design.unresolved, file.unwritable; design.covered: others have changed the same
  /// lines since; design.not-as-known: all of it is left, and the step is forgotten.
  Result<Reverted> undo();
  Result<Reverted> redo();

  /// Writes a text so that whoever reads, or a machine that stops, finds the old or the new one: beside the file, with
  /// its mode, synchronised, renamed. Errors: design.no-such-file, design.unresolved, design.conflict (it was changed
  /// on disk meanwhile, and is joined or waits to be resolved now), design.unreadable (what is there is no text, and
  /// stays), design.encoding (its XML declaration names one that it cannot be written in), file.unwritable,
  /// file.read-only.
  Result<void> save(const std::string& file);

  /// Looks at files, or at all of folders ("": the whole project), on disk: what is new there is joined with what is
  /// edited here, as one step ("mission.xml changed on disk"), or waits in `theirs`. The files that are not as they
  /// were.
  std::vector<std::string> refresh(const std::vector<std::string>& paths);
  /// Ends a conflict with this text; saving writes it over the file. Over what cannot be read, the text that is edited
  /// is written at once. Errors: design.held, design.no-such-file, design.bad-edit (there is no conflict, or another
  /// text over what cannot be read), design.conflict (it can be read again, and is joined or waits to be resolved now),
  /// design.outside (a link is in its place), design.encoding, file.unwritable (also: a folder is), file.read-only.
  Result<void> resolve(const std::string& file, const std::string& text);

  /// Writes what has changed since to the journal. Failing costs only what a restart would find.
  /// Cost: of the new steps and the whole texts of the files that they changed, twice if not saved; now and then of all
  /// that is kept.
  void keep_journal();
  /// Why the journal could not be written; empty: it was.
  [[nodiscard]] const std::string& journal_problem() const { return journal_problem_; }

  /// Who edits the folder in place of this workspace, whose edits are refused then (design.held); empty: this one does.
  [[nodiscard]] const std::string& held_by() const { return held_by_; }
  /// Error: design.held, while it is another.
  [[nodiscard]] Result<void> may_edit() const;
  /// True: the other has ended, and this one edits with what it has left.
  bool take_over();
  /// Where others are told to edit.
  void tell_address(const std::string& address);

 private:
  explicit Workspace(std::filesystem::path folder) : folder_(std::move(folder)) {}
  Result<Document*> editable(const std::string& file);
  void set_text(Document& document, std::string text);
  void did(Step step, bool join);
  /// A file that is made with `text`, or taken away, and what was there before.
  struct DiskChange {
    std::string file;
    std::optional<std::string> text;
    std::optional<std::string> before;
    std::string begin;  // of either
  };
  Result<void> change_disk(const std::vector<DiskChange>& changes) const;
  [[nodiscard]] DiskChange going(const std::string& file) const;
  Result<std::vector<std::string>> add_unsaved(const std::map<std::string, std::string>& texts,
                                               const std::vector<DiskChange>& going,
                                               std::vector<DiskChange>& changes) const;
  void was_written(const std::string& file);
  Result<void> may_go(const std::string& file);
  [[nodiscard]] Result<void> may_come(const std::string& file) const;
  void come(const std::string& file, const std::string& text, const std::string& begin);
  void rewrite(const NewText& text, Step& step);
  enum class Standing { kAsKnown, kDone, kOther };
  [[nodiscard]] Standing standing_of(const FileChange& change, bool back) const;
  Result<Reverted> revert(const Step& step, bool back);
  Result<Reverted> take_back(bool back);
  Result<void> lift(std::vector<Step>& row, bool back) const;
  [[nodiscard]] bool is_anothers(const Step& step, const std::string& who) const;
  [[nodiscard]] std::map<std::string, std::string> texts_of(const Step& step) const;
  void keep_redo(const Step& step);
  bool take_from_disk(const std::string& file, Step& step);
  void take_step_from_disk(Step step);
  Result<void> write(const std::string& file, const std::string& text, const std::string& begin) const;
  Result<std::filesystem::path> place_of(const std::string& file) const;
  void begin_journal();
  void make_journal_folder() const;
  [[nodiscard]] bool has_lock() const;
  bool take_lock();
  void read_journal();

  std::filesystem::path folder_;  // canonical
  std::map<std::string, Document> documents_;
  std::deque<Step> undo_;
  std::vector<Step> redo_;
  bool journal_due_ = false;
  /// What the journal has, so that only what is other is appended.
  struct Journaled {
    bool whole = true;        // it is to be written anew
    std::size_t dropped = 0;  // steps since that are forgotten
    std::size_t undo = 0;     // first steps of the stacks that it has
    std::size_t redo = 0;
    std::set<std::string> files;
    std::size_t size = 0;      // when it was written anew
    std::size_t appended = 0;  // since
  };
  Journaled journaled_;
  std::string journal_problem_;
  std::shared_ptr<const int> lock_;
  std::string address_;
  std::string held_by_;
  std::string who_;  ///< In whose name.
  std::set<std::string> present_;
  bool may_join_ = true;  ///< False: the last step was undone since, and what is typed now is another.
};

/// Calls `visit` for each text below `folder` that `Workspace::open` would take by its name, in no order. False: there
/// are more than `kFilesMax`, which have not been visited all.
bool each_project_text(const std::filesystem::path& folder,
                       const std::function<void(const std::filesystem::path&)>& visit);

/// Whether the files of that name are texts of a project.
[[nodiscard]] bool is_project_text(const std::filesystem::path& path);

}  // namespace sentree::design
