import type { Observation, Time } from "../../protocol/types";

/** One line of the list: an event, or a request with its outcome. */
export interface Row {
  /** Of the first observation; orders the rows. */
  sequence: number;
  first: Observation;
  outcome: Observation | null;
  /** From request to outcome. */
  duration: Time | null;
  /** "open": a request whose outcome has not been seen. */
  state: "event" | "open" | "done" | "error" | "late";
}

const kOutcome = /\.(request|reply|error|late)$/;

/** What is called, whichever way the observation goes: `battery.getBatteryState`, `GoToKitchen.tick`. */
export function subject(observation: Pick<Observation, "name">): string {
  return observation.name.replace(kOutcome, "");
}

function outcome_state(observation: Observation): Row["state"] {
  if (observation.name.endsWith(".late")) return "late";
  return observation.kind === "error" ? "error" : observation.kind === "reply" ? "done" : "event";
}

/** Joins each request with its outcome; outcomes whose request is not in the list stand alone. */
export function join(observations: readonly Observation[]): Row[] {
  const rows: Row[] = [];
  const open = new Map<string, Row>();
  for (const observation of observations) {
    const { sequence, call } = observation;
    const key = !call ? null : `${call} ${subject(observation)}`;
    const row = key === null ? undefined : open.get(key);
    if (observation.kind === "request") {
      const asked: Row = { sequence, first: observation, outcome: null, duration: null, state: "open" };
      rows.push(asked);
      if (key !== null) open.set(key, asked);
    } else if (row && key !== null) {
      row.outcome = observation;
      row.duration = observation.time - row.first.time;
      row.state = outcome_state(observation);
      open.delete(key);
    } else {
      rows.push({ sequence, first: observation, outcome: null, duration: null, state: outcome_state(observation) });
    }
  }
  return rows;
}
