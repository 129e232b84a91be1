import { describe, expect, it } from "vitest";
import { kStatuses, type Rect, type TreeNode } from "../../protocol/types";
import { last_shown, last_word } from "../../protocol/statuses";
import { ancestors, descendants, neighbour, reason_at, running, scope_of, search, shown, uncover, visible_for } from "./tree";
import { answers_of } from "./Transitions";

function node(id: number, parent: number | null, name: string, ports: TreeNode["ports"] = []): TreeNode {
  return { id, parent, path: `Main.${name}`, name, type: id === 0 ? "ReactiveSequence" : "GoTo", kind: "action", symbol: "", leaf: null, message_name: null, ports };
}

// 0 ─ 1 ─ 3, 4
//   └ 2 ─ 5
const kNodes = [
  node(0, null, "Root"),
  node(1, 0, "Energy"),
  node(2, 0, "Visit"),
  node(3, 1, "Above30", [{ name: "threshold", direction: "input", type: "", value: "30" }]),
  node(4, 1, "Charge"),
  node(5, 2, "Kitchen", [{ name: "destination", direction: "input", type: "", value: "kitchen" }]),
];
const kChildren = [[1, 2], [3, 4], [5], [], [], []];

describe("folding", () => {
  it("hides everything below a collapsed node", () => {
    expect(shown(kNodes, new Set())).toEqual([0, 1, 2, 3, 4, 5]);
    expect(shown(kNodes, new Set([1]))).toEqual([0, 1, 2, 5]);
    expect(shown(kNodes, new Set([0, 1]))).toEqual([0]);
    expect(descendants(kChildren, 0)).toBe(5);
    expect(descendants(kChildren, 5)).toBe(0);
  });

  it("uncovers what is looked for and leaves the rest folded", () => {
    expect([...uncover(kNodes, new Set([1, 2]), [5])]).toEqual([1]);
    expect(ancestors(kNodes, 5)).toEqual([2, 0]);
  });

  it("stands for a hidden node with what hides it", () => {
    expect(visible_for(kNodes, new Set([1]), 3)).toBe(1);
    expect(visible_for(kNodes, new Set([0, 1]), 3)).toBe(0);
    expect(visible_for(kNodes, new Set([2]), 3)).toBe(3);
  });
});

describe("search", () => {
  it("matches every word in names, types, paths and ports, in any case", () => {
    expect(search(kNodes, "KITCHEN")).toEqual([5]);
    expect(search(kNodes, "goto 30")).toEqual([3]);
    expect(search(kNodes, "threshold=3")).toEqual([3]);
    expect(search(kNodes, "reactive")).toEqual([0]);
    expect(search(kNodes, "  ")).toEqual([]);
    expect(search(kNodes, "nothing")).toEqual([]);
  });
});

describe("the list of running nodes", () => {
  it("names what is at work, not what waits for it", () => {
    expect(running(kChildren, [1, 1, 1, 2, 1, 5])).toEqual([4, 5]);
    expect(running(kChildren, [0, 0, 0, 0, 0, 0])).toEqual([]);
    expect(running(kChildren, [1, 0, 0, 0, 0, 0])).toEqual([0]);
  });
});

describe("arrow keys", () => {
  const box = (x: number, y: number): Rect => ({ x, y, width: 40, height: 30 });
  const parent_of = (id: number) => kNodes[id]!.parent ?? -1;
  const down = new Map([[0, box(100, 0)], [1, box(40, 60)], [2, box(160, 60)], [3, box(0, 120)], [4, box(80, 120)], [5, box(160, 120)]]);
  const right = new Map([...down].map(([id, r]) => [id, { x: r.y, y: r.x, width: 30, height: 40 }] as const));

  it("follow edges and siblings in a tree drawn downwards", () => {
    expect(neighbour(down, parent_of, 1, "ArrowUp")).toBe(0);
    expect(neighbour(down, parent_of, 1, "ArrowRight")).toBe(2);
    expect(neighbour(down, parent_of, 2, "ArrowLeft")).toBe(1);
    expect(neighbour(down, parent_of, 2, "ArrowDown")).toBe(5);
    expect([3, 4]).toContain(neighbour(down, parent_of, 1, "ArrowDown"));
  });

  it("go on to the next family beyond the last sibling, and stop at the tree's border", () => {
    expect(neighbour(down, parent_of, 4, "ArrowRight")).toBe(5);
    expect(neighbour(down, parent_of, 5, "ArrowRight")).toBeNull();
    expect(neighbour(down, parent_of, 3, "ArrowDown")).toBeNull();
    expect(neighbour(down, parent_of, 99, "ArrowDown")).toBeNull();
  });

  it("work alike in a tree drawn to the right", () => {
    expect(neighbour(right, parent_of, 1, "ArrowLeft")).toBe(0);
    expect(neighbour(right, parent_of, 1, "ArrowDown")).toBe(2);
    expect(neighbour(right, parent_of, 2, "ArrowRight")).toBe(5);
    expect(neighbour(right, parent_of, 4, "ArrowDown")).toBe(5);
  });
});

describe("the blackboard that a node sees", () => {
  const subtree = (id: number, parent: number, path: string): TreeNode => ({ ...node(id, parent, path), path, kind: "subtree" });
  // 0 ─ Go ─ Energy ─ 3
  //   └ Go ─ 5
  const nodes = [node(0, null, "Root"), subtree(1, 0, "Go"), subtree(2, 1, "Go.Energy"), node(3, 2, "Leaf"), subtree(4, 0, "Go"), node(5, 4, "Leaf")];

  it("is that of the innermost SubTree around it", () => {
    expect(scope_of(nodes, 3, ["", "Go", "Go.Energy"])).toBe("Go.Energy");
    expect(scope_of(nodes, 3, ["", "Go"])).toBe("Go");
    expect(scope_of(nodes, 1, ["", "Go"])).toBe("");
    expect(scope_of(nodes, 5, ["", "Other"])).toBe("");
  });

  it("is found by the number of a SubTree that others are called like", () => {
    const scopes = ["", "Go::2", "Go::2.Energy", "Go::5"];
    expect(scope_of(nodes, 3, scopes)).toBe("Go::2.Energy");
    expect(scope_of(nodes, 2, scopes)).toBe("Go::2");
    expect(scope_of(nodes, 5, scopes)).toBe("Go::5");
    expect(scope_of(nodes, 5, ["", "Go::15"])).toBe("");
  });
});

it("a condition's answers are told where they change", () => {
  expect(answers_of([[0, "SUCCESS"], [0, "IDLE"], [1, "SUCCESS"], [1, "IDLE"], [2, "FAILURE"], [2, "IDLE"]])).toEqual([[0, "SUCCESS"], [2, "FAILURE"]]);
  expect(answers_of([[0, "IDLE"]])).toEqual([]);
});

describe("what is said of a moment", () => {
  it("has no reason of what is still to come", () => {
    const run = { state: "ended", factor: 1, mission: "RUNNING", reason: "Pick: error", vacuous: {}, stopped_at: null, missed_ticks: 0, processes: [] } as const;
    const at = (time: number, mission: string, live = false) => reason_at({ time, end: 10, live, run: { ...run, mission, vacuous: {}, processes: [] } });
    expect(at(4, "RUNNING")).toBe("");
    expect(at(10, "RUNNING")).toBe("Pick: error");
    expect(at(9, "FAILURE")).toBe("Pick: error");
    expect(at(4, "RUNNING", true)).toBe("Pick: error");
  });

  it("does not take who was halted for running", () => {
    const of = (word: string) => kStatuses.findIndex((status) => status === word);
    expect([last_shown(of("RUNNING")), last_word(of("RUNNING"))]).toEqual([of("HALTING"), "halted"]);
    expect([last_shown(of("FAILURE")), last_word(of("FAILURE"))]).toEqual([of("FAILURE"), "failure"]);
  });
});
