import { create } from "zustand";

import type { Data, Operation, Operations, TreeNode } from "../../protocol/types";
import { ask, note, request, useStudio, type Studio } from "../../store/store";
import { code_of, id_of, opposite, type Step, type Undo } from "./by_hand";

/** Why the run cannot be steered from this page now; null: it can. */
export function why_not(studio: Pick<Studio, "phase" | "hello" | "state">): string | null {
  const { phase, hello, state } = studio;
  if (phase !== "open" || !hello || !state) return "There is no connection to the program";
  if (hello.mode === "recording") return "This is a recording: nothing can be changed any more";
  if (!hello.steerable && hello.design) return "The run beside an edited project cannot be steered; Record begins one that can";
  if (!hello.steerable) return "This page may only look; open it with the address that the program printed to steer";
  if (!state.live) return "You look at the past; go back to live (L) to steer";
  if (state.run.state === "ended") return "The run has ended";
  return null;
}

export function useWhyNot(): string | null {
  return useStudio(why_not);
}

/** A breakpoint, a fault or a forced result that stands until it is cleared or used up. */
export interface Standing {
  id: number;
  kind: string;
  text: string;
  /** How often it has had an effect. */
  used: number;
  node: number | null;
  leaf: string | null;
  chart: string | null;
  state: string | null;
  status: string | null;
}

export const useSteering = create<{
  standing: readonly Standing[];
  /** Parts that this page killed and did not restart. */
  killed: ReadonlySet<string>;
  /** What takes back what this page did, the newest last. */
  undo: readonly Undo[];
}>()(() => ({ standing: [], killed: new Set(), undo: [] }));
/** By id: how this page made something stand. */
const made = new Map<number, Step>();
/** Older ones are forgotten. */
const kUndoMax = 100;
useStudio.subscribe((studio, before) => {
  if (studio.hello?.boot === before.hello?.boot) return;
  // Another run has parts of its own.
  useSteering.setState({ killed: new Set(), undo: [] });
  made.clear();
});

/** What the program says of standing interventions, brought into one shape. */
export function read_standing(value: unknown): Standing[] {
  if (!Array.isArray(value)) return [];
  return value.filter(is_record).map((entry) => {
    const what = is_record(entry["what"]) ? { ...entry, ...entry["what"] } : entry;
    const kind = text_of(what["kind"]);
    return {
      id: Number(entry["id"]),
      kind: text_of(entry["kind"]) || kind,
      text: text_of(entry["text"]) || describe(what),
      used: typeof entry["used"] === "number" ? entry["used"] : 0,
      node: typeof what["node"] === "number" ? what["node"] : null,
      leaf: typeof what["leaf"] === "string" ? what["leaf"] : null,
      chart: typeof what["chart"] === "string" ? what["chart"] : null,
      state: typeof what["state"] === "string" ? what["state"] : null,
      status: typeof what["status"] === "string" && what["status"] !== "" ? what["status"] : null,
    };
  });
}

/** Whether it is a breakpoint on a node, or a result that its leaf is forced to. */
export function is_on(entry: Standing, node: Pick<TreeNode, "id" | "message_name">): boolean {
  return entry.node === node.id || (entry.leaf !== null && entry.leaf === node.message_name);
}

function describe(what: Record<string, Data>): string {
  const { id: _id, kind: _kind, used: _used, ...rest } = what;
  return Object.entries(rest)
    .filter(([, value]) => value !== null && value !== "" && typeof value !== "object")
    .map(([key, value]) => `${key} ${String(value)}`)
    .join(", ");
}

function is_record(value: unknown): value is Record<string, Data> {
  return typeof value === "object" && value !== null && !Array.isArray(value);
}

function text_of(value: unknown): string {
  return typeof value === "string" ? value : "";
}

export async function refresh_standing(): Promise<void> {
  if (why_not(useStudio.getState()) !== null) return;
  try {
    useSteering.setState({ standing: read_standing(await request("interventions", {})) });
  } catch {
    // The connection is gone; the list is asked for again with the next one.
  }
}

/** As `ask`; keeps what takes it back, and brings the list of standing interventions up to date. */
export async function steer<Op extends Operation>(op: Op, args: Operations[Op][0]): Promise<Operations[Op][1] | null> {
  const done = await carry_out({ op, args });
  const back = done?.back;
  if (back) useSteering.setState(({ undo }) => ({ undo: [...undo, back].slice(-kUndoMax) }));
  return (done?.answer ?? null) as Operations[Op][1] | null;
}

/** Takes back what this page did last; what has come of it meanwhile stays. */
export async function take_back(): Promise<void> {
  const last = useSteering.getState().undo.at(-1);
  const reason = why_not(useStudio.getState());
  if (reason !== null || !last) return note("info", `${reason ?? "Nothing that this page did can be taken back"}.`);
  useSteering.setState(({ undo }) => ({ undo: undo.filter((step) => step !== last) }));
  const done = await carry_out(last);
  if (done === null) return;
  if (done.refused === null) note("info", `taken back: ${last.said}`);
  else note("error", `${last.said}: cannot be taken back, ${done.refused}`);
}

/** Null: the program refused it, which is shown. `refused`: a service answered with another code than OK. */
async function carry_out(step: Step): Promise<{ answer: unknown; refused: string | null; back: Undo | null } | null> {
  const { index, state } = useStudio.getState();
  const called = step.op === "call" ? (step.args as Operations["call"][0]).service : null;
  const service = called?.endsWith("simulation") ? index?.model.services.find(({ name }) => name === called) : undefined;
  const robot = service ? (service.robot ?? index?.model.world?.robots[0]?.name ?? null) : null;
  const answer: unknown = await ask(step.op, step.args);
  if (answer === null) return null;
  const code = called === null ? null : code_of((answer as Operations["call"][1]).result);
  const refused = code === null || code === "OK" ? null : code.toLowerCase().replaceAll("_", " ");
  const id = id_of(answer);
  if (id !== null) made.set(id, step);
  if (step.op === "kill" || step.op === "restart") {
    const { part } = step.args as Operations["kill"][0];
    useSteering.setState(({ killed }) => ({ killed: new Set(step.op === "kill" ? [...killed, part] : [...killed].filter((other) => other !== part)) }));
  }
  await refresh_standing();
  return { answer, refused, back: state && refused === null ? opposite(step, answer, state, robot, made) : null };
}

/** The test control of a robot of the simulated world; null: there is none. */
export function test_control(services: readonly { name: string }[], robots: readonly { name: string }[], robot: string): string | null {
  const own = `${robot}/simulation`;
  if (services.some(({ name }) => name === own)) return own;
  const first = robots[0]?.name === robot;
  return first && services.some(({ name }) => name === "simulation") ? "simulation" : null;
}
