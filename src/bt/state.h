#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "sentree/base/result.h"
#include "sentree/base/time.h"
#include "sentree/base/value.h"
#include "sentree/bt/object.h"
#include "sentree/bt/status.h"
#include "sentree/bt/types.h"

namespace sentree::bt {

class Tree;
class Machine;

/// Entries whose names no part of the tree mentions (SetBlackboard output_key="{key}", scripts from entries,
/// set_entry); one more is refused with bt.too-many-entries.
inline constexpr std::size_t kRuntimeEntriesMax = 10'000;
class Blackboard;

/// Everything that a tree remembers between steps: statuses, counters, blackboard, timers, a suspended tick.
///
/// A plain value. A copy goes on exactly as the original. It does not refer to its tree, and must only be used with
/// that tree (or one loaded from the same text with the same registry). Cost of a copy: O(nodes + entries).
class State {
 public:
  State() = default;
  /// All nodes idle; the blackboard holds the constants that SubTrees are given.
  explicit State(const Tree& tree);

  [[nodiscard]] Status status(NodeId node) const { return status_[node]; }
  [[nodiscard]] std::span<const Status> statuses() const { return status_; }

  /// The leaf whose answer the suspended tick waits for; kNoNode when no tick is suspended.
  [[nodiscard]] NodeId waiting_leaf() const { return waiting_; }
  /// External leaves that were told to halt and have not said that they did.
  [[nodiscard]] std::span<const NodeId> outstanding_halts() const { return halting_; }
  /// When the next timer of a Delay, Timeout or Sleep is due; kNever if none runs.
  [[nodiscard]] TimePoint next_timer() const;
  /// The node whose timer that is; the root if there is none.
  [[nodiscard]] NodeId next_to_ring() const;

  /// Equal states of one tree behave alike from here on.
  friend bool operator==(const State& a, const State& b);
  /// Equal states hash alike. O(nodes + entries).
  [[nodiscard]] std::uint64_t hash() const;

 private:
  friend void restore_blackboard(State& state, const State& backup);
  friend class Machine;
  friend class Blackboard;
  friend class KeptState;
  friend struct Snapshot;

  static constexpr std::uint32_t kNoEntry = 0xFFFFFFFFU;

  /// What a name of the blackboard is linked to. Entries are shared by remapping and outlive an Unset elsewhere.
  struct Entry {
    Datum datum;
    const PortType* type = nullptr;  ///< Locked by the first strongly typed use; null: any.
    std::uint64_t sequence = 0;      ///< Counts writes.
    TimePoint stamp{};               ///< Of the last write.
    std::uint32_t links = 0;         ///< Cells linked to it; 0: free.
    bool operator==(const Entry&) const = default;
  };
  /// A name that no part of the tree mentions, created at run time.
  struct DynamicCell {
    std::uint32_t scope;
    std::string name;
    std::uint32_t parent;  ///< Cell of the parent's blackboard it is remapped to, or kNoEntry.
    std::uint32_t link;
    bool operator==(const DynamicCell&) const = default;
  };
  struct Timer {
    TimePoint due;
    NodeId node;
    bool operator==(const Timer&) const = default;
  };

  std::vector<Status> status_;
  std::vector<std::int32_t> memory_;
  std::vector<std::uint32_t> links_;  ///< Per cell of the model: index of an entry, or kNoEntry.
  std::vector<Entry> entries_;
  std::vector<DynamicCell> dynamic_;
  std::vector<ObjectSlot> objects_;  ///< What C++ nodes remember.
  std::vector<Timer> timers_;
  std::vector<NodeId> halting_;
  NodeId waiting_ = kNoNode;
};

/// The state as bytes, for `restore`. Versioned and checked; the same state gives the same bytes.
/// Error: bt.unsavable names the node or entry whose C++ type has no saved form.
[[nodiscard]] Result<std::string> save(const Tree& tree, const State& state);

/// The state that was saved with this tree. Errors: bt.bad-snapshot (not one of ours, damaged, of another tree).
[[nodiscard]] Result<State> restore(const Tree& tree, std::string_view bytes);

/// One entry of the blackboard as seen from outside.
struct EntryFact {
  std::string scope;  ///< `scope_path` of the SubTree that owns it; empty for the root's.
  std::string name;
  const Value* value;  ///< Null value if it was declared and never written, or holds a C++ object.
  std::string_view type;
  std::uint64_t sequence;
  TimePoint stamp;
};

/// What the blackboard of a SubTree is called: its path, and where others have that path too, one with numbers in the
/// place of names that nobody has given, as BehaviorTree.CPP writes them: "Mission::10".
[[nodiscard]] std::string scope_path(const Tree& tree, NodeId subtree);
/// The SubTree whose blackboard is called so, or whose path that is; kNoNode: none.
[[nodiscard]] NodeId find_scope(const Tree& tree, std::string_view path);
/// All entries, each once, under its owner; in the order of the scopes, then of first mention.
[[nodiscard]] std::vector<EntryFact> blackboard(const Tree& tree, const State& state);
/// The value of an entry by name, as the root tree or the given SubTree sees it; null if there is none or it is empty.
[[nodiscard]] const Value* entry(const Tree& tree, const State& state, std::string_view name, NodeId subtree = kNoNode);
/// Writes an entry from outside, as an untyped port would. Errors: bt.entry-type, bt.too-many-entries.
[[nodiscard]] Result<void> set_entry(const Tree& tree, State& state, std::string_view name, Value value, TimePoint now,
                                     NodeId subtree = kNoNode);

namespace detail {
Result<void> set_datum(const Tree& tree, State& state, std::string_view name, Datum datum, const PortType& type,
                       TimePoint now, NodeId subtree);
/// Converted to `wanted`, in `scratch` where it is of another type.
[[nodiscard]] Result<const Datum*> datum_as(const Tree& tree, const State& state, std::string_view name,
                                            const PortType& wanted, NodeId subtree, Datum& scratch);
}  // namespace detail

/// Writes an entry from outside as a port of that type would: what nodes are given that no file can hold
/// (`set_entry_as<std::shared_ptr<Robot>>`). Ports of that type, or of one that it can be cast to, take it. Errors:
/// bt.entry-type, bt.too-many-entries.
template <class T>
[[nodiscard]] Result<void> set_entry_as(const Tree& tree, State& state, std::string_view name, const T& value,
                                        TimePoint now, NodeId subtree = kNoNode) {
  if constexpr (Convertible<T>) {
    return detail::set_datum(tree, state, name, Datum{Convert<T>::to_value(value), nullptr}, type_of<T>(), now,
                             subtree);
  } else {
    return detail::set_datum(tree, state, name, Datum{Value(), std::make_shared<Boxed<T>>(value)}, type_of<T>(), now,
                             subtree);
  }
}

/// An entry as a port of that type reads it. Errors: bt.no-entry, bt.empty-entry, bt.conversion.
template <class T>
[[nodiscard]] Result<T> entry_as(const Tree& tree, const State& state, std::string_view name,
                                 NodeId subtree = kNoNode) {
  Datum scratch;
  const auto datum = detail::datum_as(tree, state, name, type_of<T>(), subtree, scratch);
  if (!datum) return tl::unexpected(datum.error());
  if constexpr (Convertible<T>) {
    if (auto value = Convert<T>::from_value((*datum)->value)) return std::move(*value);
  } else {
    if (const auto* boxed = dynamic_cast<const Boxed<T>*>((*datum)->object.get())) return boxed->content();
  }
  return fail("bt.conversion", "entry \"" + std::string(name) + "\" is no " + type_of<T>().name);
}

/// All entries as a map of maps: by the `scope_path` of the SubTree that owns them ("" for the main tree's), then by
/// name. C++ objects and entries without a value are left out. `to_json` makes a file of it.
[[nodiscard]] Value export_blackboard(const Tree& tree, const State& state);
/// Writes entries in that form, all or none. Errors: bt.bad-blackboard (not of that form, no such SubTree),
/// bt.entry-type, bt.too-many-entries.
[[nodiscard]] Result<void> import_blackboard(const Tree& tree, State& state, const Value& blackboard, TimePoint now);

/// Gives `state` the entries of `backup`, a copy made earlier, and leaves everything else: what runs goes on.
void restore_blackboard(State& state, const State& backup);

}  // namespace sentree::bt
