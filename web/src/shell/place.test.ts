import { expect, it } from "vitest";

import { read_place, write_place, type Place } from "./place";

const kNowhere: Place = { at: null, node: null, chart: null, monitor: null, message: null, view: null, file: null };

it("an address says a place and is read as it", () => {
  const place: Place = { at: 53_100_000_001, node: "Main/Root & co/GoTo#1", chart: "skill:GoToKitchen", monitor: "never_empty", message: 12, view: "run", file: "skills/Go To.scxml" };
  const hash = write_place("#token=abc-_", place);
  expect(hash).toMatch(/^#token=abc-_&at=53\.100000001&/);
  expect(read_place(hash)).toEqual(place);
  expect(write_place(hash, kNowhere)).toBe("#token=abc-_");
});

it("nothing is said of nowhere, and what is damaged is not there", () => {
  expect(write_place("", kNowhere)).toBe("");
  expect(read_place("")).toEqual(kNowhere);
  expect(read_place("#at=soon&message=-1&view=all&%")).toEqual(kNowhere);
});
