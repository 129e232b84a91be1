import type { MonitorModel, Violation } from "../../protocol/types";

/** Index of the violation that is shown before anybody chose: of the earliest ones the first whose requirement is in words. */
export function said_first(violations: readonly Violation[], monitors: readonly MonitorModel[]): number {
  const in_words = ({ monitor }: Violation) => monitors.some(({ name, sentence }) => name === monitor && sentence !== "");
  const found = violations.findIndex((violation) => violation.time === violations[0]?.time && in_words(violation));
  return Math.max(found, 0);
}

/** What is known of the witness, over the list of it. */
export function witness_title({ witness_complete, witness_minimal }: Violation): string {
  if (!witness_complete) return "The last observations before it; earlier ones are no longer known";
  return witness_minimal ? "The witness: none of these can be left out" : "The witness: some may not matter, there are too many to try";
}
