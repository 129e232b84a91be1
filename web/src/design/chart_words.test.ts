import { expect, it } from "vitest";

import { label_of, read_label } from "./chart_words";

it("a label is read as it is written", () => {
  for (const one of [
    { event: "tick", condition: "" },
    { event: "", condition: "list[0] > 2" },
    { event: "navigation.state.* done.state.a", condition: "_event.data['a'] === ']'" },
    { event: "", condition: "" },
  ])
    expect(read_label(label_of(one))).toEqual(one);
  expect(read_label("  go[ a ] ")).toEqual({ event: "go", condition: "a" });
});

it("what is no label is told", () => {
  for (const text of ["go [a", "go ]", "go [a] b"]) expect(read_label(text)).toBeNull();
});
