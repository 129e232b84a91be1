import { expect, test } from "vitest";

import { byte_length, caret_place, Places, splice_between } from "./places";

test("places are those of the bytes, whatever the text", () => {
  for (const text of ["", "abc", "aä€😀b", "\uFEFFa\r\nb\r\n", "x\ry\r", "ä\r\n😀\n"]) {
    const places = new Places(text);
    expect(places.shown).toBe(text.replace(/^\uFEFF/, "").replace(/\r\n?/g, "\n"));
    expect(places.byte(places.shown.length)).toBe(byte_length(text));
    for (let i = 0; i <= places.shown.length; i += 1) {
      if (/[\uDC00-\uDFFF]/.test(places.shown[i] ?? "")) continue;
      expect(places.at(places.byte(i)), JSON.stringify([text, i])).toBe(i);
    }
  }
  expect(new Places("\uFEFFa\r\nb").byte(0)).toBe(3);
  expect(new Places("a\r\nb").end_of_line).toBe("\r\n");
});

test("a caret at the end of a line is of what ends there", () => {
  const text = "<a>\n  <b/>  \n\n</a>";
  const places = Array.from({ length: text.length + 1 }, (_, i) => caret_place(text, i));
  expect(places.map((at, i) => (at === i ? "" : `${i}→${at}`)).filter(Boolean)).toEqual(["3→2", "10→9", "11→9", "12→9", `${text.length}→${text.length - 1}`]);
  expect(caret_place("", 0)).toBe(0);
});

test("one replacement is as short as can be, and never halves a character", () => {
  expect(splice_between("same", "same")).toBe(null);
  expect(splice_between("abcd", "abxd")).toEqual({ from: 2, to: 3, text: "x" });
  expect(splice_between("aa", "aaa")).toEqual({ from: 2, to: 2, text: "a" });
  expect(splice_between("😀", "😁")).toEqual({ from: 0, to: 2, text: "😁" });
});
