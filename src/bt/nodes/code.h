#pragma once

#include <string>

#include "sentree/bt/nodes/node.h"

namespace sentree::bt::nodes {

/// A script's text may come from an entry; then it is compiled when it runs.
inline bool run_code(Machine& m, const Node& n, NodeId id, ScriptValue& result) {
  if (n.data != kNone) return m.run(id, n.data, result);
  const auto text = m.read_text(n, 0);
  if (!text) {
    m.fail(id, "bt.missing-port", "needs \"code\"");
    return false;
  }
  return m.run_text(id, *text, result);
}

}  // namespace sentree::bt::nodes
