import { expect, it } from "vitest";

import { clock_text, data_text, duration_text } from "./format";

it("run time reads as minutes, seconds and decimals", () => {
  expect(clock_text(0)).toBe("0:00.000");
  expect(clock_text(20e9)).toBe("0:20.000");
  expect(clock_text(3723.4e9, 1)).toBe("1:02:03.4");
  expect(clock_text(-1.5e9, 1)).toBe("−0:01.5");
});

it("run time is rounded once", () => {
  expect(clock_text(59.9996e9)).toBe("1:00.000");
  expect(clock_text(59.6e9, 0)).toBe("1:00");
});

it("durations have three digits and a unit", () => {
  expect(duration_text(0)).toBe("0 s");
  expect(duration_text(12_345)).toBe("12.3 µs");
  expect(duration_text(3.4e6)).toBe("3.4 ms");
  expect(duration_text(1.25e9)).toBe("1.25 s");
  expect(duration_text(125e9)).toBe("2 min 5 s");
  expect(duration_text(2 * 3600e9 + 60e9)).toBe("2 h 1 min");
});

it("data fit on one line", () => {
  expect(data_text({ percentage: 0.1, names: ["a", null], ok: true })).toBe("{percentage: 0.1, names: [a, null], ok: true}");
  expect(data_text("x".repeat(300), 10)).toBe(`${"x".repeat(9)}…`);
  expect(data_text(undefined)).toBe("");
});
