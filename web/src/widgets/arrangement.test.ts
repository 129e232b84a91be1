import { describe, expect, it } from "vitest";

import { kDefaultLayout, move_border, parse_layout } from "./arrangement";

describe("a stored layout", () => {
  it("is taken when it has the panels of this page", () => {
    const stored = { ...kDefaultLayout, timeline_px: 333, maximised: "map" as const };
    expect(parse_layout(JSON.stringify(stored))).toEqual({ ...stored, maximised: null });
  });

  it("is dropped when it is of another version, or damaged", () => {
    const other = { ...kDefaultLayout, columns: kDefaultLayout.columns.slice(1) };
    const weightless = { ...kDefaultLayout, columns: kDefaultLayout.columns.map((column) => ({ ...column, weight: 0 })) };
    for (const text of [null, "", "{", "[]", "{}", JSON.stringify(other), JSON.stringify(weightless)]) expect(parse_layout(text)).toBe(kDefaultLayout);
  });
});

describe("a border", () => {
  it("takes from one neighbour what it gives the other", () => {
    expect(move_border([1, 1, 2], 0, 0.125)).toEqual([1.5, 0.5, 2]);
  });

  it("leaves each neighbour something", () => {
    const [first, second] = move_border([1, 1], 0, 5);
    expect(second).toBeGreaterThan(0.2);
    expect((first ?? 0) + (second ?? 0)).toBe(2);
  });

  it("beyond the last is none", () => {
    expect(move_border([1, 1], 1, 0.5)).toEqual([1, 1]);
  });
});
