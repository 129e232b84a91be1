import { yamlLanguage } from "@codemirror/lang-yaml";
import type { SyntaxNode } from "@lezer/common";

import type { Data } from "../protocol/types";

/** A value of a YAML text, with its place in it. */
export interface YamlValue {
  kind: "map" | "list" | "scalar";
  from: number;
  to: number;
  /** Of a scalar: as written, without quotes. */
  text: string;
  quoted: boolean;
  entries: [string, YamlValue][];
  items: YamlValue[];
}

const scalar = (text: string, { from, to }: SyntaxNode): YamlValue => ({ kind: "scalar", from, to, text: text.slice(from, to).replace(/^(["'])(.*)\1$/s, "$2"), quoted: /^["']/.test(text.slice(from, from + 1)), entries: [], items: [] });

/** What a block of lines says (YAML 1.2.2, 8.1): of `|` its lines, of `>` those joined that are no further inside. */
function block_text(written: string): string {
  const [header = "", ...lines] = written.split(/\r?\n/);
  const inside = Math.min(...lines.filter((line) => line.trim() !== "").map((line) => line.search(/\S/)));
  const own = lines.map((line) => line.slice(Number.isFinite(inside) ? inside : 0));
  while (own.length > 0 && own.at(-1)!.trim() === "") own.pop();
  const text = own.join("\n");
  const ended = /^.[\d]*-/.test(header) || text === "" ? text : `${text}\n`;
  return header.startsWith(">") ? ended.replace(/(?<=\S)(\n+)(?=\S)/g, (breaks) => (breaks.length === 1 ? " " : breaks.slice(1))) : ended;
}

/** `known`: what anchors stand before. */
function value_of(text: string, node: SyntaxNode, known: Map<string, YamlValue>): YamlValue | null {
  switch (node.name) {
    case "Anchored":
    case "Tagged": {
      const inner = node.lastChild;
      const value = inner && inner.name !== "Anchor" && inner.name !== "Tag" ? value_of(text, inner, known) : null;
      const anchor = node.getChild("Anchor");
      if (anchor && value) known.set(text.slice(anchor.from + 1, anchor.to), value);
      return value;
    }
    case "Alias":
      return known.get(text.slice(node.from + 1, node.to)) ?? null;
    case "BlockLiteral":
      return { ...scalar(text, node), text: block_text(text.slice(node.from, node.to)), quoted: true };
    case "Literal":
    case "QuotedLiteral":
      return scalar(text, node);
    case "BlockMapping":
    case "FlowMapping": {
      const entries = node.getChildren("Pair").flatMap((pair): [string, YamlValue][] => {
        const key = pair.getChild("Key")?.firstChild;
        const value = pair.lastChild && pair.lastChild.name !== "Key" ? value_of(text, pair.lastChild, known) : null;
        return key && value ? [[scalar(text, key).text, value]] : [];
      });
      return { kind: "map", from: node.from, to: node.to, text: "", quoted: false, entries, items: [] };
    }
    case "BlockSequence":
    case "FlowSequence": {
      const items = node.getChildren("Item").flatMap((item) => {
        const value = item.firstChild && value_of(text, item.firstChild, known);
        return value ? [value] : [];
      });
      return { kind: "list", from: node.from, to: node.to, text: "", quoted: false, entries: [], items };
    }
    default:
      return null;
  }
}

/** The values of a YAML document; null: it is no mapping, or has an error. */
export function yaml_values(text: string): YamlValue | null {
  const tree = yamlLanguage.parser.parse(text);
  let broken = false;
  tree.iterate({ enter: ({ type }) => void (broken ||= type.isError) });
  const root = tree.topNode.getChild("Document")?.getChild("BlockMapping");
  return root && !broken ? value_of(text, root, new Map()) : null;
}

export const entry = (value: YamlValue | null | undefined, name: string): YamlValue | null => value?.entries.find(([key]) => key === name)?.[1] ?? null;

/** A number, if that is what is written. */
export function number_of(value: YamlValue | undefined): number | null {
  if (value?.kind !== "scalar" || !/^[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?$/.test(value.text)) return null;
  return Number(value.text);
}

/** An angle [rad]: a number, or degrees. */
export function angle_of(value: YamlValue | undefined): number | null {
  const degrees = /^([-+]?[\d.]+)\s*(?:deg|°)$/.exec(value?.text ?? "");
  return degrees ? (Number(degrees[1]) * Math.PI) / 180 : number_of(value);
}

/** Whether a number, or an angle, is written that is not `to`. */
export const is_other = (value: YamlValue, to: number) => !(Math.abs((angle_of(value) ?? NaN) - to) < 1e-6);

/** Metres as people write them: to the centimetre. */
export const metres_text = (value: number) => String(Math.round(value * 100) / 100 + 0);

/** An angle [rad] in the unit that `before` is written in, to the degree. */
export function angle_text(value: number, before: string): string {
  const degrees = /\s*(?:deg|°)$/.exec(before);
  if (!degrees) return String(Math.round(value * 100) / 100 + 0);
  return `${Math.round((value * 180) / Math.PI) + 0}${degrees[0]}`;
}

/** What is written as data: numbers and truth values are no texts. */
export function data_of(value: YamlValue): Data {
  if (value.kind === "map") return Object.fromEntries(value.entries.map(([key, member]) => [key, data_of(member)]));
  if (value.kind === "list") return value.items.map(data_of);
  if (value.quoted) return value.text;
  if (value.text === "true" || value.text === "false") return value.text === "true";
  return number_of(value) ?? value.text;
}

/** What somebody types into a field as data: as in a file, or the text itself. */
export function data_in(typed: string): Data {
  const value = entry(yaml_values(`value: ${typed}\n`), "value");
  return value && value.to === "value: ".length + typed.trimEnd().length ? data_of(value) : typed;
}

/** Of a value in one line, for a field: what `data_in` reads again. */
export function typed_text(value: YamlValue | null, text: string): string {
  if (!value) return "";
  return value.kind === "scalar" ? value.text.trimEnd().replace(/\s*\n\s*/g, " ") : text.slice(value.from, value.to);
}

const kUnits_ns: Record<string, number> = { us: 1e3, ms: 1e6, s: 1e9, min: 60e9, h: 3600e9 };

/** `40 ms`, `2 s`, `5 min` [ns]; null: no duration. */
export function duration_of(written: string | undefined): number | null {
  const found = /^\s*(\d+\.?\d*|\.\d+)\s*(us|ms|s|min|h)\s*$/.exec(written ?? "");
  return found ? Number(found[1]) * kUnits_ns[found[2]!]! : null;
}

/** In the unit of `before` where that is exact to three decimals, else in seconds, or milliseconds below one. */
export function duration_like(time_ns: number, before: string): string {
  const unit = /(us|ms|s|min|h)\s*$/.exec(before)?.[1] ?? "s";
  const text = (name: string) => `${Number((time_ns / kUnits_ns[name]!).toFixed(3))} ${name}`;
  const fits = (name: string) => Math.abs(duration_of(text(name))! - time_ns) < 1e-6 * kUnits_ns[name]!;
  if (fits(unit)) return text(unit);
  return fits("s") ? text("s") : text("ms");
}

/** A rate such as `10 Hz` as its period [ns]. */
export function period_of(written: string | undefined): number | null {
  const found = /^\s*(\d+\.?\d*|\.\d+)\s*Hz\s*$/.exec(written ?? "");
  return found && Number(found[1]) > 0 ? 1e9 / Number(found[1]) : null;
}
