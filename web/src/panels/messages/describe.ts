import { data_text } from "../../draw/format";
import type { Data, Observation } from "../../protocol/types";

/** The members of an object; empty for other data. */
export function members(data: Data): { [key: string]: Data } {
  return typeof data === "object" && data !== null && !Array.isArray(data) ? data : {};
}

/** What the name says without its last word, where the kind already tells that. */
export function short_name(observation: Pick<Observation, "name" | "kind">): string {
  const suffix = `.${observation.kind}`;
  return observation.name.endsWith(suffix) ? observation.name.slice(0, -suffix.length) : observation.name;
}

/** The values that matter, in one line: arguments of a request, result of a reply, else everything. */
export function summary(observation: Observation): string {
  const data = members(observation.data);
  if (observation.kind === "request") return inner(data["args"] ?? data["inputs"]);
  if (observation.kind === "reply") {
    if ("result" in data) return data_text(data["result"]);
    if ("status" in data) {
      const outputs = members(data["outputs"] ?? null);
      return [data_text(data["status"]), Object.keys(outputs).length > 0 ? inner(outputs) : ""].filter(Boolean).join(" ");
    }
    // A call that answers nothing.
    return "args" in data ? "done" : inner(observation.data);
  }
  if (observation.kind === "error") {
    const rest = [data["kind"], data["message"]].filter((part) => part !== undefined).map((part) => data_text(part));
    if (rest.length > 0) return rest.join(": ");
  }
  const from = data["from"];
  const to = data["to"];
  if (observation.name === "node.status" && from !== undefined && to !== undefined) return `${data_text(from)} → ${data_text(to)}`;
  if (observation.name === "scenario.injection") return `${data_text(data["what"])} ${inner(data["args"])}`.trim();
  return inner(observation.data);
}

function inner(data: Data | undefined): string {
  if (data === undefined || data === null) return "";
  const text = data_text(data);
  return text === "{}" ? "" : text;
}
