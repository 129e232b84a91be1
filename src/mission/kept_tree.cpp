#include "sentree/mission/kept_tree.h"

#include <utility>

namespace sentree::mission {

KeptTree::KeptTree(TreeState&& state, const KeptTree* like)
    : tree_(std::exchange(state.tree, {}), like != nullptr ? &like->tree_ : nullptr), rest_(std::move(state)) {}

TreeState KeptTree::state() const {
  TreeState state = rest_;
  state.tree = tree_.state();
  return state;
}

std::size_t KeptTree::bytes_beside(const KeptTree* like) const {
  return sizeof(*this) + tree_.bytes_beside(like != nullptr ? &like->tree_ : nullptr) +
         rest_.leaves.size() * (sizeof(*rest_.leaves.begin()) + 48);
}

}  // namespace sentree::mission
