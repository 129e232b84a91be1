#pragma once

#include "sentree/base/assert.h"
#include "sentree/bt/nodes/all.h"

namespace sentree::bt::nodes {

/// `use.operator()<T>()` for the node T of a kind.
template <class Use>
[[gnu::always_inline]] inline auto of_kind(Kind kind, const Use& use) {
  switch (kind) {
#define SENTREE_BT_NODE(name) \
  case Kind::k##name: return use.template operator()<name>();
    SENTREE_BT_NODES(SENTREE_BT_NODE)
#undef SENTREE_BT_NODE
  }
  SENTREE_ASSERT(false && "a kind is in the list");
  return use.template operator()<Unknown>();
}

/// `use.operator()<T>(kind)` for each.
template <class Use>
void each(const Use& use) {
#define SENTREE_BT_NODE(name) use.template operator()<name>(Kind::k##name);
  SENTREE_BT_NODES(SENTREE_BT_NODE)
#undef SENTREE_BT_NODE
}

}  // namespace sentree::bt::nodes
