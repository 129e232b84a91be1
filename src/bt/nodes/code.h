#pragma once

#include <string>

#include "sentree/bt/nodes/node.h"

namespace sentree::bt::nodes {

/// A script's text that comes from an entry is compiled when it runs. False: the tick is given up.
[[gnu::noinline]] inline bool run_read_code(Machine& m, const Node& n, NodeId id, ScriptValue& result) {
  const auto text = m.read_text(n, 0);
  if (!text) {
    m.fail(id, "bt.missing-port", "needs \"code\"");
    return false;
  }
  return m.run_text(id, *text, result);
}

}  // namespace sentree::bt::nodes
