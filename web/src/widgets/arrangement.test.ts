import { describe, expect, it } from "vitest";

import { default_sizes, is_stacked, kDefaultLayout, kShareMin, move_share, parse_arrangements, parse_layout, placed, tabs_in } from "./arrangement";

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

describe("a panel", () => {
  it("is a tab where one puts it, and shown there", () => {
    const moved = placed(kDefaultLayout, "messages", "below");
    expect(tabs_in(moved, "below")).toEqual({ tabs: ["messages"], shown: "messages" });
    expect(tabs_in(moved, "side")).toEqual({ tabs: ["monitors", "reached"], shown: "monitors" });
    const both = placed(moved, "plot", "below");
    expect(tabs_in(both, "below")).toEqual({ tabs: ["messages", "plot"], shown: "plot" });
    expect(tabs_in(placed(both, "plot", "closed"), "below")).toEqual({ tabs: ["messages"], shown: "messages" });
    const none = ["monitors", "messages", "reached"].reduce((layout, id) => placed(layout, id as "monitors", "closed"), kDefaultLayout);
    expect(tabs_in(none, "side").shown).toBeNull();
  });

  it("stands there again in an arrangement that was saved by name", () => {
    const moved = placed(kDefaultLayout, "messages", "below");
    expect(parse_arrangements(JSON.stringify({ mine: moved, broken: { mission: 2 } }))).toEqual({ mine: moved });
    for (const text of [null, "", "[", "3"]) expect(parse_arrangements(text)).toEqual({});
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
  // Where both are much the same it stays as it is.
  const even = { width: 1100, height: 452 };
  expect(is_stacked(stage, even, 0.54)).not.toBe(is_stacked({ ...stage, height: 560 }, even, 0.54));
  for (const before of [true, false]) for (const height of [600, 560]) expect(is_stacked({ ...stage, height }, even, 0.54, before)).toBe(before);
});
