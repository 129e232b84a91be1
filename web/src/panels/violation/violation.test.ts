import { expect, it } from "vitest";

import type { MonitorModel, Violation } from "../../protocol/types";
import { said_first, witness_title } from "./violation";

const monitor = (name: string, sentence: string): MonitorModel => ({ name, sentence, chart: null, requirement: "", severity: null, gate: [] });
const violation = (monitor: string, time: number): Violation => ({ monitor, time, sequence: 1, story: "", witness: [], witness_complete: true, witness_minimal: true, explanation: null });

it("of violations at one instant the one in words is shown first", () => {
  const monitors = [monitor("drawn", ""), monitor("written", "The battery is never empty.")];
  expect(said_first([violation("drawn", 5), violation("written", 5)], monitors)).toBe(1);
  expect(said_first([violation("drawn", 5), violation("written", 6)], monitors)).toBe(0);
  expect(said_first([violation("drawn", 5)], monitors)).toBe(0);
});

it("says what is known of the witness", () => {
  const known = violation("battery", 5);
  expect(witness_title(known)).toMatch(/none of these can be left out/);
  expect(witness_title({ ...known, witness_minimal: false })).toMatch(/some may not matter/);
  expect(witness_title({ ...known, witness_minimal: false, witness_complete: false })).toMatch(/no longer known/);
});
