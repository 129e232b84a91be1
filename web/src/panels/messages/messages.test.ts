import { describe, expect, it } from "vitest";

import type { Data, Kind, Observation } from "../../protocol/types";
import { short_name, summary } from "./describe";
import { filter_rows, kNoFilter, server_filter, topic } from "./filter";
import { join } from "./join";
import { covers, extend, kEmptyWindow, kWindowMax, prepend } from "./window";

let next = 1;
function seen(name: string, kind: Kind, more: Partial<Observation> = {}, data: Data = {}): Observation {
  const sequence = more.sequence ?? next++;
  return { sequence, time: sequence * 1000, tick: 1, kind, name, source: "AtKitchen", target: "navigation", call: 0, data, ...more };
}

describe("requests and outcomes", () => {
  it("are one row with a duration", () => {
    const rows = join([
      seen("navigation.getPose.request", "request", { sequence: 1, call: 7 }, { args: {} }),
      seen("node.status", "event", { sequence: 2 }),
      seen("navigation.getPose.reply", "reply", { sequence: 5, call: 7 }, { args: {}, result: { x: 1 } }),
    ]);
    expect(rows.map((row) => [row.sequence, row.state, row.duration])).toEqual([
      [1, "done", 4000],
      [2, "event", null],
    ]);
  });

  it("that interleave are joined by their call", () => {
    const rows = join([
      seen("a.m.request", "request", { sequence: 1, call: 1 }),
      seen("a.m.request", "request", { sequence: 2, call: 2 }),
      seen("a.m.error", "error", { sequence: 3, call: 2 }),
      seen("a.m.reply", "reply", { sequence: 4, call: 1 }),
    ]);
    expect(rows.map((row) => [row.state, row.outcome?.sequence])).toEqual([
      ["done", 4],
      ["error", 3],
    ]);
  });

  it("without their other half stand alone", () => {
    const rows = join([seen("a.m.reply", "reply", { sequence: 1, call: 1 }), seen("a.n.request", "request", { sequence: 2, call: 3 })]);
    expect(rows.map((row) => [row.state, row.duration])).toEqual([
      ["done", null],
      ["open", null],
    ]);
  });

  it("too late are told from answers", () => {
    const rows = join([seen("a.m.request", "request", { call: 4 }), seen("a.m.late", "event", { call: 4 })]);
    expect(rows[0]?.state).toBe("late");
  });
});

describe("one line of values", () => {
  it("has arguments, results, kinds of errors, changes of status", () => {
    expect(summary(seen("n.go.request", "request", {}, { args: { destination: "kitchen" } }))).toBe("{destination: kitchen}");
    expect(summary(seen("n.go.request", "request", {}, { args: {} }))).toBe("");
    expect(summary(seen("n.get.reply", "reply", {}, { args: {}, result: 3 }))).toBe("3");
    expect(summary(seen("n.go.reply", "reply", {}, { args: {} }))).toBe("done");
    expect(summary(seen("n.go.error", "error", {}, { args: {}, kind: "vetoed", message: "by shield" }))).toBe("vetoed: by shield");
    expect(summary(seen("node.status", "event", {}, { node: "A", from: "IDLE", to: "RUNNING" }))).toBe("IDLE → RUNNING");
    expect(summary(seen("AtKitchen.tick.reply", "reply", {}, { status: "FAILURE", outputs: {} }))).toBe("FAILURE");
    expect(short_name(seen("n.go.request", "request"))).toBe("n.go");
  });
});

describe("the filter", () => {
  const rows = join([
    seen("mission.tick", "event", { source: "mission", target: "" }),
    seen("AtKitchen.tick.request", "request", { call: 1, source: "mission", target: "AtKitchen" }),
    seen("battery.getBatteryState.request", "request", { call: 2, source: "Level", target: "battery" }),
    seen("battery.getBatteryState.reply", "reply", { call: 2, source: "Level", target: "battery" }, { result: { percentage: 0.1 } }),
    seen("node.status", "event", { source: "Main.Go" }, { node: "Main.Go", from: "IDLE", to: "RUNNING" }),
    seen("monitor.violated", "event", { source: "never_empty" }),
    seen("navigation.go.error", "error", { call: 9 }, { kind: "late" }),
  ]);
  const names = (change: Partial<typeof kNoFilter>) => filter_rows(rows, { ...kNoFilter, ...change }).map((row) => row.first.name);

  it("leaves ticks out at first", () => {
    expect(names({})).toEqual(["battery.getBatteryState.request", "node.status", "monitor.violated", "navigation.go.error"]);
    expect(names({ show: "all" })).toHaveLength(6);
  });

  it("leaves out what a node is only within a tick", () => {
    const status = (tick: number, from: string, to: string) => seen("node.status", "event", { source: "Root", tick }, { node: 0, from, to });
    const rows_of_ticks = join([status(1, "IDLE", "RUNNING"), status(1, "RUNNING", "SUCCESS"), status(2, "SUCCESS", "IDLE"), status(2, "IDLE", "RUNNING"), status(2, "RUNNING", "SUCCESS"), status(3, "SUCCESS", "RUNNING")]);
    expect(filter_rows(rows_of_ticks, kNoFilter).map((row) => summary(row.first))).toEqual(["RUNNING → SUCCESS", "SUCCESS → RUNNING"]);
  });

  it("leaves out statuses that come back with every tick", () => {
    const status = (from: string, to: string) => seen("node.status", "event", { source: "AtKitchen" }, { node: 7, from, to });
    const flapping = join([status("IDLE", "FAILURE"), status("FAILURE", "IDLE"), status("IDLE", "FAILURE"), status("FAILURE", "IDLE"), status("IDLE", "SUCCESS")]);
    expect(filter_rows(flapping, kNoFilter).map((row) => summary(row.first))).toEqual(["IDLE → FAILURE", "IDLE → SUCCESS"]);
    expect(filter_rows(flapping, { ...kNoFilter, show: "statuses" })).toHaveLength(5);
  });

  it("shows one kind", () => {
    expect(names({ show: "ticks" })).toEqual(["mission.tick", "AtKitchen.tick.request"]);
    expect(names({ show: "calls" })).toEqual(["battery.getBatteryState.request", "navigation.go.error"]);
    expect(names({ show: "statuses" })).toEqual(["node.status"]);
    expect(names({ show: "events" })).toEqual(["monitor.violated"]);
    expect(names({ show: "errors" })).toEqual(["navigation.go.error"]);
  });

  it("finds by service, leaf and text, in outcomes too", () => {
    expect(names({ service: "battery" })).toEqual(["battery.getBatteryState.request"]);
    expect(names({ leaf: "Level" })).toEqual(["battery.getBatteryState.request"]);
    expect(names({ text: "PERCENTAGE 0.1" })).toEqual(["battery.getBatteryState.request"]);
    expect(names({ text: "nothing like it" })).toEqual([]);
  });

  it("tells the program what it can leave out", () => {
    expect(server_filter(kNoFilter)).toBeUndefined();
    expect(server_filter({ show: "errors", text: "", service: "battery", leaf: "" })).toEqual({ service: "battery", kind: "error" });
    expect(server_filter({ ...kNoFilter, text: " set Battery " })).toEqual({ text: "Battery" });
  });

  it("knows what each observation is about", () => {
    expect(topic(seen("GoToKitchen.halt.request", "request"))).toBe("tick");
    expect(topic(seen("scenario.injection", "event"))).toBe("event");
  });
});

describe("the window on the stream", () => {
  const page = (from: number, count: number) => Array.from({ length: count }, (_, i) => seen("mission.tick", "event", { sequence: from + i }));

  it("grows at both ends without doubles", () => {
    const middle = { observations: page(10, 5), older: true, newer: true };
    const grown = extend(prepend(middle, page(6, 6), false), page(13, 4), true);
    expect(grown.observations.map((observation) => observation.sequence)).toEqual([6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16]);
    expect(grown.older).toBe(false);
    expect(grown.newer).toBe(true);
  });

  it("covers what is inside, and what is beyond an end without more", () => {
    const window = { observations: page(10, 5), older: true, newer: false };
    expect(covers(window, 12)).toBe(true);
    expect(covers(window, 99)).toBe(true);
    expect(covers(window, 3)).toBe(false);
    expect(covers(kEmptyWindow, 3)).toBe(false);
  });

  it("is bounded, and remembers that there is more", () => {
    const window = { observations: page(1, kWindowMax), older: false, newer: false };
    const grown = extend(window, page(kWindowMax + 1, 10), false);
    expect(grown.observations).toHaveLength(kWindowMax);
    expect(grown.observations[0]?.sequence).toBe(11);
    expect(grown.older).toBe(true);
    const other = prepend({ ...window, observations: page(100, kWindowMax) }, page(90, 10), false);
    expect(other.observations).toHaveLength(kWindowMax);
    expect(other.newer).toBe(true);
  });
});
