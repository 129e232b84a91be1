import type { Data, IdlMethod, IdlTypes } from "../../protocol/types";

/** What a form holds for a value while it is edited: possibly not a value yet. */
export type Draft =
  | { kind: "text"; text: string }
  | { kind: "bool"; on: boolean }
  | { kind: "choice"; name: string }
  | { kind: "struct"; fields: Record<string, DraftField> }
  | { kind: "list"; items: Draft[] }
  | { kind: "map"; entries: [Draft, Draft][] };
/** A field that is not given counts as the IDL says: its default, or absent. */
export interface DraftField {
  given: boolean;
  draft: Draft;
}

/** Structs inside structs that a new form opens; deeper ones are opened by giving their field. */
export const kNestingMax = 16;

const kIntegers: Record<string, bigint> = {
  i8: 2n ** 7n,
  byte: 2n ** 7n,
  i16: 2n ** 15n,
  i32: 2n ** 31n,
  i64: 2n ** 63n,
};

/** An empty form, with the defaults of the IDL. */
export function new_draft(type: string, types: IdlTypes, initial?: Data, depth = 0): Draft {
  const described = types[type];
  if (!described) {
    if (type === "bool") return { kind: "bool", on: initial === true };
    if (initial !== undefined && initial !== null) return { kind: "text", text: String(initial) };
    return { kind: "text", text: type === "string" || type === "binary" ? "" : "0" };
  }
  switch (described.kind) {
    case "enum":
      return { kind: "choice", name: typeof initial === "string" ? initial : (described.values[0] ?? "") };
    case "list":
    case "set": {
      const items = Array.isArray(initial) ? initial : [];
      return { kind: "list", items: items.map((item) => new_draft(described.element, types, item, depth + 1)) };
    }
    case "map": {
      const pairs: [Data, Data][] = is_record(initial)
        ? Object.entries(initial)
        : Array.isArray(initial)
          ? (initial as [Data, Data][])
          : [];
      return {
        kind: "map",
        entries: pairs.map(([key, value]) => [
          new_draft(described.key, types, key, depth + 1),
          new_draft(described.element, types, value, depth + 1),
        ]),
      };
    }
    default: {
      const fields: Record<string, DraftField> = {};
      described.fields.forEach((field, i) => {
        const value = is_record(initial) ? initial[field.name] : undefined;
        const asked = described.kind === "union" ? i === 0 && !is_record(initial) : field.required;
        const given = value !== undefined || (asked && depth < kNestingMax);
        const start = value ?? field.default;
        fields[field.name] = {
          given,
          // What is not given is made only when somebody gives it: a struct may contain itself.
          draft: given ? new_draft(field.type, types, start, depth + 1) : { kind: "text", text: "" },
        };
      });
      return { kind: "struct", fields };
    }
  }
}

/** A form for the arguments of a method. */
export function arguments_draft(method: IdlMethod, types: IdlTypes): Record<string, DraftField> {
  const fields: Record<string, DraftField> = {};
  for (const field of method.args) {
    fields[field.name] = { given: true, draft: new_draft(field.type, types, field.default) };
  }
  return fields;
}

export interface FormError {
  /** `to.pose.x`, `names[2]`. */
  path: string;
  message: string;
}
export type Read = { value: Data; errors: FormError[] };

/** The value that a form holds, and what is wrong with it. */
export function read_draft(draft: Draft, type: string, types: IdlTypes, path = ""): Read {
  const wrong = (message: string): Read => ({ value: null, errors: [{ path, message }] });
  const described = types[type];
  switch (draft.kind) {
    case "bool":
      return { value: draft.on, errors: [] };
    case "choice":
      if (described?.kind === "enum" && !described.values.includes(draft.name)) {
        return wrong(`one of ${described.values.join(", ")}`);
      }
      return { value: draft.name, errors: [] };
    case "text":
      return read_text(draft.text, type, wrong);
    case "list": {
      const element = described?.kind === "list" || described?.kind === "set" ? described.element : "string";
      const items = draft.items.map((item, i) => read_draft(item, element, types, `${path}[${i}]`));
      return { value: items.map((item) => item.value), errors: items.flatMap((item) => item.errors) };
    }
    case "map": {
      if (described?.kind !== "map") return wrong("not a map");
      const pairs = draft.entries.map(([key, value], i) => [
        read_draft(key, described.key, types, `${path}[${i}].key`),
        read_draft(value, described.element, types, `${path}[${i}]`),
      ] as const);
      const errors = pairs.flatMap(([key, value]) => [...key.errors, ...value.errors]);
      // With other than string keys a map is a list of pairs, because JSON has no such maps.
      const value: Data =
        described.key === "string"
          ? Object.fromEntries(pairs.map(([key, item]) => [String(key.value), item.value]))
          : pairs.map(([key, item]) => [key.value, item.value]);
      return { value, errors };
    }
    case "struct": {
      if (!described || !("fields" in described)) return wrong("not a struct");
      const out: Record<string, Data> = {};
      const errors: FormError[] = [];
      for (const field of described.fields) {
        const entry = draft.fields[field.name];
        if (!entry?.given) continue;
        const read = read_draft(entry.draft, field.type, types, path ? `${path}.${field.name}` : field.name);
        out[field.name] = read.value;
        errors.push(...read.errors);
      }
      if (described.kind === "union" && Object.keys(out).length !== 1) {
        errors.push({ path, message: `exactly one of ${described.fields.map((f) => f.name).join(", ")}` });
      }
      return { value: out, errors };
    }
  }
}

/** The arguments that a form holds. */
export function read_arguments(method: IdlMethod, fields: Record<string, DraftField>, types: IdlTypes) {
  const value: Record<string, Data> = {};
  const errors: FormError[] = [];
  for (const field of method.args) {
    const entry = fields[field.name];
    if (!entry?.given) continue;
    const read = read_draft(entry.draft, field.type, types, field.name);
    value[field.name] = read.value;
    errors.push(...read.errors);
  }
  return { value, errors };
}

function read_text(text: string, type: string, wrong: (message: string) => Read): Read {
  if (type === "string" || type === "binary") return { value: text, errors: [] };
  const trimmed = text.trim();
  const bound = kIntegers[type];
  if (bound !== undefined) {
    if (!/^[+-]?\d+$/.test(trimmed)) return wrong("a whole number");
    const value = BigInt(trimmed);
    if (value < -bound || value >= bound) return wrong(`from ${-bound} to ${bound - 1n}`);
    // JSON numbers are doubles here: what they cannot hold travels as text.
    const safe = value >= BigInt(Number.MIN_SAFE_INTEGER) && value <= BigInt(Number.MAX_SAFE_INTEGER);
    return { value: safe ? Number(value) : String(value), errors: [] };
  }
  if (type === "double") {
    const named = ["NaN", "Infinity", "-Infinity"].find((name) => name.toLowerCase() === trimmed.toLowerCase());
    if (named) return { value: named, errors: [] };
    const value = Number(trimmed.replace(",", "."));
    return trimmed === "" || !Number.isFinite(value) ? wrong("a number, such as 0.5") : { value, errors: [] };
  }
  return wrong(`no value of type ${type}`);
}

export interface ReplyField {
  /** As the operation `falsify` wants it: "" is the whole reply, else `percentage`, `header.stamp`. */
  path: string;
  type: string;
  unit?: string;
}

/** The places of a reply that hold a plain value, depth first; structs that contain themselves are opened once. */
export function reply_fields(method: IdlMethod, types: IdlTypes): ReplyField[] {
  const out: ReplyField[] = [];
  const visit = (field: ReplyField, open: readonly string[]) => {
    const described = types[field.type];
    if (described && "fields" in described) {
      if (open.includes(field.type) || open.length >= kNestingMax) return;
      for (const { name, type, unit } of described.fields) {
        const path = field.path ? `${field.path}.${name}` : name;
        visit(unit === undefined ? { path, type } : { path, type, unit }, [...open, field.type]);
      }
    } else if (field.type !== "void") {
      out.push(field);
    }
  };
  visit(method.unit === undefined ? { path: "", type: method.result } : { path: "", type: method.result, unit: method.unit }, []);
  return out;
}


function is_record(data: Data | undefined): data is { [key: string]: Data } {
  return typeof data === "object" && data !== null && !Array.isArray(data);
}
