import type { Change, Comparison, PartMark } from "../protocol/types";

export const kSigns: Record<PartMark, string> = { "": "", added: "+", removed: "−", changed: "~", moved: "→", left: "" };
export const kWords: Record<Change["kind"], string> = { added: "added", removed: "removed", changed: "changed", moved: "moved" };
export const kKinds = ["added", "removed", "changed", "moved"] as const;

/** A part of a picture that can have a mark. */
export interface Part {
  kind: "node" | "state" | "transition";
  at: number;
}

/** What a difference is about, if the picture of `tree` (or of the chart) shows it. */
export function part_of(comparison: Comparison, { tree: of, part, transition }: Change, tree: NonNullable<Comparison["trees"]>[number] | null): Part | null {
  if (comparison.chart) return transition >= 0 ? { kind: "transition", at: transition } : part >= 0 ? { kind: "state", at: part } : null;
  if (of < 0 || part < 0 || comparison.trees?.[of] !== tree) return null;
  return { kind: "node", at: part };
}
