import { describe, expect, it } from "vitest";
import { free_place, places_of } from "./world_places";

const kWorld = `start: hall
locations:
  hall: [1.2, 1.5, 45 deg]
  dock: {pose: [8, 5, 1.57], description: below the window}
areas:
  kitchen: {corners: [[10, 6], [16, 6], [16, 10]]}
stations:
  s1: {pose: dock, linear_tolerance: 0.5, angular_tolerance: 20 deg}
obstacles:
  bin:   {pose: [3, 4], radius: 0.2}
  shelf: {pose: [5, 4, 0.3], size: [1.0, 0.4], on_map: true}
doors:
  front: {from: [4, 4.2], to: [5, 4.2]}
`;

describe("the places of a world", () => {
  it("are what is written, with what is around them", () => {
    const { spots, shapes, obstacles, rings } = places_of(kWorld);
    expect(spots.map(({ name, heading }) => [name, heading?.text])).toEqual([["hall", "45 deg"], ["dock", "1.57"]]);
    expect(shapes.map(({ kind, spots: ends }) => [kind, ends.map(({ name }) => name)])).toEqual([["area", ["kitchen, corner 1", "kitchen, corner 2", "kitchen, corner 3"]], ["door", ["front, from", "front, to"]]]);
    expect(obstacles.map(({ spot, ring, size }) => [spot.name, ring?.radius?.text, size])).toEqual([["bin", "0.2", null], ["shelf", undefined, [1, 0.4]]]);
    expect(rings.map(({ id, x, radius }) => [id, x.text, radius?.text])).toEqual([["station s1 tolerance", "8", "0.5"]]);
  });
  it("are none while the text is broken", () => {
    expect(places_of("locations: [")).toEqual({ spots: [], shapes: [], obstacles: [], rings: [] });
  });
  it("leave room for something new", () => {
    const [x, y] = free_place(places_of(kWorld), [8, 5]);
    expect(Math.hypot(x - 8, y - 5)).toBeGreaterThanOrEqual(0.8);
    expect(Math.hypot(x - 8, y - 5)).toBeLessThan(1.6);
    expect(free_place(places_of("start: [0, 0, 0]\n"), [2, 3])).toEqual([2, 3]);
  });
});
