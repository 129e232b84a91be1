#include "sentree/draw/tree.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "sentree/base/rng.h"

namespace sentree::draw {
namespace {

using ::testing::ContainsRegex;
using ::testing::HasSubstr;
using ::testing::Not;

TreeNode node(int parent, std::string title, TreeShape shape = TreeShape::kAction) {
  TreeNode n;
  n.parent = parent;
  n.shape = shape;
  n.title = std::move(title);
  return n;
}

Tree random_tree(std::uint64_t seed) {
  Rng rng(seed);
  Tree tree;
  tree.direction = rng.below(2) == 0 ? Direction::kDown : Direction::kRight;
  const int count = 2 + static_cast<int>(rng.below(60));
  for (int i = 0; i < count; ++i) {
    const int parent = i == 0 ? -1 : static_cast<int>(rng.below(static_cast<std::uint64_t>(i)));
    TreeNode n = node(parent, std::string(1 + rng.below(30), 'm'), static_cast<TreeShape>(rng.below(5)));
    for (std::uint64_t k = rng.below(4); k > 0; --k) n.lines.push_back(std::string(1 + rng.below(40), 'x'));
    if (rng.below(2) == 0) n.symbol = "→";
    tree.nodes.push_back(std::move(n));
  }
  return tree;
}

TEST(TreeLayout, KeepsNodesApartInOrderAndParentsCentred) {
  for (std::uint64_t seed = 1; seed <= 300; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const Tree tree = random_tree(seed);
    const bool down = tree.direction == Direction::kDown;
    const TreeLayout placed = layout(tree);
    std::vector<int> last_child(tree.nodes.size(), -1);
    std::vector<int> first_child(tree.nodes.size(), -1);
    const auto middle = [&](int i) {
      const Point center = placed.nodes[static_cast<std::size_t>(i)].center();
      return down ? center.x : center.y;
    };
    for (std::size_t i = 0; i < tree.nodes.size(); ++i) {
      const Rect& a = placed.nodes[i];
      EXPECT_GE(a.x, 0);
      EXPECT_GE(a.y, 0);
      EXPECT_LE(a.right(), placed.size.width);
      EXPECT_LE(a.bottom(), placed.size.height);
      for (std::size_t k = 0; k < i; ++k) ASSERT_FALSE(overlap(a, placed.nodes[k])) << i << " over " << k;
      const int parent = tree.nodes[i].parent;
      if (parent < 0) continue;
      const Rect& above = placed.nodes[static_cast<std::size_t>(parent)];
      EXPECT_GT(down ? a.y : a.x, down ? above.bottom() : above.right());
      int& last = last_child[static_cast<std::size_t>(parent)];
      if (last >= 0) {
        EXPECT_GT(middle(static_cast<int>(i)), middle(last));
      }
      last = static_cast<int>(i);
      if (first_child[static_cast<std::size_t>(parent)] < 0)
        first_child[static_cast<std::size_t>(parent)] = static_cast<int>(i);
    }
    for (std::size_t i = 0; i < tree.nodes.size(); ++i) {
      if (first_child[i] < 0) continue;
      const Rect& first = placed.nodes[static_cast<std::size_t>(first_child[i])];
      const Rect& last = placed.nodes[static_cast<std::size_t>(last_child[i])];
      EXPECT_NEAR(middle(static_cast<int>(i)), down ? (first.x + last.right()) / 2 : (first.y + last.bottom()) / 2,
                  1e-6);
    }
  }
}

TEST(TreeLayout, TucksShortSubtreesUnderTheirTallNeighbours) {
  // Two leaves with much text and, between them, one small node with a child: a layout by levels would be wider.
  Tree tree;
  tree.nodes = {node(-1, "root"), node(0, std::string(20, 'm')), node(0, "i"), node(2, std::string(20, 'm'))};
  tree.nodes[1].lines = {"one", "two", "three", "four"};
  const TreeLayout placed = layout(tree);
  const Rect& wide = placed.nodes[1];
  const Rect& below = placed.nodes[3];
  ASSERT_FALSE(overlap(wide, below));
  EXPECT_LT(placed.nodes[2].x - wide.right(), 130);
}

TEST(TreeLayout, TurnsATreeThatWouldBeALongStripe) {
  Tree wide;
  wide.nodes = {node(-1, "root")};
  for (int i = 0; i < 10; ++i) wide.nodes.push_back(node(0, "a leaf"));
  EXPECT_EQ(best_direction(wide), Direction::kDown);
  for (int i = 0; i < 50; ++i) wide.nodes.push_back(node(0, "a leaf"));
  EXPECT_EQ(best_direction(wide), Direction::kRight);
  Tree deep;
  for (int i = 0; i < 100; ++i) deep.nodes.push_back(node(i - 1, "n"));
  EXPECT_EQ(best_direction(deep), Direction::kDown);
  EXPECT_EQ(best_direction(Tree{}), Direction::kDown);
}

TEST(TreeSvg, WritesAWordLikeANameAndASignLarge) {
  Tree tree;
  tree.nodes = {node(-1, "", TreeShape::kDecorator), node(0, "", TreeShape::kControl)};
  tree.nodes[0].symbol = "Inverter";
  tree.nodes[1].symbol = "R?";
  const std::string svg = to_svg(tree);
  EXPECT_THAT(svg, ContainsRegex("class=\"name\" [^>]*>Inverter<"));
  EXPECT_THAT(svg, ContainsRegex("class=\"symboltext\" [^>]*>R"));
}

TEST(TreeLayout, PlacesEqualSubtreesEqually) {
  Tree tree;
  tree.nodes = {node(-1, "root"), node(0, "a"), node(1, "b"), node(1, "c"), node(0, "a"), node(4, "b"), node(4, "c")};
  const TreeLayout placed = layout(tree);
  EXPECT_NEAR(placed.nodes[2].x - placed.nodes[1].x, placed.nodes[5].x - placed.nodes[4].x, 1e-9);
  EXPECT_NEAR(placed.nodes[3].x - placed.nodes[1].x, placed.nodes[6].x - placed.nodes[4].x, 1e-9);
}

TEST(TreeLayout, StandsALongChainAndALargeTree) {
  Tree chain;
  for (int i = 0; i < 200'000; ++i) chain.nodes.push_back(node(i - 1, "n"));
  EXPECT_GT(layout(chain).size.height, 200'000.0);
  Tree comb;  // a long right contour beside many short ones: quadratic, were contours not threaded
  comb.nodes.push_back(node(-1, "root"));
  int spine = 0;
  for (int i = 0; i < 50'000; ++i) {
    comb.nodes.push_back(node(spine, "leaf"));
    comb.nodes.push_back(node(spine, "spine"));
    spine = static_cast<int>(comb.nodes.size()) - 1;
  }
  EXPECT_GT(layout(comb).size.width, 1000.0);
}

TEST(TreeLayout, DrawsSeveralTreesSideBySideAndNone) {
  Tree forest;
  forest.nodes = {node(-1, "one"), node(0, "leaf"), node(-1, "two")};
  const TreeLayout placed = layout(forest);
  EXPECT_EQ(placed.nodes[0].y, placed.nodes[2].y);
  EXPECT_FALSE(overlap(placed.nodes[0], placed.nodes[2]));
  EXPECT_TRUE(layout(Tree{}).nodes.empty());
}

TEST(TreeLayout, ShortensWhatIsTooLong) {
  Tree tree;
  tree.nodes = {node(-1, std::string(5000, 'm'))};
  tree.nodes[0].lines.assign(100, "port");
  const TreeLayout placed = layout(tree);
  EXPECT_EQ(placed.titles[0].size(), static_cast<std::size_t>(kTreeLinesMax));
  EXPECT_EQ(placed.lines[0].size(), static_cast<std::size_t>(kTreeLinesMax));
  EXPECT_LT(placed.nodes[0].width, 1.25 * kTreeTextWidthMax);
}

TEST(TreeSvg, EscapesEveryText) {
  Tree tree;
  tree.title = "a <b> & \"c\"";
  tree.nodes = {node(-1, "</text><script>alert(1)</script>")};
  tree.nodes[0].lines = {"x='&amp;'\x01\xff"};
  tree.nodes[0].symbol = "<";
  const std::string svg = to_svg(tree);
  EXPECT_THAT(svg, Not(HasSubstr("<script")));
  EXPECT_THAT(svg, HasSubstr("<title>a &lt;b&gt; &amp; &quot;c&quot;</title>"));
  EXPECT_THAT(svg, HasSubstr("x=&#39;&amp;amp;&#39; \xEF\xBF\xBD"));
}

TEST(TreeSvg, TellsStatusesApartWithoutColour) {
  std::vector<std::string> shapes;
  for (const TreeStatus status : {TreeStatus::kIdle, TreeStatus::kRunning, TreeStatus::kSuccess, TreeStatus::kFailure,
                                  TreeStatus::kSkipped, TreeStatus::kHalting}) {
    Tree tree;
    tree.nodes = {node(-1, "n")};
    tree.nodes[0].status = status;
    std::string svg = to_svg(tree);
    EXPECT_THAT(svg, HasSubstr(std::string("<g class=\"") + std::string(to_string(status))));
    if (status != TreeStatus::kIdle) {
      EXPECT_THAT(svg, HasSubstr("<title>n: " + std::string(to_string(status))));
    }
    const std::size_t badge = svg.find("class=\"badge\"");
    shapes.push_back(badge == std::string::npos ? "" : svg.substr(badge));
  }
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    for (std::size_t k = 0; k < i; ++k) EXPECT_NE(shapes[i], shapes[k]);
  }
}

TEST(TreeSvg, FollowsTheReadersThemeUnlessToldOtherwise) {
  Tree tree;
  tree.nodes = {node(-1, "n")};
  EXPECT_THAT(to_svg(tree), HasSubstr("@media (prefers-color-scheme: dark)"));
  EXPECT_THAT(to_svg(tree, {.theme = Theme::kLight}), Not(HasSubstr("@media")));
  EXPECT_NE(to_svg(tree, {.theme = Theme::kLight}), to_svg(tree, {.theme = Theme::kDark}));
  EXPECT_THAT(to_svg(tree, {.background = false}), Not(HasSubstr("<rect class=\"background\"")));
  EXPECT_EQ(to_svg(tree), to_svg(tree));
}

TEST(TreeDot, QuotesTextsAndKeepsOrder) {
  Tree tree;
  tree.nodes = {node(-1, "say \"hi\"\\"), node(0, "a", TreeShape::kCondition), node(0, "b")};
  tree.nodes[2].status = TreeStatus::kRunning;
  EXPECT_EQ(
      to_dot(tree),
      "digraph tree {\n  ordering=out;\n  node [fontname=\"Helvetica\", fontsize=11, style=filled, fillcolor=white];\n"
      "  edge [arrowhead=none];\n"
      "  n0 [shape=box, label=\"say \\\"hi\\\"\\\\\"];\n"
      "  n1 [shape=ellipse, label=\"a\"];\n"
      "  n2 [shape=box, label=\"b ▶\", color=\"#0b62c4\", fillcolor=\"#e1efff\", penwidth=2];\n"
      "  n0 -> n1;\n  n0 -> n2;\n}\n");
}

TEST(TreeMermaid, WritesShapesStatusesAndEscapes) {
  Tree tree;
  tree.nodes = {node(-1, "Root", TreeShape::kControl), node(0, "a[\"x\"]", TreeShape::kCondition)};
  tree.nodes[0].symbol = "?";
  tree.nodes[1].status = TreeStatus::kFailure;
  EXPECT_EQ(to_mermaid(tree),
            "flowchart TD\n  n0[\"?<br/>Root\"]\n  n1([\"a#91;#34;x#34;#93; ✗\"])\n  n0 --- n1\n"
            "  classDef failure stroke:#b8340c,stroke-width:2px\n  class n1 failure\n");
}

TEST(TreeValue, HoldsPositionsAndTexts) {
  Tree tree;
  tree.nodes = {node(-1, "Root", TreeShape::kControl), node(0, "leaf")};
  const TreeLayout placed = layout(tree);
  const Value value = to_value(tree, placed);
  const List& nodes = *value.find("nodes")->as_list();
  ASSERT_EQ(nodes.size(), 2u);
  EXPECT_EQ(nodes[1].find("parent")->number(), 0);
  EXPECT_EQ(nodes[1].find("x")->number(), placed.nodes[1].x);
  EXPECT_EQ(nodes[0].find("shape")->text(), "control");
  EXPECT_EQ(value.find("edges")->as_list()->at(1).as_list()->size(), 4u);
}

}  // namespace
}  // namespace sentree::draw
