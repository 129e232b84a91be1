import { kSecond_ns } from "../draw/format";
import type { Time } from "../protocol/types";

/** What a page looks at, as its address says it behind the `#`. */
export interface Place {
  /** The moment; null: the present. */
  at: Time | null;
  /** By its path in the tree. */
  node: string | null;
  chart: string | null;
  monitor: string | null;
  message: number | null;
  /** Of a project that is edited. */
  view: "run" | null;
  file: string | null;
}

/** In the order in which they stand. */
const kKeys = ["at", "node", "chart", "monitor", "message", "view", "file"] as const;

/** What cannot be understood is not there. */
export function read_place(hash: string): Place {
  const said = new URLSearchParams(hash.replace(/^#/, ""));
  const number = (name: string) => {
    const value = said.get(name);
    return value !== null && /^\d+(\.\d+)?$/.test(value) ? Number(value) : null;
  };
  const at = number("at");
  return {
    at: at === null ? null : Math.round(at * kSecond_ns),
    node: said.get("node"),
    chart: said.get("chart"),
    monitor: said.get("monitor"),
    message: number("message"),
    view: said.get("view") === "run" ? "run" : null,
    file: said.get("file"),
  };
}

/** The address with this place; what else stands in it, as the token does, stays. Empty: nothing is to be said. */
export function write_place(hash: string, place: Place): string {
  const said = new URLSearchParams(hash.replace(/^#/, ""));
  for (const key of kKeys) said.delete(key);
  for (const key of kKeys) {
    const value = place[key];
    if (value === null) continue;
    said.set(key, key === "at" ? String(Number((Number(value) / kSecond_ns).toFixed(9))) : String(value));
  }
  // People read these, and none of them ends the address.
  const text = said.toString().replace(/%2F/g, "/").replace(/%3A/g, ":");
  return text === "" ? "" : `#${text}`;
}
