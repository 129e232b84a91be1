import { describe, expect, it } from "vitest";
import { free_name, pick, type Pickable } from "./picking";

const kThings: Pickable = {
  robots: [
    { name: "left", pose: [1, 1, 0], radius: 0.22 },
    { name: "right", pose: [1.2, 1, 0], radius: 0.22 },
  ],
  obstacles: [
    { name: "box", polygon: [[3, 3], [4, 3], [4, 4], [3, 4]] },
    { name: "disc", circle: [1, 1.3, 0.3] },
  ],
  doors: [{ name: "kitchen", open: false, polygon: [[6, 0], [7, 0], [7, 0.1], [6, 0.1]] }],
  locations: [{ name: "start", x: 9, y: 9, theta: 0 }],
  stations: [{ name: "dock", x: 9.1, y: 9, theta: 0 }],
};

describe("picking", () => {
  it("takes the robot drawn last, then robots before what they stand on", () => {
    expect(pick(kThings, [1.1, 1], 0.05)).toMatchObject({ kind: "robot", name: "right" });
    expect(pick(kThings, [0.95, 1.15], 0.05)).toMatchObject({ kind: "robot", name: "left" });
    expect(pick(kThings, [1, 1.5], 0.05)).toEqual({ kind: "obstacle", name: "disc" });
  });

  it("hits thin and small things from beside", () => {
    expect(pick(kThings, [6.5, 0.15], 0.2)).toEqual({ kind: "door", name: "kitchen", open: false });
    expect(pick(kThings, [6.5, 0.5], 0.2)).toBeNull();
    expect(pick(kThings, [8.9, 9], 0.15)).toEqual({ kind: "location", name: "start" });
    expect(pick(kThings, [3.5, 3.5], 0.01)).toEqual({ kind: "obstacle", name: "box" });
  });

  it("finds nothing on the free floor", () => {
    expect(pick(kThings, [12, 12], 0.1)).toBeNull();
  });
});

describe("names of new obstacles", () => {
  it("are the first that are free", () => {
    expect(free_name([], "obstacle")).toBe("obstacle-1");
    expect(free_name(["obstacle-1", "obstacle-3"], "obstacle")).toBe("obstacle-2");
  });
});
