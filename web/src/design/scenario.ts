import { create } from "zustand";

import { arguments_draft, read_arguments, reply_fields } from "../panels/steer/idl";
import { kKinds } from "../protocol/interventions";
import type { Data, InterventionKind, Model } from "../protocol/types";
import { useStudio } from "../store/store";
import { duration_of, entry, typed_text, yaml_values, type YamlValue } from "./yaml_places";

/** An entry of a scenario's timeline. */
export interface Injection {
  /** Its place in the list. */
  i: number;
  at: YamlValue | null;
  time_ns: number | null;
  kind: string;
  says: string;
  value: YamlValue;
}

export interface ScenarioText {
  root: YamlValue;
  injections: Injection[];
  duration: YamlValue | null;
  duration_ns: number | null;
}

/** Which entry is chosen, by its place. */
export const useScenario = create<{ chosen: number | null }>()(() => ({ chosen: null }));

/** Null: the text is no scenario that can be read. */
export function scenario_of(text: string): ScenarioText | null {
  const root = yaml_values(text);
  if (!root) return null;
  const duration = entry(root, "duration");
  const injections = (entry(root, "timeline")?.items ?? []).map((value, i): Injection => {
    const at = entry(value, "at");
    const kind = kKinds.find((word) => entry(value, word) !== null) ?? "";
    const others = value.entries.filter(([key]) => key !== "at" && key !== "source" && key !== kind);
    const what = entry(value, kind);
    const parts = what?.kind === "map" ? what.entries : others.flatMap(([, member]) => (member.kind === "map" ? member.entries : []));
    const said = [kind, what?.kind === "scalar" ? what.text : "", ...parts.map(([key, member]) => `${key} ${typed_text(member, text)}`)];
    return { i, at, time_ns: duration_of(at?.text), kind, says: said.filter(Boolean).join(" "), value };
  });
  return { root, injections, duration, duration_ns: duration_of(duration?.text) };
}

/** What the project has that an entry can be about. */
export function names_of(model: Model | null): { methods: string[]; replies: string[]; parts: string[]; leaves: string[]; charts: string[]; messages: string[]; monitors: string[] } {
  const services = model?.services ?? [];
  const methods = services.flatMap((service) => service.methods.map(({ name }) => `${service.name}.${name}`));
  const replies = services.filter(({ name }) => !name.endsWith("simulation")).flatMap((service) => service.methods.filter(({ result }) => result !== "void").map(({ name }) => `${service.name}.${name}`));
  const leaves = model?.tree.nodes.flatMap((node) => (node.message_name ? [node.message_name] : [])) ?? [];
  return {
    methods,
    replies,
    parts: model?.parts.map(({ name }) => name) ?? [],
    leaves,
    charts: model?.charts.map(({ id }) => id) ?? [],
    messages: [...replies.flatMap((call) => [call, `${call}.reply`]), ...leaves.flatMap((leaf) => [`${leaf}.tick`, `${leaf}.halt`])],
    monitors: model?.monitors.map(({ name }) => name) ?? [],
  };
}

/** The arguments that a call has by its interface. */
export function arguments_of(model: Model | null, call: string): Record<string, Data> {
  const [, name, method] = /^(.*)\.([^.]+)$/.exec(call) ?? [];
  const service = model?.services.find((one) => one.name === name);
  const found = service?.methods.find((one) => one.name === method);
  return service && found ? read_arguments(found, arguments_draft(found, service.types), service.types).value : {};
}

/** A first value for what an entry of that kind says, from what the project has. */
export function new_injection(kind: InterventionKind): Record<string, Data> {
  const model = useStudio.getState().index?.model ?? null;
  const { methods, replies, parts, leaves } = names_of(model);
  const first = (names: readonly string[], otherwise: string) => names[0] ?? otherwise;
  switch (kind) {
    case "call": {
      const call = methods.find((name) => name.startsWith("simulation.")) ?? first(methods, "service.method");
      const args = arguments_of(model, call);
      return Object.keys(args).length > 0 ? { call, args } : { call };
    }
    case "kill":
    case "restart":
      return { [kind]: first(parts, "part") };
    case "stop":
      return { stop: "mission" };
    case "delay":
      return { delay: { message: first(replies, "service.method"), by: "300 ms" } };
    case "falsify":
      return { falsify: falsified(model, first(replies, "service.method")) };
    case "unreachable":
    case "late":
      return { [kind]: first(replies, "service.method") };
    case "force":
      return { force: { leaf: first(leaves, "leaf"), status: "FAILURE" } };
    case "breakpoint":
      return { breakpoint: { message: "mission.status" } };
    case "clear":
      return { clear: 1 };
  }
}

function falsified(model: Model | null, call: string): Record<string, Data> {
  const [, name, method] = /^(.*)\.([^.]+)$/.exec(call) ?? [];
  const service = model?.services.find((one) => one.name === name);
  const found = service?.methods.find((one) => one.name === method);
  const field = service && found ? (reply_fields(found, service.types).find(({ path }) => !path.startsWith("header")) ?? null) : null;
  const type = field && service ? service.types[field.type] : undefined;
  const value: Data = type?.kind === "enum" ? (type.values[0] ?? "") : field?.type === "bool" ? false : field?.type === "string" ? "" : 0;
  return { call, ...(field && field.path !== "" ? { path: field.path } : {}), value };
}

