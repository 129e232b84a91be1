import { expect, it } from "vitest";

import type { OutlineTree, TreeNode } from "../protocol/types";
import { nodes_of_run, status_code, statuses_of } from "./run_statuses";

const edited = (id: string, ...nodes: [element: number, parent: number, id: string, name: string][]) =>
  ({ id, nodes: nodes.map(([element, parent, type, name]) => ({ element, from: element, parent, id: type, name })) }) as unknown as OutlineTree;
const ran = (...nodes: [parent: number | null, kind: string, type: string, name: string][]) => nodes.map(([parent, kind, type, name], id) => ({ id, parent, kind, type, name })) as unknown as TreeNode[];

it("nodes of a tree that is edited are found in a run by name and kind, the first first", () => {
  const run = ran([null, "control", "Sequence", "Root"], [0, "action", "Go", "Go"], [0, "action", "Go", "Go"], [0, "subtree", "Sub", "Sub"], [3, "action", "Go", "Go"]);
  const main = edited("Main", [10, -1, "Sequence", "Root"], [20, 0, "Go", ""], [30, 0, "Wait", ""], [40, 0, "Go", ""], [50, 0, "Go", ""]);
  expect([...nodes_of_run(main, run, "Main")]).toEqual([[10, 0], [20, 1], [40, 2]]);
  expect([...nodes_of_run(edited("Sub", [7, -1, "Go", ""]), run, "Main")]).toEqual([[7, 4]]);
});

it("a tree that runs several times, or not at all, has no statuses", () => {
  const run = ran([null, "control", "Sequence", "Root"], [0, "subtree", "Sub", "A"], [0, "subtree", "Sub", "B"]);
  expect(nodes_of_run(edited("Sub", [7, -1, "Go", ""]), run, "Main").size).toBe(0);
  expect(nodes_of_run(edited("Other", [7, -1, "Go", ""]), run, "Main").size).toBe(0);
  // Its root is as the main tree's.
  expect(nodes_of_run(edited("Other", [7, -1, "Sequence", "Root"]), run, "Main").size).toBe(0);
});

it("what a node is and was is one number", () => {
  expect(statuses_of(status_code(1, 3))).toEqual([1, 3]);
});
