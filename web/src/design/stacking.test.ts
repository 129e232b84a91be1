import { expect, test } from "vitest";

import { is_below } from "./stacking";

const kRoom = { width: 1000, height: 700 };

test("the text is where the picture is the larger", () => {
  expect(is_below({ width: 900, height: 300 }, kRoom, null)).toBe(true);
  expect(is_below({ width: 400, height: 900 }, kRoom, null)).toBe(false);
  expect(is_below({ width: 400, height: 400 }, kRoom, null)).toBe(false);
});

test("a node more or less leaves it where it is", () => {
  // A little wider than half the room: below is a little better.
  const picture = { width: 540, height: 440 };
  expect(is_below(picture, kRoom, null)).toBe(true);
  expect(is_below(picture, kRoom, false)).toBe(false);
  expect(is_below({ ...picture, width: 490 }, kRoom, true)).toBe(true);
  // What is much better is done.
  expect(is_below({ width: 900, height: 300 }, kRoom, false)).toBe(true);
  expect(is_below({ width: 400, height: 900 }, kRoom, true)).toBe(false);
});
