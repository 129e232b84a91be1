import { expect, test } from "vitest";

import { name_of_tree } from "./tree_names";

test("a tree has the name of no node, and of no other tree", () => {
  const nodes = ["Timeout", "Dock"];
  expect(name_of_tree("GoHome", ["Main"], nodes)).toBe("GoHome");
  expect(name_of_tree("Timeout", ["Main"], nodes)).toBe("TimeoutTree");
  expect(name_of_tree("Dock", ["Main", "DockTree"], nodes)).toBe("DockTree2");
  expect(name_of_tree("Main", ["Main"], nodes)).toBe("Main2");
  expect(name_of_tree("go home!", [], nodes)).toBe("go_home_");
  expect(name_of_tree("2nd", [], nodes)).toBe("_2nd");
});
