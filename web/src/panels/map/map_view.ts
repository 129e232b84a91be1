import type { Picture } from "../../picture/export";
import { CanvasPen, SvgPen } from "../../picture/pen";
import { kClick_px, PictureView } from "../../picture/picture_view";
import type { Point, Pose, State, WorldModel } from "../../protocol/types";
import { color, type Theme } from "../../widgets/theme";
import { useStudio } from "../../store/store";
import { why_not } from "../steer/steering";
import { plan_image } from "./floor_plan";
import { map_corners, picture_box, screen_to_world } from "./geometry";
import { Glide } from "./glide";
import { choose_tool, useMap } from "./map";
import { pick, type Hit, type Pickable } from "./picking";
import { door_polygon, draw_map, type DrawnRobot, type MapColors, type Scene } from "./scene";
import { add_obstacle, move_obstacle, put_robot, send_robot } from "./steer_map";

/** Somebody asked what can be done at a place. */
export interface Asked {
  /** Of the window, for the menu. */
  x: number;
  y: number;
  at: Point;
  hit: Hit | null;
}

/** Things are hit from this far, however small they are drawn. */
const kReach_px = 9;
const kObstacleRadius_m = 0.25;
const kObstacleRadiusMax_m = 3;
/** So much of the floor is shown around a robot that is followed, across the shorter side. */
const kFollowed_m = 6;

type Drag =
  | { kind: "robot"; name: string; radius: number; offset: Point; pose: Pose; turning: boolean }
  | { kind: "obstacle"; name: string; offset: Point; centre: Point; radius: number }
  | { kind: "new obstacle"; centre: Point; radius: number }
  | { kind: "goal"; pose: Pose };

/** Draws the map and turns presses on it into what they mean. */
export class MapView {
  private readonly view: PictureView;
  private readonly glides = new Map<string, Glide>();
  private readonly stops: (() => void)[] = [];
  private plan: HTMLCanvasElement | null = null;
  private cells: Uint8Array | null = null;
  private theme: Theme = "light";
  private hovered: Hit | null = null;
  private drag: { what: Drag; pressed: Point; moved: boolean; pointer: number } | null = null;
  private frame = 0;
  private following: string | null = null;
  private readonly colors = new Map<string, MapColors>();

  constructor(
    private readonly canvas: HTMLCanvasElement,
    private readonly world: WorldModel,
    private readonly report: { ask(asked: Asked): void; readout(text: string): void },
  ) {
    this.view = new PictureView({
      limits: { min: 0.5, max: 2000 },
      margin: 10,
      fit_max: 200,
      change: ({ scale, x, y }) => {
        // For tests, which press at places of the world.
        canvas.dataset["view"] = `${scale} ${x} ${y}`;
        this.dirty();
      },
      grab: (event, at) => this.grab(event, at),
    });
    this.view.set_box(picture_box(map_corners(world.map)));
    this.view.attach(canvas);
    this.listen("pointermove", (event) => this.on_move(event));
    this.listen("pointerup", (event) => this.on_up(event));
    this.listen("pointercancel", () => this.cancel());
    this.listen("pointerleave", () => this.leave());
    this.listen("click", (event) => this.on_click(event as unknown as MouseEvent as PointerEvent));
    this.listen("contextmenu", (event) => {
      event.preventDefault();
      this.ask(event.clientX, event.clientY);
    });
    this.listen("dblclick", () => this.fit());
    this.stops.push(
      useStudio.subscribe((studio, before) => {
        const [now, then] = [studio.state, before.state];
        if (now?.robots !== then?.robots) this.take(now);
        if (now?.robots !== then?.robots || now?.obstacles !== then?.obstacles || now?.doors !== then?.doors) this.dirty();
      }),
      useMap.subscribe(({ tool }, before) => {
        if (tool !== before.tool) canvas.dataset["tool"] = tool ?? "";
        this.dirty();
      }),
    );
    this.take(useStudio.getState().state);
  }

  stop(): void {
    this.view.detach();
    for (const stop of this.stops) stop();
    cancelAnimationFrame(this.frame);
  }

  fit(): void {
    useMap.setState({ follow: null });
    this.view.fit();
  }

  zoom(factor: number): void {
    this.view.zoom(factor);
  }

  key(event: KeyboardEvent): boolean {
    if (event.key.startsWith("Arrow") || event.key === "0") useMap.setState({ follow: null });
    return this.view.key(event, true);
  }

  set_theme(theme: Theme): void {
    this.theme = theme;
    this.colors.clear();
    this.draw_plan();
  }

  /** The floor plan as the program sends it. */
  set_cells(cells: Uint8Array): void {
    this.cells = cells;
    this.draw_plan();
  }

  /** For people without a mouse. */
  ask_at_middle(): void {
    const box = this.canvas.getBoundingClientRect();
    this.ask(box.left + box.width / 2, box.top + box.height / 2);
  }

  /** What is shown now, as a drawing. */
  picture(background: string): Picture {
    const { width, height } = this.view.size;
    const pen = new SvgPen();
    draw_map(pen, this.scene(performance.now()), this.view.view, { width, height }, this.palette());
    return { name: "map", size: { width, height }, svg: pen.document({ width, height }, "Map", background) };
  }

  private listen(type: string, handler: (event: PointerEvent) => void): void {
    this.canvas.addEventListener(type, handler as EventListener);
    this.stops.push(() => this.canvas.removeEventListener(type, handler as EventListener));
  }

  private draw_plan(): void {
    if (this.cells) this.plan = plan_image(this.world.map, this.cells, this.theme);
    this.dirty();
  }

  private take(state: State | null): void {
    const now = performance.now();
    for (const [name, robot] of Object.entries(state?.robots ?? {})) {
      const glide = this.glides.get(name);
      if (glide) glide.update(robot.pose, now, state?.live === true && state.run.state === "running");
      else this.glides.set(name, new Glide(robot.pose, now));
    }
  }

  // ---- drawing ----

  private dirty(): void {
    if (this.frame === 0) this.frame = requestAnimationFrame((now) => this.draw(now));
  }

  private palette(): MapColors {
    let found = this.colors.get(this.theme);
    if (!found) {
      const names = ["ink", "muted", "accent", "running", "success", "failure", "quiet", "past"] as const;
      const all = Object.fromEntries(names.map((name) => [name, color(name)])) as Record<(typeof names)[number], string>;
      found = { ...all, ground: color("surface"), line: color("line-strong"), robot: color("map-robot"), on_robot: color("map-on-robot") };
      this.colors.set(this.theme, found);
    }
    return found;
  }

  private robots(now: number): DrawnRobot[] {
    const state = useStudio.getState().state;
    return this.world.robots.flatMap(({ name, radius, laser }) => {
      const robot = state?.robots[name];
      if (!robot) return [];
      return [{ name, radius, laser, pose: this.glides.get(name)?.at(now) ?? robot.pose, state: robot }];
    });
  }

  private doors() {
    const state = useStudio.getState().state;
    return (this.world.doors ?? []).map(({ name, a, b }) => ({
      name,
      open: state?.doors.find((door) => door.name === name)?.open ?? true,
      polygon: door_polygon(a, b),
    }));
  }

  private scene(now: number): Scene {
    const state = useStudio.getState().state;
    const what = this.drag?.what;
    const ghost: Scene["ghost"] =
      what?.kind === "robot"
        ? { kind: "robot", pose: what.pose, radius: what.radius }
        : what?.kind === "goal"
          ? { kind: "goal", pose: what.pose, radius: 0 }
          : what
            ? { kind: "obstacle", centre: what.centre, radius: what.radius }
            : null;
    return {
      world: this.world,
      plan: this.plan,
      robots: this.robots(now),
      obstacles: state?.obstacles ?? [],
      doors: this.doors(),
      layers: useMap.getState().layers,
      hovered: this.hovered,
      ghost,
    };
  }

  private draw(now: number): void {
    this.frame = 0;
    const { size } = this.view;
    const followed = useMap.getState().follow;
    const pose = followed === null ? undefined : this.glides.get(followed)?.at(now);
    if (pose && !this.drag) {
      // Near enough, once, to see what is around the robot; then as somebody zooms.
      const near = this.following === followed ? 0 : Math.min(size.width, size.height) / kFollowed_m;
      this.view.keep_centred([pose[0], -pose[1]], near);
      cancelAnimationFrame(this.frame);
      this.frame = 0;
    }
    this.following = followed;
    const ratio = window.devicePixelRatio || 1;
    const [width, height] = [Math.round(size.width * ratio), Math.round(size.height * ratio)];
    if (this.canvas.width !== width || this.canvas.height !== height) {
      this.canvas.width = width;
      this.canvas.height = height;
    }
    const context = this.canvas.getContext("2d");
    if (!context) return;
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.clearRect(0, 0, size.width, size.height);
    draw_map(new CanvasPen(context), this.scene(now), this.view.view, size, this.palette());
    if ([...this.glides.values()].some((glide) => glide.moving(now))) this.dirty();
  }

  // ---- the pointer ----

  private at(event: { clientX: number; clientY: number }): Point {
    const box = this.canvas.getBoundingClientRect();
    return screen_to_world(this.view.view, [event.clientX - box.left, event.clientY - box.top]);
  }

  private hit(at: Point): Hit | null {
    const { layers } = useMap.getState();
    const state = useStudio.getState().state;
    const things: Pickable = {
      robots: this.robots(performance.now()),
      obstacles: layers.has("obstacles") ? (state?.obstacles ?? []) : [],
      doors: this.doors(),
      locations: layers.has("places") ? this.world.locations : [],
      stations: layers.has("places") ? this.world.stations : [],
    };
    return pick(things, at, kReach_px / this.view.view.scale);
  }

  private grab(event: PointerEvent, screen: Point): boolean {
    const at = screen_to_world(this.view.view, screen);
    const what = this.begin(at, event.shiftKey);
    if (!what) return false;
    this.canvas.setPointerCapture(event.pointerId);
    this.drag = { what, pressed: screen, moved: false, pointer: event.pointerId };
    return true;
  }

  private begin(at: Point, turning: boolean): Drag | null {
    if (why_not(useStudio.getState()) !== null) return null;
    const { tool } = useMap.getState();
    if (tool === "goal") return { kind: "goal", pose: [at[0], at[1], this.heading()] };
    if (tool === "obstacle") return { kind: "new obstacle", centre: at, radius: kObstacleRadius_m };
    const hit = this.hit(at);
    if (hit?.kind === "robot") {
      const radius = this.world.robots.find(({ name }) => name === hit.name)?.radius ?? 0.2;
      return { kind: "robot", name: hit.name, radius, offset: [hit.pose[0] - at[0], hit.pose[1] - at[1]], pose: hit.pose, turning };
    }
    if (hit?.kind === "obstacle") {
      const circle = useStudio.getState().state?.obstacles.find(({ name }) => name === hit.name)?.circle;
      if (circle) return { kind: "obstacle", name: hit.name, offset: [circle[0] - at[0], circle[1] - at[1]], centre: [circle[0], circle[1]], radius: circle[2] };
    }
    return null;
  }

  private heading(): number {
    const first = this.world.robots[0]?.name;
    return first === undefined ? 0 : (this.glides.get(first)?.at(performance.now())[2] ?? 0);
  }

  private on_move(event: PointerEvent): void {
    const at = this.at(event);
    const { drag } = this;
    if (drag) {
      const box = this.canvas.getBoundingClientRect();
      const screen: Point = [event.clientX - box.left, event.clientY - box.top];
      drag.moved ||= Math.hypot(screen[0] - drag.pressed[0], screen[1] - drag.pressed[1]) >= kClick_px;
      if (drag.moved) this.pull(drag.what, at, event.shiftKey);
      this.dirty();
    } else {
      const hit = this.hit(at);
      if (hit?.kind !== this.hovered?.kind || hit?.name !== this.hovered?.name) this.dirty();
      this.hovered = hit;
      this.canvas.dataset["over"] = hit?.kind ?? "";
    }
    this.report.readout(`${at[0].toFixed(2)}, ${at[1].toFixed(2)} m${this.hovered && !drag ? ` · ${this.hovered.name}` : ""}`);
  }

  private pull(what: Drag, at: Point, shift: boolean): void {
    switch (what.kind) {
      case "robot":
        // With Shift the robot turns to the pointer instead of following it.
        if (shift || what.turning) what.pose = [what.pose[0], what.pose[1], Math.atan2(at[1] - what.pose[1], at[0] - what.pose[0])];
        else what.pose = [at[0] + what.offset[0], at[1] + what.offset[1], what.pose[2]];
        break;
      case "obstacle":
        what.centre = [at[0] + what.offset[0], at[1] + what.offset[1]];
        break;
      case "new obstacle":
        what.radius = Math.min(Math.max(Math.hypot(at[0] - what.centre[0], at[1] - what.centre[1]), 0.05), kObstacleRadiusMax_m);
        break;
      case "goal":
        what.pose = [what.pose[0], what.pose[1], Math.atan2(at[1] - what.pose[1], at[0] - what.pose[0])];
        break;
    }
  }

  private on_up(event: PointerEvent): void {
    const { drag } = this;
    if (!drag || drag.pointer !== event.pointerId) return;
    this.drag = null;
    this.dirty();
    const { what } = drag;
    if (what.kind === "new obstacle") void add_obstacle(millimetres(what.centre), Math.round(what.radius * 1000) / 1000);
    else if (what.kind === "goal") {
      const robot = useMap.getState().follow ?? this.world.robots[0]?.name;
      if (robot !== undefined) void send_robot(robot, what.pose);
      choose_tool(null);
    } else if (!drag.moved) {
      if (what.kind === "obstacle") this.ask(event.clientX, event.clientY);
    } else if (what.kind === "robot") void put_robot(what.name, what.pose);
    else void move_obstacle(what.name, millimetres(what.centre));
  }

  private on_click(event: PointerEvent): void {
    if (useMap.getState().tool !== null) return;
    if (this.hit(this.at(event))?.kind === "door") this.ask(event.clientX, event.clientY);
  }

  private cancel(): void {
    this.drag = null;
    this.dirty();
  }

  private leave(): void {
    this.hovered = null;
    this.report.readout("");
    this.dirty();
  }

  private ask(x: number, y: number): void {
    const at = this.at({ clientX: x, clientY: y });
    this.report.ask({ x, y, at, hit: this.hit(at) });
  }
}

function millimetres([x, y]: Point): Point {
  return [Math.round(x * 1000) / 1000, Math.round(y * 1000) / 1000];
}
