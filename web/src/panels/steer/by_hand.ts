import type { Data, Operation, Operations, Pose, State } from "../../protocol/types";

/** An operation with its arguments. */
export interface Step {
  op: Operation;
  args: Operations[Operation][0];
}

/** What takes something back that was done by hand, and what that was. */
export interface Undo extends Step {
  said: string;
}

type Arguments = Readonly<Record<string, unknown>>;

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
 * Null: there is none, as of a goal that a robot was told. `robot`: whose test control was called; `made`: by which step
 * something that is cleared came to stand.
 */
export function opposite(step: Step, answer: unknown, before: Pick<State, "robots" | "obstacles" | "doors">, robot: string | null, made: ReadonlyMap<number, Step>): Undo | null {
  const args: Arguments = step.args;
  switch (step.op) {
    case "call":
      return robot === null ? null : opposite_call(args as Operations["call"][0], before, robot);
    case "kill":
      return { said: `${String(args["part"])} killed`, op: "restart", args: { part: String(args["part"]) } };
    case "breakpoint":
    case "delay":
    case "falsify":
    case "force":
    case "late":
    case "unreachable": {
      const id = id_of(answer);
      return id === null ? null : { said: step.op === "breakpoint" ? "breakpoint set" : `${kSaid[step.op]} ${String(args["message"] ?? args["call"] ?? args["leaf"])}`, op: "clear", args: { what: id } };
    }
    case "clear": {
      const again = made.get(Number(args["what"]));
      return again ? { said: `${again.op} cleared`, ...again } : null;
    }
    default:
      return null;
  }
}

const kSaid = { delay: "delay of", falsify: "falsified", force: "forced", late: "late answers of", unreachable: "no answers of" } as const;

/** What an operation made to stand. */
export function id_of(answer: unknown): number | null {
  if (typeof answer !== "object" || answer === null) return null;
  const { id, breakpoint } = answer as { id?: unknown; breakpoint?: unknown };
  return typeof id === "number" ? id : typeof breakpoint === "number" ? breakpoint : null;
}

function opposite_call({ service, method, args }: Operations["call"][0], before: Pick<State, "robots" | "obstacles" | "doors">, robot: string): Undo | null {
  const call = (said: string, name: string, given: Record<string, Data>): Undo => ({ said, op: "call", args: { service, method: name, args: given } });
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
