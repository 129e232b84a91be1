import type { Pen } from "../../picture/pen";
import type { Viewport } from "../../picture/viewport";
import type { LaserModel, Location, Obstacle, Point, Pose, RobotState, Size, WorldModel } from "../../protocol/types";
import type { DrawnDoor } from "./picking";
import { image_matrix, laser_pose, length_text, scale_bar, scan_points, scan_polygon, transform, world_to_screen } from "./geometry";

/** What can be left out of the map. */
export const kLayers = ["areas", "places", "laser", "particles", "path", "estimate", "obstacles", "names"] as const;
export type Layer = (typeof kLayers)[number];

/** Particles that are drawn of one robot; of more, evenly chosen ones. */
export const kParticlesMax = 1000;
/** The model does not say how thick a door is. */
const kDoorThickness_m = 0.1;

export interface MapColors {
  ground: string;
  ink: string;
  muted: string;
  line: string;
  accent: string;
  running: string;
  success: string;
  failure: string;
  quiet: string;
  past: string;
  robot: string;
  on_robot: string;
}

export interface DrawnRobot {
  name: string;
  radius: number;
  laser: LaserModel | null;
  /** Where it is drawn: between two updates. */
  pose: Pose;
  state: RobotState;
}

/** Everything that the map shows at one moment. */
export interface Scene {
  world: WorldModel;
  plan: HTMLCanvasElement | null;
  robots: readonly DrawnRobot[];
  obstacles: readonly Obstacle[];
  doors: readonly DrawnDoor[];
  layers: ReadonlySet<Layer>;
  /** What the pointer is at, drawn with an outline. */
  hovered: { kind: string; name: string } | null;
  /** What a tool is about to do. */
  ghost: { kind: "robot" | "goal"; pose: Pose; radius: number } | { kind: "obstacle"; centre: Point; radius: number } | null;
}

export function draw_map(pen: Pen, scene: Scene, view: Viewport, size: Size, colors: MapColors): void {
  const { world, layers } = scene;
  const at = (point: readonly [number, number, ...number[]]) => world_to_screen(view, point);
  const many = (points: readonly Point[]) => points.map(at);
  const px = (metres: number) => metres * view.scale;
  const named = layers.has("names");

  if (scene.plan && world.map) pen.image(scene.plan, image_matrix(view, world.map), px(world.map.resolution) < 3);

  if (layers.has("areas")) {
    for (const { name, polygon } of world.areas) {
      pen.polygon(many(polygon), { fill: colors.accent, fill_alpha: 0.07, stroke: colors.accent, width: 1, dash: [4, 4], alpha: 0.8 });
      // In the lower left corner, where fewer things stand than in the middle.
      const corners = many(polygon);
      const corner: Point = [Math.min(...corners.map(([x]) => x)) + 5, Math.max(...corners.map(([, y]) => y)) - 6];
      if (named && polygon.length > 0) pen.text(corner, name, { fill: colors.accent, size: 11, italic: true, halo: colors.ground });
    }
  }
  if (layers.has("laser")) {
    for (const robot of scene.robots) {
      const { scan } = robot.state;
      if (!robot.laser || !scan) continue;
      // From where it was taken: the walls that it shows do not move with the robot.
      const laser_at = robot.state.scan_pose ?? laser_pose(robot.pose, robot.laser);
      pen.polygon(many(scan_polygon(laser_at, robot.laser, scan)), { fill: colors.failure, fill_alpha: 0.07 });
      pen.dots(many(scan_points(laser_at, robot.laser, scan)), Math.max(1.4, Math.min(px(0.025), 3)), { fill: colors.failure });
    }
  }
  for (const door of scene.doors) draw_door(pen, door, many, colors, named, scene.hovered);
  if (layers.has("places")) {
    // A location at a station is drawn once, as the station.
    const covered = (place: Location) => world.stations.some((station) => Math.hypot(station.x - place.x, station.y - place.y) < 0.01);
    const robots = scene.robots.map(({ pose, radius }) => ({ centre: at(pose), radius: robot_px(radius, px) }));
    for (const place of world.locations) draw_place(pen, place, at, colors, named, covered(place), size.width, robots);
    for (const station of world.stations) draw_station(pen, station, at, px, colors, named);
  }
  if (layers.has("path")) {
    for (const { state } of scene.robots) {
      if (state.path.length > 1) pen.polyline(many(state.path), { stroke: colors.success, width: 2.2 });
      if (state.goal) draw_goal(pen, state.goal, at, px, colors.success);
    }
  }
  if (layers.has("obstacles")) {
    for (const obstacle of scene.obstacles) {
      const hovered = scene.hovered?.kind === "obstacle" && scene.hovered.name === obstacle.name;
      const style = { fill: colors.quiet, fill_alpha: 0.55, stroke: hovered ? colors.accent : colors.quiet, width: hovered ? 2.5 : 1.5 };
      if (obstacle.circle) pen.circle(at(obstacle.circle), px(obstacle.circle[2]), style);
      if (obstacle.polygon) pen.polygon(many(obstacle.polygon), style);
      const where: Point | null = obstacle.circle ? [obstacle.circle[0], obstacle.circle[1]] : obstacle.polygon ? middle_of(obstacle.polygon) : null;
      if (named && where) {
        const [x, y] = at(where);
        pen.text([x, y + px(obstacle.circle?.[2] ?? 0.2) + 12], obstacle.name, { fill: colors.quiet, size: 11, anchor: "middle", halo: colors.ground });
      }
    }
  }
  for (const robot of scene.robots) {
    if (layers.has("particles")) draw_particles(pen, robot.state.particles ?? [], at, px, colors);
    if (layers.has("estimate") && robot.state.estimate) draw_estimate(pen, robot.state.estimate, robot.radius, at, px, colors);
  }
  for (const robot of scene.robots) {
    const hovered = scene.hovered?.kind === "robot" && scene.hovered.name === robot.name;
    draw_robot(pen, robot, at, px, colors, named, hovered);
  }
  const { ghost } = scene;
  if (ghost?.kind === "obstacle") {
    pen.circle(at(ghost.centre), px(ghost.radius), { fill: colors.quiet, fill_alpha: 0.3, stroke: colors.quiet, width: 1.5, dash: [4, 3] });
  } else if (ghost) {
    const color = ghost.kind === "goal" ? colors.success : colors.robot;
    if (ghost.kind === "goal") draw_goal(pen, ghost.pose, at, px, color);
    else pen.circle(at(ghost.pose), px(ghost.radius), { fill: color, fill_alpha: 0.3, stroke: color, width: 1.5, dash: [4, 3] });
    arrow(pen, ghost.pose, Math.max(0.6, 40 / view.scale), at, color);
  }
  draw_scale(pen, view, size, colors);
}

type At = (point: readonly [number, number, ...number[]]) => Point;
type Px = (metres: number) => number;

/** Never too small to be seen and dragged. */
const robot_px = (radius: number, px: Px): number => Math.max(px(radius), 6);

function draw_robot(pen: Pen, robot: DrawnRobot, at: At, px: Px, colors: MapColors, named: boolean, hovered: boolean): void {
  const { pose } = robot;
  const radius = robot_px(robot.radius, px);
  const centre = at(pose);
  pen.circle(centre, radius, { fill: colors.robot, stroke: hovered ? colors.accent : colors.on_robot, width: hovered ? 3 : 1.5 });
  const corner = (angle: number, length: number): Point => [
    centre[0] + length * radius * Math.cos(pose[2] + angle),
    centre[1] - length * radius * Math.sin(pose[2] + angle),
  ];
  pen.polygon([corner(0, 0.8), corner(2.45, 0.62), corner(Math.PI, 0.2), corner(-2.45, 0.62)], { fill: colors.on_robot });
  if (named) {
    const battery = robot.state.battery;
    const charge = battery ? ` ${Math.round(battery.percentage * 100)} %${battery.charging ? " charging" : ""}` : "";
    pen.text([centre[0], centre[1] - radius - 6], `${robot.name}${charge}`, { fill: colors.ink, size: 11, weight: 600, anchor: "middle", halo: colors.ground });
  }
}

function draw_estimate(pen: Pen, estimate: Pose, radius: number, at: At, px: Px, colors: MapColors): void {
  pen.circle(at(estimate), Math.max(px(radius), 6), { stroke: colors.past, width: 1.5, dash: [4, 3] });
  pen.segments([at(estimate), at(transform(estimate, [radius * 1.4, 0]))], { stroke: colors.past, width: 1.5 });
}

function draw_particles(pen: Pen, particles: readonly Pose[], at: At, px: Px, colors: MapColors): void {
  const every = Math.max(1, Math.ceil(particles.length / kParticlesMax));
  const length = Math.max(px(0.08), 4) / px(1);
  const lines: Point[] = [];
  for (let i = 0; i < particles.length; i += every) {
    const particle = particles[i]!;
    lines.push(at(particle), at(transform(particle, [length, 0])));
  }
  pen.segments(lines, { stroke: colors.past, width: 1.2, alpha: 0.65 });
}

function draw_place(pen: Pen, place: Location, at: At, colors: MapColors, named: boolean, covered: boolean, width: number, robots: readonly { centre: Point; radius: number }[]): void {
  const centre = at([place.x, place.y]);
  if (!covered) {
    pen.segments([centre, [centre[0] + 13 * Math.cos(place.theta), centre[1] - 13 * Math.sin(place.theta)]], { stroke: colors.accent, width: 2 });
    pen.circle(centre, 4.5, { fill: colors.accent, stroke: colors.ground, width: 1 });
  }
  // Names stay inside the panel, and below who stands there.
  const right = centre[0] + 9 + 6.5 * place.name.length < width;
  const below = robots.filter((robot) => Math.hypot(robot.centre[0] - centre[0], robot.centre[1] - centre[1]) <= robot.radius).map((robot) => robot.centre[1] + robot.radius + 11);
  if (named) pen.text([centre[0] + (right ? 9 : -9), Math.max(centre[1] + 15, ...below)], place.name, { anchor: right ? "start" : "end", fill: colors.accent, size: 11, weight: 500, halo: colors.ground });
}

function draw_station(pen: Pen, station: Location, at: At, px: Px, colors: MapColors, named: boolean): void {
  const centre = at([station.x, station.y]);
  const half = Math.max(px(0.2), 8);
  const turned = (u: number, v: number): Point => {
    const [c, s] = [Math.cos(station.theta), Math.sin(station.theta)];
    return [centre[0] + c * u - s * v, centre[1] - s * u - c * v];
  };
  pen.polygon([turned(-half, -half), turned(half, -half), turned(half, half), turned(-half, half)], { fill: colors.success, fill_alpha: 0.16, stroke: colors.success, width: 1.5 });
  // A flash, for what gives power.
  const bolt: Point[] = [[0.12, -0.62], [-0.36, 0.1], [-0.04, 0.1], [-0.12, 0.62], [0.36, -0.1], [0.04, -0.1]];
  pen.polygon(bolt.map(([x, y]) => [centre[0] + x * half, centre[1] + y * half]), { fill: colors.success });
  if (named) pen.text([centre[0], centre[1] - half - 4], station.name, { fill: colors.success, size: 11, weight: 500, anchor: "middle", halo: colors.ground });
}

function draw_goal(pen: Pen, goal: Pose, at: At, px: Px, color: string): void {
  const radius = Math.max(px(0.22), 8);
  const centre = at(goal);
  pen.circle(centre, radius, { stroke: color, width: 2 });
  pen.circle(centre, 2.5, { fill: color });
  const tip = (length: number): Point => [centre[0] + length * Math.cos(goal[2]), centre[1] - length * Math.sin(goal[2])];
  pen.segments([tip(radius), tip(radius + 8)], { stroke: color, width: 2 });
}

function arrow(pen: Pen, pose: Pose, length: number, at: At, color: string): void {
  const head = length * 0.25;
  const tip = transform(pose, [length, 0]);
  pen.segments([at(pose), at(tip), at(tip), at(transform(pose, [length - head, head * 0.7])), at(tip), at(transform(pose, [length - head, -head * 0.7]))], { stroke: color, width: 2.5 });
}

function draw_door(pen: Pen, door: DrawnDoor, many: (points: readonly Point[]) => Point[], colors: MapColors, named: boolean, hovered: Scene["hovered"]): void {
  const chosen = hovered?.kind === "door" && hovered.name === door.name;
  const stroke = chosen ? colors.accent : colors.quiet;
  const points = many(door.polygon);
  pen.polygon(points, door.open ? { stroke, width: chosen ? 2.5 : 1.5, dash: [3, 3] } : { fill: colors.quiet, stroke, width: chosen ? 2.5 : 1.5 });
  if (named) {
    // Below it: an area's name stands above its lower border.
    const [x] = middle_of(points);
    const y = Math.max(...points.map(([, bottom]) => bottom));
    pen.text([x, y + 13], `${door.name}${door.open ? "" : " (closed)"}`, { fill: colors.quiet, size: 11, anchor: "middle", halo: colors.ground });
  }
}

/** The floor that a door from `a` to `b` closes. */
export function door_polygon(a: Point, b: Point, thickness = kDoorThickness_m): Point[] {
  const [dx, dy] = [b[0] - a[0], b[1] - a[1]];
  const length = Math.hypot(dx, dy) || 1;
  const [nx, ny] = [((-dy / length) * thickness) / 2, ((dx / length) * thickness) / 2];
  return [[a[0] + nx, a[1] + ny], [b[0] + nx, b[1] + ny], [b[0] - nx, b[1] - ny], [a[0] - nx, a[1] - ny]];
}

function draw_scale(pen: Pen, view: Viewport, size: Size, colors: MapColors): void {
  const { metres, pixels } = scale_bar(view.scale, 110);
  const [x, y] = [10, size.height - 10];
  pen.polyline([[x, y - 5], [x, y], [x + pixels, y], [x + pixels, y - 5]], { stroke: colors.ground, width: 4 });
  pen.polyline([[x, y - 5], [x, y], [x + pixels, y], [x + pixels, y - 5]], { stroke: colors.ink, width: 1.5 });
  pen.text([x + pixels / 2, y - 5], length_text(metres), { fill: colors.ink, size: 11, anchor: "middle", halo: colors.ground });
}

function middle_of(points: readonly Point[]): Point {
  const sum = points.reduce<Point>(([x, y], [px, py]) => [x + px, y + py], [0, 0]);
  return [sum[0] / points.length, sum[1] / points.length];
}
