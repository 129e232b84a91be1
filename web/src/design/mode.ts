import { create } from "zustand";

import type { Design, Time } from "../protocol/types";
import { useEdit } from "../store/edit";
import { ask, note, on_design } from "../store/store";
import { go_live, seek } from "../store/time_travel";

export type Runs = Design["runs"];

/** Why a run cannot go on with what is edited. */
interface Refusals {
  refused: readonly { file: string; line: number; message: string }[];
  /** It may at another moment. */
  later: boolean;
}

/** What the page of a project that is edited shows: its files, or how it goes; which run that is, and which file is open, or is to be opened first. */
export const useMode = create<{ mode: "design" | "run"; project: string; file: string | null; /** The monitor whose violation in the shadow run is told. */ happened: string | null; runs: Runs; refused: Refusals | null }>()(() => ({ mode: "design", project: "", file: null, happened: null, runs: { recordings: [], on_show: "", goes_on: null, continues: "", outdated: false, problem: "" }, refused: null }));

export function take_summary({ project, runs }: Pick<Design, "project" | "runs">): void {
  const { runs: before, project: known } = useMode.getState();
  useMode.setState({ project, runs });
  // Whoever begins a run, on whichever page: what of another one was looked at is not on show any more.
  if (known !== "" && runs.goes_on !== null && runs.goes_on !== before.goes_on) go_live();
  if (before.goes_on === null || runs.goes_on !== null) return;
  if (runs.problem !== "") note("error", `the run: ${runs.problem}`);
  note("info", `recorded: runs/${before.goes_on}`);
}
useEdit.subscribe(({ wanted }) => wanted && useMode.setState({ mode: "design" }));
on_design((message) => {
  if (message.type === "design") take_summary(message);
});

/** Begins a run that is steered and recorded, of the scenario that is open. */
export async function record(how: { factor?: number; real_time?: boolean }): Promise<void> {
  if (await ask("design_record", how)) show();
}

/** Lets the run that goes on go on with the texts as they are. */
export async function apply_edits(): Promise<void> {
  const applied = await ask("design_apply", {});
  if (applied === null) return;
  if ("refused" in applied) useMode.setState({ refused: applied });
  else note("info", applied.changes.length > 0 ? `the run goes on with the edits: ${applied.changes.join("; ")}` : "the run goes on with the edits");
}

/** A recording in all panels; empty: the shadow run. */
export async function show_recording(recording: string): Promise<void> {
  if ((await ask("design_show", { recording })) !== null) show();
}

/** A recording at a moment, beside what is edited. */
export async function look_at(recording: string, time: Time): Promise<void> {
  if (useMode.getState().runs.on_show !== recording && (await ask("design_show", { recording })) === null) return;
  seek(time);
}

function show(): void {
  go_live();
  useMode.setState({ mode: "run" });
}
