import { create } from "zustand";

import { Client, LostError, socket_address, type Phase } from "../protocol/client";
import type {
  ChartModel,
  Hello,
  Model,
  Observation,
  Operation,
  Operations,
  Problem,
  ServerMessage,
  State,
  Time,
  TreeNode,
  Violation,
} from "../protocol/types";
import { append, fold } from "./fold";
import { PageName } from "./page_name";

/** Observations that the page keeps while it follows the run; older ones are asked for. */
export const kLiveMessagesMax = 2000;
export const kProblemsMax = 200;

/** What all panels agree to look at. */
export interface Selection {
  node: number | null;
  chart: string | null;
  monitor: string | null;
  /** Sequence of the chosen observation. */
  sequence: number | null;
}

/** A short-lived line for the person who uses the page, e.g. why an operation was refused. */
export interface Note {
  id: number;
  kind: "info" | "error";
  text: string;
  /** Said because the program could not be reached. */
  lost: boolean;
}

/** The model, and the ways that panels look things up in it. */
export interface Index {
  model: Model;
  children: number[][];
  /** By the name that the leaf has in observations. */
  node_of_leaf: Map<string, TreeNode>;
  chart: Map<string, ChartModel>;
}

export interface Studio {
  phase: Phase;
  attempt: number;
  hello: Hello | null;
  /** Whether this page may: not without the token, where one is wanted. */
  may_steer: boolean;
  index: Index | null;
  /** Of the moment that the page shows: the present when `state.live`, else the chosen one. */
  state: State | null;
  /** The newest observations, in order, while following the run. */
  messages: readonly Observation[];
  /** Observations left out because the page could not keep up. */
  missed: number;
  violations: readonly Violation[];
  problems: readonly Problem[];
  selection: Selection;
  notes: readonly Note[];
  /** The moment asked for, while its state has not arrived. */
  wanted: Time | null;
  /** Replay: run time per wall time; 0: not replaying. */
  replay: number;
  replay_speed: number;
}

const kNothingSelected: Selection = { node: null, chart: null, monitor: null, sequence: null };

export const kEmpty: Studio = {
  phase: "connecting",
  attempt: 0,
  hello: null,
  may_steer: true,
  index: null,
  state: null,
  messages: [],
  missed: 0,
  violations: [],
  problems: [],
  selection: kNothingSelected,
  notes: [],
  wanted: null,
  replay: 0,
  replay_speed: 1,
};

/** Before anything has been observed there are neither charts nor robots in what the program sends. */
const kNothingYet = { blackboard: {}, charts: {}, monitors: {}, robots: {}, obstacles: [], doors: [] };

export const useStudio = create<Studio>()(() => kEmpty);

export function make_index(model: Model): Index {
  const children: number[][] = model.tree.nodes.map(() => []);
  const node_of_leaf = new Map<string, TreeNode>();
  for (const node of model.tree.nodes) {
    if (node.parent !== null) children[node.parent]?.push(node.id);
    if (node.message_name !== null) node_of_leaf.set(node.message_name, node);
  }
  return { model, children, node_of_leaf, chart: new Map(model.charts.map((chart) => [chart.id, chart])) };
}

/** What is said of a project that is edited; the store of design mode takes it. */
export type DesignMessage = Extract<ServerMessage, { type: "design" | "design_document" | "design_gone" | "design_past" }>;
export type RunMessage = Exclude<ServerMessage, { type: "answer" } | DesignMessage>;

function is_of_design(message: RunMessage | DesignMessage): message is DesignMessage {
  return message.type === "design" || message.type === "design_document" || message.type === "design_gone" || message.type === "design_past";
}

/** Told of each message of design mode at once, in order. */
const design_listeners = new Set<(message: DesignMessage) => void>();
export function on_design(listener: (message: DesignMessage) => void): () => void {
  design_listeners.add(listener);
  return () => design_listeners.delete(listener);
}

/** What is said of the project while a whole answer is waited for. */
let held_back: DesignMessage[] | null = null;
function release(): void {
  const messages = held_back ?? [];
  held_back = null;
  for (const message of messages) design_listeners.forEach((listener) => listener(message));
}

/** The store after one message of the program. */
export function receive(studio: Studio, message: RunMessage): Studio {
  switch (message.type) {
    case "hello": {
      const { type: _, ...hello } = message;
      // The same run goes on after a reconnect; its state, past messages and violations are sent again.
      const same = studio.hello?.boot === hello.boot;
      return same
        ? { ...studio, hello, violations: [], problems: [], messages: [], missed: 0 }
        : { ...kEmpty, phase: studio.phase, attempt: studio.attempt, may_steer: studio.may_steer, notes: studio.notes, hello };
    }
    case "model": {
      const { type: _, ...model } = message;
      return { ...studio, index: make_index(model) };
    }
    case "state": {
      const { type: _, ...sent } = message;
      const state: State = { ...kNothingYet, ...sent };
      // A page that had fallen behind gets the complete state: what it has not seen lies between.
      const messages = state.live && studio.state?.live ? studio.messages : [];
      return { ...studio, state, messages };
    }
    case "delta": {
      if (!studio.state) return studio;
      const { type: _, ...delta } = message;
      return {
        ...studio,
        state: fold(studio.state, delta),
        messages: append(studio.messages, delta.messages ?? [], kLiveMessagesMax),
        missed: studio.missed + (delta.missed ?? 0),
      };
    }
    case "violation": {
      const { type: _, ...violation } = message;
      if (studio.violations.some((v) => v.monitor === violation.monitor && v.sequence === violation.sequence)) return studio;
      const violations = [...studio.violations, violation].sort((a, b) => a.time - b.time || a.sequence - b.sequence);
      return { ...studio, violations };
    }
    case "problem": {
      const { type: _, ...problem } = message;
      return { ...studio, problems: append(studio.problems, [problem], kProblemsMax) };
    }
  }
}

// ---- the connection ----

let staged: Studio | null = null;
let scheduled = false;

/** What was selected, in a run whose tree may have been edited. */
export function reselected({ node, chart, ...others }: Selection, before: Index | null, index: Index | null): Selection {
  const key = node === null ? undefined : node_keys(before)[node];
  const there = key === undefined ? -1 : node_keys(index).indexOf(key);
  return { ...others, node: there < 0 ? null : there, chart: chart !== null && index?.chart.has(chart) ? chart : null };
}

/** By id, what a node is known by when the tree around it is edited: its path, and the how manieth it is of that path. */
export function node_keys(index: Index | null): string[] {
  const count = new Map<string, number>();
  return (index?.model.tree.nodes ?? []).map(({ path }) => {
    const nth = (count.get(path) ?? 0) + 1;
    count.set(path, nth);
    return `${nth} ${path}`;
  });
}

function commit(): void {
  scheduled = false;
  if (!staged) return;
  const { phase, attempt, may_steer, index, state, messages, missed, violations, problems } = staged;
  const shown = useStudio.getState();
  const hello = may_steer || !staged.hello?.steerable ? staged.hello : { ...staged.hello, steerable: false, repeatable: false };
  const fresh = hello !== null && shown.hello?.boot !== hello.boot;
  staged = null;
  useStudio.setState({
    ...{ phase, attempt, hello, may_steer, index, state, messages, missed, violations, problems },
    ...(fresh ? { selection: kNothingSelected, wanted: null, replay: 0 } : index !== shown.index ? { selection: reselected(shown.selection, shown.index, index) } : {}),
  });
}

/** Messages that arrive within one frame are drawn together. */
function stage(change: (studio: Studio) => Studio): void {
  staged = change(staged ?? useStudio.getState());
  if (scheduled) return;
  scheduled = true;
  // A hidden page draws no frames, but must not fall behind.
  if (document.hidden) window.setTimeout(commit, 100);
  else requestAnimationFrame(commit);
}

function token(): string | undefined {
  return /(?:^#|&)token=([^&]+)/.exec(window.location.hash)?.[1];
}

let own_name: PageName | null = null;
/** What the page calls itself. */
export function page_name(): string {
  // The program is told of another name as soon as it is known.
  own_name ??= new PageName(sessionStorage, new BroadcastChannel("sentree.pages"), performance.timeOrigin, () => client?.greet());
  return own_name.current;
}

let client: Client | null = null;

/** Of the stream before the page looked, this much is asked for. */
const kMessagesBefore = 300;

/** A page that begins to follow shows what was said last, too. */
async function fill_messages(until: number): Promise<void> {
  try {
    const { messages: older } = await request("messages", { before: until + 1, limit: kMessagesBefore });
    stage((studio) => {
      if (!studio.state?.live) return studio;
      const first = studio.messages[0]?.sequence ?? Infinity;
      const messages = append(older.filter((message) => message.sequence < first), studio.messages, kLiveMessagesMax);
      return { ...studio, messages };
    });
  } catch {
    // The connection was lost meanwhile; the next one begins anew.
  }
}

export function connect(): void {
  const given = token();
  client = new Client({
    open: () => new WebSocket(socket_address(window.location)),
    receive: (message) => {
      if (is_of_design(message)) {
        if (held_back) held_back.push(message);
        else design_listeners.forEach((listener) => listener(message));
        return;
      }
      stage((studio) => receive(studio, message));
      if (message.type === "state" && message.live) void fill_messages(message.sequence);
    },
    page: page_name,
    greeted: (may_steer) => stage((studio) => ({ ...studio, may_steer })),
    phase: (phase, attempt) => {
      stage((studio) => ({ ...studio, phase, attempt }));
      if (phase === "open") useStudio.setState((studio) => ({ notes: studio.notes.filter(({ lost }) => !lost) }));
    },
    ...(given === undefined ? {} : { token: given }),
  });
  client.start();
  // A page that nobody sees may wait for minutes until it tries again.
  document.addEventListener("visibilitychange", () => document.hidden || retry());
}

export function retry(): void {
  client?.retry();
}

/** The answer of the program; rejects with a RefusedError that says why not. */
export function request<Op extends Operation>(op: Op, args: Operations[Op][0]): Promise<Operations[Op][1]> {
  return client ? client.request(op, args).finally(release) : Promise.reject(new LostError("not connected to the program"));
}

/**
 * As `request`; what the program says of the project before it answers comes with the answer, so that nobody can do anything
 * between the two: to a picture that has changed, while what is chosen in it is still that of before.
 */
export function request_whole<Op extends Operation>(op: Op, args: Operations[Op][0]): Promise<Operations[Op][1]> {
  held_back ??= [];
  return request(op, args);
}

/** As `request`; a refusal is shown to the person, and the value is null. */
export async function ask<Op extends Operation>(op: Op, args: Operations[Op][0]): Promise<Operations[Op][1] | null> {
  try {
    return await request(op, args);
  } catch (error) {
    // Another run begins at this address, maybe before the program has answered.
    if (op === "run_again" && error instanceof LostError) return null;
    note("error", `${op.replace("_", " ")}: ${error instanceof Error ? error.message : String(error)}`, error instanceof LostError);
    return null;
  }
}

let next_note = 1;
const kNotesMax = 5;
const kNoteShown_ms = 8000;

/** `lost`: it is said no longer than the program cannot be reached. */
export function note(kind: Note["kind"], text: string, lost = false): void {
  const id = next_note++;
  useStudio.setState((studio) => ({ notes: append(studio.notes, [{ id, kind, text, lost }], kNotesMax) }));
  window.setTimeout(() => dismiss(id), kNoteShown_ms);
}

export function dismiss(id: number): void {
  useStudio.setState((studio) => ({ notes: studio.notes.filter((entry) => entry.id !== id) }));
}

export function select(selection: Partial<Selection>): void {
  useStudio.setState((studio) => ({ selection: { ...studio.selection, ...selection } }));
}
