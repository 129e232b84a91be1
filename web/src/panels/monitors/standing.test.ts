import { expect, it } from "vitest";

import { split_standing } from "./standing";

it("a standing is a first word and what is said", () => {
  expect(split_standing("pending: waits for level")).toEqual({ word: "pending", rest: "waits for level" });
  expect(split_standing("holds so far: in state content")).toEqual({ word: "holds so far", rest: "in state content" });
  expect(split_standing("")).toEqual({ word: "", rest: "" });
  expect(split_standing("something: else")).toEqual({ word: "", rest: "something: else" });
});
