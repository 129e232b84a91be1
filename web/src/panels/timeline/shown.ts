import { create } from "zustand";

import type { Time } from "../../protocol/types";
import type { View } from "./view";

/** A moment that others tell the timeline of: where another run would have violated what is being written. */
export interface PastMark {
  kind: "past";
  time: Time;
  text: string;
}
export const usePastMarks = create<{ marks: readonly PastMark[] }>()(() => ({ marks: [] }));

/** The piece of run time that the timeline shows, for pictures that go with it. */
export const useShownPiece = create<View>()(() => ({ from: 0, to: 30e9 }));

let show: ((view: View) => void) | null = null;

/** The timeline shows another piece; without a timeline the others do. */
export function show_piece(view: View): void {
  if (show) show(view);
  else useShownPiece.setState(view);
}

/** How the timeline is told; null: it is gone. */
export function told_by(listener: ((view: View) => void) | null): void {
  show = listener;
}
