#include "sentree/mission/kept_tree.h"

#include <utility>

namespace sentree::mission {

KeptTree::KeptTree(TreeState&& state, const KeptTree* like)
    : tree_(std::exchange(state.tree, {}), like != nullptr ? &like->tree_ : nullptr),
      leaves_(std::exchange(state.leaves, {}), like != nullptr ? &like->leaves_ : nullptr),
      rest_(std::move(state)) {}

TreeState KeptTree::state() const {
  TreeState state = rest_;
  state.tree = tree_.state();
  state.leaves = leaves_.whole();
  return state;
}

std::size_t KeptTree::bytes_beside(const KeptTree* like) const {
  return sizeof(*this) + tree_.bytes_beside(like != nullptr ? &like->tree_ : nullptr) +
         leaves_.bytes_beside(like != nullptr ? &like->leaves_ : nullptr);
}

}  // namespace sentree::mission
