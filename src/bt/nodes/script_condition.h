#pragma once

#include <string>

#include "sentree/bt/nodes/code.h"

namespace sentree::bt::nodes {

struct ScriptCondition : AnyNode {
  static may::Mask may_return(const may::Asked& /*asked*/) { return may::kSuccess | may::kFailure; }
  static Manifests manifests() {
    return {format4(leaf("ScriptCondition", Category::kCondition, {input<std::string>("code")}))};
  }

  static Next enter(Machine& m, const Node& n, NodeId id) {
    if (n.data == kNone) return enter_read(m, n, id);
    bool holds = false;
    if (!m.run_condition(id, n.data, holds)) return Next::done(Status::kIdle);
    return Next::done(holds ? Status::kSuccess : Status::kFailure);
  }
  [[gnu::noinline]] static Next enter_read(Machine& m, const Node& n, NodeId id) {
    ScriptValue result;
    if (!run_read_code(m, n, id, result)) return Next::done(Status::kIdle);
    bool holds = false;
    std::string error;
    if (!truth(result, holds, error)) return m.fail(id, "bt.script", "script \"" + *m.read_text(n, 0) + "\": " + error);
    return Next::done(holds ? Status::kSuccess : Status::kFailure);
  }
};

}  // namespace sentree::bt::nodes
