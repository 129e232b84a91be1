export type PanelId = "map" | "mission" | "charts" | "monitors" | "messages" | "timeline" | "steer";

/** Sizes are weights within a column or a row; the timeline's height is in pixels. */
export interface Layout {
  columns: { weight: number; panels: { id: PanelId; weight: number }[] }[];
  timeline_px: number;
  collapsed: PanelId[];
  maximised: PanelId | null;
}

export const kTimelineMin_px = 90;
export const kWeightMin = 0.12;

export const kDefaultLayout: Layout = {
  columns: [
    { weight: 0.95, panels: [{ id: "map", weight: 1.1 }, { id: "steer", weight: 0.9 }] },
    { weight: 1.75, panels: [{ id: "mission", weight: 1.15 }, { id: "charts", weight: 0.9 }] },
    { weight: 0.95, panels: [{ id: "monitors", weight: 1 }, { id: "messages", weight: 1 }] },
  ],
  timeline_px: 250,
  collapsed: [],
  maximised: null,
};

/** A stored layout, unless it is of another version of the page: then the default. */
export function parse_layout(text: string | null): Layout {
  if (text === null) return kDefaultLayout;
  try {
    const layout = JSON.parse(text) as Layout;
    const shown = layout.columns.flatMap((column) => column.panels.map((panel) => panel.id)).sort();
    const known = kDefaultLayout.columns.flatMap((column) => column.panels.map((panel) => panel.id)).sort();
    const weights = layout.columns.flatMap((column) => [column.weight, ...column.panels.map((panel) => panel.weight)]);
    const sane = weights.every((weight) => Number.isFinite(weight) && weight > 0) && Number.isFinite(layout.timeline_px);
    if (shown.join() !== known.join() || !sane || !Array.isArray(layout.collapsed)) return kDefaultLayout;
    return { ...layout, maximised: null };
  } catch {
    return kDefaultLayout;
  }
}

/** The weights after the border between `index` and `index + 1` moved by `delta` of the whole. */
export function move_border(weights: readonly number[], index: number, delta: number): number[] {
  const total = weights.reduce((sum, weight) => sum + weight, 0);
  const first = weights[index];
  const second = weights[index + 1];
  if (first === undefined || second === undefined) return [...weights];
  const min = Math.min(kWeightMin * total, (first + second) / 2);
  const moved = Math.min(Math.max(first + delta * total, min), first + second - min);
  return weights.map((weight, i) => (i === index ? moved : i === index + 1 ? first + second - moved : weight));
}
