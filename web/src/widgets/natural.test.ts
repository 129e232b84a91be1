import { expect, it } from "vitest";

import { by_name } from "./natural";

it("numbers in names count as numbers", () => {
  expect(["leaf10", "leaf2", "Leaf1", "leaf2b"].sort(by_name)).toEqual(["Leaf1", "leaf2", "leaf2b", "leaf10"]);
  expect(["skills/b.scxml", "skills/a10.scxml", "skills/a9.scxml"].sort(by_name)).toEqual(["skills/a9.scxml", "skills/a10.scxml", "skills/b.scxml"]);
});
