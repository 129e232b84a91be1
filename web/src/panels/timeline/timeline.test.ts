import { describe, expect, it } from "vitest";

import type { Lane, Mark } from "../../protocol/types";
import { at_work, is_idle, kLowRows, kRows, known_until, label_place, lane_at, lane_title, mark_at, merge_close, place, span_at, value_at, value_range, value_text } from "./lanes";
import { around, clamp, covers, fit, keep_in_view, newest, span_of, ticks, time_at, x_of, zoom } from "./view";

const second = 1e9;
const lane = (kind: Lane["kind"], name: string, spans: Lane["spans"]): Lane => ({ id: `${kind}:${name}`, kind, name, ...(spans ? { spans } : {}) });
const battery: Lane = { id: "battery:r", kind: "value", name: "battery of r [%]", points: [[0, 100], [5 * second, 40.25]] };

describe("the view", () => {
  it("maps time to pixels and back", () => {
    const view = { from: 10 * second, to: 20 * second };
    expect(x_of(view, 15 * second, 800)).toBe(400);
    expect(time_at(view, 400, 800)).toBe(15 * second);
  });

  it("keeps the point under the pointer where it is while zooming", () => {
    const view = zoom({ from: 0, to: 100 * second }, 0.5, 20 * second);
    expect(x_of(view, 20 * second, 1000)).toBeCloseTo(200);
    expect(span_of(view)).toBe(50 * second);
  });

  it("stays within what is known", () => {
    const wide = clamp({ from: -1000 * second, to: 1000 * second }, 0, 100 * second);
    expect(span_of(wide)).toBeLessThan(110 * second);
    expect(wide.from).toBeLessThanOrEqual(0);
    const far = clamp({ from: 500 * second, to: 510 * second }, 0, 100 * second);
    expect(far.to).toBeGreaterThanOrEqual(100 * second);
    expect(far.from).toBeLessThan(100 * second);
    expect(span_of(far)).toBeCloseTo(10 * second);
  });

  it("of everything has begin and end inside, even before anything has happened", () => {
    const view = fit(0, 60 * second);
    expect(view.from).toBeLessThan(0);
    expect(view.to).toBeGreaterThan(60 * second);
    expect(span_of(fit(0, 0))).toBeGreaterThan(0);
  });

  it("of the newest ends a little after the end", () => {
    const view = newest(100 * second, 0, 300 * second);
    expect(span_of(view)).toBe(100 * second);
    expect(view.to).toBeGreaterThan(300 * second);
    expect(newest(100 * second, 0, 10 * second).from).toBe(0);
  });

  it("is asked for once, also where it begins before the run or ends after it", () => {
    const [begin, end] = [0, 60 * second];
    for (const view of [fit(begin, end), newest(30 * second, begin, end), clamp({ from: -9 * second, to: 90 * second }, begin, end), { from: 10 * second, to: 12 * second }]) {
      const asked = around(view, begin);
      expect(covers(asked, view, begin, end)).toBe(true);
      expect(covers(asked, zoom(view, 0.1, 11 * second), begin, end)).toBe(false);
    }
    expect(covers(around({ from: 0, to: 10 * second }, begin), { from: 30 * second, to: 40 * second }, begin, end)).toBe(false);
  });

  it("moves only when the moment leaves it", () => {
    const view = { from: 0, to: 100 * second };
    expect(keep_in_view(view, 50 * second)).toBe(view);
    const moved = keep_in_view(view, 150 * second);
    expect(moved.from).toBeLessThan(150 * second);
    expect(moved.to).toBeGreaterThan(150 * second);
    expect(keep_in_view({ from: 50 * second, to: 60 * second }, 0).from).toBeLessThan(0);
  });

  it("has round ticks that do not collide", () => {
    const found = ticks({ from: 0, to: 60 * second }, 900);
    expect(found.map((tick) => tick.text)).toEqual(["0:00", "0:10", "0:20", "0:30", "0:40", "0:50", "1:00"]);
    expect(ticks({ from: 0, to: 0.01 * second }, 900)[1]?.text).toBe("0:00.001");
    expect(ticks({ from: 0, to: 100 * 3600 * second }, 900).length).toBeLessThan(14);
  });
});

describe("lanes", () => {
  const lanes = [
    battery,
    lane("monitor", "m", [[0, second, "undecided"]]),
    lane("leaf", "A", [[0, second, "RUNNING"]]),
    lane("leaf", "B", []),
    lane("mission", "mission", [[0, second, "RUNNING"]]),
  ];

  it("are ordered by kind, with room between kinds", () => {
    const { placed, height } = place(lanes, false);
    expect(placed.map((entry) => entry.lane.name)).toEqual(["mission", "m", "A", "B", "battery of r [%]"]);
    const [, first, second_lane, third] = placed;
    expect(second_lane!.top - (first!.top + kRows.state)).toBeGreaterThan(third!.top - (second_lane!.top + kRows.state));
    expect(placed.at(-1)!.height).toBe(kRows.value);
    expect(height).toBeGreaterThanOrEqual(placed.at(-1)!.top + kRows.value);
    expect(place(lanes, false, kLowRows).height).toBeLessThan(0.75 * height);
  });

  it("of monitors that are violated come first among them", () => {
    const names = (violated: string[]) => place([lane("monitor", "m", []), lane("monitor", "n", []), lanes[4]!], false, kRows, new Set(violated)).placed.map((entry) => entry.lane.name);
    expect(names([])).toEqual(["mission", "m", "n"]);
    expect(names(["n"])).toEqual(["mission", "n", "m"]);
  });

  it("in which nothing happens can be left out", () => {
    expect(place(lanes, true).placed.map((entry) => entry.lane.name)).not.toContain("B");
    expect(is_idle(lane("skill", "s", [[0, 5, ""]]))).toBe(true);
    expect(is_idle(lane("mission", "mission", []))).toBe(false);
  });

  it("are found by place and time", () => {
    const { placed } = place(lanes, false);
    expect(lane_at(placed, placed[2]!.top + 3)?.lane.name).toBe("A");
    expect(lane_at(placed, -5)).toBeUndefined();
    const spans = lane("leaf", "A", [[0, 10, "RUNNING"], [10, 20, "SUCCESS"]]);
    expect(span_at(spans, 10)?.[2]).toBe("SUCCESS");
    expect(span_at(spans, 20)).toBeUndefined();
    expect(known_until([spans, lane("leaf", "B", [[0, 30, "RUNNING"]])])).toBe(30);
  });

  it("of all that is at work show who began last, below the mission", () => {
    const busy = [lane("leaf", "A", [[0, 10, "RUNNING"], [10, 11, "SUCCESS"], [30, 60, "RUNNING"]]), lane("leaf", "B", [[5, 8, "RUNNING"], [40, 80, "RUNNING"]]), lane("leaf", "C", [[0, 99, "SUCCESS"]])];
    const work = at_work(busy)!;
    expect(work.spans).toEqual([[0, 5, "A"], [5, 8, "B"], [8, 10, "A"], [30, 40, "A"], [40, 80, "B"]]);
    expect(place([work, ...lanes], false).placed[1]!.lane).toBe(work);
    expect(at_work(lanes)?.spans).toEqual([[0, second, "A"]]);
    expect(at_work([battery])).toBeNull();
  });

  it("that flap with every tick are whole from far away", () => {
    const flapping = lane("leaf", "A", [[0, 1, "SUCCESS"], [10, 11, "SUCCESS"], [20, 21, "FAILURE"], [30, 31, "FAILURE"], [90, 91, "FAILURE"]]);
    expect(merge_close(flapping, 15).spans).toEqual([[0, 11, "SUCCESS"], [20, 31, "FAILURE"], [90, 91, "FAILURE"]]);
    expect(merge_close(flapping, 2).spans).toEqual(flapping.spans);
  });

  it("keep their labels in view", () => {
    expect(label_place(100, 300, 800, 50)).toBe(105);
    // Begins left of what is shown.
    expect(label_place(-500, 300, 800, 50)).toBe(5);
    expect(label_place(-500, 40, 800, 50)).toBeNull();
    expect(label_place(780, 1200, 800, 50)).toBeNull();
  });
});

describe("values", () => {
  it("hold until the next one", () => {
    expect(value_at(battery, 4.9 * second)).toBe(100);
    expect(value_at(battery, 5 * second)).toBe(40.25);
    expect(value_at({ ...battery, points: [] }, 1)).toBeUndefined();
  });

  it("have a range and a unit", () => {
    expect(value_range(battery)).toEqual([0, 100]);
    expect(value_text(battery, 40.25)).toBe("40.3 %");
    expect(lane_title(battery)).toBe("battery of r");
    expect(value_range({ ...battery, name: "speed", points: [[0, 2], [1, 2]] })).toEqual([1, 3]);
    expect(value_range({ ...battery, name: "speed", points: [] })).toEqual([0, 1]);
  });
});

it("the mark nearest to the pointer is meant", () => {
  const mark = (time: number): Mark => ({ time, kind: "violation", text: "", sequence: time });
  const view = { from: 0, to: 1000 };
  const marks = [mark(100), mark(106), mark(500)];
  expect(mark_at(marks, view, 105, 1000)?.time).toBe(106);
  expect(mark_at(marks, view, 300, 1000)).toBeUndefined();
});
