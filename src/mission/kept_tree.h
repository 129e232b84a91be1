#pragma once

#include <cstddef>
#include <cstdint>

#include "sentree/bt/kept_state.h"
#include "sentree/mission/tree.h"

namespace sentree::mission {

/// A state of the tree that is put aside, beside many that it differs little from (`bt::KeptState`): a step is one of a
/// leaf, of which there may be thousands. Never changes.
class KeptTree {
 public:
  /// @param like  Of the same tree; null: there is none.
  KeptTree(TreeState&& state, const KeptTree* like);

  /// The state that was put aside. Cost: a copy of it.
  [[nodiscard]] TreeState state() const;
  [[nodiscard]] bt::Status root() const { return rest_.root; }
  /// As `TreeState::Leaf::outstanding`.
  [[nodiscard]] std::uint64_t outstanding(std::size_t leaf) const { return rest_.outstanding(leaf); }
  /// About, what it takes beside the other one.
  [[nodiscard]] std::size_t bytes_beside(const KeptTree* like) const;

 private:
  bt::KeptState tree_;
  TreeState rest_;
};

}  // namespace sentree::mission
