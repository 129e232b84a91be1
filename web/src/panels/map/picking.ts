import type { Location, Obstacle, Point, Pose } from "../../protocol/types";
import { inside_polygon, segment_distance } from "./geometry";

export type Hit =
  | { kind: "robot"; name: string; pose: Pose }
  | { kind: "obstacle"; name: string }
  | { kind: "door"; name: string; open: boolean }
  | { kind: "location" | "station"; name: string };

/** A door with the floor that it closes. */
export interface DrawnDoor {
  name: string;
  open: boolean;
  polygon: Point[];
}

export interface Pickable {
  robots: readonly { name: string; pose: Pose; radius: number }[];
  obstacles: readonly Obstacle[];
  doors: readonly DrawnDoor[];
  locations: readonly Location[];
  stations: readonly Location[];
}

/** What is drawn at a point of the world, the topmost first; things smaller than `reach` [m] can be hit beside them. */
export function pick(things: Pickable, point: Point, reach: number): Hit | null {
  const near = (x: number, y: number, radius: number) => Math.hypot(point[0] - x, point[1] - y) <= Math.max(radius, reach);
  for (const robot of [...things.robots].reverse()) {
    if (near(robot.pose[0], robot.pose[1], robot.radius)) return { kind: "robot", name: robot.name, pose: robot.pose };
  }
  for (const { name, circle, polygon } of [...things.obstacles].reverse()) {
    if (circle && near(...circle)) return { kind: "obstacle", name };
    if (polygon && near_polygon(polygon, point, reach)) return { kind: "obstacle", name };
  }
  for (const { name, open, polygon } of things.doors) {
    if (near_polygon(polygon, point, reach)) return { kind: "door", name, open };
  }
  for (const { name, x, y } of things.locations) if (near(x, y, 0)) return { kind: "location", name };
  for (const { name, x, y } of things.stations) if (near(x, y, 0)) return { kind: "station", name };
  return null;
}

function near_polygon(polygon: readonly Point[], point: Point, reach: number): boolean {
  if (inside_polygon(polygon, point)) return true;
  return polygon.some((corner, i) => segment_distance(corner, polygon[(i + 1) % polygon.length]!, point) <= reach / 2);
}

/** `obstacle-3`: the first that is free. */
export function free_name(taken: readonly string[], stem: string): string {
  for (let n = 1; ; ++n) if (!taken.includes(`${stem}-${n}`)) return `${stem}-${n}`;
}
