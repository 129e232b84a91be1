#pragma once

#include <array>
#include <map>
#include <string_view>
#include <utility>
#include <vector>

#include "sentree/bt/script_needs.h"
#include "sentree/bt/tree.h"

namespace sentree::bt {

/// What a tree takes the entries of its blackboards for: its scripts, pre- and post-conditions, and ports with a type,
/// in all SubTrees that an entry is given to. Scripts that assign or compare two entries, and SetBlackboard, make them
/// of one kind. A name in a script that nothing writes counts as that of an enum, which is a number.
class EntryUses {
 public:
  /// For each kind of use, a node that uses the entry so; kNoNode for none.
  using Users = std::array<NodeId, kWantedKinds>;
  [[nodiscard]] static constexpr Users unused() {
    Users none{};
    none.fill(kNoNode);
    return none;
  }

  /// Cost: O(nodes + scripts).
  explicit EntryUses(const Tree& tree);

  /// Of the entry that the port names; none for a port with a literal.
  [[nodiscard]] Users of(NodeId node, std::string_view port) const;

 private:
  const Tree& tree_;
  std::vector<std::uint32_t> group_;      // by cell, of entries of one kind
  std::map<std::uint32_t, Users> users_;  // by group
};

}  // namespace sentree::bt
