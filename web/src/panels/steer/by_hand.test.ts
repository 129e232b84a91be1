import { describe, expect, it } from "vitest";
import type { State } from "../../protocol/types";
import { code_of, opposite, type Step } from "./by_hand";

describe("the return code of an answer", () => {
  it("is the answer, or a member of it; the reason goes before the code", () => {
    expect(code_of("OK")).toBe("OK");
    expect(code_of({ code: "OK", goal_id: 3, error_code: "NONE" })).toBe("OK");
    expect(code_of({ code: "ERROR", error_code: "NO_VALID_PATH" })).toBe("NO_VALID_PATH");
  });
  it("is none where a service answers otherwise", () => {
    expect(code_of("the kitchen")).toBeNull();
    expect(code_of(0.5)).toBeNull();
    expect(code_of({ percentage: 0.1 })).toBeNull();
    expect(code_of(undefined)).toBeNull();
  });
});

const before = {
  robots: { robot: { pose: [1, 2, 0.5], battery: { percentage: 0.8 } } },
  obstacles: [{ name: "crate", circle: [3, 4, 0.25] }, { name: "wall", polygon: [[0, 0], [1, 0], [1, 1]] }],
  doors: [{ name: "kitchen_door", open: true }],
} as unknown as Pick<State, "robots" | "obstacles" | "doors">;
const call = (method: string, args: Step["args"] = {}): Step => ({ op: "call", args: { service: "simulation", method, args } as Step["args"] });
const back = (step: Step, answer: unknown = {}, made = new Map<number, Step>()) => opposite(step, answer, before, "robot", made);

describe("the opposite of what was done by hand", () => {
  it("puts the world back to how it was", () => {
    expect(back(call("setBatteryCharge", { percent: 10 } as never))).toEqual({ said: "charge of 10 %", ...call("setBatteryCharge", { percent: 80 } as never) });
    expect(back(call("setRobotPose", { pose: { x: 9, y: 9, theta: 0 } } as never))).toMatchObject(call("setRobotPose", { pose: { x: 1, y: 2, theta: 0.5 } } as never));
    expect(back(call("addObstacle", { id: "box", centre: { x: 0, y: 0 }, radius: 1 } as never))).toMatchObject(call("removeObstacle", { id: "box" } as never));
    expect(back(call("removeObstacle", { id: "crate" } as never))).toMatchObject(call("addObstacle", { id: "crate", centre: { x: 3, y: 4 }, radius: 0.25 } as never));
    expect(back(call("moveObstacle", { id: "crate", centre: { x: 0, y: 0 } } as never))).toMatchObject(call("moveObstacle", { id: "crate", centre: { x: 3, y: 4 } } as never));
    expect(back(call("setDoor", { id: "kitchen_door", open: false } as never))).toEqual({ said: "kitchen_door closed", ...call("setDoor", { id: "kitchen_door", open: true } as never) });
    expect(back(call("plugIn"))).toMatchObject(call("unplug"));
  });
  it("clears what was made to stand, and makes stand what was cleared", () => {
    const forced: Step = { op: "force", args: { leaf: "GoTo", status: "FAILURE", once: false } };
    expect(back(forced, { id: 7 })).toEqual({ said: "forced GoTo", op: "clear", args: { what: 7 } });
    expect(back({ op: "breakpoint", args: { kind: "node", node: 1 } }, { breakpoint: 3 })).toMatchObject({ op: "clear", args: { what: 3 } });
    expect(back({ op: "clear", args: { what: 7 } }, null, new Map([[7, forced]]))).toMatchObject(forced);
    expect(back({ op: "kill", args: { part: "GoTo" } })).toMatchObject({ op: "restart", args: { part: "GoTo" } });
  });
  it("is none of a goal that was told, of a wall that was removed, and of what somebody else made to stand", () => {
    expect(back(call("gotoTargetByLocationName", { name: "kitchen" } as never))).toBeNull();
    expect(back(call("removeObstacle", { id: "wall" } as never))).toBeNull();
    expect(back({ op: "clear", args: { what: 7 } })).toBeNull();
    expect(opposite(call("setBatteryCharge", { percent: 10 } as never), {}, before, null, new Map())).toBeNull();
  });
});
