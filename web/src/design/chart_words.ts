import type { EditedChart, EditedTransition, ServiceModel } from "../protocol/types";

/** Values that are listed of a structure, so that a list can still be read. */
const kListedMax = 200;

export const is_history = (kind: string): boolean => kind.endsWith("history");
/** Whether transitions of its own lead out of such a state. */
export const leads_out = (kind: string): boolean => kind !== "final" && !is_history(kind);

/** Events that a transition can wait for: those of services, of states that end, and those that the chart sends itself. */
export function event_words(chart: EditedChart, services: readonly ServiceModel[]): string[] {
  const composite = new Set(chart.states.map(({ inside }) => inside).filter((id) => id !== ""));
  const own = chart.transitions.flatMap(({ event }) => event.split(/\s+/).filter(Boolean));
  const sent = [...chart.states.flatMap(({ onentry, onexit }) => [...onentry, ...onexit]), ...chart.transitions.flatMap(({ actions }) => actions)]
    .filter((xml) => !/\btarget=/.test(xml))
    .flatMap((xml) => [...xml.matchAll(/\bevent=["']([^"']+)["']/g)].map(([, event]) => event!));
  const calls = services.flatMap(({ name, methods }) => methods.flatMap((method) => [`${name}.${method.name}.reply`, `${name}.${method.name}.error`]));
  return [...new Set(["tick", "halt", ...own, ...sent, ...[...composite].map((id) => `done.state.${id}`), ...calls, "error.communication", "error.execution"])];
}

/** Conditions that begin what one may want to say: what the event brings, and which states are active. */
export function condition_words(chart: EditedChart, event: string, services: readonly ServiceModel[]): string[] {
  const words: string[] = [];
  for (const called of event.split(/\s+/)) {
    const [name, method] = called.split(".");
    const service = services.find((candidate) => candidate.name === name);
    const result = service?.methods.find((candidate) => candidate.name === method)?.result;
    if (service && result && !called.endsWith(".error")) words.push(...of_type(service, result, "_event.data.result", 0));
  }
  const data = chart.data.map((xml) => /\bid=["']([^"']+)["']/.exec(xml)?.[1]).filter((id) => id !== undefined);
  return [...new Set([...words, ...data, ...chart.states.filter(({ id }) => id !== "").map(({ id }) => `In('${id}')`)])].slice(0, kListedMax);
}

function of_type(service: ServiceModel, type: string, path: string, depth: number): string[] {
  const described = service.types[type];
  if (!described) return [path];
  if (described.kind === "enum") return described.values.map((value) => `${path} === '${value}'`);
  if ("fields" in described && depth < 2) return described.fields.flatMap((field) => of_type(service, field.type, `${path}.${field.name}`, depth + 1));
  return [path];
}

/** What can be done, as it is written first: it can be read, and `check` says what is to be filled in. */
export const kActions: Readonly<Record<string, string>> = {
  "call a service": '<send type="thrift" target="service" event="method"/>',
  assign: '<assign location="name" expr="0"/>',
  "raise an event": '<raise event="event"/>',
  "send later": '<send event="event" delay="1s" id="later"/>',
  cancel: '<cancel sendid="later"/>',
  log: `<log label="" expr="'here'"/>`,
  if: `<if cond="true">\n  <log expr="'here'"/>\n</if>`,
};

/** In one line: `event [condition] → target`. */
export function transition_text({ event, condition, target, written }: EditedTransition): string {
  if (!written) return `begins with ${target}`;
  return [event, condition && `[${condition}]`, target && `→ ${target}`].filter(Boolean).join(" ");
}

/** What a transition waits for, as it is drawn: `event [condition]`. */
export const label_of = ({ event, condition }: Pick<EditedTransition, "event" | "condition">): string => [event, condition && `[${condition}]`].filter(Boolean).join(" ");

/** Null: it is no label. */
export function read_label(text: string): { event: string; condition: string } | null {
  const found = /^([^[\]]*)(?:\[([^]*)\])?\s*$/.exec(text);
  return found && { event: found[1]!.trim(), condition: (found[2] ?? "").trim() };
}
