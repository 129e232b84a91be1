import { expect, it } from "vitest";

import type { ChartFold, EditedChart, OutlineTree } from "../protocol/types";
import { nodes_inside, outermost, outermost_states, span_of, states_inside } from "./selection";

const node = (element: number, parent: number) => ({ element, parent, name: "", id: `N${element}` });
const tree = {
  element: 1,
  // 2 (3 (5), 4)
  nodes: [node(2, -1), node(3, 0), node(5, 1), node(4, 0)],
  layout: { nodes: [0, 100, 200, 300].map((x) => ({ x, y: x, width: 50, height: 20 })) },
} as unknown as OutlineTree;
const [root, three, five, four] = tree.nodes as [never, never, never, never];

it("what is inside of another chosen node goes along with it", () => {
  expect(outermost(tree, [five, four, three])).toEqual([three, four]);
  expect(outermost(tree, [five, root])).toEqual([root]);
  expect(outermost(tree, [four, five])).toEqual([five, four]);
});

it("several nodes have a place where they are children of one", () => {
  expect(span_of(tree, [four, three])).toEqual({ parent: 2, first: 0, last: 1 });
  expect(span_of(tree, [root])).toEqual({ parent: 1, first: 0, last: 0 });
  expect(span_of(tree, [four, five])).toBeNull();
  expect(span_of(tree, [])).toBeNull();
});

it("a band takes the nodes that are in it as a whole", () => {
  expect(nodes_inside(tree, { x: 90, y: 90, width: 160, height: 130 })).toEqual([three, five]);
  expect(nodes_inside(tree, { x: 110, y: 90, width: 140, height: 130 })).toEqual([five]);
});

// The dot before a, and a (b (c), d).
const chart = { states: [["", ""], ["a", ""], ["b", "a"], ["c", "b"], ["d", "a"]].map(([id, inside]) => ({ id, inside })) } as unknown as EditedChart;
const ids = (...wanted: string[]) => chart.states.filter(({ id }) => wanted.includes(id));

it("what is inside of another chosen state goes along with it", () => {
  expect(outermost_states(chart, ids("d", "c", "b"))).toEqual(ids("b", "d"));
  expect(outermost_states(chart, ids("c", "a"))).toEqual(ids("a"));
  expect(outermost_states(chart, [])).toEqual([]);
});

it("a band takes the states that are in what is shown of it", () => {
  // b is closed: c is not shown.
  const shown = { states: [0, 1, 2, 4], layout: { states: [0, 0, 10, 60].map((x, i) => ({ x, y: x, width: i === 1 ? 100 : 20, height: 20 })) } } as unknown as ChartFold;
  expect(states_inside(chart, shown, { x: 0, y: 0, width: 80, height: 80 })).toEqual(["b", "d"]);
  expect(states_inside(chart, shown, { x: 5, y: 5, width: 30, height: 30 })).toEqual(["b"]);
});
