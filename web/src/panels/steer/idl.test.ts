import { describe, expect, it } from "vitest";
import { arguments_draft, new_draft, read_arguments, read_draft, reply_fields, type Draft } from "./idl";
import type { IdlMethod, IdlTypes } from "../../protocol/types";

const kTypes: IdlTypes = {
  Header: {
    kind: "struct",
    fields: [
      { name: "stamp", type: "double", required: true },
      { name: "frame_id", type: "string", required: false, default: "map" },
    ],
  },
  Mode: { kind: "enum", values: ["SLOW", "FAST"] },
  Battery: {
    kind: "struct",
    fields: [
      { name: "header", type: "Header", required: true },
      { name: "percentage", type: "double", required: true, unit: "ratio" },
      { name: "mode", type: "Mode", required: true },
    ],
  },
  Place: {
    kind: "struct",
    fields: [
      { name: "name", type: "string", required: true },
      { name: "inside", type: "Place", required: false },
      { name: "tags", type: "list<string>", required: false },
    ],
  },
  Target: {
    kind: "union",
    fields: [
      { name: "name", type: "string", required: false },
      { name: "id", type: "i32", required: false },
    ],
  },
  "list<string>": { kind: "list", element: "string" },
  "map<string, i32>": { kind: "map", key: "string", element: "i32" },
  "map<i32, bool>": { kind: "map", key: "i32", element: "bool" },
};

const text = (value: string): Draft => ({ kind: "text", text: value });

describe("a form made from the IDL", () => {
  it("starts with defaults and reads back as a value", () => {
    const draft = new_draft("Battery", kTypes);
    expect(read_draft(draft, "Battery", kTypes)).toEqual({
      value: { header: { stamp: 0 }, percentage: 0, mode: "SLOW" },
      errors: [],
    });
  });

  it("leaves out what is not given, so that the IDL's default counts", () => {
    const method: IdlMethod = {
      name: "go",
      result: "void",
      oneway: false,
      args: [
        { name: "to", type: "string", required: true },
        { name: "speed", type: "double", required: false, default: 0.5 },
      ],
    };
    const form = arguments_draft(method, kTypes);
    expect(read_arguments(method, form, kTypes)).toEqual({ value: { to: "", speed: 0.5 }, errors: [] });
    form["speed"]!.given = false;
    expect(read_arguments(method, form, kTypes).value).toEqual({ to: "" });
  });

  it("opens a struct that contains itself only as far as asked", () => {
    expect(read_draft(new_draft("Place", kTypes), "Place", kTypes).value).toEqual({ name: "" });
    const given = { name: "a", inside: { name: "b" }, tags: ["x", "y"] };
    expect(read_draft(new_draft("Place", kTypes, given), "Place", kTypes).value).toEqual(given);
  });

  it("says where and what is wrong", () => {
    const draft = new_draft("Battery", kTypes);
    if (draft.kind !== "struct") throw new Error("no struct");
    draft.fields["percentage"]!.draft = text("much");
    draft.fields["mode"]!.draft = { kind: "choice", name: "MEDIUM" };
    expect(read_draft(draft, "Battery", kTypes).errors).toEqual([
      { path: "percentage", message: "a number, such as 0.5" },
      { path: "mode", message: "one of SLOW, FAST" },
    ]);
  });

  it("holds integers within their type, and sends what JSON cannot hold as text", () => {
    expect(read_draft(text("127"), "i8", {}).value).toBe(127);
    expect(read_draft(text("128"), "i8", {}).errors[0]?.message).toBe("from -128 to 127");
    expect(read_draft(text("1.5"), "i32", {}).errors).toHaveLength(1);
    expect(read_draft(text("9007199254740991"), "i64", {}).value).toBe(9007199254740991);
    expect(read_draft(text("-9223372036854775808"), "i64", {}).value).toBe("-9223372036854775808");
    expect(read_draft(text("9223372036854775808"), "i64", {}).errors).toHaveLength(1);
  });

  it("takes numbers as people write them, and the names of those that JSON lacks", () => {
    expect(read_draft(text(" 0,5 "), "double", {}).value).toBe(0.5);
    expect(read_draft(text("infinity"), "double", {}).value).toBe("Infinity");
    expect(read_draft(text(""), "double", {}).errors).toHaveLength(1);
  });

  it("wants exactly one member of a union", () => {
    const draft = new_draft("Target", kTypes);
    expect(read_draft(draft, "Target", kTypes)).toEqual({ value: { name: "" }, errors: [] });
    if (draft.kind !== "struct") throw new Error("no struct");
    draft.fields["id"] = { given: true, draft: text("3") };
    expect(read_draft(draft, "Target", kTypes).errors[0]?.message).toBe("exactly one of name, id");
  });

  it("writes maps with string keys as objects and others as pairs", () => {
    const named = new_draft("map<string, i32>", kTypes, { a: 1 });
    expect(read_draft(named, "map<string, i32>", kTypes)).toEqual({ value: { a: 1 }, errors: [] });
    const numbered = new_draft("map<i32, bool>", kTypes, [[3, true]]);
    expect(read_draft(numbered, "map<i32, bool>", kTypes)).toEqual({ value: [[3, true]], errors: [] });
  });
});

describe("the fields of a reply", () => {
  const method = (result: string): IdlMethod => ({ name: "get", args: [], result, oneway: false });
  it("are its plain values, by path", () => {
    expect(reply_fields(method("Battery"), kTypes)).toEqual([
      { path: "header.stamp", type: "double" },
      { path: "header.frame_id", type: "string" },
      { path: "percentage", type: "double", unit: "ratio" },
      { path: "mode", type: "Mode" },
    ]);
  });
  it("are the reply itself where it is a plain value, and none where there is none", () => {
    expect(reply_fields({ ...method("double"), unit: "%" }, kTypes)).toEqual([{ path: "", type: "double", unit: "%" }]);
    expect(reply_fields(method("void"), kTypes)).toEqual([]);
  });
  it("end where a struct contains itself", () => {
    expect(reply_fields(method("Place"), kTypes).map((field) => field.path)).toEqual(["name", "tags"]);
  });
});
