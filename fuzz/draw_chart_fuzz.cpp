// Draws the chart and the tree that the bytes describe: any structure that keeps the models' rules must come out.

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>

#include "sentree/draw/chart.h"
#include "sentree/draw/tree.h"

namespace {

class Bytes {
 public:
  Bytes(const std::uint8_t* data, std::size_t size) : data_(data), size_(size) {}
  [[nodiscard]] bool empty() const { return size_ == 0; }
  int number(int bound) {
    if (size_ == 0 || bound <= 0) return 0;
    --size_;
    return *data_++ % bound;
  }
  std::string text() {
    const std::size_t length = std::min<std::size_t>(static_cast<std::size_t>(number(48)), size_);
    std::string text(reinterpret_cast<const char*>(data_), length);
    data_ += length;
    size_ -= length;
    return text;
  }

 private:
  const std::uint8_t* data_;
  std::size_t size_;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace sentree::draw;
  constexpr int kStatesMax = 60;
  Bytes bytes(data, size);
  Chart chart;
  Tree tree;
  chart.title = tree.title = bytes.text();
  for (int n = 1 + bytes.number(kStatesMax), i = 0; i < n; ++i) {
    ChartState state;
    state.parent = bytes.number(i + 1) - 1;
    state.kind = static_cast<StateKind>(bytes.number(6));
    state.active = bytes.number(2) == 1;
    state.name = bytes.text();
    TreeNode node;
    node.parent = state.parent;
    node.shape = static_cast<TreeShape>(bytes.number(5));
    node.status = static_cast<TreeStatus>(bytes.number(6));
    node.title = node.symbol = state.name;
    node.lines = {state.name};
    chart.states.push_back(std::move(state));
    tree.nodes.push_back(std::move(node));
  }
  const int states = static_cast<int>(chart.states.size());
  while (!bytes.empty()) {
    ChartTransition transition;
    transition.source = bytes.number(states);
    for (int n = bytes.number(3); n > 0; --n) transition.targets.push_back(bytes.number(states));
    transition.event = bytes.text();
    transition.condition = bytes.text();
    chart.transitions.push_back(std::move(transition));
  }
  for (const std::string& text : {to_svg(chart), to_dot(chart), to_mermaid(chart), to_plantuml(chart), to_svg(tree),
                                  to_dot(tree), to_mermaid(tree)}) {
    if (text.empty()) return 1;
  }
  return 0;
}
