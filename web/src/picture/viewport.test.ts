import { describe, expect, it } from "vitest";
import type { Point } from "../protocol/types";
import { centre_on, fit, pinch, reveal, to_picture, to_screen, wheel_factor, zoom_at, type Viewport } from "./viewport";

const kLimits = { min: 0.1, max: 10 };
const kSize = { width: 400, height: 300 };

describe("a viewport", () => {
  it("maps a point to the screen and back", () => {
    const view: Viewport = { scale: 2.5, x: -30, y: 12 };
    const [x, y] = to_picture(view, to_screen(view, [3, -7]));
    expect(x).toBeCloseTo(3);
    expect(y).toBeCloseTo(-7);
  });

  it("keeps what is under the pointer when it zooms, also at its limits", () => {
    const at: Point = [130, 70];
    for (const factor of [0.001, 0.5, 1.3, 1000]) {
      const view: Viewport = { scale: 1.5, x: 20, y: -40 };
      const next = zoom_at(view, at, factor, kLimits);
      expect(next.scale).toBeGreaterThanOrEqual(kLimits.min);
      expect(next.scale).toBeLessThanOrEqual(kLimits.max);
      const [x, y] = to_picture(next, at);
      expect(x).toBeCloseTo(to_picture(view, at)[0]);
      expect(y).toBeCloseTo(to_picture(view, at)[1]);
    }
  });

  it("fits a box with its margin and does not blow a small one up", () => {
    const wide = fit({ x: 10, y: 20, width: 1000, height: 100 }, kSize, 20, 1.5, kLimits);
    expect(to_screen(wide, [10, 70])[0]).toBeCloseTo(20);
    expect(to_screen(wide, [1010, 70])[0]).toBeCloseTo(380);
    expect(to_screen(wide, [10, 70])[1]).toBeCloseTo(150);
    expect(fit({ x: 0, y: 0, width: 10, height: 10 }, kSize, 20, 1.5, kLimits).scale).toBe(1.5);
    expect(fit({ x: 0, y: 0, width: 0, height: 0 }, kSize, 20, 1.5, kLimits).scale).toBe(1.5);
  });

  it("centres on a point", () => {
    expect(to_screen(centre_on({ scale: 3, x: 0, y: 0 }, [7, 9], kSize), [7, 9])).toEqual([200, 150]);
  });

  it("reveals with the least move", () => {
    const view: Viewport = { scale: 1, x: 0, y: 0 };
    expect(reveal(view, { x: 50, y: 50, width: 20, height: 20 }, kSize, 10)).toEqual(view);
    expect(reveal(view, { x: 395, y: -5, width: 20, height: 20 }, kSize, 10)).toEqual({ scale: 1, x: -25, y: 15 });
    expect(reveal(view, { x: 90, y: 90, width: 900, height: 20 }, kSize, 10)).toEqual({ scale: 1, x: -80, y: 0 });
  });

  it("follows two fingers", () => {
    const view: Viewport = { scale: 1, x: 0, y: 0 };
    const next = pinch(view, [[100, 100], [200, 100]], [[100, 120], [300, 120]], kLimits);
    expect(next.scale).toBe(2);
    expect(to_screen(next, [100, 100])).toEqual([100, 120]);
    expect(to_screen(next, [200, 100])).toEqual([300, 120]);
  });

  it("zooms alike for wheels that count in lines, and no turn is a leap", () => {
    expect(wheel_factor(-3, 1, false)).toBeCloseTo(wheel_factor(-48, 0, false));
    expect(wheel_factor(-100, 0, false)).toBeGreaterThan(1);
    expect(wheel_factor(1e9, 2, false)).toBeGreaterThan(0.5);
  });
});
