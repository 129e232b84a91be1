import { create } from "zustand";

import type { Data, IdlField, IdlTypes, PlayedChart, PlayedTree } from "../protocol/types";
import { request, useStudio } from "../store/store";
import { broken, doc_of, tree_of, useDesign } from "./design";

/** The open chart or tree, run by hand. */
export interface Simulation {
  on: boolean;
  file: string | null;
  tree: string | null;
  chart_now: PlayedChart | null;
  tree_now: PlayedTree | null;
  /** Of a chart: the event that is about to be sent, with what it brings. */
  event: string;
  problem: string | null;
}

const kNothing = { file: null, tree: null, chart_now: null, tree_now: null, event: "", problem: null };
export const useSimulation = create<Simulation>()(() => ({ on: false, ...kNothing }));

export const kAnswers = [
  { status: "SUCCESS", sign: "✓", word: "success" },
  { status: "FAILURE", sign: "✗", word: "failure" },
  { status: "RUNNING", sign: "▶", word: "running" },
] as const;

export function simulate(on: boolean): void {
  useSimulation.setState({ on, ...kNothing });
  if (on) void look();
}

type ChartStep = { do: "look" | "back" } | { do: "start"; data?: Record<string, Data> } | { do: "send"; event: string; data?: Data } | { do: "wait"; time: number };
type TreeStep = { do: "start" | "look" | "tick" | "wait" | "back" } | { do: "answer"; leaf: string; status: "SUCCESS" | "FAILURE" | "RUNNING" };

async function attempt(what: () => Promise<Partial<Simulation>>): Promise<boolean> {
  try {
    useSimulation.setState({ ...(await what()), problem: null });
    return true;
  } catch (error) {
    useSimulation.setState({ problem: error instanceof Error ? error.message : String(error) });
    return false;
  }
}

export function play_chart(step: ChartStep): Promise<boolean> {
  return attempt(async () => {
    const doc = doc_of(useDesign.getState());
    if (!doc) throw new Error("no file is open");
    return { file: doc.file, tree: null, tree_now: null, chart_now: await request("simulate_chart", { file: doc.file, ...step }) };
  });
}

export function play_tree(step: TreeStep): Promise<boolean> {
  return attempt(async () => {
    const state = useDesign.getState();
    const doc = doc_of(state);
    const tree = tree_of(state);
    if (!doc || !tree) throw new Error("no tree is open");
    return { file: doc.file, tree: tree.id, chart_now: null, tree_now: await request("simulate_tree", { file: doc.file, tree: tree.id, ...step }) };
  });
}

/** What is open is shown as it goes with its present text. */
export async function look(): Promise<void> {
  const state = useDesign.getState();
  const doc = doc_of(state);
  if (!useSimulation.getState().on || !doc || broken(state)) return;
  if (doc.chart) await play_chart({ do: "look" });
  else if (doc.trees) await play_tree({ do: "look" });
}

/** What an event of a service brings, as the interface says: {result: …} of a reply; null: nobody says. */
export function payload_of(event: string): { fields: IdlField[]; types: IdlTypes } | null {
  const [service, method, kind] = event.split(".");
  const model = useStudio.getState().index?.model.services.find(({ name }) => name === service);
  const found = model?.methods.find(({ name }) => name === method);
  if (!model || !found || kind !== "reply" || found.result === "void") return null;
  return { fields: [{ name: "result", type: found.result, required: true }], types: model.types };
}

/** The steps as `sentree chart` reads them. */
export function session_text(file: string, { steps }: PlayedChart): string {
  const lines = steps.map(({ event, data, time }) => (event === null ? `wait ${time / 1e6} ms` : `send ${event}${data === null ? "" : ` ${JSON.stringify(data)}`}`));
  return [`# sentree chart ${file} < this file`, ...lines, "state", ""].join("\n");
}
