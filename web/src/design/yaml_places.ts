import { yamlLanguage } from "@codemirror/lang-yaml";
import type { SyntaxNode } from "@lezer/common";

/** A value of a YAML text, with its place in it. */
export interface YamlValue {
  kind: "map" | "list" | "scalar";
  from: number;
  to: number;
  /** Of a scalar: as written, without quotes. */
  text: string;
  entries: [string, YamlValue][];
  items: YamlValue[];
}

const scalar = (text: string, { from, to }: SyntaxNode): YamlValue => ({ kind: "scalar", from, to, text: text.slice(from, to).replace(/^(["'])(.*)\1$/s, "$2"), entries: [], items: [] });

function value_of(text: string, node: SyntaxNode): YamlValue | null {
  switch (node.name) {
    case "Literal":
    case "QuotedLiteral":
      return scalar(text, node);
    case "BlockMapping":
    case "FlowMapping": {
      const entries = node.getChildren("Pair").flatMap((pair): [string, YamlValue][] => {
        const key = pair.getChild("Key")?.firstChild;
        const value = pair.lastChild && pair.lastChild.name !== "Key" ? value_of(text, pair.lastChild) : null;
        return key && value ? [[scalar(text, key).text, value]] : [];
      });
      return { kind: "map", from: node.from, to: node.to, text: "", entries, items: [] };
    }
    case "BlockSequence":
    case "FlowSequence": {
      const items = node.getChildren("Item").flatMap((item) => {
        const value = item.firstChild && value_of(text, item.firstChild);
        return value ? [value] : [];
      });
      return { kind: "list", from: node.from, to: node.to, text: "", entries: [], items };
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
  return root && !broken ? value_of(text, root) : null;
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

/** Metres as people write them: to the centimetre. */
export const metres_text = (value: number) => String(Math.round(value * 100) / 100 + 0);

/** An angle [rad] in the unit that `before` is written in, to the degree. */
export function angle_text(value: number, before: string): string {
  const degrees = /\s*(?:deg|°)$/.exec(before);
  if (!degrees) return String(Math.round(value * 100) / 100 + 0);
  return `${Math.round((value * 180) / Math.PI) + 0}${degrees[0]}`;
}
