#include "sentree/graph/tree.h"

#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <string_view>
namespace sentree::graph {

namespace {

draw::TreeShape shape(bt::Category category) {
  switch (category) {
    case bt::Category::kControl: return draw::TreeShape::kControl;
    case bt::Category::kDecorator: return draw::TreeShape::kDecorator;
    case bt::Category::kCondition: return draw::TreeShape::kCondition;
    case bt::Category::kAction: return draw::TreeShape::kAction;
    case bt::Category::kSubTree: return draw::TreeShape::kSubtree;
  }
  return draw::TreeShape::kAction;
}

draw::TreeStatus status_of(bt::Status status) {
  switch (status) {
    case bt::Status::kIdle: return draw::TreeStatus::kIdle;
    case bt::Status::kRunning: return draw::TreeStatus::kRunning;
    case bt::Status::kSuccess: return draw::TreeStatus::kSuccess;
    case bt::Status::kFailure: return draw::TreeStatus::kFailure;
    case bt::Status::kSkipped: return draw::TreeStatus::kSkipped;
  }
  return draw::TreeStatus::kIdle;
}

}  // namespace

std::string symbol_of(std::string_view id) {
  std::string sequence(draw::kSequenceSymbol);
  std::string fallback(draw::kFallbackSymbol);
  if (id == "Sequence") return sequence;
  if (id == "Fallback") return fallback;
  if (id == "ReactiveSequence") return "R" + sequence;
  if (id == "ReactiveFallback") return "R" + fallback;
  if (id == "AsyncSequence") return "A" + sequence;
  if (id == "AsyncFallback") return "A" + fallback;
  if (id == "SequenceWithMemory" || id == "SequenceStar") return sequence + "*";
  if (id == "Parallel" || id == "ParallelAll") return std::string(draw::kParallelSymbol);
  return std::string(id);
}

draw::Tree drawing_of(const bt::Tree& tree, const bt::State* state, const TreeOptions& options) {
  draw::Tree graph;
  graph.nodes.reserve(tree.size());
  for (bt::NodeId id = 0; id < tree.size(); ++id) {
    draw::TreeNode node;
    node.parent = tree.parent(id) == bt::kNoNode ? -1 : static_cast<int>(tree.parent(id));
    const bt::Category category = tree.category(id);
    const std::string_view registration = tree.registration(id);
    const std::string_view name = tree.name(id);
    node.shape = shape(category);
    if (category == bt::Category::kControl || category == bt::Category::kDecorator) {
      node.symbol = symbol_of(registration);
      if (name != registration) node.title = name;
      if (tree.is_unknown(id)) node.lines.emplace_back("of unknown kind");
    } else if (category == bt::Category::kSubTree) {
      // Without a name of its own it is called "SubTree", which says nothing.
      node.title = name != registration ? name : tree.subtree_id(id);
      if (tree.is_unknown(id)) node.lines.emplace_back("not here");
    } else {
      node.title = name;
      if (name != registration) node.lines.emplace_back(registration);
    }
    if (options.ports) {
      for (const bt::PortFact& port : tree.ports(id)) {
        node.lines.push_back(std::string(port.name) + (port.output && !port.input ? " → " : ": ") +
                             std::string(port.text));
      }
    }
    if (options.conditions) {
      for (const auto& [attribute, script] : tree.conditions(id)) {
        node.lines.push_back(fmt::format("{}: {}", attribute, script));
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

draw::Tree drawing_of(const std::vector<bt::NodeModel>& models) {
  draw::Tree graph;
  const std::size_t count = bt::node_count(models);
  draw::TreeNode root;
  root.shape = draw::TreeShape::kControl;
  root.symbol = fmt::format("palette of {} {}", count, count == 1 ? "node" : "nodes");
  graph.nodes.push_back(std::move(root));
  for (const bt::NodeModel& model : models) {
    if (model.category == bt::Category::kSubTree) continue;
    draw::TreeNode node;
    node.parent = 0;
    node.shape = shape(model.category);
    const bool has_symbol = model.category == bt::Category::kControl || model.category == bt::Category::kDecorator;
    (has_symbol ? node.symbol : node.title) = model.id;
    for (const bt::PortInfo& port : model.ports) {
      const std::string arrow = port.direction == bt::PortDirection::kOutput  ? " →"
                                : port.direction == bt::PortDirection::kInOut ? " ↔"
                                                                              : "";
      const std::string value = port.default_text ? ": " + *port.default_text : "";
      node.lines.push_back(port.name + arrow + value);
    }
    graph.nodes.push_back(std::move(node));
  }
  return graph;
}

}  // namespace sentree::graph
