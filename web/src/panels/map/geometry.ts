import type { Matrix } from "../../picture/pen";
import type { Viewport } from "../../picture/viewport";
import type { Point, Pose, Rect, WorldModel } from "../../protocol/types";

export type MapInfo = NonNullable<WorldModel["map"]>;

// The picture of a world is the world with y turned down: metres, x right. Its viewport's scale is pixels per metre.

export function world_to_screen(view: Viewport, point: readonly [number, number, ...number[]]): Point {
  return [view.scale * point[0] + view.x, view.y - view.scale * point[1]];
}

export function screen_to_world(view: Viewport, point: Point): Point {
  return [(point[0] - view.x) / view.scale, (view.y - point[1]) / view.scale];
}

/** From coordinates in the frame of `pose` to those of the frame that the pose is in. */
export function transform(pose: Pose, point: Point): Point {
  const [c, s] = [Math.cos(pose[2]), Math.sin(pose[2])];
  return [pose[0] + c * point[0] - s * point[1], pose[1] + s * point[0] + c * point[1]];
}

/** Into [-π, π). */
export function wrap_angle(angle: number): number {
  const turn = 2 * Math.PI;
  return ((((angle + Math.PI) % turn) + turn) % turn) - Math.PI;
}

/** The cell that holds a point of the world, row 0 at the bottom of the map; null beside the map. */
export function cell_at(map: MapInfo, point: Point): { column: number; row: number } | null {
  const [ox, oy, yaw] = map.origin;
  const [dx, dy] = [point[0] - ox, point[1] - oy];
  const [c, s] = [Math.cos(yaw), Math.sin(yaw)];
  const column = Math.floor((c * dx + s * dy) / map.resolution);
  const row = Math.floor((-s * dx + c * dy) / map.resolution);
  const inside = column >= 0 && row >= 0 && column < map.width && row < map.height;
  return inside ? { column, row } : null;
}

/** Corners of the map in the world, counter-clockwise from its origin. */
export function map_corners(map: MapInfo): Point[] {
  const [width, height] = [map.width * map.resolution, map.height * map.resolution];
  const corners: Point[] = [[0, 0], [width, 0], [width, height], [0, height]];
  return corners.map((corner) => transform(map.origin, corner));
}

/** The smallest box of the picture (y down) around points of the world. */
export function picture_box(points: readonly Point[]): Rect {
  if (points.length === 0) return { x: -1, y: -1, width: 2, height: 2 };
  const xs = points.map((p) => p[0]);
  const ys = points.map((p) => -p[1]);
  const [x, y] = [Math.min(...xs), Math.min(...ys)];
  return { x, y, width: Math.max(...xs) - x, height: Math.max(...ys) - y };
}

/** From the pixels of the map's image, whose first row is the map's last, to the screen. */
export function image_matrix(view: Viewport, map: MapInfo): Matrix {
  const [ox, oy, yaw] = map.origin;
  const cell = view.scale * map.resolution;
  const [c, s] = [Math.cos(yaw), Math.sin(yaw)];
  // Column u, image row v is at the map's metres (u, height − v) · resolution, turned by yaw, shifted, y turned down.
  const top = map.height * map.resolution;
  const [e, f] = world_to_screen(view, [ox - s * top, oy + c * top]);
  return [cell * c, -cell * s, cell * s, cell * c, e, f];
}

/** A round length [m] whose bar is at most `pixels_max` long. */
export function scale_bar(scale: number, pixels_max: number): { metres: number; pixels: number } {
  const longest = pixels_max / scale;
  const power = 10 ** Math.floor(Math.log10(longest));
  const metres = [5, 2, 1].map((step) => step * power).find((length) => length <= longest * (1 + 1e-12)) ?? power;
  return { metres, pixels: metres * scale };
}

/** `2 m`, `50 cm`, `1 km`. */
export function length_text(metres: number): string {
  if (metres >= 1000) return `${short(metres / 1000)} km`;
  if (metres >= 1) return `${short(metres)} m`;
  return metres >= 0.01 ? `${short(metres * 100)} cm` : `${short(metres * 1000)} mm`;
}

function short(value: number): string {
  return String(Number(value.toPrecision(3)));
}

/** Beams of a scan taken at `laser_at` as points of the world; those that hit nothing are left out. */
export function scan_points(laser_at: Pose, laser: { angle_min: number; angle_increment: number }, ranges: readonly (number | null)[]): Point[] {
  const points: Point[] = [];
  ranges.forEach((range, i) => {
    if (range === null || !Number.isFinite(range)) return;
    const angle = laser_at[2] + laser.angle_min + i * laser.angle_increment;
    points.push([laser_at[0] + range * Math.cos(angle), laser_at[1] + range * Math.sin(angle)]);
  });
  return points;
}

/** What the laser sees: the polygon through the ends of all beams. One of a full turn does not pass through the laser. */
export function scan_polygon(
  laser_at: Pose,
  laser: { angle_min: number; angle_increment: number; range_max: number },
  ranges: readonly (number | null)[],
): Point[] {
  const points: Point[] = ranges.map((range, i) => {
    const angle = laser_at[2] + laser.angle_min + i * laser.angle_increment;
    const length = range === null || !Number.isFinite(range) ? laser.range_max : range;
    return [laser_at[0] + length * Math.cos(angle), laser_at[1] + length * Math.sin(angle)];
  });
  const view = Math.abs(laser.angle_increment) * ranges.length;
  return view < 2 * Math.PI - 1e-6 ? [[laser_at[0], laser_at[1]], ...points] : points;
}

/** Where the laser of a robot at `pose` is. */
export function laser_pose(pose: Pose, laser: { x: number; y: number; yaw: number }): Pose {
  const [x, y] = transform(pose, [laser.x, laser.y]);
  return [x, y, pose[2] + laser.yaw];
}

/** True inside a simple polygon; points on its border may count either way. */
export function inside_polygon(polygon: readonly Point[], [x, y]: Point): boolean {
  let inside = false;
  for (let i = 0, j = polygon.length - 1; i < polygon.length; j = i++) {
    const [ax, ay] = polygon[i]!;
    const [bx, by] = polygon[j]!;
    if (ay > y !== by > y && x < ((bx - ax) * (y - ay)) / (by - ay) + ax) inside = !inside;
  }
  return inside;
}

/** Distance of a point to the line from `a` to `b`. */
export function segment_distance(a: Point, b: Point, point: Point): number {
  const [dx, dy] = [b[0] - a[0], b[1] - a[1]];
  const square = dx * dx + dy * dy;
  const t = square > 0 ? Math.min(Math.max(((point[0] - a[0]) * dx + (point[1] - a[1]) * dy) / square, 0), 1) : 0;
  return Math.hypot(point[0] - a[0] - t * dx, point[1] - a[1] - t * dy);
}
