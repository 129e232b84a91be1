import { expect, it } from "vitest";

import type { MonitorModel, Violation } from "../protocol/types";
import { is_whole, said_first, without_witness } from "./violation";

const monitor = (name: string, sentence: string): MonitorModel => ({ name, sentence, chart: null, requirement: "", severity: null, gate: [] });
const violation = (monitor: string, time: number): Violation => ({ monitor, time, sequence: 1, story: "", witness: [], explanation: null });

it("of violations at one instant the one in words is shown first", () => {
  const monitors = [monitor("drawn", ""), monitor("written", "The battery is never empty.")];
  expect(said_first([violation("drawn", 5), violation("written", 5)], monitors)).toBe(1);
  expect(said_first([violation("drawn", 5), violation("written", 6)], monitors)).toBe(0);
  expect(said_first([violation("drawn", 5)], monitors)).toBe(0);
});

it("a story ends where the list of observations begins", () => {
  const story = "✗  battery violated at 20.000 s\n   The observations that led there, none of which can be left out:\n     20.000 s  a\n";
  expect(without_witness(story)).toBe("✗  battery violated at 20.000 s");
  expect(is_whole(story)).toBe(true);
  const late = "✗  b violated\n   The last observations before it (the earlier ones are no longer known):\n     20.000 s  a\n";
  expect(without_witness(late)).toBe("✗  b violated");
  expect(is_whole(late)).toBe(false);
  expect(without_witness("✗  b violated\n   because of c\n")).toBe("✗  b violated\n   because of c");
});
