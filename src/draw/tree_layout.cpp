#include <algorithm>
#include <cstddef>

#include "sentree/base/assert.h"
#include "sentree/draw/detail/text.h"
#include "sentree/draw/detail/tree_metrics.h"
#include "sentree/draw/tree.h"

namespace sentree::draw {
namespace {

constexpr double kMargin = 16;
constexpr double kSiblingGap = 18;
constexpr double kLevelGap = 34;

// The contour algorithm of van der Ploeg's paper, in its vocabulary: `extent` is the size across (what siblings share),
// `depth` the distance from the root. Node 0 is an invisible root above the real ones, so that several trees stand side
// by side.
class Placement {
 public:
  explicit Placement(std::size_t count) : nodes_(count) {}

  struct Node {
    int first_child = -1;
    int last_child = -1;
    int next_sibling = -1;
    double across = 0;  // size across, gap included
    double along = 0;   // size along, gap included
    double depth = 0;
    double preliminary = 0;
    double modifier = 0;
    double shift = 0;
    double change = 0;
    int left_thread = -1;
    int right_thread = -1;
    int extreme_left = -1;
    int extreme_right = -1;
    double modifier_sum_left = 0;  // of the modifiers from here to extreme_left
    double modifier_sum_right = 0;
    double position = 0;
  };

  Node& operator[](int i) { return nodes_[static_cast<std::size_t>(i)]; }

  // Children come after their parents in index order: backwards is a post-order good enough, forwards a pre-order.
  void run() {
    for (int i = static_cast<int>(nodes_.size()) - 1; i >= 0; --i) first_walk(i);
    std::vector<double> sums(nodes_.size(), 0.0);
    for (int i = 0; i < static_cast<int>(nodes_.size()); ++i) {
      Node& node = (*this)[i];
      sums[static_cast<std::size_t>(i)] += node.modifier;
      node.position = node.preliminary + sums[static_cast<std::size_t>(i)];
      double shift = 0;
      double extra = 0;
      for (int c = node.first_child; c >= 0; c = (*this)[c].next_sibling) {
        Node& child = (*this)[c];
        shift += child.shift;
        extra += shift + child.change;
        child.modifier += extra;
        sums[static_cast<std::size_t>(c)] = sums[static_cast<std::size_t>(i)];
      }
    }
  }

 private:
  // Left siblings by the depth their contour reaches, the nearest first: which of them a new subtree collides with.
  struct Reach {
    double low;
    int index;
  };

  double bottom(int i) { return (*this)[i].depth + (*this)[i].along; }
  int next_left(int i) { return (*this)[i].first_child < 0 ? (*this)[i].left_thread : (*this)[i].first_child; }
  int next_right(int i) { return (*this)[i].last_child < 0 ? (*this)[i].right_thread : (*this)[i].last_child; }

  void push_reach(double low, int index) {
    while (!reaches_.empty() && low >= reaches_.back().low) reaches_.pop_back();
    reaches_.push_back({low, index});
  }

  void first_walk(int i) {
    Node& node = (*this)[i];
    if (node.first_child < 0) {
      node.extreme_left = node.extreme_right = i;
      return;
    }
    children_.clear();
    for (int c = node.first_child; c >= 0; c = (*this)[c].next_sibling) children_.push_back(c);
    reaches_.clear();
    push_reach(bottom((*this)[children_[0]].extreme_left), 0);
    for (int k = 1; k < static_cast<int>(children_.size()); ++k) {
      const double low = bottom((*this)[child(k)].extreme_right);
      separate(k);
      push_reach(low, k);
    }
    const Node& first = (*this)[children_.front()];
    const Node& last = (*this)[children_.back()];
    node.preliminary =
        (first.preliminary + first.modifier + last.preliminary + last.modifier + last.across - node.across) / 2;
    node.extreme_left = first.extreme_left;
    node.modifier_sum_left = first.modifier_sum_left;
    node.extreme_right = last.extreme_right;
    node.modifier_sum_right = last.modifier_sum_right;
  }

  int child(int k) const { return children_[static_cast<std::size_t>(k)]; }

  // Moves child k right until its left contour clears the right contour of the children before it.
  void separate(int k) {
    int right = child(k - 1);
    double right_sum = (*this)[right].modifier;
    int left = child(k);
    double left_sum = (*this)[left].modifier;
    std::size_t reach = reaches_.size();
    while (right >= 0 && left >= 0) {
      while (reach > 1 && bottom(right) > reaches_[reach - 1].low) --reach;
      const double overlap =
          right_sum + (*this)[right].preliminary + (*this)[right].across - (left_sum + (*this)[left].preliminary);
      if (overlap > 0) {
        left_sum += overlap;
        move_subtree(k, reaches_[reach - 1].index, overlap);
      }
      const double right_bottom = bottom(right);
      const double left_bottom = bottom(left);
      if (right_bottom <= left_bottom) {
        right = next_right(right);
        if (right >= 0) right_sum += (*this)[right].modifier;
      }
      if (right_bottom >= left_bottom) {
        left = next_left(left);
        if (left >= 0) left_sum += (*this)[left].modifier;
      }
    }
    if (right < 0 && left >= 0) thread_left(k, left, left_sum);
    if (right >= 0 && left < 0) thread_right(k, right, right_sum);
  }

  void move_subtree(int k, int collided, double distance) {
    Node& moved = (*this)[child(k)];
    moved.modifier += distance;
    moved.modifier_sum_left += distance;
    moved.modifier_sum_right += distance;
    // Children between the two that touched share the distance, so that gaps look even.
    if (collided != k - 1) {
      const double between = k - collided;
      (*this)[child(collided + 1)].shift += distance / between;
      moved.shift -= distance / between;
      moved.change -= distance - distance / between;
    }
  }

  void thread_left(int k, int to, double sum) {
    Node& first = (*this)[child(0)];
    const Node& current = (*this)[child(k)];
    Node& extreme = (*this)[first.extreme_left];
    extreme.left_thread = to;
    const double difference = (sum - (*this)[to].modifier) - first.modifier_sum_left;
    extreme.modifier += difference;
    extreme.preliminary -= difference;
    first.extreme_left = current.extreme_left;
    first.modifier_sum_left = current.modifier_sum_left;
  }

  void thread_right(int k, int to, double sum) {
    Node& current = (*this)[child(k)];
    const Node& before = (*this)[child(k - 1)];
    Node& extreme = (*this)[current.extreme_right];
    extreme.right_thread = to;
    const double difference = (sum - (*this)[to].modifier) - current.modifier_sum_right;
    extreme.modifier += difference;
    extreme.preliminary -= difference;
    current.extreme_right = before.extreme_right;
    current.modifier_sum_right = before.modifier_sum_right;
  }

  std::vector<Node> nodes_;
  std::vector<int> children_;
  std::vector<Reach> reaches_;
};

Size node_size(const TreeNode& node, const std::vector<std::string>& titles, const std::vector<std::string>& lines) {
  double width = 0;
  for (const std::string& title : titles) width = std::max(width, kBoldFactor * text_width(title, kTitleSize));
  for (const std::string& line : lines) width = std::max(width, text_width(line, kLineSize));
  double height = static_cast<double>(titles.size()) * kTitleHeight + static_cast<double>(lines.size()) * kLineHeight;
  if (!node.symbol.empty()) {
    width = std::max(width, is_sign(node.symbol) ? std::max(kSymbolSize, text_width(node.symbol, kSymbolSize))
                                                 : kBoldFactor * text_width(node.symbol, kTitleSize));
    height += symbol_height(node.symbol);
  }
  width += 2 * kPaddingX;
  height += 2 * kPaddingY;
  if (node.shape == TreeShape::kSubtree) width += 4 * kDoubleSide;
  if (node.shape == TreeShape::kDecorator) width += 2 * kPoint - kPaddingX;
  if (node.shape == TreeShape::kCondition) {
    // An ellipse around a box of text: √2 in both directions is the smallest; texts rarely fill their corners.
    width *= 1.22;
    height *= 1.25;
  }
  return {std::max(width, kNodeWidthMin), std::max(height, kNodeHeightMin)};
}

Curve link(const Rect& parent, const Rect& child, Direction direction) {
  if (direction == Direction::kDown) {
    const Point from{parent.center().x, parent.bottom()};
    const Point to{child.center().x, child.y};
    const double middle = std::max((from.y + to.y) / 2, to.y - kLevelGap / 2);
    return {from, {from.x, middle}, {to.x, middle}, to};
  }
  const Point from{parent.right(), parent.center().y};
  const Point to{child.x, child.center().y};
  const double middle = std::max((from.x + to.x) / 2, to.x - kLevelGap / 2);
  return {from, {middle, from.y}, {middle, to.y}, to};
}

}  // namespace

TreeLayout layout(const Tree& tree) {
  const int count = static_cast<int>(tree.nodes.size());
  const bool down = tree.direction == Direction::kDown;
  TreeLayout result;
  Placement placement(tree.nodes.size() + 1);
  for (int i = 0; i < count; ++i) {
    const TreeNode& node = tree.nodes[static_cast<std::size_t>(i)];
    SENTREE_ASSERT(node.parent >= -1 && node.parent < i);
    result.titles.push_back(wrap(node.title, kTitleSize, kTreeTextWidthMax, kTreeLinesMax));
    std::vector<std::string> lines;
    for (const std::string& line : node.lines) {
      for (std::string& wrapped : wrap(line, kLineSize, kTreeTextWidthMax, kTreeLinesMax))
        lines.push_back(std::move(wrapped));
    }
    if (lines.size() > kTreeLinesMax) {
      lines.resize(kTreeLinesMax);
      lines.back() = "…";
    }
    result.lines.push_back(std::move(lines));
    const Size size = node_size(node, result.titles.back(), result.lines.back());
    result.nodes.push_back({0, 0, size.width, size.height});

    auto& placed = placement[i + 1];
    placed.across = (down ? size.width : size.height) + kSiblingGap;
    placed.along = (down ? size.height : size.width) + kLevelGap;
    auto& parent = placement[node.parent + 1];
    placed.depth = parent.depth + parent.along;
    if (parent.last_child < 0) {
      parent.first_child = i + 1;
    } else {
      placement[parent.last_child].next_sibling = i + 1;
    }
    parent.last_child = i + 1;
  }
  placement.run();

  const double title = tree.title.empty() ? 0 : kTitleBlock;
  double least = 0;
  for (int i = 1; i <= count; ++i) least = i == 1 ? placement[i].position : std::min(least, placement[i].position);
  Size size{tree.title.empty() ? 0 : text_width(tree.title, kTitleSize), 0};
  for (int i = 0; i < count; ++i) {
    Rect& rect = result.nodes[static_cast<std::size_t>(i)];
    const double across = placement[i + 1].position - least;
    const double along = placement[i + 1].depth;
    rect.x = kMargin + (down ? across : along);
    rect.y = kMargin + title + (down ? along : across);
    size.width = std::max(size.width, rect.right() - kMargin);
    size.height = std::max(size.height, rect.bottom() - kMargin);
  }
  result.size = {size.width + 2 * kMargin, size.height + 2 * kMargin};
  for (int i = 0; i < count; ++i) {
    const int parent = tree.nodes[static_cast<std::size_t>(i)].parent;
    result.edges.push_back(parent < 0 ? Curve{}
                                      : link(result.nodes[static_cast<std::size_t>(parent)],
                                             result.nodes[static_cast<std::size_t>(i)], tree.direction));
  }
  return result;
}

Direction best_direction(const Tree& tree) {
  constexpr double kWideMax = 2'400;  // a screen
  constexpr double kStripe = 3;       // times as long as the other side
  Tree turned = tree;
  turned.direction = Direction::kDown;
  const Size down = layout(turned).size;
  if (down.width < kWideMax || down.width < kStripe * down.height) return Direction::kDown;
  turned.direction = Direction::kRight;
  const Size right = layout(turned).size;
  return right.height / right.width < down.width / down.height ? Direction::kRight : Direction::kDown;
}

}  // namespace sentree::draw
