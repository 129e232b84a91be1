import { expect, test } from "vitest";

import type { TreeLayout } from "../protocol/types";
import { kDetailText, largest } from "./fitting";

const node = (shape: TreeLayout["nodes"][number]["shape"]): TreeLayout["nodes"][number] => ({ x: 0, y: 100, width: 122, height: 60, parent: -1, shape, status: "", symbol: "", title: [], lines: [] });
const fit = (shape: TreeLayout["nodes"][number]["shape"], width: number, y = 130) => largest(node(shape), "text", kDetailText, y, 12, 5, () => width);

test("a text is enlarged as far as there is room at its height", () => {
  expect(fit("control", 100)).toBeCloseTo(1.196, 2);
  expect(fit("subtree", 100)).toBeCloseTo(1.096, 2);
  expect(fit("control", 200)).toBe(1);
  // Towards its end an ellipse has less room, and so have the sides of a decorator.
  expect(fit("condition", 60, 140)).toBeLessThan(fit("condition", 60));
  expect(fit("decorator", 60, 140)).toBeLessThan(fit("decorator", 60));
  // Nor does it cross the lower border.
  expect(fit("control", 10, 150)).toBeCloseTo((30 - 20 - 1.2) / (11 * 0.42), 2);
  // Where texts cannot be measured nothing is said.
  expect(fit("control", 0)).toBeGreaterThan(5);
});
