import { expect, test } from "vitest";

import type { Observation } from "../protocol/types";
import { choices_of, chosen_otherwise, offer_of } from "./choices";

const said = (sequence: number, name: string, data: Observation["data"]): Observation => ({ sequence, time: sequence * 1e6, tick: 0, kind: "event", name, source: name.split(".")[0]!, target: "", call: 0, data });
const kChoices = choices_of([
  said(1, "robot.choice", { function: "pick", name: "starts_at", value: 4 }),
  said(2, "hall.choice", { function: "chance", value: true }),
  said(3, "robot.log", { text: "x" }),
  said(4, "robot.choice", { function: "pick", name: "plugs_in", value: false, place: "models/robot.scxml:33" }),
  said(5, "robot.choice", { function: "pick", name: "starts_at", value: 2 }),
]);

test("choices are numbered by model", () => {
  expect(kChoices.map(({ model, number }) => `${model}#${number}`)).toEqual(["robot#1", "hall#1", "robot#2", "robot#3"]);
});

test("a choice tells where it stands, if that is known", () => {
  expect(kChoices.map(({ place }) => place)).toEqual(["", "", "models/robot.scxml:33", ""]);
});

const offered = (i: number, possible: Parameters<typeof offer_of>[2]) => offer_of(kChoices, kChoices[i]!, possible);

test("other alternatives are those that the program knows", () => {
  expect(offered(0, { values: [2, 3, 4], count: 3, last: 4 })).toEqual({ others: [2, 3], as: "buttons", typed: null });
  expect(offered(0, { values: [4], count: 1, last: 4 })).toEqual({ others: [], as: "buttons", typed: null });
  const many = Array.from({ length: 100 }, (_, i) => i);
  expect(offered(0, { values: many.slice(0, 20), count: 20, last: 19 })).toEqual({ others: many.slice(0, 20).filter((value) => value !== 4), as: "list", typed: null });
  expect(offered(0, { values: many, count: 300, last: 299 })).toEqual({ others: [], as: "buttons", typed: { hint: "0 … 299, 300 in all" } });
});

test("where it knows none, they are the other truth value, and what the same choice gave elsewhere", () => {
  expect(offered(0, null)).toEqual({ others: [2], as: "buttons", typed: { hint: "another value" } });
  expect(offered(1, null)).toEqual({ others: [false], as: "buttons", typed: null });
  expect(offered(2, null)).toEqual({ others: [true], as: "buttons", typed: null });
});

test("the run is the same up to the choice that is another", () => {
  expect(chosen_otherwise(kChoices, 2, true)).toEqual(["robot#1=4", "hall#1=true", "robot#2=true"]);
  expect(chosen_otherwise(kChoices, 0, "two")).toEqual(['robot#1="two"']);
});
