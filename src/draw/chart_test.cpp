#include "sentree/draw/chart.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "sentree/base/rng.h"
#include "sentree/draw/detail/layered.h"

namespace sentree::draw {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

ChartState state(int parent, std::string name, StateKind kind = StateKind::kState) {
  ChartState s;
  s.parent = parent;
  s.kind = kind;
  s.name = std::move(name);
  return s;
}

ChartTransition transition(int source, std::vector<int> targets, std::string event = "", std::string condition = "",
                           std::string actions = "") {
  ChartTransition t;
  t.source = source;
  t.targets = std::move(targets);
  t.event = std::move(event);
  t.condition = std::move(condition);
  t.actions = std::move(actions);
  return t;
}

Chart door() {
  Chart chart;
  chart.title = "door";
  chart.states = {state(-1, "", StateKind::kInitial), state(-1, "closed"), state(-1, "open"),
                  state(-1, "end", StateKind::kFinal)};
  chart.transitions = {transition(0, {1}), transition(1, {2}, "open"), transition(2, {1}, "close", "clear", "log"),
                       transition(2, {3}, "break")};
  return chart;
}

Chart random_chart(std::uint64_t seed) {
  Rng rng(seed);
  Chart chart;
  const int count = 2 + static_cast<int>(rng.below(16));
  for (int s = 0; s < count; ++s) {
    ChartState one = state(s == 0 ? -1 : static_cast<int>(rng.below(static_cast<std::uint64_t>(s) + 1)) - 1,
                           std::string(1 + rng.below(12), 's'));
    if (one.parent >= 0 && chart.states[static_cast<std::size_t>(one.parent)].kind != StateKind::kState &&
        chart.states[static_cast<std::size_t>(one.parent)].kind != StateKind::kParallel) {
      one.parent = -1;
    }
    one.kind = static_cast<StateKind>(rng.below(6));
    for (std::uint64_t k = rng.below(3); k > 0; --k) one.lines.push_back("entry / " + std::string(rng.below(30), 'x'));
    chart.states.push_back(std::move(one));
  }
  for (std::uint64_t k = rng.below(14); k > 0; --k) {
    std::vector<int> targets;
    for (std::uint64_t n = rng.below(8) == 0 ? 2 : 1; n > 0; --n)
      targets.push_back(static_cast<int>(rng.below(static_cast<std::uint64_t>(count))));
    chart.transitions.push_back(transition(static_cast<int>(rng.below(static_cast<std::uint64_t>(count))), targets,
                                           rng.below(3) == 0 ? "" : std::string(1 + rng.below(40), 'e'),
                                           std::string(rng.below(60), 'c')));
  }
  return chart;
}

bool inside(const Chart& chart, int s, int ancestor) {
  while (s >= 0 && s != ancestor) s = chart.states[static_cast<std::size_t>(s)].parent;
  return s == ancestor;
}

Point on_curve(const Curve& curve, std::size_t piece, double t) {
  const auto mix = [&](Point a, Point b) { return Point{a.x + (b.x - a.x) * t, a.y + (b.y - a.y) * t}; };
  const Point* p = &curve[3 * piece];
  const Point ab = mix(p[0], p[1]);
  const Point bc = mix(p[1], p[2]);
  const Point cd = mix(p[2], p[3]);
  return mix(mix(ab, bc), mix(bc, cd));
}

bool contains(const Rect& rect, Point p, double margin) {
  return p.x > rect.x + margin && p.x < rect.right() - margin && p.y > rect.y + margin && p.y < rect.bottom() - margin;
}

TEST(ChartLayout, KeepsStatesInsideTheirParentsAndApartFromEachOther) {
  for (std::uint64_t seed = 1; seed <= 400; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const Chart chart = random_chart(seed);
    const ChartLayout placed = layout(chart);
    for (int a = 0; a < static_cast<int>(chart.states.size()); ++a) {
      const Rect& rect = placed.states[static_cast<std::size_t>(a)];
      const int parent = chart.states[static_cast<std::size_t>(a)].parent;
      const Rect outer = parent < 0 ? Rect{0, 0, placed.size.width, placed.size.height}
                                    : placed.states[static_cast<std::size_t>(parent)];
      EXPECT_GE(rect.x, outer.x - 1e-6) << a;
      EXPECT_GE(rect.y, outer.y - 1e-6) << a;
      EXPECT_LE(rect.right(), outer.right() + 1e-6) << a;
      EXPECT_LE(rect.bottom(), outer.bottom() + 1e-6) << a;
      for (int b = 0; b < a; ++b) {
        if (inside(chart, a, b)) continue;
        EXPECT_FALSE(overlap({rect.x + 0.01, rect.y + 0.01, rect.width - 0.02, rect.height - 0.02},
                             placed.states[static_cast<std::size_t>(b)]))
            << a << " over " << b;
      }
    }
  }
}

TEST(ChartLayout, KeepsArrowsClearOfStatesThatTheyDoNotJoin) {
  for (std::uint64_t seed = 1; seed <= 400; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const Chart chart = random_chart(seed);
    const ChartLayout placed = layout(chart);
    for (const ChartEdge& edge : placed.edges) {
      const int source = chart.transitions[static_cast<std::size_t>(edge.transition)].source;
      ASSERT_EQ(edge.curve.size() % 3, 1u);
      for (std::size_t piece = 0; 3 * piece + 3 < edge.curve.size(); ++piece) {
        for (int step = 0; step <= 10; ++step) {
          const Point p = on_curve(edge.curve, piece, step / 10.0);
          for (int s = 0; s < static_cast<int>(chart.states.size()); ++s) {
            if (inside(chart, source, s) || inside(chart, edge.target, s)) continue;
            EXPECT_FALSE(contains(placed.states[static_cast<std::size_t>(s)], p, 0.5))
                << "transition " << edge.transition << " runs through state " << s;
          }
        }
      }
    }
  }
}

TEST(ChartLayout, LetsArrowsEndOnTheBordersOfWhatTheyJoin) {
  for (std::uint64_t seed = 1; seed <= 400; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const Chart chart = random_chart(seed);
    const ChartLayout placed = layout(chart);
    const auto on_border = [&](int s, Point p) {
      const Rect& r = placed.states[static_cast<std::size_t>(s)];
      const double across = std::min(std::abs(p.x - r.x), std::abs(p.x - r.right()));
      const double along = std::min(std::abs(p.y - r.y), std::abs(p.y - r.bottom()));
      return std::min(across, along) < 1e-6 && p.x > r.x - 1e-6 && p.x < r.right() + 1e-6 && p.y > r.y - 1e-6 &&
             p.y < r.bottom() + 1e-6;
    };
    for (const ChartEdge& edge : placed.edges) {
      ASSERT_GE(edge.curve.size(), 4u);
      EXPECT_TRUE(on_border(chart.transitions[static_cast<std::size_t>(edge.transition)].source, edge.curve.front()))
          << edge.transition;
      EXPECT_TRUE(on_border(edge.target, edge.curve.back())) << edge.transition;
    }
  }
}

TEST(ChartLayout, KeepsLabelsClearOfStatesAndOfEachOther) {
  for (std::uint64_t seed = 1; seed <= 400; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const Chart chart = random_chart(seed);
    const ChartLayout placed = layout(chart);
    for (const ChartEdge& edge : placed.edges) {
      if (edge.lines.empty()) continue;
      const int source = chart.transitions[static_cast<std::size_t>(edge.transition)].source;
      EXPECT_LE(edge.label.right(), placed.size.width);
      for (const ChartEdge& other : placed.edges) {
        if (&other == &edge || other.lines.empty()) continue;
        EXPECT_FALSE(overlap(edge.label, other.label)) << edge.transition << " and " << other.transition;
      }
      for (int s = 0; s < static_cast<int>(chart.states.size()); ++s) {
        const bool around =
            inside(chart, source, s) && inside(chart, edge.target, s) && !(source == edge.target && s == source);
        if (around) continue;
        EXPECT_FALSE(overlap(edge.label, placed.states[static_cast<std::size_t>(s)]))
            << edge.transition << " over " << s;
      }
    }
  }
}

// Rows that can be drawn without a crossing, whose nodes come in any order.
TEST(LayeredLayout, FindsOrdersInWhichHardlyAnArrowCrosses) {
  constexpr int kRows = 4;
  constexpr int kPerRow = 6;
  int crossings = 0;
  int drawn_so = 0;  // without a crossing
  for (std::uint64_t seed = 1; seed <= 100; ++seed) {
    Rng rng(seed);
    std::vector<LayeredNode> nodes(static_cast<std::size_t>(kRows * kPerRow), LayeredNode{{40, 20}, 40, Pin::kNone});
    std::vector<int> named(nodes.size());  // by place in the drawing
    for (std::size_t i = 0; i < named.size(); ++i) named[i] = static_cast<int>(i);
    for (std::size_t i = named.size(); i > 1; --i) std::swap(named[i - 1], named[rng.below(i)]);
    std::vector<int> rows(nodes.size());
    for (std::size_t i = 0; i < named.size(); ++i) rows[at(named[i])] = static_cast<int>(i) / kPerRow;
    std::vector<LayeredEdge> edges;
    for (int row = 0; row + 1 < kRows; ++row) {
      // Both ends go to the right, one of them by one.
      for (int from = 0, to = 0; from < kPerRow && to < kPerRow; (rng.below(2) == 0 ? from : to) += 1) {
        edges.push_back({named[at(row * kPerRow + from)], named[at((row + 1) * kPerRow + to)], {}, {}, {}});
      }
    }
    int bends = 1000;
    const LayeredDrawing drawn = place(nodes, edges, rows, bends);
    const int before = crossings;
    for (std::size_t a = 0; a < edges.size(); ++a) {
      for (std::size_t b = 0; b < a; ++b) {
        if (rows[at(edges[a].from)] != rows[at(edges[b].from)]) continue;
        const double above = drawn.nodes[at(edges[a].from)].x - drawn.nodes[at(edges[b].from)].x;
        const double below = drawn.nodes[at(edges[a].to)].x - drawn.nodes[at(edges[b].to)].x;
        if (above * below < 0) ++crossings;
      }
    }
    drawn_so += crossings == before ? 1 : 0;
  }
  EXPECT_GE(drawn_so, 20);
  EXPECT_LE(crossings, 200);  // 632 where each row begins as its nodes come
}

TEST(ChartLayout, GoesDownFromTheInitialState) {
  const ChartLayout placed = layout(door());
  EXPECT_LT(placed.states[0].y, placed.states[1].y);
  EXPECT_LT(placed.states[1].y, placed.states[2].y);
  EXPECT_LT(placed.states[2].y, placed.states[3].y);
}

TEST(ChartLayout, WritesTransitionsWithoutTargetInsideTheirState) {
  Chart chart;
  chart.states = {state(-1, "s")};
  chart.transitions = {transition(0, {}, "tick", "", "n = n + 1")};
  const ChartLayout placed = layout(chart);
  EXPECT_TRUE(placed.edges.empty());
  EXPECT_THAT(placed.lines[0], ::testing::ElementsAre("tick / n = n + 1"));
}

TEST(ChartLayout, StandsManyStatesAndDeepNesting) {
  Chart ring;  // a long way back up from the last to the first: bends in every row
  for (int s = 0; s < 1000; ++s) ring.states.push_back(state(-1, "s" + std::to_string(s)));
  for (int s = 0; s < 1000; ++s) ring.transitions.push_back(transition(s, {(s + 1) % 1000}, "next"));
  EXPECT_EQ(layout(ring).edges.size(), 1000u);
  Chart nested;
  for (int s = 0; s < 5000; ++s) nested.states.push_back(state(s - 1, "n"));
  nested.transitions = {transition(0, {4999}, "in"), transition(4999, {0}, "out")};
  const ChartLayout placed = layout(nested);
  EXPECT_GT(placed.states[0].height, placed.states[4999].height);
  EXPECT_TRUE(layout(Chart{}).states.empty());
}

TEST(ChartLayout, DrawsStraightWhatExceedsItsBounds) {
  Chart bends;  // every state leads back to the first: rows · arrows bends, far more than the bound
  for (int s = 0; s < 400; ++s) bends.states.push_back(state(-1, "s"));
  for (int s = 1; s < 400; ++s) {
    bends.transitions.push_back(transition(s - 1, {s}, "next"));
    bends.transitions.push_back(transition(s, {0}, "reset"));
  }
  static_assert(2 * 400 * 400 / 2 > kChartBendsMax);
  const ChartLayout placed = layout(bends);
  const auto straight =
      std::count_if(placed.edges.begin(), placed.edges.end(), [](const ChartEdge& e) { return e.curve.size() == 4; });
  EXPECT_GT(straight, 100);

  Chart passes;  // deep nesting times many arrows
  for (int s = 0; s < 1000; ++s) passes.states.push_back(state(s - 1, "n"));
  passes.states.push_back(state(-1, "out"));
  for (int k = 0; k < 200; ++k) passes.transitions.push_back(transition(999, {1000}));
  static_assert(200 * 1000 > kChartPassesMax);
  EXPECT_EQ(layout(passes).edges.size(), 200u);
}

TEST(ChartSvg, EscapesEveryText) {
  Chart chart;
  chart.title = "<t>";
  chart.states = {state(-1, "a & b"), state(-1, "<script>")};
  chart.states[0].lines = {"entry / x < 3 && y > \"2\""};
  chart.transitions = {transition(0, {1}, "e", "a < b && c")};
  const std::string svg = to_svg(chart);
  EXPECT_THAT(svg, Not(HasSubstr("<script>")));
  EXPECT_THAT(svg, HasSubstr("x &lt; 3 &amp;&amp; y &gt; &quot;2&quot;"));
  EXPECT_THAT(svg, HasSubstr("e [a &lt; b &amp;&amp; c]"));
}

TEST(ChartSvg, MarksActiveStatesAndTheLastTransition) {
  Chart chart = door();
  const std::string before = to_svg(chart);
  EXPECT_THAT(before, Not(HasSubstr("class=\"state active\"")));
  chart.states[2].active = true;
  chart.transitions[1].last = true;
  const std::string svg = to_svg(chart);
  EXPECT_THAT(svg, HasSubstr("class=\"state active\""));
  EXPECT_THAT(svg, HasSubstr("<title>open: active</title>"));
  EXPECT_THAT(svg, HasSubstr("class=\"badge\""));
  EXPECT_THAT(svg, HasSubstr("class=\"arrow last\""));
  EXPECT_EQ(svg, to_svg(chart));
}

TEST(ChartDot, NestsClustersAndNamesTheirArrows) {
  Chart chart;
  chart.states = {state(-1, "outer"), state(0, "inner \"x\""), state(-1, "end", StateKind::kFinal)};
  chart.transitions = {transition(0, {2}, "done"), transition(1, {}, "tick", "", "n++")};
  EXPECT_EQ(
      to_dot(chart),
      "digraph chart {\n  compound=true;\n"
      "  node [fontname=\"Helvetica\", fontsize=11, fillcolor=white];\n  edge [fontname=\"Helvetica\", fontsize=9];\n"
      "  graph [fontname=\"Helvetica\", fontsize=11, style=rounded];\n"
      "  subgraph cluster_s0 { label=\"outer\"; labeljust=l; style=rounded;\n"
      "    s1 [shape=box, style=\"rounded,filled\", label=\"inner \\\"x\\\"\\ntick / n++\"];\n"
      "  }\n"
      "  s2 [shape=box, style=\"rounded,filled\", label=\"end\", peripheries=2];\n"
      "  s1 -> s2 [ltail=cluster_s0, label=\"done\"];\n}\n");
}

TEST(ChartMermaid, WritesRegionsAndInitialStates) {
  Chart chart;
  chart.states = {state(-1, "", StateKind::kInitial),
                  state(-1, "both", StateKind::kParallel),
                  state(1, "left"),
                  state(2, "l1"),
                  state(1, "right"),
                  state(4, "r:1")};
  chart.states[5].active = true;
  chart.transitions = {transition(0, {1}), transition(3, {3}, "again", "x > 1")};
  EXPECT_EQ(to_mermaid(chart),
            "stateDiagram-v2\n"
            "  state \"both\" as s1 {\n"
            "    state \"left\" as s2 {\n"
            "      state \"l1\" as s3\n"
            "      s3 --> s3 : again #91;x #62; 1#93;\n"
            "    }\n"
            "    --\n"
            "    state \"right\" as s4 {\n"
            "      state \"r#58;1\" as s5\n"
            "    }\n"
            "  }\n"
            "  [*] --> s1\n"
            "  classDef active fill:#e1efff,stroke:#0b62c4,stroke-width:3px\n"
            "  class s5 active\n");
}

TEST(ChartPlantUml, WritesStatesHistoryAndTheLastTransition) {
  Chart chart;
  chart.states = {state(-1, "on"), state(0, "", StateKind::kHistoryDeep), state(0, "idle"), state(-1, "off")};
  chart.states[3].active = true;
  chart.transitions = {transition(1, {2}), transition(3, {1}, "resume"), transition(0, {3}, "stop")};
  chart.transitions[2].last = true;
  EXPECT_EQ(to_plantuml(chart),
            "@startuml\nhide empty description\n"
            "  state \"on\" as s0 {\n"
            "    state \"\" as s1 <<history*>>\n"
            "    state \"idle\" as s2\n"
            "    s1 --> s2\n"
            "  }\n"
            "  state \"off\" as s3 #e1efff;line:0b62c4;line.bold\n"
            "s3 --> s1 : resume\ns0 -[#0b62c4,bold]-> s3 : stop\n@enduml\n");
}

TEST(ChartMermaid, WritesAnArrowWhereBothItsEndsAreKnown) {
  Chart chart;
  chart.states = {state(-1, "a"), state(0, "inner"), state(-1, "b")};
  chart.transitions = {transition(1, {2}, "leave"), transition(0, {1}, "restart")};
  EXPECT_EQ(to_mermaid(chart),
            "stateDiagram-v2\n  state \"a\" as s0 {\n    state \"inner\" as s1\n  }\n  state \"b\" as s2\n"
            "  s1 --> s2 : leave\n  s0 --> s1 : restart\n");
}

TEST(ChartValue, HoldsPositionsOfStatesAndArrows) {
  const Chart chart = door();
  const ChartLayout placed = layout(chart);
  const Value value = to_value(chart, placed);
  EXPECT_EQ(value.find("states")->as_list()->size(), 4u);
  const Value& arrow = value.find("edges")->as_list()->at(1);
  EXPECT_EQ(arrow.find("source")->number(), 1);
  EXPECT_EQ(arrow.find("target")->number(), 2);
  EXPECT_EQ(arrow.at({"label", "x"})->number(), placed.edges[1].label.x);
  EXPECT_EQ(to_json(value), to_json(to_value(chart, layout(chart))));
}

TEST(LabelText, JoinsWhatThereIs) {
  EXPECT_EQ(label_text(transition(0, {0}, "e", "c", "a")), "e [c] / a");
  EXPECT_EQ(label_text(transition(0, {0}, "", "c")), "[c]");
  EXPECT_EQ(label_text(transition(0, {0})), "");
}

}  // namespace
}  // namespace sentree::draw
