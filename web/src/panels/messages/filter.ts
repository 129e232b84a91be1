import type { Filter, Model, Observation } from "../../protocol/types";
import { matches } from "../../shell/match";
import { summary } from "./describe";
import type { Row } from "./join";

/** What a line is about. */
export type Topic = "call" | "tick" | "status" | "event";
/** What the list shows; "default" leaves out ticks, which are most of the stream. */
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
  if (observation.source === leaf || observation.target === leaf || starts(observation.name, leaf)) return true;
  const data = observation.data;
  return observation.name === "node.status" && typeof data === "object" && data !== null && !Array.isArray(data) && data["node"] === leaf;
}

export function of_service(observation: Observation, service: string): boolean {
  return observation.target === service || observation.source === service || starts(observation.name, service);
}

function text_of(row: Row): string {
  const second = row.outcome ? `${row.outcome.name} ${summary(row.outcome)}` : "";
  return `${row.first.name} ${row.first.source} ${row.first.target} ${summary(row.first)} ${second}`;
}

export function filter_rows(rows: readonly Row[], filter: MessageFilter): Row[] {
  const { show, text, service, leaf } = filter;
  return rows.filter(
    (row) =>
      shown(show, row) &&
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
