import type { Data, Observation } from "../protocol/types";

/** One of the choices that a model made in a run. */
export interface Choice {
  model: string;
  /** Which of that model's, from 1. */
  number: number;
  time: number;
  function: string;
  name: string;
  value: Data;
  /** Where the model's chart makes it, "models/robot.scxml:31"; empty: a recording of before says nothing of it. */
  place: string;
}

/** The choices among these observations, which are all of a run from its beginning, in order. */
export function choices_of(observations: readonly Observation[]): Choice[] {
  const numbers = new Map<string, number>();
  return observations.flatMap(({ name, time, data }): Choice[] => {
    if (!name.endsWith(".choice") || typeof data !== "object" || data === null || Array.isArray(data) || typeof data["function"] !== "string") return [];
    const model = name.slice(0, -".choice".length);
    const number = (numbers.get(model) ?? 0) + 1;
    numbers.set(model, number);
    const text = (member: string) => {
      const value = data[member];
      return typeof value === "string" ? value : "";
    };
    return [{ model, number, time, function: text("function"), name: text("name"), value: data["value"] ?? null, place: text("place") }];
  });
}

/** Alternatives of a choice as far as they are known: the other truth value, and what the same choice gave elsewhere. */
export function others_of(choices: readonly Choice[], choice: Choice): Data[] {
  const own = JSON.stringify(choice.value);
  const seen = choices.filter((one) => one.model === choice.model && one.function === choice.function && one.name === choice.name).map(({ value }) => value);
  if (typeof choice.value === "boolean") seen.push(!choice.value);
  const different = new Map(seen.map((value) => [JSON.stringify(value), value] as const));
  different.delete(own);
  return [...different.values()];
}

/** What `run_again` is told so that the run is the same up to the `i`th choice, and has `value` there. */
export function chosen_otherwise(choices: readonly Choice[], i: number, value: Data): string[] {
  return choices.slice(0, i + 1).map((one, k) => `${one.model}#${one.number}=${JSON.stringify(k === i ? value : one.value)}`);
}
