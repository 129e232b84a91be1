/**
 * What the page and the program say to each other over the WebSocket: the one description, as JSON Schema.
 * docs/studio-protocol.md says when what is sent. From here come the types of the page (types.ts) and the check that
 * what the program sends is so (messages.test.ts). Members that are not described are not sent.
 *
 * All times are integers: nanoseconds of run time.
 */
import { Type, type Static, type TObject, type TProperties, type TSchema } from "@sinclair/typebox";

import { kStatuses } from "./statuses";

const kExact = { additionalProperties: false } as const;
const object = <P extends TProperties>(properties: P, description?: string): TObject<P> => Type.Object(properties, description === undefined ? kExact : { ...kExact, description });
const or_null = <S extends TSchema>(schema: S) => Type.Union([schema, Type.Null()]);
const by_name = <S extends TSchema>(schema: S) => Type.Record(Type.String(), schema);
const one_of = <const W extends readonly string[]>(...words: W) => Type.Unsafe<W[number]>(Type.Union(words.map((word) => Type.Literal(word))));

const { Number: number, String: string, Boolean: boolean, Array: list, Optional: optional, Tuple: tuple } = Type;

export const Time = Type.Integer({ description: "Nanoseconds of run time" });
export const Data = Type.Recursive((Self) => Type.Union([Type.Null(), boolean(), number(), string(), list(Self), by_name(Self)]), { $id: "Data" });
export const Pose = tuple([number(), number(), number()], { description: "x, y [m], heading [rad]" });
export const Point = tuple([number(), number()]);
const index = () => Type.Integer({ minimum: 0 });

export const Hello = object({
  protocol: Type.Literal(1),
  version: string(),
  mode: one_of("live", "recording"),
  title: string(),
  description: string(),
  clock: one_of("virtual", "real"),
  seed: Type.Integer(),
  steerable: Type.Boolean({ description: "Whether the run can be steered at all" }),
  repeatable: Type.Boolean({ description: "Whether `run_again` begins it once more" }),
  design: Type.Boolean({ description: "A project is edited; what is shown is a scenario that runs again after each edit" }),
  compare: Type.Boolean({ description: "Two states of files are compared, and nothing else" }),
  coverage: Type.Boolean({ description: "Whether `coverage` can be asked for" }),
  boot: Type.String({ description: "Random id of this server: another one means another run" }),
});

// ---- model ----

export const NodeKind = one_of("action", "condition", "control", "decorator", "subtree");
export const TreeNode = object({
  id: index(),
  parent: or_null(index()),
  path: string(),
  name: string(),
  type: string(),
  kind: NodeKind,
  symbol: string(),
  leaf: or_null(Type.String({ description: "The chart that a leaf runs" })),
  message_name: or_null(Type.String({ description: "What a leaf is called in observations" })),
  ports: list(object({ name: string(), direction: one_of("input", "output", "inout"), value: string(), type: string() })),
});
const size = { width: number(), height: number() };
const rect = { x: number(), y: number(), ...size };
export const Size = object(size);
export const Rect = object(rect);
export const TreeLayout = object(
  {
    size: Size,
    nodes: list(object({ ...rect, parent: Type.Integer(), shape: NodeKind, status: string(), symbol: string(), title: list(string()), lines: list(string()) })),
    edges: list(list(Point)),
  },
  "As draw::to_value writes trees",
);
export const TreeModel = object({ id: string(), direction: one_of("down", "right"), nodes: list(TreeNode), layout: TreeLayout });
export const ChartLayout = object(
  {
    size: Size,
    states: list(object({ ...rect, parent: Type.Integer(), kind: string(), active: boolean(), name: list(string()), lines: list(string()) })),
    edges: list(object({ transition: Type.Integer(), source: Type.Integer(), target: Type.Integer(), last: boolean(), curve: list(Point), label: Rect, lines: list(string()) })),
    separators: list(tuple([number(), number(), number(), number()])),
  },
  "As draw::to_value writes charts",
);
export const ChartModel = object({
  id: string(),
  kind: one_of("skill", "monitor"),
  name: string(),
  file: string(),
  layout: ChartLayout,
  states: list(object({ id: string(), parent: Type.Integer(), kind: string() })),
  transitions: list(object({ source: Type.Integer(), targets: list(Type.Integer()), event: string(), condition: string(), actions: string(), line: or_null(Type.Integer()) })),
});
export const MonitorModel = object({
  name: string(),
  chart: or_null(Type.String({ description: "Null: the monitor is in another process" })),
  requirement: string(),
  sentence: string(),
  severity: or_null(string()),
  gate: list(string()),
});
export const IdlField = object({ name: string(), type: string(), required: boolean(), default: optional(Data), unit: optional(string()) }, "As idl::describe writes what methods take and give");
export const IdlType = Type.Union([
  object({ kind: one_of("struct", "union", "exception"), fields: list(IdlField) }),
  object({ kind: Type.Literal("enum"), values: list(string()) }),
  object({ kind: one_of("list", "set"), element: string() }),
  object({ kind: Type.Literal("map"), key: string(), element: string() }),
]);
export const IdlTypes = by_name(IdlType);
export const IdlMethod = object({ name: string(), args: list(IdlField), result: string(), oneway: boolean(), unit: optional(string()) });
export const ServiceModel = object({
  name: string(),
  interface: string(),
  at: string(),
  robot: or_null(Type.String({ description: "Of the simulated world; null: the service is not a robot's" })),
  methods: list(IdlMethod),
  types: IdlTypes,
});
const place = { name: string(), x: number(), y: number(), theta: number() };
export const Location = object(place);
export const Station = object({ ...place, linear_tolerance: number(), angular_tolerance: number() }, "A robot charges within both tolerances of it [m, rad]");
export const LaserModel = object({ angle_min: number(), angle_increment: number(), beams: Type.Integer(), range_max: number(), x: number(), y: number(), yaw: number() });
export const WorldModel = object({
  map: object({ width: Type.Integer(), height: Type.Integer(), resolution: number(), origin: Pose }),
  locations: list(Location),
  areas: list(object({ name: string(), polygon: list(Point) })),
  stations: list(Station),
  doors: list(object({ name: string(), a: Point, b: Point })),
  robots: list(object({ name: string(), radius: number(), laser: LaserModel })),
});
export const Part = object({ name: string(), kind: one_of("skill", "component", "monitor"), process: boolean() });
export const Model = object({
  tree: TreeModel,
  charts: list(ChartModel),
  monitors: list(MonitorModel),
  services: list(ServiceModel),
  world: or_null(WorldModel),
  scenario: or_null(object({ name: string(), description: string(), timeline: list(object({ at: Time, what: string() })) })),
  scenarios: Type.Array(string(), { description: "Names of the project's scenarios" }),
  parts: list(Part),
});

// ---- state ----

export const RunState = object({
  state: one_of("running", "paused", "ended"),
  factor: number(),
  mission: string(),
  reason: string(),
  vacuous: Type.Record(Type.String(), string(), { description: "Of a run that ended: monitors that were not put to the test, and why" }),
  stopped_at: or_null(object({ breakpoint: Type.Integer(), what: string() })),
  missed_ticks: Type.Integer(),
  processes: Type.Array(object({ name: string(), pid: Type.Integer() }), { description: "Those that run now" }),
});
const status = () => Type.Integer({ minimum: 0, maximum: kStatuses.length - 1, description: kStatuses.map((name, i) => `${i} ${name}`).join(", ") });
export const TreeState = object({
  status: list(status()),
  last: Type.Array(status(), { description: "The last status that was not IDLE" }),
  since: Type.Array(Time, { description: "When the status changed last" }),
});
export const ChartState = object({
  running: boolean(),
  active: Type.Array(index(), { description: "States of the drawing" }),
  last: optional(or_null(Type.Integer({ description: "The transition taken last, by its place in the document" }))),
  event: optional(string()),
  data: optional(by_name(Data)),
  since: Time,
});
export const Verdict = one_of("violated", "satisfied", "undecided");
export const MonitorState = object({ verdict: Verdict, standing: string(), deadline: or_null(Time), states: list(string()), violations: index(), since: optional(Time) });
export const Battery = object({ percentage: Type.Number({ description: "0 to 1" }), voltage: or_null(number()), current: number(), charging: boolean(), plugged: or_null(boolean()) });
export const RobotState = object({
  pose: Pose,
  estimate: or_null(Pose),
  twist: optional(tuple([number(), number()], { description: "Speed [m/s], turn [rad/s]" })),
  navigation: optional(Type.String({ description: "What the navigation says that it does" })),
  scan: optional(list(or_null(number()))),
  scan_pose: optional(Type.Tuple([number(), number(), number()], { description: "The laser's pose on the map when it scanned" })),
  path: list(Point),
  goal: optional(or_null(Pose)),
  particles: optional(list(Pose)),
  battery: or_null(Battery),
});
export const Obstacle = object({ name: string(), polygon: optional(list(Point)), circle: optional(tuple([number(), number(), number()], { description: "x, y, radius" })) });
export const Door = object({ name: string(), open: boolean() });
const state = {
  time: Time,
  tick: index(),
  sequence: Type.Integer({ minimum: 0, description: "Of the last observation until then" }),
  live: Type.Boolean({ description: "Whether this page follows the present" }),
  end: Type.Integer({ description: "Of what is known" }),
  begin: Type.Integer({ description: "Of what is known" }),
  run: RunState,
  tree: TreeState,
  blackboard: Type.Record(Type.String(), by_name(Data), { description: "By the path of the SubTree, then by name" }),
  outputs: optional(Type.Record(Type.String(), by_name(Data), { description: "By leaf, then by port" })),
  charts: by_name(ChartState),
  monitors: by_name(MonitorState),
  robots: by_name(RobotState),
  obstacles: list(Obstacle),
  doors: list(Door),
};
export const State = object(state);

export const Kind = one_of("request", "reply", "error", "event");
export const Observation = object({
  sequence: index(),
  time: Time,
  tick: index(),
  kind: Kind,
  name: string(),
  source: string(),
  target: string(),
  call: Type.Integer({ minimum: 0, description: "Joins a request with its outcome; 0: neither" }),
  data: Data,
});
const { charts: _charts, monitors: _monitors, robots: _robots, ...others } = state;
/** Members that are absent did not change; entries of `charts`, `monitors` and `robots` are whole, null removes one. */
export const Delta = object({
  ...Type.Partial(Type.Object(others)).properties,
  charts: optional(by_name(or_null(ChartState))),
  monitors: optional(by_name(or_null(MonitorState))),
  robots: optional(by_name(or_null(RobotState))),
  messages: optional(list(Observation)),
  missed: optional(Type.Integer({ minimum: 0, description: "Observations that were left out" })),
});
export const Violation = object({
  monitor: string(),
  time: Time,
  sequence: Type.Integer({ minimum: 0, description: "0: a deadline passed" }),
  story: string(),
  witness: list(Observation),
  witness_complete: Type.Boolean({ description: "False: what was long before is not known any more" }),
  witness_minimal: Type.Boolean({ description: "Without any one of them the verdict would not come" }),
  explanation: Data,
});
export const Problem = object({ text: string(), time: Time });
export const ReachedKind = one_of("nodes", "states", "transitions", "guards", "methods", "requirements");
export const NotReached = object({
  kind: ReachedKind,
  of: Type.String({ description: "The node's path, the chart's file, the call, the requirement" }),
  what: Type.String({ description: "Status, state, transition, condition and value, outcome; empty: put to the test" }),
  file: Type.String({ description: "Inside the project; empty: it stands in none" }),
  line: index(),
});
export const Reached = object(
  {
    kinds: list(object({ kind: ReachedKind, reached: index(), of: index() })),
    not_reached: list(NotReached),
    verification: optional(
      object(
        {
          complete: Type.Boolean({ description: "Every behaviour was tried; else those up to `tick`" }),
          tick: index(),
          states: index(),
          changed: Type.Array(string(), { description: "Files of the project that are others now" }),
        },
        "Not runs, but `sentree verify` has",
      ),
    ),
  },
  "What runs have reached of a project",
);

// ---- design: bytes count from the beginning of a file's text in UTF-8 ----

const byte = () => Type.Integer({ minimum: 0 });
export const TextEdit = object({ from: byte(), to: byte(), text: string() });
export const FileKind = one_of("project", "mission", "skill", "monitor", "requirement", "scenario", "world", "interface", "model", "other");
export const DesignFile = object({ file: string(), kind: FileKind, version: index(), dirty: boolean(), conflict: boolean(), errors: index(), warnings: index() });
export const Finding = object({
  file: Type.String({ description: "Inside the project; empty: elsewhere" }),
  line: index(),
  column: index(),
  from: byte(),
  to: byte(),
  severity: one_of("error", "warning", "note"),
  code: string(),
  message: string(),
  fixes: list(object({ title: string(), from: byte(), to: byte(), text: string() })),
});
export const RunDifference = object({ time: Time, who: string(), before: string(), after: string() });
/** What a page can undo, and do again: the name of the next, and how many. */
export const DesignSteps = object({ undo: or_null(string()), undo_count: index(), redo: or_null(string()), redo_count: index() });
export const Design = object({
  project: string(),
  files: list(DesignFile),
  findings: list(Finding),
  checked: Type.Boolean({ description: "The findings are of the texts as they are now" }),
  steps: DesignSteps,
  pages: Type.Record(string(), DesignSteps, { description: "By the names that pages gave in `hello`, of those that are there; `steps`: of one without a name" }),
  scenario: Type.String({ description: "That runs again; empty: the mission without one" }),
  scenarios: list(string()),
  runs: object({
    recordings: Type.Array(string(), { description: "In runs/, the newest first" }),
    on_show: Type.String({ description: "The recording that pages are shown; empty: the shadow run" }),
    goes_on: or_null(Type.String({ description: "The recording of the run that goes on and is steered" })),
    continues: Type.String({ description: "While that run is on show: the recording of what was before the last edits that were applied; empty: none were" }),
    outdated: Type.Boolean({ description: "The run that goes on runs other texts than those that are edited now" }),
    problem: Type.String({ description: "Why the last of these runs, or its recording, is not whole; empty: it is" }),
  }),
  held_by: Type.String({ description: "Who else edits the project, so that edits are refused here until that program ends; empty: nobody" }),
  journal: Type.String({ description: "Why what is not saved would not be there again if the program ended now; empty: it would" }),
  reached_by_all: Type.Boolean({ description: "`design_reached` knows what all scenarios reach with the texts as they are now" }),
  shadow: object({
    ready: boolean(),
    current: Type.Boolean({ description: "It ran with the texts as they are now" }),
    problem: string(),
    ended: Time,
    differences: or_null(Type.Array(RunDifference, { description: "From the run with what is saved; the first of each part" })),
    expects: Type.Boolean({ description: "Its scenario says what is to come out" }),
    unmet: Type.Array(string(), { description: "What did not, one sentence each" }),
  }),
});
export const OutlineNode = object({
  element: index(),
  parent: Type.Integer({ description: "Place in the list; -1: the root" }),
  id: string(),
  name: string(),
  kind: NodeKind,
  known: boolean(),
  children_min: index(),
  children_max: index(),
  from: byte(),
  open_end: byte(),
  to: byte(),
  attributes: list(tuple([string(), string()])),
});
export const OutlineTree = object({ element: index(), id: string(), from: byte(), to: byte(), direction: one_of("down", "right"), nodes: list(OutlineNode), layout: TreeLayout });
const Actions = () => Type.Array(string(), { description: "Executable content, as XML" });
export const OutlineChart = object({ layout: ChartLayout, states: list(object({ id: string(), line: index() })), transitions: list(object({ line: index() })) });
export const EditedChart = object({
  layout: ChartLayout,
  states: list(
    object({
      id: string(),
      line: index(),
      kind: Type.String({ description: "As in gestures; empty: a dot before an initial state" }),
      inside: Type.String({ description: "The state that it is in; empty: none" }),
      initial: Type.Boolean({ description: "What it is in begins with it" }),
      from: byte(),
      to: byte(),
      onentry: Actions(),
      onexit: Actions(),
    }),
  ),
  transitions: list(
    object({
      line: index(),
      transition: Type.Integer({ minimum: 0, description: "Its place in the document, as in gestures" }),
      source: string(),
      written: Type.Boolean({ description: "As <transition>; else it is an initial state's, and has a target only" }),
      event: string(),
      condition: string(),
      target: string(),
      actions: Actions(),
    }),
  ),
  data: Type.Array(string(), { description: "<data> of the chart, as XML" }),
});
/** A chart in which some states hide what is in them; places are those of the whole. */
const folded = { layout: ChartLayout, states: list(index()), transitions: list(index()), hidden: list(index()) };
export const ChartFold = object(folded, "By what is drawn: which state or transition of the whole it is, and how many states it hides");
export const FoldedChart = object({ version: index(), ...folded });
export const Sentence = object(
  {
    name: string(),
    prose: string(),
    scope: one_of("globally", "before", "after", "between", "after-until", "while"),
    pattern: string(),
    from: byte(),
    to: byte(),
    parts: list(object({ part: one_of("open", "close", "p", "q", "r", "bound", "times", "assuming"), from: byte(), to: byte(), text: string() })),
  },
  "A requirement as its text has it",
);
export const DesignDocument = object({
  file: string(),
  version: index(),
  kind: FileKind,
  text: string(),
  theirs: or_null(Type.String({ description: "What is on disk, where both changed the same" })),
  unreadable: Type.String({ description: "Why what is on disk cannot be edited, as of another editor: it is written over only by `design_resolve`; empty: it can" }),
  error: or_null(object({ line: index(), column: index(), message: string() })),
  main: or_null(string()),
  trees: or_null(list(OutlineTree)),
  chart: or_null(EditedChart),
  requirements: or_null(list(Sentence)),
});
const saved_beside = () => Type.Array(string(), { description: "Others that were saved with it: they had the name of a file on disk that went" });
export const Reverted = object({ files: list(string()), left: Type.Array(string(), { description: "That somebody else has changed since, so that the step is not of them: they stay as they are" }), saved: saved_beside() });
/** What a file of requirements would have said of the last runs; `violated`: when first [ns], by run. */
export const DesignPast = object({
  file: string(),
  runs: list(object({ name: string(), ended: index(), problem: string() })),
  requirements: list(object({ name: string(), line: index(), chart: OutlineChart, violated: list(or_null(index())) })),
});
export const PaletteNode = object({
  id: string(),
  kind: NodeKind,
  children_max: index(),
  own: Type.Boolean({ description: "A skill of the project" }),
  description: string(),
  ports: list(object({ name: string(), direction: string(), type: string(), default: or_null(string()), description: string() })),
});
const YamlPath = () => Type.Array(Type.Union([string(), index()]), { description: "Keys of mappings and places in lists, from 0" });
export const StateKind = one_of("state", "parallel", "final", "history", "deep-history");
/** Of a transition, or of a state ("": the chart). */
const action_place = () => ({ transition: optional(index()), state: optional(string()), block: optional(one_of("onentry", "onexit", "datamodel")) });
export const Gesture = Type.Union([
  object({ what: Type.Literal("insert"), id: string(), subtree: optional(boolean()), name: optional(string()), ports: optional(by_name(string())), parent: index(), index: index() }),
  object({ what: Type.Literal("delete"), node: index() }),
  object({ what: Type.Literal("move"), node: index(), parent: index(), index: index(), copy: optional(boolean()) }),
  object({ what: Type.Literal("wrap"), node: index(), id: string() }),
  object({ what: Type.Literal("unwrap"), node: index() }),
  object({ what: Type.Literal("extract"), node: index(), id: string() }),
  object({ what: Type.Literal("inline"), node: index() }),
  object({ what: Type.Literal("paste"), xml: string(), parent: index(), index: index() }),
  object({ what: Type.Literal("add_tree"), id: string() }),
  object({ what: Type.Literal("delete_tree"), node: Type.Integer({ minimum: 0, description: "Element of the tree" }) }),
  object({ what: Type.Literal("set"), node: index(), name: string(), value: or_null(string()) }),
  object({ what: one_of("delete", "unwrap"), nodes: list(index()) }),
  object({ what: Type.Literal("move"), nodes: list(index()), parent: index(), index: index(), copy: optional(boolean()) }),
  object({ what: Type.Literal("wrap"), nodes: list(index()), id: string() }),
  object({ what: Type.Literal("set"), nodes: list(index()), name: string(), value: or_null(string()) }),
  object({ what: Type.Literal("rename_state"), state: string(), id: string() }),
  object({ what: Type.Literal("add_state"), inside: string(), id: string(), kind: StateKind }),
  object({ what: Type.Literal("remove_state"), state: string() }),
  object({ what: Type.Literal("move_state"), state: string(), inside: string() }),
  object({ what: Type.Literal("wrap_state"), state: string(), id: string(), kind: one_of("state", "parallel") }),
  object({ what: Type.Literal("remove_state"), states: list(string()) }),
  object({ what: Type.Literal("move_state"), states: list(string()), inside: string() }),
  object({ what: Type.Literal("wrap_state"), states: list(string()), id: string(), kind: one_of("state", "parallel") }),
  object({ what: Type.Literal("paste_states"), inside: string(), xml: string() }),
  object({ what: Type.Literal("set_kind"), state: string(), kind: StateKind }),
  object({ what: Type.Literal("set_initial"), state: string() }),
  object({ what: Type.Literal("add_transition"), state: string(), target: string(), event: string(), condition: string(), fresh: optional(Type.Boolean({ description: "The target is a state that is made for it" })) }),
  object({ what: Type.Literal("set_transition"), transition: index(), event: optional(string()), condition: optional(string()), target: optional(string()) }),
  object({ what: Type.Literal("remove_transition"), transition: index() }),
  object({ what: Type.Literal("move_transition"), transition: index(), state: string(), index: index() }),
  object({ what: Type.Literal("insert_action"), ...action_place(), index: index(), xml: string() }),
  object({ what: Type.Literal("set_action"), ...action_place(), index: index(), xml: string() }),
  object({ what: Type.Literal("remove_action"), ...action_place(), index: index() }),
  object({ what: Type.Literal("move_action"), ...action_place(), index: index(), to: index() }),
  object({ what: Type.Literal("set_part"), requirement: string(), part: string(), text: string() }),
  object({ what: Type.Literal("set_scope"), requirement: string(), scope: string() }),
  object({ what: Type.Literal("set_pattern"), requirement: string(), pattern: string() }),
  object({ what: Type.Literal("yaml_set"), path: YamlPath(), value: Data }),
  object({ what: Type.Literal("yaml_insert"), path: YamlPath(), index: index(), value: Data }),
  object({ what: Type.Literal("yaml_remove"), path: YamlPath() }),
]);

// ---- running one chart or one tree by hand ----

export const PlayedChart = object({
  version: index(),
  time: Time,
  status: string(),
  failure: string(),
  active: list(index()),
  taken: Type.Array(index(), { description: "Transitions of the last step" }),
  enabled: Type.Array(object({ event: string(), transition: index(), condition: string() }), { description: "Transitions of active states that name an event" }),
  timers: list(object({ due: Time, event: string() })),
  data: Type.Unsafe<Record<string, Static<typeof Data>>>(by_name(Data)),
  trace: Type.Array(object({ what: string(), time: Time, text: string() }), { description: "What the last step did" }),
  steps: list(object({ event: or_null(Type.String({ description: "Null: time passed" })), data: Data, time: Time })),
});
export const PlayedTree = object({
  version: index(),
  time: Time,
  timer: or_null(Time),
  result: string(),
  ticks: index(),
  back: Type.Integer({ description: "Steps that can be taken back" }),
  nodes: Type.Array(object({ at: byte(), status: string(), leaf: or_null(string()) }), { description: "Of the tree that is shown, without what is in its SubTrees" }),
  leaves: list(object({ leaf: string(), name: string(), condition: boolean(), answer: string(), status: string() })),
});

// ---- comparing ----

export const PartMark = one_of("", "added", "removed", "changed", "moved", "left");
export const Change = object(
  {
    kind: one_of("added", "removed", "changed", "moved"),
    path: string(),
    what: string(),
    before_line: Type.Integer({ description: "0: it is not there" }),
    after_line: Type.Integer(),
    tree: Type.Integer({ description: "Place in `trees`; -1: none" }),
    part: Type.Integer({ description: "Node or state; -1: the picture does not show it" }),
    transition: Type.Integer({ description: "Of a chart, instead of a state; -1: none" }),
  },
  "One of what `sentree diff` says",
);
const moves = () => list(tuple([index(), index()], { description: "From a part that is marked left to the one that moved" }));
export const Comparison = object({
  file: string(),
  before: or_null(Type.String({ description: "The text; null: the file was not there" })),
  after: or_null(string()),
  problem: Type.String({ description: "Why there is no picture; then there are no differences but those of the texts" }),
  differences: list(Change),
  trees: or_null(list(object({ id: string(), layout: TreeLayout, marks: list(PartMark), moves: moves() }))),
  chart: or_null(object({ layout: ChartLayout, states: list(PartMark), transitions: list(PartMark), moves: moves() })),
});
export const ComparedFile = object({ file: string(), change: one_of("added", "removed", "changed") });

// ---- requests: by operation, what is sent beside `op` and `id`, and the value of the answer ----

export const Filter = object({
  text: optional(string()),
  service: optional(string()),
  leaf: optional(string()),
  kind: optional(string()),
  name: optional(Type.String({ description: "With * for any text" })),
});
export const Lane = object({
  id: string(),
  kind: one_of("leaf", "skill", "monitor", "mission", "value"),
  name: string(),
  spans: optional(list(tuple([Time, Time, string()]))),
  points: optional(list(tuple([Time, number()]))),
});
export const Mark = object({ time: Time, kind: one_of("violation", "injection", "intervention", "veto", "problem", "gap"), text: string(), sequence: index(), from: optional(Type.Integer({ description: "Of a gap: when it began" })) });

const times = () => optional(Type.Integer({ minimum: 1, description: "How many messages; else until it is cleared" }));
/** By kind: what may be done to a run, as an entry of a scenario's timeline spells it. */
export const Interventions = {
  call: object({ call: Type.String({ description: "SERVICE.METHOD" }), args: optional(by_name(Data)) }),
  stop: object({ stop: Type.Literal("mission") }),
  kill: object({ kill: string() }),
  restart: object({ restart: string() }),
  delay: object({ delay: object({ message: string(), by: Type.String({ description: "300 ms" }), count: times() }) }),
  falsify: object({ falsify: object({ call: string(), path: optional(string()), value: Data, count: times() }) }),
  force: object({ force: object({ leaf: string(), status: one_of("SUCCESS", "FAILURE", "RUNNING"), count: times() }) }),
  breakpoint: object({ breakpoint: Type.Union([object({ node: Type.String({ description: "Its path" }), status: optional(string()) }), object({ chart: string(), state: string() }), object({ message: string() })]) }),
  clear: object({ clear: Type.Integer({ minimum: 1, description: "The number of what stands" }) }),
  unreachable: object({ unreachable: Type.String({ description: "SERVICE.METHOD" }) }),
  late: object({ late: Type.String({ description: "SERVICE.METHOD" }) }),
} as const;
const kinds = Object.values(Interventions);
export const Intervention = Type.Unsafe<Static<(typeof kinds)[number]>>(Type.Union(kinds));
const standing = { id: Type.Integer(), used: index(), text: string() };
export const Standing = Type.Unsafe<Static<(typeof kinds)[number]> & Static<TObject<typeof standing>>>(Type.Union(kinds.map(({ properties }) => Type.Object({ ...properties, ...standing }, kExact))));

const nothing = () => object({});
export const Operations = {
  hello: [
    object({ token: optional(string()), page: optional(Type.String({ description: "What it calls itself, at most 64 characters: what others did, who are there, it does not undo" })) }),
    object({ steerable: Type.Boolean({ description: "Whether this page may" }) }),
  ],
  live: [nothing(), Type.Unknown()],
  seek: [object({ time: Time }), Type.Unknown()],
  layout: [object({ collapsed: list(index()) }), object({ nodes: list(index()), layout: TreeLayout })],
  fold_chart: [object({ chart: string(), closed: Type.Array(string(), { description: "Ids of states whose inside is hidden" }) }), ChartFold],
  messages: [
    object({ before: optional(Type.Integer()), after: optional(Type.Integer()), until: optional(Time), limit: optional(Type.Integer({ minimum: 1, maximum: 500 })), filter: optional(Filter) }),
    object({ messages: list(Observation), more: boolean() }),
  ],
  lanes: [object({ from: Time, to: Time, width: Type.Integer({ minimum: 1, maximum: 4000 }) }), object({ lanes: list(Lane), marks: list(Mark) })],
  signal: [
    object({ path: Type.Array(string(), { description: "messages, a name, and what of their data; or charts, robots or blackboard, and what of them, as in `state`" }), from: Time, to: Time, width: Type.Integer({ minimum: 1, maximum: 4000 }) }),
    object({ points: Type.Array(tuple([Time, number()]), { description: "Of messages each pixel's first, last and extremes; of the others a value a pixel" }) }),
  ],
  signals: [nothing(), object({ paths: Type.Array(list(string()), { description: "What `signal` can be asked for of messages, as the newest of each name is, and the data of charts; at most 2,000" }) })],
  transitions: [object({ node: index() }), object({ rows: list(tuple([Time, string()])), left_out: index() })],
  find: [object({ filter: Filter, after: optional(Time), before: optional(Time) }), or_null(Observation)],
  pause: [nothing(), Type.Unknown()],
  resume: [nothing(), Type.Unknown()],
  step: [object({ ticks: Type.Integer({ minimum: 1 }) }), Type.Unknown()],
  factor: [object({ value: number() }), Type.Unknown()],
  run_again: [object({ seed: optional(Type.Integer({ minimum: 0 })), scenario: optional(string()), choose: optional(Type.Array(string(), { description: "MODEL#NUMBER=VALUE: what models choose instead" })) }), Type.Unknown()],
  alternatives: [
    object({ choices: Type.Array(string(), { description: "MODEL#NUMBER: choices that models have made in the run" }) }),
    list(or_null(object({ values: Type.Array(Data, { description: "At most 100, the first ones" }), count: Type.Integer({ minimum: 1, description: "Of all" }), last: Data }, "What that choice could have been; null: not known"))),
  ],
  intervene: [Intervention, object({ id: optional(Type.Integer({ description: "Of what stands" })), result: optional(Data) })],
  interventions: [nothing(), list(Standing)],
  coverage: [object({ verification: optional(Type.Boolean({ description: "What a verification has reached; null: none is there" })) }), or_null(Reached)],
  save_scenario: [object({ name: string() }), object({ yaml: string(), file: string() })],
  add_to_scenario: [object({ name: string() }), object({ yaml: string(), file: string() })],
  design: [nothing(), Design],
  design_palette: [nothing(), object({ nodes: list(PaletteNode), places: list(string()), interfaces: Type.Array(string(), { description: "FILE.thrift/SERVICE" }), charts: Type.Record(string(), string(), { description: "By ID or name of leaves: the file that the chosen scenario runs" }) })],
  design_read: [object({ file: string() }), DesignDocument],
  design_edit: [object({ file: string(), base: index(), edits: list(TextEdit), cause: string(), join: optional(boolean()) }), object({ version: index() })],
  design_gesture: [
    object({ file: string(), base: index(), gesture: Gesture, try: optional(Type.Boolean({ description: "Only say whether it is possible" })) }),
    object({ name: string(), version: optional(index()), at: optional(Type.Integer({ description: "Byte where the element stands now" })), nodes: optional(Type.Array(index(), { description: "Of several: their numbers now, as far as they can be told" })), states: optional(Type.Array(string(), { description: "Ids of those pasted" })) }),
  ],
  design_complete: [
    object({ file: string(), byte: byte() }),
    object({ from: byte(), to: byte(), items: list(object({ label: string(), kind: string(), detail: string(), documentation: string(), insert: string() })) }, "What may stand there, in place of these bytes"),
  ],
  design_explain: [object({ file: string(), byte: byte() }), or_null(object({ from: byte(), to: byte(), text: Type.String({ description: "Markdown" }) }))],
  design_reached: [object({ all: optional(Type.Boolean({ description: "What all scenarios reach together, not the shadow run alone" })), verification: optional(boolean()) }), or_null(Reached)],
  design_undo: [nothing(), Reverted],
  design_redo: [nothing(), Reverted],
  design_save: [object({ file: optional(string()) }), object({ saved: index() })],
  design_resolve: [object({ file: string(), keep: one_of("mine", "theirs") }), Type.Unknown()],
  design_add: [object({ kind: one_of("skill", "monitor", "requirement", "scenario", "component"), name: string() }), object({ file: string() })],
  design_init: [nothing(), Type.Unknown()],
  design_remove: [object({ file: string() }), object({ saved: saved_beside() })],
  design_rename_file: [
    object({ file: string(), to: Type.String({ description: "Its path inside the project" }) }),
    object({ file: string(), files: Type.Array(string(), { description: "Others that name it, and say so" }), places: index(), saved: saved_beside() }),
  ],
  design_uses: [object({ file: string() }), object({ uses: list(object({ file: string(), line: index(), text: string() })) })],
  design_fold: [object({ file: string(), closed: Type.Array(string(), { description: "Ids of states whose inside is hidden" }) }), FoldedChart],
  simulate_chart: [object({ file: string(), do: one_of("start", "look", "send", "wait", "back"), event: optional(string()), data: optional(Type.Unsafe<Static<typeof Data>>({ description: "Of the event; with start: values of <data> to begin with" })), time: optional(Time) }), PlayedChart],
  simulate_tree: [
    object({ file: string(), tree: string(), do: one_of("start", "look", "answer", "tick", "wait", "back"), leaf: optional(string()), status: optional(one_of("SUCCESS", "FAILURE", "RUNNING")) }),
    PlayedTree,
  ],
  compare_sides: [nothing(), object({ sides: list(object({ id: string(), title: string() })) })],
  compare_files: [object({ with: optional(string()) }), object({ before: string(), after: string(), files: list(ComparedFile) })],
  compare: [object({ with: optional(string()), file: string() }), Comparison],
  design_scenario: [object({ scenario: string() }), Type.Unknown()],
  design_record: [
    object({ factor: optional(Type.Number({ description: "Run seconds per second" })), real_time: optional(boolean()) }),
    object({ recording: string() }),
  ],
  design_rename: [
    object({ location: optional(Type.String({ description: "Or an area, of the world" })), tree: optional(Type.String({ description: "Instead" })), node: optional(Type.String({ description: "Instead: its name" })), state: optional(Type.String({ description: "Instead, of a chart" })), file: optional(Type.String({ description: "Of the chart, or the node's" })), base: optional(index()), gesture: optional(Gesture), to: string() }),
    object({ files: list(string()), places: Type.Integer({ description: "0: a node that nobody else names, or one of several of that name; the gesture is done instead" }), left: Type.Array(object({ file: string(), line: index(), text: string() }), { description: "What may mean it, and stays as it is: that cannot be told" }) }),
  ],
  design_apply: [
    nothing(),
    Type.Union([
      object({ recording: string(), changes: Type.Array(string(), { description: "What came, went or is another one" }) }),
      object({
        refused: list(object({ file: string(), line: index(), message: string() })),
        later: Type.Boolean({ description: "What is at work stands in the way: another moment may do" }),
      }),
    ]),
  ],
  design_show: [object({ recording: Type.String({ description: "Empty: the shadow run" }) }), Type.Unknown()],
} as const satisfies Record<string, readonly [TSchema, TSchema]>;

export const Answer = object({ id: Type.Integer(), ok: boolean(), error: optional(string()), value: optional(Type.Unknown()) });

const said = <N extends string, P extends TProperties>(name: N, { properties }: TObject<P>) => Type.Object({ type: Type.Literal(name), ...properties }, kExact);
/** By `type`: what the program sends. */
export const ServerMessages = {
  hello: said("hello", Hello),
  model: said("model", Model),
  // Before anything has been observed there is nothing of these.
  state: said("state", object({ ...state, charts: optional(state.charts), monitors: optional(state.monitors), robots: optional(state.robots) })),
  delta: said("delta", Delta),
  violation: said("violation", Violation),
  problem: said("problem", Problem),
  design: said("design", Design),
  design_document: said("design_document", DesignDocument),
  design_past: said("design_past", DesignPast),
  design_gone: said("design_gone", object({ file: string() })),
  answer: said("answer", Answer),
} as const;
