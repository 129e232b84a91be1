#include <algorithm>
#include <cmath>
#include <cstddef>

#include "sentree/base/assert.h"
#include "sentree/draw/detail/layered.h"

namespace sentree::draw {
namespace {

struct Arc {
  int from;
  int to;
};

bool is_border(Pin pin) { return pin == Pin::kTop || pin == Pin::kBottom; }

// Which edges point upwards, so that the rest has no cycle: those that lead back to a node of the present path of a
// depth-first search. The search starts where nothing leads to, then in index order.
std::vector<Arc> break_cycles(const std::vector<LayeredNode>& nodes, const std::vector<LayeredEdge>& edges) {
  const std::size_t count = nodes.size();
  std::vector<Arc> arcs;
  std::vector<std::vector<int>> leaving(count);  // arc indices
  std::vector<int> entering(count, 0);
  for (const LayeredEdge& edge : edges) {
    SENTREE_ASSERT(edge.from != edge.to);
    const Pin from = nodes[static_cast<std::size_t>(edge.from)].pin;
    const Pin to = nodes[static_cast<std::size_t>(edge.to)].pin;
    const bool up = to == Pin::kTop || from == Pin::kBottom;
    arcs.push_back(up ? Arc{edge.to, edge.from} : Arc{edge.from, edge.to});
    // Edges at the border have their direction already.
    if (is_border(from) || is_border(to)) continue;
    leaving[static_cast<std::size_t>(edge.from)].push_back(static_cast<int>(arcs.size()) - 1);
    ++entering[static_cast<std::size_t>(edge.to)];
  }

  enum class Mark : char { kNew, kOpen, kDone };
  std::vector<Mark> marks(count, Mark::kNew);
  std::vector<int> starts;
  for (const bool sources : {true, false}) {
    for (std::size_t i = 0; i < count; ++i) {
      if ((entering[i] == 0) == sources) starts.push_back(static_cast<int>(i));
    }
  }
  struct Frame {
    int node;
    std::size_t next;
  };
  std::vector<Frame> path;
  for (const int start : starts) {
    if (marks[static_cast<std::size_t>(start)] != Mark::kNew) continue;
    path.push_back({start, 0});
    marks[static_cast<std::size_t>(start)] = Mark::kOpen;
    while (!path.empty()) {
      Frame& frame = path.back();
      const auto& out = leaving[static_cast<std::size_t>(frame.node)];
      if (frame.next == out.size()) {
        marks[static_cast<std::size_t>(frame.node)] = Mark::kDone;
        path.pop_back();
        continue;
      }
      Arc& arc = arcs[static_cast<std::size_t>(out[frame.next++])];
      const int target = arc.to;
      Mark& mark = marks[static_cast<std::size_t>(target)];
      if (mark == Mark::kOpen) {
        std::swap(arc.from, arc.to);
      } else if (mark == Mark::kNew) {
        mark = Mark::kOpen;
        path.push_back({target, 0});
      }
    }
  }
  return arcs;
}

}  // namespace

std::vector<int> assign_rows(const std::vector<LayeredNode>& nodes, const std::vector<LayeredEdge>& edges) {
  const std::size_t count = nodes.size();
  const std::vector<Arc> arcs = break_cycles(nodes, edges);
  std::vector<std::vector<int>> below(count);
  std::vector<int> waiting(count, 0);
  std::vector<bool> loose(count, true);
  for (const Arc& arc : arcs) {
    below[static_cast<std::size_t>(arc.from)].push_back(arc.to);
    ++waiting[static_cast<std::size_t>(arc.to)];
    loose[static_cast<std::size_t>(arc.from)] = loose[static_cast<std::size_t>(arc.to)] = false;
  }

  // Longest path from above; points on the upper border have a row of their own.
  const bool border_row = std::any_of(nodes.begin(), nodes.end(),
                                      [](const LayeredNode& n) { return n.pin == Pin::kTop || n.pin == Pin::kCorner; });
  std::vector<int> rows(count, 0);
  std::vector<int> order;
  for (std::size_t i = 0; i < count; ++i) {
    if (border_row && (nodes[i].pin == Pin::kNone || nodes[i].pin == Pin::kBottom)) rows[i] = 1;
    if (waiting[i] == 0) order.push_back(static_cast<int>(i));
  }
  for (std::size_t k = 0; k < order.size(); ++k) {
    const int node = order[k];
    for (const int next : below[static_cast<std::size_t>(node)]) {
      const auto n = static_cast<std::size_t>(next);
      rows[n] = std::max(rows[n], rows[static_cast<std::size_t>(node)] + 1);
      if (--waiting[n] == 0) order.push_back(next);
    }
  }
  SENTREE_ASSERT(order.size() == count);

  // What nothing leads to stands right above what it leads to: the dot above the initial state.
  std::vector<bool> has_above(count, false);
  for (const Arc& arc : arcs) has_above[static_cast<std::size_t>(arc.to)] = true;
  for (std::size_t i = 0; i < count; ++i) {
    if (has_above[i] || below[i].empty() || nodes[i].pin != Pin::kNone) continue;
    int nearest = rows[static_cast<std::size_t>(below[i][0])];
    for (const int next : below[i]) nearest = std::min(nearest, rows[static_cast<std::size_t>(next)]);
    rows[i] = std::max(rows[i], nearest - 1);
  }

  // Nodes without edges form a square block rather than one wide row.
  std::vector<std::size_t> loners;
  for (std::size_t i = 0; i < count; ++i) {
    if (loose[i] && nodes[i].pin == Pin::kNone) loners.push_back(i);
  }
  constexpr std::size_t kLonersInRow = 4;
  if (loners.size() > kLonersInRow) {
    const auto columns = static_cast<std::size_t>(std::ceil(std::sqrt(static_cast<double>(loners.size()))));
    for (std::size_t k = 0; k < loners.size(); ++k) rows[loners[k]] += static_cast<int>(k / columns);
  }

  int last = 0;
  for (std::size_t i = 0; i < count; ++i) {
    if (nodes[i].pin != Pin::kBottom) last = std::max(last, rows[i]);
  }
  for (std::size_t i = 0; i < count; ++i) {
    if (nodes[i].pin == Pin::kBottom) rows[i] = last + 1;
  }
  return rows;
}

}  // namespace sentree::draw
