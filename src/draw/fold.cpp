#include "sentree/draw/fold.h"

#include <algorithm>

namespace sentree::draw {

FoldedChart folded(const Chart& chart, const std::vector<bool>& closed) {
  FoldedChart result;
  result.chart.title = chart.title;
  // The outermost closed state around each, or itself; a parent comes before what is in it.
  std::vector<int> shown(chart.states.size());
  std::vector<int> place(chart.states.size(), -1);
  for (std::size_t i = 0; i < chart.states.size(); ++i) {
    const int parent = chart.states[i].parent;
    const auto above = static_cast<std::size_t>(parent);
    const bool hidden = parent >= 0 && (closed[above] || shown[above] != parent);
    shown[i] = hidden ? shown[above] : static_cast<int>(i);
    if (hidden) {
      if (chart.states[i].kind != StateKind::kInitial)
        ++result.hidden[static_cast<std::size_t>(place[static_cast<std::size_t>(shown[i])])];
      continue;
    }
    place[i] = static_cast<int>(result.chart.states.size());
    ChartState state = chart.states[i];
    if (parent >= 0) state.parent = place[above];
    result.chart.states.push_back(std::move(state));
    result.states.push_back(static_cast<int>(i));
    result.hidden.push_back(0);
  }
  for (std::size_t i = 0; i < chart.transitions.size(); ++i) {
    ChartTransition transition = chart.transitions[i];
    const int source = shown[static_cast<std::size_t>(transition.source)];
    const bool inside = source != transition.source;
    std::vector<int> targets;
    for (const int target : transition.targets) {
      const int to = shown[static_cast<std::size_t>(target)];
      if (inside && to == source) continue;
      const int at = place[static_cast<std::size_t>(to)];
      if (std::find(targets.begin(), targets.end(), at) == targets.end()) targets.push_back(at);
    }
    if (inside && targets.empty()) continue;
    transition.source = place[static_cast<std::size_t>(source)];
    transition.targets = std::move(targets);
    result.chart.transitions.push_back(std::move(transition));
    result.transitions.push_back(static_cast<int>(i));
  }
  return result;
}

Map to_value(const FoldedChart& folded) {
  const auto numbers = [](const std::vector<int>& from) {
    List values;
    for (const int one : from) values.emplace_back(static_cast<std::int64_t>(one));
    return values;
  };
  return {{"layout", to_value(folded.chart, layout(folded.chart))},
          {"states", numbers(folded.states)},
          {"transitions", numbers(folded.transitions)},
          {"hidden", numbers(folded.hidden)}};
}

}  // namespace sentree::draw
