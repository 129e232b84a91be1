import { describe, expect, it } from "vitest";
import type { Point, Pose } from "../../protocol/types";
import {
  cell_at,
  image_matrix,
  inside_polygon,
  length_text,
  map_corners,
  picture_box,
  scale_bar,
  laser_pose,
  scan_points,
  scan_polygon,
  screen_to_world,
  segment_distance,
  transform,
  world_to_screen,
  wrap_angle,
  type MapInfo,
} from "./geometry";

const kView = { scale: 40, x: 120, y: 300 };
const kYawed: MapInfo = { width: 30, height: 20, resolution: 0.1, origin: [1, -2, Math.PI / 6] };

function close(actual: Point, wanted: Point) {
  expect(actual[0]).toBeCloseTo(wanted[0], 9);
  expect(actual[1]).toBeCloseTo(wanted[1], 9);
}

describe("the map's frames", () => {
  it("have y up in the world and down on the screen", () => {
    expect(world_to_screen(kView, [1, 1])).toEqual([160, 260]);
    close(screen_to_world(kView, world_to_screen(kView, [-3.2, 7.9])), [-3.2, 7.9]);
  });

  it("turn the floor plan by the origin's yaw about the map's lower left corner", () => {
    const [origin, right, , top] = map_corners(kYawed);
    close(origin!, [1, -2]);
    close(right!, [1 + 3 * Math.cos(Math.PI / 6), -2 + 3 * Math.sin(Math.PI / 6)]);
    close(top!, [1 - 2 * Math.sin(Math.PI / 6), -2 + 2 * Math.cos(Math.PI / 6)]);
  });

  it("put the pixels of the image where their cells are, whatever origin and yaw", () => {
    for (const origin of [[0, 0, 0], [1, -2, Math.PI / 6], [-4, 3, -2.5]] as Pose[]) {
      const map: MapInfo = { width: 30, height: 20, resolution: 0.1, origin };
      const [a, b, c, d, e, f] = image_matrix(kView, map);
      for (const [column, row] of [[0, 0], [29, 0], [0, 19], [17, 4]] as Point[]) {
        // The middle of the cell, in the image: its first row is the map's last.
        const [u, v] = [column + 0.5, map.height - row - 0.5];
        const screen: Point = [a * u + c * v + e, b * u + d * v + f];
        close(screen, world_to_screen(kView, transform(origin, [(column + 0.5) * 0.1, (row + 0.5) * 0.1])));
        expect(cell_at(map, screen_to_world(kView, screen))).toEqual({ column, row });
      }
    }
  });

  it("know what lies beside the map", () => {
    expect(cell_at(kYawed, [1, -2.01])).toBeNull();
    expect(cell_at(kYawed, transform(kYawed.origin, [3.01, 1]))).toBeNull();
    expect(cell_at(kYawed, transform(kYawed.origin, [2.99, 1.99]))).toEqual({ column: 29, row: 19 });
  });

  it("give the box of the picture with y down", () => {
    expect(picture_box([[1, 2], [4, 8]])).toEqual({ x: 1, y: -8, width: 3, height: 6 });
    expect(picture_box([]).width).toBeGreaterThan(0);
  });
});

describe("the scale bar", () => {
  it("is the longest round length that fits", () => {
    expect(scale_bar(40, 100)).toEqual({ metres: 2, pixels: 80 });
    expect(scale_bar(100, 100)).toEqual({ metres: 1, pixels: 100 });
    expect(scale_bar(300, 100).metres).toBeCloseTo(0.2);
    for (let scale = 0.01; scale < 2000; scale *= 1.37) {
      const { metres, pixels } = scale_bar(scale, 100);
      expect(pixels).toBeLessThanOrEqual(100.0001);
      expect(pixels).toBeGreaterThan(39);
      expect(length_text(metres)).toMatch(/^[125]0* (km|m|cm|mm)$/);
    }
  });
});

describe("a scan", () => {
  const laser = { angle_min: -Math.PI / 2, angle_increment: Math.PI / 2, range_max: 8, x: 0.1, y: 0, yaw: 0 };
  const pose: Pose = [2, 3, Math.PI / 2];

  it("starts at the laser's own pose on the robot and leaves out what hits nothing", () => {
    const points = scan_points(laser_pose(pose, laser), laser, [1, 2, null]);
    expect(points).toHaveLength(2);
    close(points[0]!, [3, 3.1]);
    close(points[1]!, [2, 5.1]);
  });

  it("sees to its range where nothing is, and passes through the laser unless it sees all round", () => {
    const part = scan_polygon(laser_pose(pose, laser), laser, [1, 2, null]);
    expect(part).toHaveLength(4);
    close(part[0]!, [2, 3.1]);
    close(part[3]!, [-6, 3.1]);
    expect(scan_polygon(laser_pose(pose, laser), laser, [1, 1, 1, 1])).toHaveLength(4);
  });
});

describe("hit tests", () => {
  const polygon: Point[] = [[0, 0], [4, 0], [4, 4], [2, 1], [0, 4]];
  it("know a polygon's inside, also where it is not convex", () => {
    expect(inside_polygon(polygon, [1, 1])).toBe(true);
    expect(inside_polygon(polygon, [2, 3])).toBe(false);
    expect(inside_polygon(polygon, [5, 1])).toBe(false);
  });
  it("measure to the ends of a line beyond it", () => {
    expect(segment_distance([0, 0], [4, 0], [2, 3])).toBe(3);
    expect(segment_distance([0, 0], [4, 0], [7, 4])).toBe(5);
    expect(segment_distance([1, 1], [1, 1], [1, 3])).toBe(2);
  });
});

describe("angles", () => {
  it("wrap to half a turn each way", () => {
    expect(wrap_angle(3 * Math.PI / 2)).toBeCloseTo(-Math.PI / 2);
    expect(wrap_angle(-7)).toBeCloseTo(-7 + 2 * Math.PI);
    expect(wrap_angle(0.3)).toBeCloseTo(0.3);
  });
});
