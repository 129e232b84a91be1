import type { MonitorModel, Violation } from "../protocol/types";

/** Index of the violation that is shown before anybody chose: of the earliest ones the first whose requirement is in words. */
export function said_first(violations: readonly Violation[], monitors: readonly MonitorModel[]): number {
  const in_words = ({ monitor }: Violation) => monitors.some(({ name, sentence }) => name === monitor && sentence !== "");
  const found = violations.findIndex((violation) => violation.time === violations[0]?.time && in_words(violation));
  return Math.max(found, 0);
}

const kWitness = /^ *(The observations that led there|The last observations before it)\b/;

/** Whether the witness has all that led there; of what happened long ago, only the last observations are known. */
export function is_whole(story: string): boolean {
  return !/^ *The last observations before it\b/m.test(story);
}

/** The story without the list of observations that ends it: the page shows them as links. */
export function without_witness(story: string): string {
  const lines = story.trim().split("\n");
  const at = lines.findIndex((line) => kWitness.test(line));
  return (at < 0 ? lines : lines.slice(0, at)).join("\n").trimEnd();
}
