import { create } from "zustand";

import type { State } from "../../protocol/types";
import { select, type Index } from "../../store/store";
import { useLayout } from "../../widgets/layout";
import { running } from "../mission/tree";

/** Charts that are drawn side by side at once; more are left out until somebody picks. */
export const kTilesMax = 60;

export const useCharts = create<{
  grid: boolean;
  /** The chart of the leaf at work is shown, until somebody picks one. */
  follow: boolean;
  values: boolean;
  /** Charts that somebody picked for the grid; none: all. */
  pinned: readonly string[];
}>()(() => ({ grid: false, follow: true, values: true, pinned: [] }));

/** The chart of the leaf at work: the one shown while its leaf is, else the first; null when none is. */
export function chart_to_follow(index: Index, state: State | null, shown: string | null): string | null {
  if (!state) return null;
  const leaves = running(index.children, state.tree.status).map((id) => index.model.tree.nodes[id]?.leaf ?? null);
  const charts = leaves.filter((leaf) => leaf !== null);
  return charts.find((chart) => chart === shown) ?? charts[0] ?? null;
}

/** Shows it, alone, and no longer that of the leaf at work. */
export function open_chart(id: string): void {
  select({ chart: id });
  useCharts.setState({ grid: false, follow: false });
  useLayout.setState({ charts_open: true });
}
