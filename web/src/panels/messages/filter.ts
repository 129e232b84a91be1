import type { Filter, Model, Observation } from "../../protocol/types";
import { matches } from "../../shell/match";
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
 * False for a status that is no news: a node that goes idle between ticks, or comes to what it was before that.
 * Conditions under reactive nodes do so with every tick. `last` keeps what each node was.
 */
function is_news(row: Row, last: Map<string, string>): boolean {
  if (row.first.name !== "node.status") return true;
  const { to } = members(row.first.data);
  if (typeof to !== "string") return true;
  if (to === "IDLE" || last.get(row.first.source) === to) return false;
  last.set(row.first.source, to);
  return true;
}

export function filter_rows(rows: readonly Row[], filter: MessageFilter): Row[] {
  const { show, text, service, leaf } = filter;
  const last = new Map<string, string>();
  return rows.filter(
    (row) =>
      shown(show, row) &&
      (show !== "default" || is_news(row, last)) &&
      (service === "" || of_service(row.first, service)) &&
      (leaf === "" || of_leaf(row.first, leaf)) &&
      (text.trim() === "" || matches(text.trim(), text_of(row))),
  );
}

/** What the program can already leave out of its answer; `filter_rows` does the rest. */
export function server_filter(filter: MessageFilter): Filter | undefined {
  const narrow: Filter = {
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
