import { expect, it } from "vitest";

import type { OutlineTree } from "../protocol/types";
import { nodes_inside, outermost, span_of } from "./selection";

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
