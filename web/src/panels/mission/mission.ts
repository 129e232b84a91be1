import { create } from "zustand";

import type { TreeLayout } from "../../protocol/types";
import { node_keys, request, select, useStudio } from "../../store/store";
import { uncover } from "./tree";

/** What the Mission panel shows of the tree. */
export interface Mission {
  collapsed: ReadonlySet<number>;
  /** Ids of the nodes shown, in the order of `layout`; null: the model's own. */
  drawn: { nodes: number[]; layout: TreeLayout } | null;
  found: ReadonlySet<number>;
  follow: boolean;
  ages: boolean;
  inspecting: boolean;
  /** Asks the picture to show a node; counts up, so that the same node can be asked for again. */
  wanted: { node: number; count: number } | null;
}

export const useMission = create<Mission>()(() => ({
  collapsed: new Set(),
  drawn: null,
  found: new Set(),
  follow: false,
  ages: false,
  inspecting: false,
  wanted: null,
}));

let asked = 0;

/** Hides the children of these nodes; the program lays the rest out. */
export async function set_collapsed(collapsed: ReadonlySet<number>): Promise<void> {
  const number = ++asked;
  const drawn = collapsed.size === 0 ? null : await request("layout", { collapsed: [...collapsed] }).catch(() => null);
  if (number !== asked || (collapsed.size > 0 && !drawn)) return;
  useMission.setState({ collapsed, drawn });
}

export function toggle(node: number): void {
  const next = new Set(useMission.getState().collapsed);
  if (!next.delete(node)) next.add(node);
  void set_collapsed(next);
}

/** Leaves the root and its children. */
export function collapse_all(): void {
  const index = useStudio.getState().index;
  if (!index) return;
  const roots = index.model.tree.nodes.filter((node) => node.parent === null).map((node) => node.id);
  const level = roots.flatMap((root) => index.children[root] ?? []);
  void set_collapsed(new Set(level.filter((id) => (index.children[id]?.length ?? 0) > 0)));
}

export function expand_all(): void {
  void set_collapsed(new Set());
}

/** Chooses a node and shows it, whatever hides it. */
export function jump_to(node: number): void {
  const index = useStudio.getState().index;
  if (!index) return;
  const { collapsed, wanted } = useMission.getState();
  const open = uncover(index.model.tree.nodes, collapsed, [node]);
  const show = () => {
    select({ node, ...(index.model.tree.nodes[node]?.leaf ? { chart: index.model.tree.nodes[node].leaf } : {}) });
    useMission.setState({ wanted: { node, count: (wanted?.count ?? 0) + 1 } });
  };
  if (open.size === collapsed.size) show();
  else void set_collapsed(open).then(show);
}

useStudio.subscribe((studio, before) => {
  if (studio.index === before.index) return;
  // Another run has another tree; that of a scenario that runs again may have been edited.
  const keys = node_keys(before.index);
  const collapsed = new Set(studio.hello?.boot === before.hello?.boot ? [...useMission.getState().collapsed].map((id) => keys[id]) : []);
  asked += 1;
  useMission.setState({ collapsed: new Set(), drawn: null, wanted: null });
  const again = collapsed.size === 0 ? [] : node_keys(studio.index).flatMap((key, id) => (collapsed.has(key) ? [id] : []));
  if (again.length > 0) void set_collapsed(new Set(again));
});

/** Shows a leaf's chart in the Charts panel. */
export function open_skill(chart: string, node: number): void {
  select({ node, chart });
  document.dispatchEvent(new CustomEvent("sentree:open-chart"));
}
