#pragma once

#include <string>
#include <utility>

#include "sentree/bt/nodes/decorator.h"

namespace sentree::bt::nodes {

/// Format 3's BlackboardCheckInt, …Double, …String, …Bool: run the child if two values are equal.
struct BlackboardCheck : AnyNode {
  static constexpr bool kStaysRunning = false;
  static may::Mask may_return(const may::Asked& asked) { return asked.child() | asked.status(2); }
  template <class T>
  static BuiltIn of(std::string id) {
    return format3(
        decorator(std::move(id), {input<T>("value_A"), input<T>("value_B"), input<Status>("return_on_mismatch")}));
  }
  static Manifests manifests() {
    return {of<std::int32_t>("BlackboardCheckInt"), of<double>("BlackboardCheckDouble"),
            of<bool>("BlackboardCheckBool"), of<std::string>("BlackboardCheckString")};
  }
  static constexpr std::uint32_t kValueAPort = 0, kValueBPort = 1, kReturnPort = 2;

  static Next enter(Machine& m, const Node& n, NodeId id) {
    const Binding* a = m.binding(n, kValueAPort);
    const Binding* b = m.binding(n, kValueBPort);
    Datum x, y;
    const Datum* left = a != nullptr ? m.read(*a, a->type, x) : nullptr;
    const Datum* right = b != nullptr ? m.read(*b, b->type, y) : nullptr;
    if (left != nullptr && right != nullptr && left->value == right->value) {
      m.set_status(id, Status::kRunning);
      return Next::tick(0);
    }
    if (m.status(only_child(m, n)) == Status::kRunning) m.reset(only_child(m, n));
    const auto otherwise = m.read_status(n, kReturnPort);
    if (!otherwise) return m.fail(id, "bt.missing-port", "needs \"return_on_mismatch\" as a status");
    return Next::done(*otherwise);
  }
  static Next child_done(Machine& /*m*/, const Node& /*n*/, NodeId /*id*/, Status status) { return Next::done(status); }
};

}  // namespace sentree::bt::nodes
