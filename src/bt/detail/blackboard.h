#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "sentree/base/time.h"
#include "sentree/bt/model.h"
#include "sentree/bt/object.h"
#include "sentree/bt/state.h"

namespace sentree::bt {

/// The entries of a state, by the rules of BehaviorTree.CPP: a name of a SubTree's blackboard is linked to an entry of
/// its own or, where it is remapped, to the parent's, at the first use.
///
/// Cells beyond the model's are names made at run time. Refers to model and state; for the files of this library.
class Blackboard {
 public:
  using Entry = State::Entry;

  Blackboard(const Model& model, State& state, TimePoint now)
      : model_(model),
        state_(state),
        links_(state.links_.data()),
        cells_(static_cast<std::uint32_t>(state.links_.size())),
        now_(now) {}

  /// The entry, or null. Links the cell to a parent's entry where there is one.
  Entry* find(std::uint32_t cell) {
    const std::uint32_t link = link_of(cell);
    return link != State::kNoEntry ? &state_.entries_[link] : find_slow(cell);
  }
  /// The entry of one of the model's cells if that is linked already, as it is from the second use on.
  [[gnu::always_inline]] Entry* find_linked(std::uint32_t cell) {
    const std::uint32_t link = links_[cell];
    if (link == State::kNoEntry) return nullptr;
    Entry* const entry = &state_.entries_[link];
    if (entry == nullptr) __builtin_unreachable();  // Callers compare with null what is a link of none.
    return entry;
  }
  /// The entry, made where it does not exist. Null, with `error` set, where it exists with another strong type.
  Entry* create(std::uint32_t cell, const PortType* type, std::string& error);
  /// Writes as a typed port does. False, with `error` set, where the entry has another type.
  bool set(std::uint32_t cell, Datum&& datum, const PortType* type, std::string& error);
  /// Writes a copy of another entry's value, which is of that type. False, with `error` set, where the entry has
  /// another one.
  bool put(std::uint32_t cell, Datum&& datum, const PortType* type, std::string& error);
  /// Forgets the name in this blackboard; other names linked to the entry keep it.
  void unset(std::uint32_t cell);
  [[nodiscard]] TimePoint now() const { return now_; }
  /// Counts and stamps a write made through the pointer.
  void written(Entry& entry) {
    ++entry.sequence;
    entry.stamp = now_;
  }
  /// The cell of a name as one scope sees it; makes one if nobody mentions the name. kNone beyond kRuntimeEntriesMax.
  std::uint32_t cell(std::uint32_t scope, std::string_view name);
  /// What to say then.
  [[nodiscard]] static std::string too_many(std::string_view name);
  /// The same without making one: kNone.
  [[nodiscard]] std::uint32_t find_cell(std::uint32_t scope, std::string_view name) const;
  [[nodiscard]] std::string_view name(std::uint32_t cell) const;
  /// The entry that `find` would give, without linking anything: its index, or State::kNoEntry.
  [[nodiscard]] static std::uint32_t resolve(const Model& model, const State& state, std::uint32_t cell);
  /// What a name holds, without linking anything; null if there is no entry.
  [[nodiscard]] static const Datum* peek_datum(const Model& model, const State& state, std::uint32_t scope,
                                               std::string_view name);
  /// The value of a name without linking anything; null if there is none.
  [[nodiscard]] static const Value* peek(const Model& model, const State& state, std::uint32_t scope,
                                         std::string_view name);
  /// The name has been linked to an entry, in this blackboard itself.
  [[nodiscard]] static bool is_linked(const State& state, std::uint32_t cell) {
    return state.links_[cell] != State::kNoEntry;
  }
  /// All entries for listing (see `blackboard`).
  [[nodiscard]] static std::vector<EntryFact> list(const Tree& tree, const State& state);

 private:
  [[nodiscard, gnu::always_inline]] std::uint32_t link_of(std::uint32_t cell) const {
    return cell < cells_ ? links_[cell] : state_.dynamic_[cell - cells_].link;
  }
  [[nodiscard]] std::uint32_t parent_of(std::uint32_t cell) const {
    return cell < cells_ ? model_.cells[cell].parent : state_.dynamic_[cell - cells_].parent;
  }
  /// The entry lives in this very blackboard. In format 3, one that has been used here counts as such.
  [[nodiscard]] bool is_own(std::uint32_t cell) const {
    return model_.format == 3 || parent_of(cell) == kNone || (cell < cells_ && model_.cells[cell].home != kNone);
  }
  /// Format 4 looks through the remapping each time; what it finds is always the same where nothing is ever unset.
  [[nodiscard]] bool keeps_links() const { return model_.format == 3 || !model_.unsets; }
  void link(std::uint32_t cell, std::uint32_t entry);
  Entry* find_slow(std::uint32_t cell);
  /// A free place for an entry of that cell: its home where that is free, so that equal contents give equal states.
  std::uint32_t allocate(std::uint32_t cell);

  const Model& model_;
  State& state_;
  std::uint32_t* links_;  ///< State::links_, which no step resizes.
  std::uint32_t cells_;
  TimePoint now_;
};

/// Numbers are converted to the kind that `into` holds, if nothing is lost; an empty one takes anything. False
/// otherwise.
[[nodiscard]] bool copy_into(const Datum& from, Datum& into);

}  // namespace sentree::bt
