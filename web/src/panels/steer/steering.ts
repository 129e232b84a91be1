import { create } from "zustand";

import { kind_of, said_of } from "../../protocol/interventions";
import type { Intervention, InterventionKind, Operations, Standing as Said, TreeNode } from "../../protocol/types";
import { ask, note, request, useStudio, type Studio } from "../../store/store";
import { code_of, opposite, type Undo } from "./by_hand";

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
  kind: InterventionKind;
  text: string;
  /** How often it has had an effect. */
  used: number;
  /** Of a breakpoint: the node's path. */
  node: string | null;
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
/** By id: what this page made to stand. */
const made = new Map<number, Intervention>();
/** Older ones are forgotten. */
const kUndoMax = 100;
/** What this page did to the run is known after it is loaded anew, too. */
const kStored = "sentree.steering";
interface Stored {
  boot: string;
  undo: readonly Undo[];
  killed: readonly string[];
  made: readonly [number, Intervention][];
}
useStudio.subscribe((studio, before) => {
  const boot = studio.hello?.boot;
  if (boot === before.hello?.boot) return;
  const stored = JSON.parse(sessionStorage.getItem(kStored) ?? "null") as Stored | null;
  // Another run has parts of its own.
  const own = stored && stored.boot === boot ? stored : null;
  made.clear();
  for (const [id, what] of own?.made ?? []) made.set(id, what);
  useSteering.setState({ killed: new Set(own?.killed), undo: own?.undo ?? [] });
});
useSteering.subscribe(({ undo, killed }, before) => {
  const boot = useStudio.getState().hello?.boot;
  if (boot === undefined || (undo === before.undo && killed === before.killed)) return;
  sessionStorage.setItem(kStored, JSON.stringify({ boot, undo, killed: [...killed], made: [...made] } satisfies Stored));
});

const shown = (what: Said): Standing => ({
  id: what.id,
  kind: kind_of(what),
  text: what.text,
  used: what.used,
  node: said_of(what, "node"),
  leaf: said_of(what, "leaf"),
  chart: said_of(what, "chart"),
  state: said_of(what, "state"),
  status: said_of(what, "status"),
});

/** Whether it is a breakpoint on a node, or a result that its leaf is forced to. */
export function is_on(entry: Standing, node: Pick<TreeNode, "path" | "message_name">): boolean {
  return entry.node === node.path || (entry.leaf !== null && entry.leaf === node.message_name);
}

export async function refresh_standing(): Promise<void> {
  if (why_not(useStudio.getState()) !== null) return;
  try {
    useSteering.setState({ standing: (await request("interventions", {})).map(shown) });
  } catch {
    // The connection is gone; the list is asked for again with the next one.
  }
}

/** Null: the program refuses it, which is shown. Keeps what takes it back, and brings the list of what stands up to date. */
export async function intervene(what: Intervention): Promise<Operations["intervene"][1] | null> {
  const done = await carry_out(what);
  const back = done?.back;
  if (back) useSteering.setState(({ undo }) => ({ undo: [...undo, back].slice(-kUndoMax) }));
  return done?.answer ?? null;
}

/** Takes back what this page did last; what has come of it meanwhile stays. */
export async function take_back(): Promise<void> {
  const last = useSteering.getState().undo.at(-1);
  const reason = why_not(useStudio.getState());
  if (reason !== null || !last) return note("info", `${reason ?? "Nothing that this page did can be taken back"}.`);
  useSteering.setState(({ undo }) => ({ undo: undo.filter((step) => step !== last) }));
  const done = await carry_out(last.what);
  if (done === null) return;
  if (done.refused === null) note("info", `taken back: ${last.said}`);
  else note("error", `${last.said}: cannot be taken back, ${done.refused}`);
}

/** Null: the program refused it, which is shown. `refused`: a service answered with another code than OK. */
async function carry_out(what: Intervention): Promise<{ answer: Operations["intervene"][1]; refused: string | null; back: Undo | null } | null> {
  const { index, state } = useStudio.getState();
  const called = "call" in what ? what.call.slice(0, what.call.lastIndexOf(".")) : null;
  const service = called?.endsWith("simulation") ? index?.model.services.find(({ name }) => name === called) : undefined;
  const robot = service ? (service.robot ?? index?.model.world?.robots[0]?.name ?? null) : null;
  const answer = await ask("intervene", what);
  if (answer === null) return null;
  const code = called === null ? null : code_of(answer.result);
  const refused = code === null || code === "OK" ? null : code.toLowerCase().replaceAll("_", " ");
  const id = answer.id ?? null;
  if (id !== null) made.set(id, what);
  if ("kill" in what) useSteering.setState(({ killed }) => ({ killed: new Set([...killed, what.kill]) }));
  if ("restart" in what) useSteering.setState(({ killed }) => ({ killed: new Set([...killed].filter((other) => other !== what.restart)) }));
  await refresh_standing();
  return { answer, refused, back: state && refused === null ? opposite(what, id, state, robot, made) : null };
}

/** The test control of a robot of the simulated world; null: there is none. */
export function test_control(services: readonly { name: string }[], robots: readonly { name: string }[], robot: string): string | null {
  const own = `${robot}/simulation`;
  if (services.some(({ name }) => name === own)) return own;
  const first = robots[0]?.name === robot;
  return first && services.some(({ name }) => name === "simulation") ? "simulation" : null;
}
