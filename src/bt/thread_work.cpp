#include "sentree/bt/thread_work.h"

#include "sentree/bt/detail/machine.h"
#include "sentree/bt/registry.h"

namespace sentree::bt {

namespace {

const ThreadWork* thread_work_of(const UserNode& node) { return dynamic_cast<const ThreadWork*>(node.behaviour); }

}  // namespace

std::vector<NodeId> nodes_in_threads(const Tree& tree) {
  const Model& model = tree.model();
  std::vector<NodeId> found;
  for (NodeId id = 0; id < model.nodes.size(); ++id) {
    if (model.nodes[id].kind != Kind::kUser) continue;
    const ThreadWork* const work = thread_work_of(model.users[model.nodes[id].data]);
    if (work != nullptr && work->works_in_threads()) found.push_back(id);
  }
  return found;
}

NodeId wait_for_threads(const Tree& tree, State& state, std::span<const NodeId> nodes,
                        std::chrono::steady_clock::time_point until) {
  Effects effects;
  Machine machine(tree, state, TimePoint{}, effects);
  for (const NodeId id : nodes) {
    if (machine.status(id) != Status::kRunning) continue;
    const UserNode& user = machine.user(machine.node(id));
    const NodeMemory* const memory = user.object != kNone ? machine.object(user.object) : nullptr;
    if (memory != nullptr && !thread_work_of(user)->wait(*memory, until)) return id;
  }
  return kNoNode;
}

}  // namespace sentree::bt
