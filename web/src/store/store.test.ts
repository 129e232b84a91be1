import { describe, expect, it } from "vitest";

import type { Observation, State } from "../protocol/types";
import { append, fold } from "./fold";
import { kEmpty, kLiveMessagesMax, make_index, receive, reselected, type RunMessage, type Studio } from "./store";

const state: State = {
  time: 1e9,
  tick: 10,
  sequence: 40,
  live: true,
  end: 1e9,
  begin: 0,
  run: { state: "running", factor: 1, mission: "RUNNING", reason: "", vacuous: {}, stopped_at: null, missed_ticks: 0, processes: [] },
  tree: { status: [1, 0], last: [1, 2], since: [0, 5] },
  blackboard: {},
  charts: {
    "skill:A": { running: true, active: [1], last: null, event: "", data: {}, since: 0 },
    "skill:B": { running: false, active: [], last: null, event: "", data: {}, since: 0 },
  },
  monitors: { battery: { verdict: "undecided", standing: "", deadline: null, states: ["get"], violations: 0 } },
  robots: {},
  obstacles: [],
  doors: [],
};

const observation = (sequence: number): Observation => ({
  sequence,
  time: sequence,
  tick: 1,
  kind: "event",
  name: "mission.tick",
  source: "mission",
  target: "",
  call: 0,
  data: { tick: 1 },
});

const hello = (boot: string): RunMessage => ({
  type: "hello",
  ...{ protocol: 1, version: "0.1.0", mode: "live", title: "t", description: "", clock: "virtual", seed: 1, steerable: true, repeatable: false, design: false, compare: false, coverage: true, boot },
});

const violated = (time: number, sequence: number): RunMessage => ({
  type: "violation",
  ...{ monitor: "battery", time, sequence, story: "", witness: [], witness_complete: true, witness_minimal: true, explanation: null },
});

const play = (studio: Studio, ...messages: RunMessage[]) => messages.reduce(receive, studio);

describe("a delta", () => {
  it("replaces what it names and shares the rest", () => {
    const next = fold(state, { time: 2e9, charts: { "skill:B": { ...state.charts["skill:B"]!, running: true } } });
    expect(next.time).toBe(2e9);
    expect(next.charts["skill:B"]?.running).toBe(true);
    expect(next.charts["skill:A"]).toBe(state.charts["skill:A"]);
    expect(next.tree).toBe(state.tree);
    expect(next.monitors).toBe(state.monitors);
    expect(state.charts["skill:B"]?.running).toBe(false);
  });

  it("removes entries that are null", () => {
    expect(Object.keys(fold(state, { charts: { "skill:A": null } }).charts)).toEqual(["skill:B"]);
  });

  it("keeps its messages out of the state", () => {
    expect(fold(state, { messages: [observation(1)], missed: 2 })).not.toHaveProperty("messages");
  });

  it("before any state is ignored", () => {
    expect(receive(kEmpty, { type: "delta", time: 1 })).toBe(kEmpty);
  });
});

describe("the newest observations", () => {
  it("are appended up to a bound; the oldest go", () => {
    const many = Array.from({ length: kLiveMessagesMax }, (_, i) => observation(i));
    const studio = play(kEmpty, { type: "state", ...state }, { type: "delta", messages: many }, { type: "delta", messages: [observation(99_999)], missed: 3 });
    expect(studio.messages).toHaveLength(kLiveMessagesMax);
    expect(studio.messages[0]?.sequence).toBe(1);
    expect(studio.messages.at(-1)?.sequence).toBe(99_999);
    expect(studio.missed).toBe(3);
  });

  it("start anew when the page comes back from the past", () => {
    const followed = play(kEmpty, { type: "state", ...state }, { type: "delta", messages: [observation(1)] });
    expect(followed.messages).toHaveLength(1);
    expect(play(followed, { type: "state", ...state, live: false }).messages).toHaveLength(0);
  });

  it("keep their identity when nothing comes", () => {
    const list = [1, 2];
    expect(append(list, [], 5)).toBe(list);
  });
});

it("a state from before anything was observed has no charts and no robots", () => {
  const { charts: _, robots: __, monitors: ___, ...bare } = state;
  const studio = receive(kEmpty, { type: "state", ...bare } as RunMessage);
  expect(studio.state).toMatchObject({ charts: {}, robots: {}, monitors: {} });
});

describe("a hello", () => {
  it("of the same run keeps the model, and takes violations anew", () => {
    const violation = violated(5, 9);
    const before = play(kEmpty, hello("a"), { type: "state", ...state }, violation);
    expect(before.violations).toHaveLength(1);
    const again = play(before, hello("a"), violation);
    expect(again.violations).toHaveLength(1);
    expect(again.state).not.toBeNull();
  });

  it("of another run forgets everything", () => {
    const before = play(kEmpty, hello("a"), { type: "state", ...state }, { type: "problem", text: "late", time: 1 });
    const other = play(before, hello("b"));
    expect(other.state).toBeNull();
    expect(other.problems).toHaveLength(0);
    expect(other.hello?.boot).toBe("b");
  });
});

describe("violations", () => {
  it("are sorted by time, each once", () => {
    const studio = play(kEmpty, violated(9, 90), violated(3, 30), violated(9, 90));
    expect(studio.violations.map((violation) => violation.time)).toEqual([3, 9]);
  });
});

describe("what is selected", () => {
  const index_of = (paths: string[], charts: string[]) =>
    make_index({
      tree: { nodes: paths.map((path, id) => ({ id, path, parent: id === 0 ? null : 0, message_name: null })) },
      charts: charts.map((id) => ({ id })),
    } as unknown as Parameters<typeof make_index>[0]);
  const before = index_of(["Root", "Root/A", "Root/B"], ["skill:A", "skill:B"]);

  it("is the same node of a tree that was edited", () => {
    const selection = { node: 2, chart: "skill:B", monitor: "battery", sequence: null };
    expect(reselected(selection, before, index_of(["Root", "Root/B"], ["skill:B"]))).toEqual({ ...selection, node: 1 });
    expect(reselected(selection, before, index_of(["Root", "Root/A"], ["skill:A"]))).toEqual({ ...selection, node: null, chart: null });
  });
});
