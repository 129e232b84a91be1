import { describe, expect, it } from "vitest";
import { plan_pixels } from "./floor_plan";

describe("the floor plan", () => {
  const map = { width: 2, height: 2 };
  // From the bottom: wall, free; unknown, half sure.
  const cells = new Uint8Array([100, 0, 255, 40]);
  const pixel = (pixels: Uint8ClampedArray, i: number) => [...pixels.slice(4 * i, 4 * i + 4)];

  it("has the map's last row first", () => {
    const pixels = plan_pixels(map, cells, "light");
    expect(pixel(pixels, 2)).toEqual([55, 62, 71, 255]);
    expect(pixel(pixels, 3)).toEqual([255, 255, 255, 255]);
    expect(pixel(pixels, 0)).toEqual([225, 229, 234, 255]);
  });

  it("tells what nobody was sure of from free and from occupied", () => {
    const [unsure] = pixel(plan_pixels(map, cells, "light"), 1);
    expect(unsure).toBeLessThan(255);
    expect(unsure).toBeGreaterThan(55);
  });

  it("is unknown where the cells end early", () => {
    expect(pixel(plan_pixels(map, new Uint8Array([0]), "dark"), 0)).toEqual([34, 42, 51, 255]);
  });
});
