import { create } from "zustand";

import type { EditedChart, EditedState } from "../protocol/types";
import { is_xml, nothing_pasted, pasted, to_clipboard, written_at } from "./clipboard";
import { choose_state, choose_states, chosen_states, doc_of, focus_field, fresh_id, gesture, gesture_then, useDesign } from "./design";
import { outermost_states } from "./selection";

/** What is done to the chosen states of a chart. */

/** States that were copied or cut, to be pasted. */
interface Kept {
  states: readonly string[];
  file: string;
  cut: boolean;
  /** As others are given it. */
  text: string;
}
export const useKeptStates = create<{ kept: Kept | null }>()(() => ({ kept: null }));

export const named_states = (ids: readonly string[]) => (ids.length === 1 ? ids[0]! : `${ids.length} states`);
const ids_of = (states: readonly EditedState[]) => states.map(({ id }) => id);

interface Chosen {
  chart: EditedChart;
  file: string;
  /** Without those inside of others of them. */
  states: readonly EditedState[];
  text: string;
}
function chosen_now(): Chosen | null {
  const now = useDesign.getState();
  const doc = doc_of(now);
  if (!doc?.shown_chart) return null;
  const states = outermost_states(doc.shown_chart, chosen_states(now, doc.shown_chart));
  return { chart: doc.shown_chart, file: doc.file, states, text: states.map((state) => written_at(doc, state)).join("\n") };
}

export function keep_states(cut: boolean): void {
  const now = chosen_now();
  if (!now || now.states.length === 0) return;
  useKeptStates.setState({ kept: { states: ids_of(now.states), file: now.file, cut, text: now.text } });
  to_clipboard(now.text);
}

/** Into the chosen state if it holds others and is none of those pasted, else beside it. `text`: of the clipboard, where it could be read. */
export function paste_states(text: string): void {
  const now = chosen_now();
  if (!now) return;
  const { lines, kept } = pasted(text, useKeptStates.getState().kept);
  const at = now.states.at(-1);
  const holds = at !== undefined && now.chart.states.some(({ inside }) => inside === at.id) && !kept?.states.includes(at.id);
  const inside = holds ? at.id : (at?.inside ?? "");
  if (kept?.cut && kept.file === now.file) {
    move_states(kept.states, inside, () => useKeptStates.setState({ kept: null }));
    return;
  }
  const xml = kept?.text ?? lines;
  if (is_xml(xml)) void gesture({ what: "paste_states", xml, inside });
  else useDesign.setState({ refused: nothing_pasted(lines, "state") });
}

/** Beside the last of them. */
export function duplicate_states(): void {
  const now = chosen_now();
  const last = now?.states.at(-1);
  if (last) void gesture({ what: "paste_states", xml: now!.text, inside: last.inside });
}

export function remove_states(): void {
  const now = chosen_now();
  if (now && now.states.length > 0) void gesture({ what: "remove_state", states: ids_of(now.states) }).then((done) => done && choose_state(null));
}

export function move_states(states: readonly string[], inside: string, then?: () => void): void {
  void gesture_then({ what: "move_state", states: [...states], inside }, () => choose_states(states)).then((done) => done && then?.());
}

/** Into a new state, whose id is to be said next. */
export async function wrap_states(kind: "state" | "parallel"): Promise<void> {
  const now = chosen_now();
  if (!now || now.states.length === 0) return;
  const id = fresh_id();
  await gesture_then({ what: "wrap_state", states: ids_of(now.states), id, kind }, () => {
    choose_state(id);
    focus_field("design-state", id);
  });
}
