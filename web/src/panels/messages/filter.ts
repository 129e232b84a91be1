import type { Filter, Model, Observation } from "../../protocol/types";
import { matches } from "../../widgets/match";
import { members, summary } from "./describe";
import type { Row } from "./join";

/** What a line is about. */
export type Topic = "call" | "tick" | "status" | "event";
/** What the list shows; "default" leaves out ticks, and statuses that come back with every tick: most of the stream. */
export const kShows = ["default", "all", "calls", "ticks", "statuses", "events", "errors"] as const;
export type Show = (typeof kShows)[number];

export interface MessageFilter {
  show: Show;
  text: string;
  service: string;
  leaf: string;
}
export const kNoFilter: MessageFilter = { show: "default", text: "", service: "", leaf: "" };

export function topic(observation: Observation): Topic {
  const { name } = observation;
  if (name === "mission.tick" || /\.(tick|halt)\.(request|reply|error|late)$/.test(name)) return "tick";
  if (name === "node.status" || name === "mission.status") return "status";
  return observation.kind === "event" && !name.endsWith(".late") ? "event" : "call";
}

function shown(show: Show, row: Row): boolean {
  if (show === "all") return true;
  if (show === "errors") return row.state === "error" || row.state === "late";
  const about = topic(row.first);
  switch (show) {
    case "default":
      // A tick that went wrong is worth a line.
      return about !== "tick" || row.state === "error" || row.state === "late";
    case "calls":
      return about === "call";
    case "ticks":
      return about === "tick";
    case "statuses":
      return about === "status";
    case "events":
      return about === "event";
  }
}

const starts = (name: string, head: string) => name === head || name.startsWith(`${head}.`);

/** True if the observation is a leaf's own, or of a call that the leaf makes. */
export function of_leaf(observation: Observation, leaf: string): boolean {
  return observation.source === leaf || observation.target === leaf || starts(observation.name, leaf);
}

export function of_service(observation: Observation, service: string): boolean {
  return observation.target === service || observation.source === service || starts(observation.name, service);
}

function text_of(row: Row): string {
  const second = row.outcome ? `${row.outcome.name} ${summary(row.outcome)}` : "";
  return `${row.first.name} ${row.first.source} ${row.first.target} ${summary(row.first)} ${second}`;
}

/**
 * Statuses that are no news: a node that goes idle between ticks, one that is RUNNING only until it is something else in
 * the same tick, and one that comes to what it was in the tick before. Reactive nodes do all that with every tick.
 */
function old_news(rows: readonly Row[]): Set<Row> {
  const old = new Set<Row>();
  const next_tick = new Map<string, number>();
  for (const row of rows.toReversed()) {
    const { name, source, tick } = row.first;
    if (name !== "node.status") continue;
    if (members(row.first.data)["to"] === "RUNNING" && next_tick.get(source) === tick) old.add(row);
    next_tick.set(source, tick);
  }
  const last = new Map<string, unknown>();
  for (const row of rows) {
    const { name, source, data } = row.first;
    if (name !== "node.status" || old.has(row)) continue;
    const { to } = members(data);
    if (to === "IDLE" || last.get(source) === to) old.add(row);
    else last.set(source, to);
  }
  return old;
}

export function filter_rows(rows: readonly Row[], filter: MessageFilter): Row[] {
  const { show, text, service, leaf } = filter;
  const old = show === "default" ? old_news(rows) : null;
  return rows.filter(
    (row) =>
      shown(show, row) &&
      !old?.has(row) &&
      (service === "" || of_service(row.first, service)) &&
      (leaf === "" || of_leaf(row.first, leaf)) &&
      (text.trim() === "" || matches(text.trim(), text_of(row))),
  );
}

/** What the program can already leave out of its answer; `filter_rows` does the rest. */
export function server_filter(filter: MessageFilter): Filter | undefined {
  // The program looks for one piece of text; of several words the longest is the rarest.
  const word = filter.text.split(/\s+/).reduce((longest, each) => (each.length > longest.length ? each : longest), "");
  const narrow: Filter = {
    ...(word ? { text: word } : {}),
    ...(filter.service ? { service: filter.service } : {}),
    ...(filter.leaf ? { leaf: filter.leaf } : {}),
    ...(filter.show === "errors" ? { kind: "error" } : {}),
  };
  return Object.keys(narrow).length > 0 ? narrow : undefined;
}

/** Names to choose from. */
export function choices(model: Model): { services: string[]; leaves: string[] } {
  return {
    services: model.services.map((service) => service.name),
    leaves: model.tree.nodes.flatMap((node) => node.message_name ?? []),
  };
}
