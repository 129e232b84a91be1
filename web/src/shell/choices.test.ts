import { expect, test } from "vitest";

import type { Observation } from "../protocol/types";
import { choices_of, chosen_otherwise, others_of } from "./choices";

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

test("other alternatives are the other truth value, and what the same choice gave elsewhere", () => {
  expect(others_of(kChoices, kChoices[0]!)).toEqual([2]);
  expect(others_of(kChoices, kChoices[1]!)).toEqual([false]);
  expect(others_of(kChoices, kChoices[2]!)).toEqual([true]);
});

test("the run is the same up to the choice that is another", () => {
  expect(chosen_otherwise(kChoices, 2, true)).toEqual(["robot#1=4", "hall#1=true", "robot#2=true"]);
  expect(chosen_otherwise(kChoices, 0, "two")).toEqual(['robot#1="two"']);
});
