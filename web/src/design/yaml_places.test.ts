import { expect, test } from "vitest";

import { angle_of, angle_text, data_in, data_of, duration_like, duration_of, entry, is_other, metres_text, number_of, period_of, typed_text, yaml_values } from "./yaml_places";

const kWorld = "# a house\nstart: a\nlocations:\n  a: [1.2, -3, 45 deg] # here\n  'b c': [0, 0, 0.5]\nareas:\n  hall: {corners: [[0.1, 4.3], [1, 2]]}\n";

test("values have the place that they are written at", () => {
  const a = entry(entry(yaml_values(kWorld), "locations"), "a");
  expect(a?.items.map(({ from, to }) => kWorld.slice(from, to))).toEqual(["1.2", "-3", "45 deg"]);
  const corner = entry(entry(entry(yaml_values(kWorld), "areas"), "hall"), "corners")?.items[0]?.items[1];
  expect(kWorld.slice(corner?.from, corner?.to)).toBe("4.3");
});

test("keys are read without their quotes", () => {
  expect(entry(yaml_values(kWorld), "locations")?.entries.map(([name]) => name)).toEqual(["a", "b c"]);
});

test("what is no mapping has no values", () => {
  expect(yaml_values("- 1\n- 2\n")).toBeNull();
  expect(yaml_values("")).toBeNull();
});

test("numbers and angles are read and written as people do", () => {
  const [x, , heading] = entry(entry(yaml_values(kWorld), "locations"), "a")?.items ?? [];
  expect(number_of(x)).toBe(1.2);
  expect(number_of(heading)).toBeNull();
  expect(angle_of(heading)).toBeCloseTo(Math.PI / 4);
  expect(angle_text(Math.PI / 2, "45 deg")).toBe("90 deg");
  expect(angle_text(-0.001, "45 deg")).toBe("0 deg");
  expect(angle_text(1.2345, "0.5")).toBe("1.23");
  expect(metres_text(3.14159)).toBe("3.14");
  expect(metres_text(-0.001)).toBe("0");
});

test("data are read as a file says them", () => {
  const root = yaml_values("a: 1\nb: '1'\nc: [x, true, 2.5]\nd: {e: 10 s}\n");
  expect(root && data_of(root)).toEqual({ a: 1, b: "1", c: ["x", true, 2.5], d: { e: "10 s" } });
  expect(data_in("12.5")).toBe(12.5);
  expect(data_in("12.5 s")).toBe("12.5 s");
  expect(data_in("[a, b]")).toEqual(["a", "b"]);
  expect(data_in("tcp://h:1")).toBe("tcp://h:1");
  expect(data_in("[a")).toBe("[a");
  expect(data_in("a # b")).toBe("a # b");
});

test("durations keep their unit where that is exact", () => {
  expect(duration_of("4500 ms")).toBe(4.5e9);
  expect(duration_of("2 min")).toBe(120e9);
  expect(duration_of("2")).toBeNull();
  expect(duration_like(21.5e9, "20 s")).toBe("21.5 s");
  expect(duration_like(90e9, "2 min")).toBe("1.5 min");
  expect(duration_like(100e9, "2 min")).toBe("100 s");
  expect(duration_like(4.6e9, "4500 ms")).toBe("4600 ms");
  expect(duration_like(1.2345e9, "1 s")).toBe("1234.5 ms");
  expect(period_of("10 Hz")).toBe(1e8);
});

test("anchors, tags and aliases are what they stand for", () => {
  const text = "services:\n  battery: &b {at: sim}\n  other: *b\n  arm: !x\n    at: model\n  none: *c\n";
  const services = entry(yaml_values(text), "services");
  expect(services?.entries.map(([name]) => name)).toEqual(["battery", "other", "arm"]);
  expect(services?.entries.map(([, value]) => entry(value, "at")?.text)).toEqual(["sim", "sim", "model"]);
});

test("texts over several lines are shown in one", () => {
  const text = "a: >\n  one\n  two\n\n  three\nb: |-\n  one\n    two\nc: >-\n\nd: 1\n";
  const root = yaml_values(text);
  expect(root && data_of(root)).toEqual({ a: "one two\nthree\n", b: "one\n  two", c: "", d: 1 });
  expect(["a", "b", "c"].map((key) => typed_text(entry(root, key), text))).toEqual(["one two three", "one two", ""]);
});

test("a number that stays is told by what it means, not by how it is written", () => {
  const [x, y, heading] = entry(yaml_values("p: [1.20, 3.0, 45 deg]\n"), "p")!.items;
  expect(is_other(x!, 1.2)).toBe(false);
  expect(is_other(y!, 3.05)).toBe(true);
  expect(is_other(heading!, Math.PI / 4)).toBe(false);
});
