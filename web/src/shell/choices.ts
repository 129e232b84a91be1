import { data_text } from "../draw/format";
import type { Data, Observation, Operations } from "../protocol/types";

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

/** What a choice could have been, as the program says; null: it does not know. */
export type Possible = Operations["alternatives"][1][number];

/** Of so many others each has a button. */
const kButtonsMax = 5;

export interface Offer {
  others: Data[];
  /** They stand side by side, or in a list. */
  as: "buttons" | "list";
  /** Others can be typed too: the program judges them. `hint`: which there may be. */
  typed: { hint: string } | null;
}

/**
 * Alternatives of a choice: those that the program knows; of a choice of which it knows none the other truth value, and
 * what the same choice gave elsewhere.
 */
export function offer_of(choices: readonly Choice[], choice: Choice, possible: Possible): Offer {
  const own = JSON.stringify(choice.value);
  const seen = possible ? [...possible.values] : choices.filter((one) => one.model === choice.model && one.function === choice.function && one.name === choice.name).map(({ value }) => value);
  if (!possible && typeof choice.value === "boolean") seen.push(!choice.value);
  const different = new Map(seen.map((value) => [JSON.stringify(value), value] as const));
  different.delete(own);
  const others = [...different.values()];
  const listed = possible ? possible.values.length >= possible.count : typeof choice.value === "boolean";
  const hint = possible && !listed ? `${data_text(possible.values[0] ?? null)} … ${data_text(possible.last)}, ${possible.count} in all` : "another value";
  const shown = listed || !possible ? others : [];
  return { others: shown, as: shown.length <= kButtonsMax ? "buttons" : "list", typed: listed ? null : { hint } };
}

/** What `run_again` is told so that the run is the same up to the `i`th choice, and has `value` there. */
export function chosen_otherwise(choices: readonly Choice[], i: number, value: Data): string[] {
  return choices.slice(0, i + 1).map((one, k) => `${one.model}#${one.number}=${JSON.stringify(k === i ? value : one.value)}`);
}
