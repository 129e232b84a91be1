import { about, kind_of, kInterventions } from "../../protocol/interventions";
import type { Data, Intervention, Pose, State } from "../../protocol/types";

/** What takes something back that was done by hand, and what that was. */
export interface Undo {
  what: Intervention;
  said: string;
}

/** The return code in an answer of a service of the robot; null: it has none. */
export function code_of(result: Data | undefined): string | null {
  if (typeof result === "string" && /^[A-Z][A-Z_]*$/.test(result)) return result;
  if (typeof result === "object" && result !== null && !Array.isArray(result) && typeof result["code"] === "string") {
    const error = result["error_code"];
    return typeof error === "string" && error !== "NONE" ? error : result["code"];
  }
  return null;
}

/**
 * The opposite of what was done: the world of the simulator and what stands are put back to how they were at `before`.
 * Null: there is none, as of a goal that a robot was told. `robot`: whose test control was called; `made`: what came to
 * stand under a number.
 */
export function opposite(what: Intervention, id: number | null, before: Pick<State, "robots" | "obstacles" | "doors">, robot: string | null, made: ReadonlyMap<number, Intervention>): Undo | null {
  if ("call" in what) return robot === null ? null : opposite_call(what, before, robot);
  if ("kill" in what) return { said: `${what.kill} killed`, what: { restart: what.kill } };
  if ("clear" in what) {
    const again = made.get(what.clear);
    return again ? { said: `${kind_of(again)} cleared`, what: again } : null;
  }
  return id === null ? null : { said: `${kInterventions[kind_of(what)].made ?? kind_of(what)} ${about(what)}`, what: { clear: id } };
}

function opposite_call({ call: called, args = {} }: { call: string; args?: Record<string, Data> }, before: Pick<State, "robots" | "obstacles" | "doors">, robot: string): Undo | null {
  const dot = called.lastIndexOf(".");
  const method = called.slice(dot + 1);
  const call = (said: string, name: string, given: Record<string, Data>): Undo => ({ said, what: { call: `${called.slice(0, dot)}.${name}`, args: given } });
  const now = before.robots[robot];
  const id = String(args["id"] ?? "");
  switch (method) {
    case "setBatteryCharge":
      return now?.battery ? call(`charge of ${Number(args["percent"])} %`, method, { percent: now.battery.percentage * 100 }) : null;
    case "plugIn":
      return call(`${robot} plugged in`, "unplug", {});
    case "unplug":
      return call(`${robot} unplugged`, "plugIn", {});
    case "setRobotPose":
      return now ? call(`${robot} put elsewhere`, method, { pose: pose_of(now.pose) }) : null;
    case "addObstacle":
    case "addWall":
      return call(`${id} added`, "removeObstacle", { id });
    case "moveObstacle": {
      const circle = before.obstacles.find(({ name }) => name === id)?.circle;
      return circle ? call(`${id} moved`, method, { id, centre: { x: circle[0], y: circle[1] } }) : null;
    }
    case "removeObstacle": {
      const circle = before.obstacles.find(({ name }) => name === id)?.circle;
      return circle ? call(`${id} removed`, "addObstacle", { id, centre: { x: circle[0], y: circle[1] }, radius: circle[2] }) : null;
    }
    case "setDoor": {
      const door = before.doors.find(({ name }) => name === id);
      return door ? call(`${id} ${args["open"] === true ? "opened" : "closed"}`, method, { id, open: door.open }) : null;
    }
    default:
      return null;
  }
}

const pose_of = ([x, y, theta]: Pose): Record<string, Data> => ({ x, y, theta });
