import type { Data, Intervention, InterventionKind } from "./types";

/** What each kind of intervention does; of those that stand, their sign, and how it is told that they were made. */
export const kInterventions: Readonly<Record<InterventionKind, { does: string; sign?: string; made?: string; members?: readonly string[] }>> = {
  call: { does: "a call to a service, or to the simulator" },
  kill: { does: "a part ends as a killed process does" },
  restart: { does: "what was killed can be used again" },
  delay: { does: "messages are held back", sign: "⏱", made: "delay of", members: ["message", "by", "count"] },
  falsify: { does: "a reply says something else", sign: "≠", made: "falsified", members: ["call", "path", "value", "count"] },
  unreachable: { does: "calls find nobody", sign: "∅", made: "no answers of" },
  late: { does: "answers come too late", sign: "⌛", made: "late answers of" },
  force: { does: "a leaf answers something else", sign: "F", made: "forced", members: ["leaf", "status", "count"] },
  breakpoint: { does: "reaching it is observed", sign: "⬣", made: "breakpoint at", members: ["message", "node", "chart", "state", "status"] },
  stop: { does: "the mission is halted" },
  clear: { does: "what stands ends; the first is 1" },
};
export const kKinds = Object.keys(kInterventions) as InterventionKind[];

export function kind_of(what: Intervention): InterventionKind {
  return kKinds.find((kind) => kind in what) ?? "call";
}

/** What an intervention says of a member; null: nothing that is text. The value of a kind without members is what it is about. */
export function said_of(what: Intervention, member: string): string | null {
  const said: Data = (what as Record<string, Data>)[kind_of(what)] ?? null;
  const value = typeof said === "object" && said !== null && !Array.isArray(said) ? said[member] : null;
  return typeof value === "string" && value !== "" ? value : null;
}

/** What it is about: a part, a call, a message, a leaf. */
export function about(what: Intervention): string {
  const said: Data = (what as Record<string, Data>)[kind_of(what)] ?? null;
  if (typeof said === "string") return said;
  return ["message", "call", "leaf", "node", "chart"].map((member) => said_of(what, member)).find((text) => text !== null) ?? "";
}
