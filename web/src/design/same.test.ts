import { expect, it } from "vitest";

import type { OutlineNode, OutlineTree } from "../protocol/types";
import { is_same_drawn, is_same_node } from "./same";

const node: OutlineNode = { element: 3, parent: 0, id: "AtLocation", name: "AtKitchen", kind: "condition", known: true, children_min: 0, children_max: 0, from: 40, open_end: 80, to: 80, attributes: [["location", "kitchen"]] };
const drawn: OutlineTree["layout"]["nodes"][number] = { x: 1, y: 2, width: 90, height: 40, parent: 0, shape: "condition", status: "", symbol: "", title: ["AtKitchen"], lines: ["location: kitchen"] };

it("a node that an edit elsewhere has moved in the text is drawn as it was", () => {
  expect(is_same_node(node, { ...node, from: 41, open_end: 81, to: 81, attributes: [["location", "kitchen"]] })).toBe(true);
  expect(is_same_drawn(drawn, { ...drawn, title: ["AtKitchen"], lines: ["location: kitchen"] })).toBe(true);
});

it("whatever is to be seen of a node is drawn anew", () => {
  for (const other of [{ element: 4 }, { id: "GoTo" }, { name: "" }, { kind: "action" }, { known: false }] as const) expect(is_same_node(node, { ...node, ...other }), JSON.stringify(other)).toBe(false);
  for (const other of [{ x: 0 }, { y: 0 }, { width: 91 }, { height: 41 }, { shape: "action" }, { symbol: "→" }, { title: [] }, { lines: ["location: study"] }] as const)
    expect(is_same_drawn(drawn, { ...drawn, ...other } as typeof drawn), JSON.stringify(other)).toBe(false);
});
