import { describe, expect, it } from "vitest";
import { arrow } from "./arrow";

describe("an arrow", () => {
  it("ends in a head that points where the line goes", () => {
    const shape = arrow([[0, 0], [0, 10], [0, 20], [0, 30]]);
    expect(shape?.head).toBe("M0 30L-3.6 21L3.6 21Z");
    expect(shape?.line.at(-1)![1]).toBeCloseTo(22.8);
  });
  it("looks past points that repeat the tip", () => {
    expect(arrow([[0, 0], [10, 0], [30, 0], [30, 0]])?.head).toBe("M30 0L21 3.6L21 -3.6Z");
  });
  it("is nothing without a line", () => {
    expect(arrow([])).toBeNull();
    expect(arrow([[1, 1], [1, 1], [1, 1], [1, 1]])?.head).toMatch(/^M1 1L/);
  });
});
