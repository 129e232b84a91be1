import { describe, expect, it } from "vitest";

import type { State } from "../../protocol/types";
import { candidates, held_at, kSignalsMax, on_one_axis, parse_signals, sides_of, title_of, together, with_signal, type Signal } from "./signals";

describe("what can be plotted", () => {
  const state = {
    robots: { robot: { pose: [1, 2, 0.5], battery: { percentage: 0.7, charging: false, status: "full" }, scan: [1, 2, 3] } },
    charts: { "skill:GoTo": { data: { tries: 2, name: "kitchen" } } },
    blackboard: { "": { level: 30, where: "x" } },
  } as unknown as State;

  it("is every number and truth value, and no text or picture", () => {
    expect(together(candidates(state), [["messages", "battery.getBatteryState.reply", "result", "percentage"], ["robots", "robot", "pose", "0"]]).map(title_of)).toEqual([
      "robots/robot/pose/0",
      "robots/robot/pose/1",
      "robots/robot/pose/2",
      "robots/robot/battery/percentage",
      "robots/robot/battery/charging",
      "charts/skill:GoTo/data/tries",
      "blackboard//level",
      "messages/battery.getBatteryState.reply/result/percentage",
    ]);
  });

  it("is added once, and the newest few are kept", () => {
    let signals: readonly Signal[] = with_signal(with_signal([], ["a", "b"]), ["a", "b"]);
    expect(signals).toEqual([["a", "b"]]);
    for (let i = 0; i < kSignalsMax; i++) signals = with_signal(signals, ["s", String(i)]);
    expect(signals).toHaveLength(kSignalsMax);
    expect(signals.map(title_of)).not.toContain("a/b");
  });

  it("is stored, and dropped where it is damaged", () => {
    expect(parse_signals(JSON.stringify([["a", "b"], 3, [4]]))).toEqual([["a", "b"]]);
    for (const text of [null, "", "{}", "3"]) expect(parse_signals(text)).toEqual([]);
  });
});

it("several signals share the times at which one of them changes", () => {
  const a = [[0, 1], [10, 2]] as const;
  const b = [[5, 7]] as const;
  expect(on_one_axis([a, b])).toEqual([[0, 5, 10], [1, 1, 2], [null, 7, 7]]);
  expect(held_at(a, -1)).toBeNull();
  expect(held_at(a, 9)).toBe(1);
  expect(held_at(a, 10)).toBe(2);
});

describe("signals of very different size", () => {
  const wave = (low: number, most: number) => [[0, low], [1, most], [2, low]] as const;

  it("have an axis each", () => {
    expect(sides_of([wave(0, 14), wave(0, 1)], [])).toEqual(["left", "right"]);
    expect(sides_of([wave(0, 1), wave(0, 14), wave(0, 0.8), wave(2, 12)], [])).toEqual(["left", "right", "left", "right"]);
    expect(sides_of([wave(100, 101), wave(0, 1)], [])).toEqual(["left", "right"]);
  });

  it("and others share one", () => {
    expect(sides_of([wave(0, 4), wave(0, 1)], [])).toEqual(["left", "left"]);
    expect(sides_of([wave(0, 1)], [])).toEqual(["left"]);
    expect(sides_of([], [])).toEqual([]);
    // What does not change, or has no number, needs none.
    expect(sides_of([wave(0, 14), wave(3, 3), []], [])).toEqual(["left", "left", "left"]);
  });

  it("keep their axes while that will do", () => {
    expect(sides_of([wave(0, 6), wave(0, 1)], ["left", "right"])).toEqual(["left", "right"]);
    expect(sides_of([wave(0, 6), wave(0, 1)], [])).toEqual(["left", "left"]);
    expect(sides_of([wave(0, 2), wave(0, 1)], ["left", "right"])).toEqual(["left", "left"]);
    expect(sides_of([wave(0, 14), wave(0, 1), wave(0, 1)], ["left", "right"])).toEqual(["left", "right", "right"]);
  });
});
