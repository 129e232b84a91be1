#include "sentree/draw/detail/layered.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numeric>

#include "sentree/base/assert.h"

namespace sentree::draw {
namespace {

// Distances between neighbours of a row [px].
constexpr double kNodeGap = 32;
constexpr double kLineGap = 16;
constexpr double kLabelIndent = 6;  // from an arrow to its label
constexpr double kEndGapMin = 8;    // between ends on a side, where others fix their places
// Between rows: at least the first; more where arrows cover much distance sideways, so that they do not get flat.
constexpr double kRowGapMin = 16;
constexpr double kRowGapEmpty = 9;  // beside a row without height: points on a border, arrows without label
constexpr double kRowGapMax = 46;
constexpr double kRowGapSlope = 0.07;

constexpr int kOrderSweeps = 12;
// Orders that are begun with while arrows cross; above this many items, the one in which they come.
constexpr int kOrderStarts = 24;
constexpr std::size_t kStartsItemsMax = 400;
constexpr int kPlaceSweeps = 24;
// Above this many items a level is drawn with few sweeps: quick rather than beautiful.
constexpr std::size_t kFineItemsMax = 3000;
constexpr int kCoarseSweeps = 2;

// A box in a row: a node, or an edge on its way through (with its label, in one of the rows).
struct Item {
  double width = 0;
  double height = 0;
  int row = 0;
  int node = -1;  // index of the node, or
  int edge = -1;  // index of the edge
  bool label = false;
  std::vector<int> up;  // links, by index
  std::vector<int> down;
  double x = 0;
  int order = 0;  // place in its row
};

// Joins two items of adjacent rows, with the place where it attaches to each, from the left of the item.
struct Link {
  int upper;
  int lower;
  double upper_at = 0;
  double lower_at = 0;
  bool upper_fixed = false;
  bool lower_fixed = false;
  double weight = 1;
};

class Placer {
 public:
  Placer(const std::vector<LayeredNode>& nodes, const std::vector<LayeredEdge>& edges, const std::vector<int>& rows,
         int& bends)
      : nodes_(nodes), edges_(edges), node_rows_(rows) {
    make_items(bends);
    order_rows();
    attach();
    place_across();
    place_along();
  }

  LayeredDrawing result() {
    LayeredDrawing drawing;
    drawing.nodes.resize(nodes_.size());
    for (std::size_t i = 0; i < nodes_.size(); ++i) drawing.nodes[i] = box(items_[i]);
    drawing.curves.resize(edges_.size());
    drawing.labels.resize(edges_.size());
    for (std::size_t e = 0; e < edges_.size(); ++e) route(static_cast<int>(e), drawing);
    for (const Item& item : items_) drawing.size.width = std::max(drawing.size.width, item.x + item.width);
    drawing.size.height = row_y_.empty() ? 0 : row_y_.back() + row_height_.back();
    return drawing;
  }

 private:
  Item& item(int i) { return items_[static_cast<std::size_t>(i)]; }
  Link& link(int i) { return links_[static_cast<std::size_t>(i)]; }

  // Even rows hold nodes, odd rows the labels of the edges between.
  void make_items(int& bends) {
    int rows = 0;
    for (const int row : node_rows_) rows = std::max(rows, 2 * row + 1);
    rows_.resize(static_cast<std::size_t>(rows));
    for (std::size_t i = 0; i < nodes_.size(); ++i) {
      Item it;
      it.width = nodes_[i].size.width;
      it.height = nodes_[i].size.height;
      it.row = 2 * node_rows_[i];
      it.node = static_cast<int>(i);
      add(std::move(it));
    }
    for (std::size_t e = 0; e < edges_.size(); ++e) {
      const LayeredEdge& edge = edges_[e];
      const bool down = node_rows_[static_cast<std::size_t>(edge.from)] < node_rows_[static_cast<std::size_t>(edge.to)];
      const int top = down ? edge.from : edge.to;
      const int bottom = down ? edge.to : edge.from;
      const int first = item(top).row;
      const int last = item(bottom).row;
      SENTREE_ASSERT(first < last);
      std::vector<int>& chain = chains_.emplace_back();
      if (last - first - 1 > bends) continue;
      bends -= last - first - 1;
      const int label_row = ((first + last) / 2) | 1;
      int before = top;
      chain.push_back(top);
      for (int row = first + 1; row <= last; ++row) {
        int next = bottom;
        if (row < last) {
          Item it;
          it.row = row;
          it.edge = static_cast<int>(e);
          it.label = row == label_row && edge.label.width > 0;
          it.width = it.label ? edge.label.width + kLabelIndent : 0;
          it.height = it.label ? edge.label.height : 0;
          next = add(std::move(it));
        }
        Link l{before, next};
        l.weight = (item(before).node < 0 ? 2.0 : 1.0) * (item(next).node < 0 ? 2.0 : 1.0);
        if (before == top) set_end(l.upper_at, l.upper_fixed, down ? edge.from_offset : edge.to_offset);
        if (next == bottom) set_end(l.lower_at, l.lower_fixed, down ? edge.to_offset : edge.from_offset);
        links_.push_back(l);
        item(before).down.push_back(static_cast<int>(links_.size()) - 1);
        item(next).up.push_back(static_cast<int>(links_.size()) - 1);
        chain.push_back(next);
        before = next;
      }
    }
  }

  static void set_end(double& at, bool& fixed, const std::optional<double>& offset) {
    fixed = offset.has_value();
    if (fixed) at = *offset;
  }

  int add(Item&& it) {
    auto& row = rows_[static_cast<std::size_t>(it.row)];
    const int index = static_cast<int>(items_.size());
    it.order = static_cast<int>(row.size());
    row.push_back(index);
    items_.push_back(std::move(it));
    return index;
  }

  [[nodiscard]] bool corner(int i) const {
    const Item& it = items_[static_cast<std::size_t>(i)];
    return it.node >= 0 && nodes_[static_cast<std::size_t>(it.node)].pin == Pin::kCorner;
  }

  // --- order within rows -------------------------------------------------------------------------------------------

  // Barycentres up and down, then swaps of neighbours, from several orders; the best order seen wins.
  void order_rows() {
    const bool fine = items_.size() <= kFineItemsMax;
    const std::vector<std::vector<int>> given = rows_;
    std::vector<std::vector<int>> best = rows_;
    std::int64_t fewest = crossings();
    std::uint64_t random = 1;
    for (int start = 0; start < (items_.size() <= kStartsItemsMax ? kOrderStarts : 1) && fewest > 0; ++start) {
      if (start > 0) {
        rows_ = given;
        for (auto& row : rows_) shuffle(row, random);
      }
      for (int sweep = 0; sweep < (fine ? kOrderSweeps : kCoarseSweeps) && fewest > 0; ++sweep) {
        const bool downwards = sweep % 2 == 0;
        for (std::size_t k = 1; k < rows_.size(); ++k) sort_row(downwards ? k : rows_.size() - 1 - k, downwards);
        if (fine) swap_neighbours();
        const std::int64_t now = crossings();
        if (now >= fewest) continue;
        fewest = now;
        best = rows_;
      }
    }
    rows_ = std::move(best);
    for (auto& row : rows_) {
      std::stable_partition(row.begin(), row.end(), [&](int i) { return corner(i); });
      renumber(row);
    }
  }

  // The same on every machine, which std::shuffle need not be.
  void shuffle(std::vector<int>& row, std::uint64_t& random) {
    for (std::size_t k = row.size(); k > 1; --k) {
      random = random * 6364136223846793005U + 1442695040888963407U;
      std::swap(row[k - 1], row[(random >> 33U) % k]);
    }
    renumber(row);
  }

  void renumber(const std::vector<int>& row) {
    for (std::size_t k = 0; k < row.size(); ++k) item(row[k]).order = static_cast<int>(k);
  }

  // Where an end lies in its row, finer than the item's place: ends at one item differ by their offset.
  double end_position(const Link& l, bool upper) {
    const Item& it = item(upper ? l.upper : l.lower);
    const bool fixed = upper ? l.upper_fixed : l.lower_fixed;
    const double at = upper ? l.upper_at : l.lower_at;
    return it.order + (fixed && it.width > 0 ? at / it.width : 0.5);
  }

  void sort_row(std::size_t r, bool by_upper) {
    auto& row = rows_[r];
    std::vector<std::pair<double, int>> keys;
    for (const int i : row) {
      const auto& links = by_upper ? item(i).up : item(i).down;
      double sum = 0;
      for (const int l : links) sum += end_position(link(l), by_upper);
      // An item without links keeps its place.
      keys.emplace_back(links.empty() ? item(i).order + 0.5 : sum / static_cast<double>(links.size()), i);
    }
    std::stable_sort(keys.begin(), keys.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
    for (std::size_t k = 0; k < row.size(); ++k) row[k] = keys[k].second;
    renumber(row);
  }

  // Crossings between the links of two items that are neighbours, left before right.
  std::int64_t crossings_between(int left, int right) {
    std::int64_t count = 0;
    for (const bool upper : {true, false}) {
      for (const int a : upper ? item(left).up : item(left).down) {
        for (const int b : upper ? item(right).up : item(right).down) {
          if (end_position(link(a), upper) > end_position(link(b), upper)) ++count;
        }
      }
    }
    return count;
  }

  void swap_neighbours() {
    constexpr int kRounds = 4;
    bool changed = true;
    for (int round = 0; round < kRounds && changed; ++round) {
      changed = false;
      for (auto& row : rows_) {
        for (std::size_t k = 0; k + 1 < row.size(); ++k) {
          if (crossings_between(row[k], row[k + 1]) <= crossings_between(row[k + 1], row[k])) continue;
          std::swap(row[k], row[k + 1]);
          std::swap(item(row[k]).order, item(row[k + 1]).order);
          changed = true;
        }
      }
    }
  }

  // Inversions, counted with a Fenwick tree: O(links · log links) for each pair of rows.
  std::int64_t crossings() {
    std::int64_t total = 0;
    for (std::size_t r = 0; r + 1 < rows_.size(); ++r) {
      std::vector<std::pair<double, double>> ends;
      for (const int i : rows_[r]) {
        for (const int l : item(i).down) ends.emplace_back(end_position(link(l), true), end_position(link(l), false));
      }
      std::sort(ends.begin(), ends.end());
      std::vector<double> lower;
      for (const auto& end : ends) lower.push_back(end.second);
      std::sort(lower.begin(), lower.end());
      lower.erase(std::unique(lower.begin(), lower.end()), lower.end());
      std::vector<std::int64_t> tree(lower.size() + 1, 0);
      for (std::size_t k = 0; k < ends.size(); ++k) {
        const auto at =
            static_cast<std::size_t>(std::lower_bound(lower.begin(), lower.end(), ends[k].second) - lower.begin()) + 1;
        std::int64_t not_beyond = 0;
        for (std::size_t t = at; t > 0; t -= t & (~t + 1)) not_beyond += tree[t];
        total += static_cast<std::int64_t>(k) - not_beyond;
        for (std::size_t t = at; t < tree.size(); t += t & (~t + 1)) ++tree[t];
      }
    }
    return total;
  }

  // --- ends on the sides of nodes ------------------------------------------------------------------------------------

  void attach() {
    for (std::size_t i = 0; i < nodes_.size(); ++i) {
      spread(items_[i].up, true, nodes_[i]);
      spread(items_[i].down, false, nodes_[i]);
    }
  }

  // Ends that are free spread evenly over the body, between the fixed ones, in the order of what they lead to.
  void spread(std::vector<int>& links, bool upwards, const LayeredNode& node) {
    const auto other = [&](int l) { return end_position(link(l), upwards); };
    const auto fixed = [&](int l) { return upwards ? link(l).lower_fixed : link(l).upper_fixed; };
    const auto place = [&](int l) -> double& { return upwards ? link(l).lower_at : link(l).upper_at; };
    std::stable_sort(links.begin(), links.end(), [&](int a, int b) { return other(a) < other(b); });
    for (std::size_t first = 0; first < links.size();) {
      if (fixed(links[first])) {
        ++first;
        continue;
      }
      std::size_t last = first;
      while (last < links.size() && !fixed(links[last])) ++last;
      double low = first > 0 ? place(links[first - 1]) : 0;
      double high = last < links.size() ? place(links[last]) : node.body_width;
      if (high - low < static_cast<double>(last - first) * kEndGapMin) {
        low = 0;
        high = node.body_width;
      }
      const double step = (high - low) / (static_cast<double>(last - first) + 1);
      for (std::size_t k = first; k < last; ++k) place(links[k]) = low + step * static_cast<double>(k - first + 1);
      first = last;
    }
  }

  // --- coordinates ---------------------------------------------------------------------------------------------------

  double gap(const Item& a, const Item& b) const {
    return a.node >= 0 && b.node >= 0             ? kNodeGap
           : a.node < 0 && b.node < 0 && !a.label ? kLineGap
                                                  : (kNodeGap + kLineGap) / 2;
  }

  void place_across() {
    for (const auto& row : rows_) {
      double x = 0;
      for (std::size_t k = 0; k < row.size(); ++k) {
        if (k > 0) x += gap(item(row[k - 1]), item(row[k]));
        item(row[k]).x = x;
        x += item(row[k]).width;
      }
    }
    const int sweeps = items_.size() <= kFineItemsMax ? kPlaceSweeps : kCoarseSweeps;
    for (int sweep = 0; sweep < sweeps; ++sweep) {
      // At first from one side each, to unfold; then from both, to settle.
      const bool both = sweep >= sweeps / 3;
      const bool downwards = sweep % 2 == 0;
      for (std::size_t k = 0; k < rows_.size(); ++k) {
        const std::size_t r = downwards ? k : rows_.size() - 1 - k;
        settle(rows_[r], both || downwards, both || !downwards);
      }
    }
    for (std::size_t e = 0; e < edges_.size(); ++e) straighten(chains_[e]);
    double least = std::numeric_limits<double>::max();
    for (const Item& it : items_) least = std::min(least, it.x);
    for (Item& it : items_) it.x -= least;
  }

  // Moves the items of a row as near as their order and gaps allow to where their links want them: least squares
  // under order constraints, by pooling adjacent violators (Ayer et al. 1955).
  void settle(const std::vector<int>& row, bool look_up, bool look_down) {
    struct Pool {
      double sum;
      double weight;
      std::size_t first;
      [[nodiscard]] double at() const { return sum / weight; }
    };
    std::vector<Pool> pools;
    std::vector<double> offsets(row.size());  // of each item from the first, packed
    double offset = 0;
    for (std::size_t k = 0; k < row.size(); ++k) {
      const Item& it = item(row[k]);
      if (k > 0) offset += item(row[k - 1]).width + gap(item(row[k - 1]), it);
      offsets[k] = offset;
      double sum = 0;
      double weight = 0;
      const auto pull = [&](const std::vector<int>& links, bool up) {
        for (const int i : links) {
          const Link& l = link(i);
          sum +=
              l.weight * (up ? item(l.upper).x + l.upper_at - l.lower_at : item(l.lower).x + l.lower_at - l.upper_at);
          weight += l.weight;
        }
      };
      if (look_up) pull(it.up, true);
      if (look_down) pull(it.down, false);
      constexpr double kInertia = 0.05;  // what nothing pulls stays, but gives way
      sum += kInertia * it.x;
      weight += kInertia;
      pools.push_back({sum - weight * offset, weight, k});
      while (pools.size() > 1 && pools[pools.size() - 2].at() > pools.back().at()) {
        Pool& before = pools[pools.size() - 2];
        before.sum += pools.back().sum;
        before.weight += pools.back().weight;
        pools.pop_back();
      }
    }
    for (std::size_t p = 0; p < pools.size(); ++p) {
      const std::size_t end = p + 1 < pools.size() ? pools[p + 1].first : row.size();
      for (std::size_t k = pools[p].first; k < end; ++k) item(row[k]).x = pools[p].at() + offsets[k];
    }
  }

  // Puts runs of an edge's items on one vertical line, as long as their neighbours leave room; in line with the end of
  // the edge above or below the run where that lies within the room.
  void straighten(const std::vector<int>& chain) {
    for (std::size_t first = 1; first + 1 < chain.size();) {
      double low = -std::numeric_limits<double>::max();
      double high = std::numeric_limits<double>::max();
      double sum = 0;
      std::size_t last = first;
      for (; last + 1 < chain.size(); ++last) {
        const auto [item_low, item_high] = room(chain[last]);
        if (std::max(low, item_low) > std::min(high, item_high)) break;
        low = std::max(low, item_low);
        high = std::min(high, item_high);
        sum += item(chain[last]).x;
      }
      double x = std::clamp(sum / static_cast<double>(last - first), low, high);
      for (const double aim : {aim_of(chain, first, true), aim_of(chain, last - 1, false)}) {
        if (aim >= low && aim <= high) {
          x = aim;
          break;
        }
      }
      for (std::size_t k = first; k < last; ++k) item(chain[k]).x = x;
      first = last;
    }
  }

  // Between which places an item can move without coming too near to its neighbours.
  std::pair<double, double> room(int i) {
    const Item& it = item(i);
    const auto& row = rows_[static_cast<std::size_t>(it.row)];
    const auto order = static_cast<std::size_t>(it.order);
    double low = -std::numeric_limits<double>::max();
    double high = std::numeric_limits<double>::max();
    if (order > 0) {
      const Item& left = item(row[order - 1]);
      low = std::min(it.x, left.x + left.width + gap(left, it));
    }
    if (order + 1 < row.size()) {
      const Item& right = item(row[order + 1]);
      high = std::max(it.x, right.x - it.width - gap(it, right));
    }
    return {low, high};
  }

  // The place of what a run of an edge joins, above its first or below its last item.
  double aim_of(const std::vector<int>& chain, std::size_t k, bool above) {
    const Item& it = item(chain[k]);
    const Link& l = link(above ? it.up[0] : it.down[0]);
    return above ? item(l.upper).x + l.upper_at : item(l.lower).x + l.lower_at;
  }

  void place_along() {
    double y = 0;
    for (std::size_t r = 0; r < rows_.size(); ++r) {
      double height = 0;
      double reach = 0;
      for (const int i : rows_[r]) {
        height = std::max(height, item(i).height);
        for (const int l : item(i).up) {
          reach = std::max(reach, std::abs(item(link(l).upper).x + link(l).upper_at - item(i).x - link(l).lower_at));
        }
      }
      if (r > 0)
        y += std::clamp(kRowGapSlope * reach, height > 0 && row_height_.back() > 0 ? kRowGapMin : kRowGapEmpty,
                        kRowGapMax);
      row_y_.push_back(y);
      row_height_.push_back(height);
      y += height;
    }
  }

  [[nodiscard]] Rect box(const Item& it) const {
    const auto r = static_cast<std::size_t>(it.row);
    return {it.x, row_y_[r] + (row_height_[r] - it.height) / 2, it.width, it.height};
  }

  // --- curves --------------------------------------------------------------------------------------------------------

  void route(int e, LayeredDrawing& drawing) {
    const LayeredEdge& edge = edges_[static_cast<std::size_t>(e)];
    const std::vector<int>& chain = chains_[static_cast<std::size_t>(e)];
    Curve& curve = drawing.curves[static_cast<std::size_t>(e)];
    const bool down = item(edge.from).row < item(edge.to).row;
    if (chain.empty()) {
      straight(edge, down, drawing, static_cast<std::size_t>(e));
      return;
    }
    for (std::size_t k = 0; k + 1 < chain.size(); ++k) {
      const Item& upper = item(chain[k]);
      const Item& lower = item(chain[k + 1]);
      const Link& l = joining(upper, chain[k + 1], e);
      const auto r = static_cast<std::size_t>(upper.row);
      const Point from{upper.x + l.upper_at, upper.node >= 0 ? box(upper).bottom() : row_y_[r] + row_height_[r]};
      const Point start{from.x, row_y_[r] + row_height_[r]};
      const Point end{lower.x + l.lower_at, row_y_[r + 1]};
      if (curve.empty()) curve.push_back(from);
      line_to(curve, start);
      if (std::abs(start.x - end.x) < 0.5) {
        line_to(curve, end);
      } else {
        const double middle = (start.y + end.y) / 2;
        curve.insert(curve.end(), {{start.x, middle}, {end.x, middle}, end});
      }
      line_to(curve, {end.x, lower.node >= 0 ? box(lower).y : row_y_[r + 1] + row_height_[r + 1]});
      if (lower.label) {
        const Rect label = box(lower);
        drawing.labels[static_cast<std::size_t>(e)] = {label.x + kLabelIndent, label.y, label.width - kLabelIndent,
                                                       label.height};
      }
    }
    if (!down) std::reverse(curve.begin(), curve.end());
  }

  // The link of edge `e` between two items; between items of the edge itself there is only one.
  const Link& joining(const Item& upper, int lower, int e) {
    for (const int l : item(lower).up) {
      if (&item(link(l).upper) == &upper && (upper.edge == e || item(lower).edge == e)) return link(l);
    }
    SENTREE_ASSERT(false);
    return links_[0];
  }

  void straight(const LayeredEdge& edge, bool down, LayeredDrawing& drawing, std::size_t e) {
    const Rect from = box(item(edge.from));
    const Rect to = box(item(edge.to));
    const auto across = [&](const Rect& rect, int node, const std::optional<double>& offset) {
      return rect.x + offset.value_or(nodes_[static_cast<std::size_t>(node)].body_width / 2);
    };
    const Point start{across(from, edge.from, edge.from_offset), down ? from.bottom() : from.y};
    const Point end{across(to, edge.to, edge.to_offset), down ? to.y : to.bottom()};
    drawing.curves[e].push_back(start);
    line_to(drawing.curves[e], end);
    if (edge.label.width > 0) {
      drawing.labels[e] = {(start.x + end.x) / 2 + kLabelIndent, (start.y + end.y - edge.label.height) / 2,
                           edge.label.width, edge.label.height};
    }
  }

  const std::vector<LayeredNode>& nodes_;
  const std::vector<LayeredEdge>& edges_;
  const std::vector<int>& node_rows_;
  std::vector<Item> items_;  // nodes first, by index
  std::vector<Link> links_;
  std::vector<std::vector<int>> chains_;  // by edge: items from top to bottom; empty: drawn straight
  std::vector<std::vector<int>> rows_;
  std::vector<double> row_y_;
  std::vector<double> row_height_;
};

}  // namespace

LayeredDrawing place(const std::vector<LayeredNode>& nodes, const std::vector<LayeredEdge>& edges,
                     const std::vector<int>& rows, int& bends) {
  SENTREE_ASSERT(rows.size() == nodes.size());
  return Placer(nodes, edges, rows, bends).result();
}

void line_to(Curve& curve, Point to) {
  const Point from = curve.back();
  if (from == to) return;
  // A straight piece is one whose handles lie on its ends' vertical; only those are extended.
  if (curve.size() >= 4 && from.x == to.x) {
    const Point before = curve[curve.size() - 4];
    const bool straight =
        before.x == from.x && curve[curve.size() - 3].x == from.x && curve[curve.size() - 2].x == from.x;
    if (straight && (from.y - before.y) * (to.y - from.y) > 0) {
      curve.resize(curve.size() - 3);
      line_to(curve, to);
      return;
    }
  }
  curve.insert(curve.end(), {from, to, to});
}

}  // namespace sentree::draw
