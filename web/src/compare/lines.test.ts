import { expect, test } from "vitest";

import { compare_lines } from "./lines";

const signs = (before: string, after: string) => compare_lines(before, after).map(({ text, before: was, after: is }) => `${was === null ? "+" : is === null ? "-" : " "}${text}`);

test("what is in both is said once, in order", () => {
  expect(signs("a\nb\nc", "a\nx\nc")).toEqual([" a", "-b", "+x", " c"]);
  expect(signs("a\nb\nc\nd", "b\nd\ne")).toEqual(["-a", " b", "-c", " d", "+e"]);
});

test("the end of the last line is none", () => {
  expect(signs("", "a\nb\n")).toEqual(["+a", "+b"]);
  expect(signs("a\n", "")).toEqual(["-a"]);
  expect(signs("a\nb\n", "a\n")).toEqual([" a", "-b"]);
  // But where one of them lacks it.
  expect(signs("a", "a\n")).toEqual([" a", "+"]);
});

test("lines are numbered as each text counts them", () => {
  expect(compare_lines("a\nb", "x\na\nb").map(({ before, after }) => [before, after])).toEqual([
    [null, 1],
    [1, 2],
    [2, 3],
  ]);
});

test("texts too long to be compared pair by pair are replaced between their first and last difference", () => {
  const lines = (word: string) => Array.from({ length: 2100 }, (_, i) => `${word}${i}`).join("\n");
  const found = compare_lines(`same\n${lines("a")}\nend`, `same\n${lines("b")}\nend`);
  expect(found.length).toBe(2 + 2 * 2100);
  expect([found[0]?.text, found[1]?.text, found[2101]?.text, found.at(-1)?.text]).toEqual(["same", "a0", "b0", "end"]);
});
