import { useMemo } from "react";

import type { OutlineTree, TreeNode } from "../protocol/types";
import { useStudio } from "../store/store";
import { useMode } from "./mode";

/** By element of a tree that is edited, the node of a run that it is, by name and kind; none where its tree runs several times. `main` is the run's main tree. */
export function nodes_of_run(tree: OutlineTree, nodes: readonly TreeNode[], main: string): ReadonlyMap<number, number> {
  const key = (name: string, type: string) => `${type} ${name || type}`;
  // By node, the SubTree that it is in; parents come first.
  const instances: (number | null)[] = [];
  for (const { parent } of nodes) instances.push(parent === null ? null : nodes[parent]?.kind === "subtree" ? parent : (instances[parent] ?? null));
  const root = tree.nodes.find(({ parent }) => parent < 0);
  if (!root) return new Map();
  const first = nodes[0];
  const used = nodes.filter(({ kind, type, name }) => kind === "subtree" && (type === tree.id || name === tree.id));
  const is_main = first !== undefined && tree.id === main && key(first.name, first.type) === key(root.name, root.id);
  if (!is_main && used.length !== 1) return new Map();
  const inside = is_main ? null : used[0]!.id;
  const waiting = new Map<string, number[]>();
  for (const node of nodes) {
    if (instances[node.id] !== inside) continue;
    const known = key(node.name, node.type);
    const those = waiting.get(known);
    if (those) those.push(node.id);
    else waiting.set(known, [node.id]);
  }
  for (const those of waiting.values()) those.reverse();
  const found = new Map<number, number>();
  // Both stand in the order of the text.
  for (const { element, name, id } of [...tree.nodes].sort((a, b) => a.from - b.from)) {
    const node = waiting.get(key(name, id))?.pop();
    if (node !== undefined) found.set(element, node);
  }
  return found;
}

const kNone: ReadonlyMap<number, number> = new Map();

/** What a node is in a run, and what it was when it was last ticked, as one number. */
export const status_code = (now: number, last: number): number => now + 8 * last;
export const statuses_of = (code: number): [now: number, last: number] => [code & 7, code >> 3];

/** By element, its `status_code` in the run that goes on, or in the recording on show. */
export function useRunStatuses(tree: OutlineTree): ReadonlyMap<number, number> {
  const recorded = useMode(({ runs }) => runs.on_show !== "");
  // Of the shadow run too, while one looks at a moment of it: beside its end the tree is only what is edited.
  const looked_at = useStudio(({ state }) => state !== null && !state.live);
  const shown = recorded || looked_at;
  const ran = useStudio(({ index }) => index?.model.tree);
  const now = useStudio(({ state }) => (shown ? state?.tree : undefined));
  const of_run = useMemo(() => (shown && ran ? nodes_of_run(tree, ran.nodes, ran.id) : kNone), [shown, tree, ran]);
  return useMemo(() => (now ? new Map([...of_run].map(([element, node]) => [element, status_code(now.status[node] ?? 0, now.last[node] ?? 0)])) : kNone), [of_run, now]);
}
