import { expect, it } from "vitest";

import type { OutlineTree } from "../protocol/types";
import { slot_words } from "./slots";

it("a place in the tree is said by the node that takes what is dropped, and by its neighbours", () => {
  const node = (element: number, parent: number, name: string, id = "Sequence") => ({ element, parent, name, id });
  const tree = { id: "Main", element: 1, nodes: [node(2, -1, "Root"), node(3, 0, "", "Fallback"), node(4, 0, "B"), node(5, 1, "C")] } as unknown as OutlineTree;
  expect(slot_words(tree, { parent: 2, index: 0 })).toBe("into Root, before Fallback");
  expect(slot_words(tree, { parent: 2, index: 1 })).toBe("into Root, after Fallback");
  expect(slot_words(tree, { parent: 2, index: 2 })).toBe("into Root, after B");
  expect(slot_words(tree, { parent: 5, index: 0 })).toBe("into C");
  expect(slot_words({ ...tree, nodes: [] }, { parent: 1, index: 0 })).toBe("the root of Main");
});
