import { describe, expect, it } from "vitest";
import type { Data, Intervention, State } from "../../protocol/types";
import { code_of, opposite } from "./by_hand";

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
const call = (method: string, args: Record<string, Data> = {}): Intervention => ({ call: `simulation.${method}`, args });
const back = (what: Intervention, id: number | null = null, made = new Map<number, Intervention>()) => opposite(what, id, before, "robot", made);

describe("the opposite of what was done by hand", () => {
  it("puts the world back to how it was", () => {
    expect(back(call("setBatteryCharge", { percent: 10 }))).toEqual({ said: "charge of 10 %", what: call("setBatteryCharge", { percent: 80 }) });
    expect(back(call("setRobotPose", { pose: { x: 9, y: 9, theta: 0 } }))).toMatchObject({ what: call("setRobotPose", { pose: { x: 1, y: 2, theta: 0.5 } }) });
    expect(back(call("addObstacle", { id: "box", centre: { x: 0, y: 0 }, radius: 1 }))).toMatchObject({ what: call("removeObstacle", { id: "box" }) });
    expect(back(call("removeObstacle", { id: "crate" }))).toMatchObject({ what: call("addObstacle", { id: "crate", centre: { x: 3, y: 4 }, radius: 0.25 }) });
    expect(back(call("moveObstacle", { id: "crate", centre: { x: 0, y: 0 } }))).toMatchObject({ what: call("moveObstacle", { id: "crate", centre: { x: 3, y: 4 } }) });
    expect(back(call("setDoor", { id: "kitchen_door", open: false }))).toEqual({ said: "kitchen_door closed", what: call("setDoor", { id: "kitchen_door", open: true }) });
    expect(back(call("plugIn"))).toMatchObject({ what: call("unplug") });
  });
  it("clears what was made to stand, and makes stand what was cleared", () => {
    const forced: Intervention = { force: { leaf: "GoTo", status: "FAILURE" } };
    expect(back(forced, 7)).toEqual({ said: "forced GoTo", what: { clear: 7 } });
    expect(back({ breakpoint: { node: "Root.Go" } }, 3)).toEqual({ said: "breakpoint at Root.Go", what: { clear: 3 } });
    expect(back({ late: "battery.level" }, 4)).toEqual({ said: "late answers of battery.level", what: { clear: 4 } });
    expect(back({ clear: 7 }, null, new Map([[7, forced]]))).toEqual({ said: "force cleared", what: forced });
    expect(back({ kill: "GoTo" })).toEqual({ said: "GoTo killed", what: { restart: "GoTo" } });
  });
  it("is none of a goal that was told, of a wall that was removed, and of what somebody else made to stand", () => {
    expect(back(call("gotoTargetByLocationName", { name: "kitchen" }))).toBeNull();
    expect(back(call("removeObstacle", { id: "wall" }))).toBeNull();
    expect(back({ clear: 7 })).toBeNull();
    expect(opposite(call("setBatteryCharge", { percent: 10 }), null, before, null, new Map())).toBeNull();
  });
});
