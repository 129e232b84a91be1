import { create } from "zustand";

import type { NodeKind, NotReached, Reached, ReachedKind } from "../../protocol/types";

/** What a picture marks. */
export interface Never {
  /** What a node lacks, by its path. */
  nodes: ReadonlyMap<string, ReadonlySet<string>>;
  /** The same by `node_key`. */
  node_lines: ReadonlyMap<string, ReadonlySet<string>>;
  /** States and transitions of charts: `state_key`, `transition_key`. */
  parts: ReadonlySet<string>;
}

const kNothing: Never = { nodes: new Map(), node_lines: new Map(), parts: new Set() };

/** What was never reached, while somebody looks at it; and what was chosen of it. */
export const useReached = create<{ never: Never; sought: string | null }>()(() => ({ never: kNothing, sought: null }));

/** Charts are known by their path inside the project, and by longer ones. */
const name_of = (file: string) => file.split("/").slice(-2).join("/");
export const state_key = (file: string, id: string) => `${name_of(file)}|${id}`;
export const transition_key = (file: string, line: number) => `${name_of(file)}:${line}`;
export const node_key = (file: string, line: number) => `${name_of(file)}:${line}`;

export const mark_of = (never: boolean, sought: boolean) => [never ? "never" : "", sought ? "sought" : ""].filter(Boolean).join(" ") || undefined;

/** Whether a leaf was never ticked. Nodes that hold others are told by their leaves: that one runs is not counted. */
export const is_never = (lacks: ReadonlySet<string> | undefined, kind: NodeKind) =>
  lacks !== undefined && (kind === "action" || kind === "condition") && lacks.has("SUCCESS") && lacks.has("FAILURE") && (kind === "condition" || lacks.has("RUNNING"));

/** What pictures mark of what was not reached. */
export function marks(not_reached: readonly NotReached[]): Never {
  const nodes = new Map<string, Set<string>>();
  const node_lines = new Map<string, Set<string>>();
  const parts = new Set<string>();
  for (const { kind, of, what, file, line } of not_reached) {
    if (kind === "nodes") {
      const lacks = nodes.get(of) ?? new Set<string>();
      lacks.add(what);
      nodes.set(of, lacks);
      node_lines.set(node_key(file, line), lacks);
    } else if (kind === "states") parts.add(state_key(file, what));
    else if (kind === "transitions") parts.add(transition_key(file, line));
  }
  return { nodes, node_lines, parts };
}

export function show_marks(reached: Reached | null): void {
  useReached.setState(reached ? { never: marks(reached.not_reached) } : { never: kNothing, sought: null });
}

/** What lacks several things of one kind, as one line: statuses of a node, both ways of a guard. */
export interface Line {
  first: NotReached;
  what: string;
  lacks: string[];
}

export function lines_of(not_reached: readonly NotReached[], kind: ReachedKind): Line[] {
  const lines = new Map<string, Line>();
  for (const one of not_reached) {
    if (one.kind !== kind) continue;
    const guard = /^(.*): (true|false)$/.exec(one.what);
    const joins = kind === "nodes" || kind === "methods";
    const [what, lack] = joins ? ["", one.what] : kind === "guards" && guard ? [guard[1]!, guard[2]!] : [one.what, ""];
    const key = `${one.of}|${what}|${one.line}`;
    const line = lines.get(key) ?? { first: one, what, lacks: [] };
    if (lack !== "") line.lacks.push(lack);
    lines.set(key, line);
  }
  return [...lines.values()];
}
