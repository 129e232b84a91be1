#include "sentree/bt/graph.h"

#include <algorithm>

#include "sentree/bt/model.h"

namespace sentree::bt {

namespace {

draw::TreeShape shape(Category category) {
  switch (category) {
    case Category::kControl: return draw::TreeShape::kControl;
    case Category::kDecorator: return draw::TreeShape::kDecorator;
    case Category::kCondition: return draw::TreeShape::kCondition;
    case Category::kAction: return draw::TreeShape::kAction;
    case Category::kSubTree: return draw::TreeShape::kSubtree;
  }
  return draw::TreeShape::kAction;
}

/// The literature's signs; an R marks the memoryless ones, a star the one that remembers.
std::string symbol(Kind kind, std::string_view id) {
  const std::string sequence(draw::kSequenceSymbol);
  const std::string fallback(draw::kFallbackSymbol);
  switch (kind) {
    case Kind::kSequence: return sequence;
    case Kind::kFallback: return fallback;
    case Kind::kReactiveSequence: return "R" + sequence;
    case Kind::kReactiveFallback: return "R" + fallback;
    case Kind::kAsyncSequence: return "A" + sequence;
    case Kind::kAsyncFallback: return "A" + fallback;
    case Kind::kSequenceWithMemory: return sequence + "*";
    case Kind::kParallel:
    case Kind::kParallelAll: return std::string(draw::kParallelSymbol);
    default: return std::string(id);
  }
}

draw::TreeStatus status_of(Status status) {
  switch (status) {
    case Status::kIdle: return draw::TreeStatus::kIdle;
    case Status::kRunning: return draw::TreeStatus::kRunning;
    case Status::kSuccess: return draw::TreeStatus::kSuccess;
    case Status::kFailure: return draw::TreeStatus::kFailure;
    case Status::kSkipped: return draw::TreeStatus::kSkipped;
  }
  return draw::TreeStatus::kIdle;
}

}  // namespace

draw::Tree to_graph(const Tree& tree, const State* state, const GraphOptions& options) {
  draw::Tree graph;
  graph.nodes.reserve(tree.size());
  for (NodeId id = 0; id < tree.size(); ++id) {
    draw::TreeNode node;
    node.parent = tree.parent(id) == kNoNode ? -1 : static_cast<int>(tree.parent(id));
    const Category category = tree.category(id);
    const std::string_view registration = tree.registration(id);
    const std::string_view name = tree.name(id);
    node.shape = shape(category);
    if (category == Category::kControl || category == Category::kDecorator) {
      node.symbol = symbol(tree.model().nodes[id].kind, registration);
      if (name != registration) node.title = name;
    } else {
      node.title = name;
      if (name != registration && category != Category::kSubTree) node.lines.emplace_back(registration);
    }
    if (options.ports) {
      for (const PortFact& port : tree.ports(id)) {
        node.lines.push_back(std::string(port.name) + (port.output && !port.input ? " → " : ": ") +
                             std::string(port.text));
      }
    }
    if (options.conditions) {
      for (const auto& [attribute, script] : tree.conditions(id)) {
        node.lines.push_back(std::string(attribute) + ": " + std::string(script));
      }
    }
    if (state != nullptr) {
      const auto halting = state->outstanding_halts();
      node.status = std::find(halting.begin(), halting.end(), id) != halting.end() ? draw::TreeStatus::kHalting
                                                                                   : status_of(state->status(id));
    }
    graph.nodes.push_back(std::move(node));
  }
  return graph;
}

}  // namespace sentree::bt
