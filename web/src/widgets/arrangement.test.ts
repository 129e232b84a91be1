import { describe, expect, it } from "vitest";

import { default_sizes, is_stacked, kDefaultLayout, kShareMin, move_share, parse_layout } from "./arrangement";

describe("a stored layout", () => {
  it("is taken, but no panel fills the page again", () => {
    const stored = { ...kDefaultLayout, timeline_px: 333, side: "messages" as const, maximised: "map" as const };
    expect(parse_layout(JSON.stringify(stored))).toEqual({ ...stored, maximised: null });
  });

  it("is dropped when it is of another version, or damaged", () => {
    const columns = { columns: [{ weight: 1, panels: [] }], timeline_px: 250, collapsed: [], maximised: null };
    const none = { ...kDefaultLayout, mission: 0 };
    for (const text of [null, "", "{", "[]", "{}", "null", JSON.stringify(columns), JSON.stringify(none)]) expect(parse_layout(text)).toBe(kDefaultLayout);
  });
});

it("a border leaves each side something", () => {
  expect(move_share(0.5, 100, 1000)).toBeCloseTo(0.6);
  expect(move_share(0.5, 5000, 1000)).toBe(1 - kShareMin);
  expect(move_share(0.5, -5000, 1000)).toBe(kShareMin);
});

it("the stage has three fifths of the window", () => {
  for (const [width, height] of [[1920, 1080], [1440, 900], [1366, 768]] as const) {
    const { side_px, timeline_px } = default_sizes({ width, height });
    // Header and strip of 40 pixels each, and the borders.
    const stage = (width - side_px - 12) * (height - timeline_px - 80 - 12);
    expect(stage / (width * height), `${width}`).toBeGreaterThan(0.6);
  }
});

it("a wide tree stands above the map, a slim one beside it", () => {
  const stage = { width: 1100, height: 600 };
  expect(is_stacked(stage, { width: 1400, height: 400 }, 0.54)).toBe(true);
  expect(is_stacked(stage, { width: 300, height: 900 }, 0.54)).toBe(false);
});
