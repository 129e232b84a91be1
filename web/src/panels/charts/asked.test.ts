import { expect, test } from "vitest";

import { asks_for_chart } from "./asked";

const kNothing = { node: null, chart: null, monitor: null, sequence: null };
/** Node 1 is a leaf. */
const asks = (now: object, before: object = {}) => asks_for_chart({ ...kNothing, ...now }, { ...kNothing, ...before }, (node) => node === 1);

test("what has a chart brings it back", () => {
  expect(asks({ node: 1, chart: "skill:a" })).toBe(true);
  expect(asks({ node: 1, chart: "skill:a" }, { node: 1, chart: "skill:a" })).toBe(true);
  expect(asks({ monitor: "m", chart: "monitor:m" }, { node: 1, chart: "skill:a" })).toBe(true);
  expect(asks({ node: 1, chart: "skill:a" }, { node: 2, chart: "skill:a" })).toBe(true);
});

test("nothing else does", () => {
  expect(asks({ node: 2 })).toBe(false);
  expect(asks({ node: 2, chart: "skill:a" }, { node: 1, chart: "skill:a" })).toBe(false);
  expect(asks({ node: 2, chart: "skill:a" }, { node: 2, chart: "skill:a" })).toBe(false);
  expect(asks({ node: 1, chart: "skill:a", sequence: 3 }, { node: 1, chart: "skill:a", sequence: 2 })).toBe(false);
  expect(asks({}, { node: 1, chart: "skill:a" })).toBe(false);
});
