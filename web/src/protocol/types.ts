/**
 * What the page and the program say to each other over the WebSocket; docs/studio-protocol.md has the meaning.
 * All times are integers: nanoseconds of run time.
 */

export type Time = number;
export type Data = null | boolean | number | string | Data[] | { [key: string]: Data };
export type Pose = [x: number, y: number, theta: number];
export type Point = [x: number, y: number];

/** Indices of `TreeState.status` and `TreeState.last`. */
export const kStatuses = ["IDLE", "RUNNING", "SUCCESS", "FAILURE", "SKIPPED", "HALTING"] as const;
export type StatusName = (typeof kStatuses)[number];

export interface Hello {
  protocol: number;
  version: string;
  mode: "live" | "recording";
  title: string;
  description: string;
  clock: "virtual" | "real";
  seed: number | string;
  steerable: boolean;
  /** Random id of this server: another one means another run. */
  boot: string;
}

// ---- model ----

export type NodeKind = "action" | "condition" | "control" | "decorator" | "subtree";
export interface TreeNode {
  id: number;
  /** null: the root. */
  parent: number | null;
  path: string;
  name: string;
  type: string;
  kind: NodeKind;
  symbol: string;
  /** The chart that a leaf runs. */
  leaf: string | null;
  /** What a leaf is called in observations. */
  message_name: string | null;
  ports: { name: string; direction: "input" | "output" | "inout"; value: string; type: string }[];
}
export interface Size {
  width: number;
  height: number;
}
export interface Rect extends Size {
  x: number;
  y: number;
}
/** As draw::to_value writes trees. */
export interface TreeLayout {
  size: Size;
  nodes: (Rect & { parent: number; shape: NodeKind; status: string; symbol: string; title: string[]; lines: string[] })[];
  edges: Point[][];
}
export interface TreeModel {
  id: string;
  direction: "down" | "right";
  nodes: TreeNode[];
  layout: TreeLayout;
}
/** As draw::to_value writes charts. */
export interface ChartLayout {
  size: Size;
  states: (Rect & { parent: number; kind: string; active: boolean; name: string[]; lines: string[] })[];
  edges: { transition: number; source: number; target: number; last: boolean; curve: Point[]; label: Rect; lines: string[] }[];
  separators: [x1: number, y1: number, x2: number, y2: number][];
}
export interface ChartModel {
  id: string;
  kind: "skill" | "monitor";
  name: string;
  file: string;
  layout: ChartLayout;
  states: { id: string; parent: number; kind: string }[];
  transitions: { source: number; targets: number[]; event: string; condition: string; actions: string; line: number | null }[];
}
export interface MonitorModel {
  name: string;
  /** null: the monitor is in another process. */
  chart: string | null;
  requirement: string;
  sentence: string;
  severity: string | null;
  gate: string[];
}
/** As idl::describe writes what a service's methods take and give. */
export interface IdlField {
  name: string;
  type: string;
  required: boolean;
  default?: Data;
  unit?: string;
}
export type IdlType =
  | { kind: "struct" | "union" | "exception"; fields: IdlField[] }
  | { kind: "enum"; values: string[] }
  | { kind: "list" | "set"; element: string }
  | { kind: "map"; key: string; element: string };
export type IdlTypes = Record<string, IdlType>;
export interface IdlMethod {
  name: string;
  args: IdlField[];
  result: string;
  oneway: boolean;
  unit?: string;
}
export interface ServiceModel {
  name: string;
  interface: string;
  at: string;
  /** Of the simulated world; null: the service is not a robot's. */
  robot: string | null;
  methods: IdlMethod[];
  types: IdlTypes;
}
export interface Location {
  name: string;
  x: number;
  y: number;
  theta: number;
}
export interface LaserModel {
  angle_min: number;
  angle_increment: number;
  beams: number;
  range_max: number;
  x: number;
  y: number;
  yaw: number;
}
/** A robot charges within both tolerances of it [m, rad]. */
export interface Station extends Location {
  linear_tolerance: number;
  angular_tolerance: number;
}
export interface WorldModel {
  map: { width: number; height: number; resolution: number; origin: Pose };
  locations: Location[];
  areas: { name: string; polygon: Point[] }[];
  stations: Station[];
  doors: { name: string; a: Point; b: Point }[];
  robots: { name: string; radius: number; laser: LaserModel }[];
}
export interface Part {
  name: string;
  kind: "skill" | "component" | "monitor";
  process: boolean;
}
export interface Model {
  tree: TreeModel;
  charts: ChartModel[];
  monitors: MonitorModel[];
  services: ServiceModel[];
  world: WorldModel | null;
  scenario: { name: string; description: string; timeline: { at: Time; what: string }[] } | null;
  parts: Part[];
}

// ---- state ----

export interface RunState {
  state: "running" | "paused" | "ended";
  factor: number;
  mission: string;
  reason: string;
  stopped_at: { breakpoint: number | string; what: string } | null;
  missed_ticks: number;
  /** Those that run now. */
  processes: { name: string; pid: number }[];
}
export interface TreeState {
  status: number[];
  /** The last status that was not IDLE. */
  last: number[];
  /** When the status changed last. */
  since: Time[];
}
export interface ChartState {
  running: boolean;
  active: number[];
  last?: number | null;
  event?: string;
  data?: Record<string, Data>;
  since: Time;
}
export type Verdict = "violated" | "satisfied" | "undecided";
export interface MonitorState {
  verdict: Verdict;
  standing: string;
  deadline: Time | null;
  states: string[];
  violations: number;
  since?: Time;
}
export interface Battery {
  percentage: number;
  voltage: number | null;
  current: number;
  charging: boolean;
  plugged: boolean | null;
}
export interface RobotState {
  pose: Pose;
  estimate: Pose | null;
  twist?: [v: number, w: number];
  /** What the navigation says that it does. */
  navigation?: string;
  scan?: (number | null)[];
  /** The laser's pose on the map when it scanned. */
  scan_pose?: Pose;
  path: Point[];
  goal?: Pose | null;
  particles?: Pose[];
  battery: Battery | null;
}
export interface Obstacle {
  name: string;
  polygon?: Point[];
  circle?: [x: number, y: number, radius: number];
}
export interface Door {
  name: string;
  open: boolean;
}
export interface State {
  time: Time;
  tick: number;
  sequence: number;
  /** Whether this page follows the present. */
  live: boolean;
  end: Time;
  begin: Time;
  run: RunState;
  tree: TreeState;
  blackboard: Record<string, Record<string, Data>>;
  outputs?: Record<string, Record<string, Data>>;
  charts: Record<string, ChartState>;
  monitors: Record<string, MonitorState>;
  robots: Record<string, RobotState>;
  obstacles: Obstacle[];
  doors: Door[];
}
/** Members that are absent did not change; entries of `charts`, `monitors` and `robots` are whole, null removes one. */
export type Delta = Partial<Omit<State, "charts" | "monitors" | "robots">> & {
  charts?: Record<string, ChartState | null>;
  monitors?: Record<string, MonitorState | null>;
  robots?: Record<string, RobotState | null>;
  messages?: Observation[];
  missed?: number;
};

export type Kind = "request" | "reply" | "error" | "event";
export interface Observation {
  sequence: number;
  time: Time;
  tick: number;
  kind: Kind;
  name: string;
  source: string;
  target: string;
  /** Joins a request with its outcome; 0: neither. */
  call: number;
  data: Data;
}
export interface Violation {
  monitor: string;
  time: Time;
  sequence: number;
  story: string;
  witness: Observation[];
  /** False: what was long before is not known any more. */
  witness_complete: boolean;
  /** Without any one of them the verdict would not come. */
  witness_minimal: boolean;
  explanation: Data;
}
export interface Problem {
  text: string;
  time: Time;
}

export type ServerMessage =
  | ({ type: "hello" } & Hello)
  | ({ type: "model" } & Model)
  | ({ type: "state" } & State)
  | ({ type: "delta" } & Delta)
  | ({ type: "violation" } & Violation)
  | ({ type: "problem" } & Problem)
  | { type: "answer"; id: number; ok: boolean; error?: string; value?: unknown };

// ---- requests ----

export interface Filter {
  text?: string;
  service?: string;
  leaf?: string;
  kind?: string;
  name?: string;
}
export interface Lane {
  id: string;
  kind: "leaf" | "skill" | "monitor" | "mission" | "value";
  name: string;
  spans?: [from: Time, to: Time, label: string][];
  points?: [time: Time, value: number][];
}
export interface Mark {
  time: Time;
  kind: "violation" | "injection" | "intervention" | "veto" | "problem";
  text: string;
  sequence: number;
}
export interface Interventions {
  [kind: string]: Data;
}
type Nothing = Record<string, never>;

/** By operation: what is sent beside `op` and `id`, and the value of the answer. */
export interface Operations {
  hello: [{ token?: string }, unknown];
  live: [Nothing, unknown];
  seek: [{ time: Time }, unknown];
  layout: [{ collapsed: number[] }, { nodes: number[]; layout: TreeLayout }];
  messages: [
    { before?: number; after?: number; until?: Time; limit?: number; filter?: Filter },
    { messages: Observation[]; more: boolean },
  ];
  lanes: [{ from: Time; to: Time; width: number }, { lanes: Lane[]; marks: Mark[] }];
  find: [{ filter: Filter; after?: Time; before?: Time }, Observation | null];
  pause: [Nothing, unknown];
  resume: [Nothing, unknown];
  step: [{ ticks: number }, unknown];
  factor: [{ value: number }, unknown];
  stop: [Nothing, unknown];
  call: [{ service: string; method: string; args: Record<string, Data> }, { result: Data }];
  kill: [{ part: string }, unknown];
  restart: [{ part: string }, unknown];
  delay: [{ message: string; by: Time; count?: number }, { id?: number }];
  falsify: [{ call: string; path: string; value: Data; count?: number }, { id?: number }];
  force: [{ leaf: string; status: "SUCCESS" | "FAILURE" | "RUNNING"; once: boolean }, { id?: number }];
  breakpoint: [
    { kind: "node" | "state" | "message"; node?: number; chart?: string; state?: string; pattern?: string; status?: string },
    { breakpoint: number },
  ];
  clear: [{ what: number }, unknown];
  interventions: [Nothing, Interventions];
  save_scenario: [{ name: string }, { yaml: string; file: string }];
}
export type Operation = keyof Operations;
