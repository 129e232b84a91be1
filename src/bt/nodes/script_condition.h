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
    bool holds = false;
    if (n.data != kNone) {
      if (!m.run_condition(id, n.data, holds)) return Next::done(Status::kIdle);
      return Next::done(holds ? Status::kSuccess : Status::kFailure);
    }
    ScriptValue result;
    if (!run_code(m, n, id, result)) return Next::done(Status::kIdle);
    std::string error;
    if (!truth(result, holds, error)) return m.fail(id, "bt.script", "script \"" + *m.read_text(n, 0) + "\": " + error);
    return Next::done(holds ? Status::kSuccess : Status::kFailure);
  }
};

}  // namespace sentree::bt::nodes
