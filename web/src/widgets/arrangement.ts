export type PanelId = "map" | "mission" | "charts" | "monitors" | "messages" | "reached" | "timeline" | "steer";
/** Panels that share the column at the side. */
export const kSides = ["monitors", "messages", "reached"] as const;
export type SideId = (typeof kSides)[number];

/**
 * The page: the stage (mission above or beside map and chart), a column at its side, the timeline below. Shares are of
 * the stage; sizes in pixels that nobody chose follow the window.
 */
export interface Layout {
  /** What the mission has of the stage. */
  mission: number;
  /** What the chart has of the rest, beside the map. */
  chart: number;
  side_px: number | null;
  timeline_px: number | null;
  side: SideId;
  charts_open: boolean;
  maximised: PanelId | null;
}

export const kTimelineMin_px = 84;
export const kSideMin_px = 200;
export const kShareMin = 0.15;
/** Below this width the side is a rail, and opens over the stage. */
export const kNarrow_px = 1180;

export const kDefaultLayout: Layout = {
  mission: 0.6,
  chart: 0.5,
  side_px: null,
  timeline_px: null,
  side: "monitors",
  charts_open: true,
  maximised: null,
};

/** A stored layout, unless it is of another version of the page: then the default. */
export function parse_layout(text: string | null): Layout {
  if (text === null) return kDefaultLayout;
  try {
    const stored = JSON.parse(text) as Layout;
    const is_share = (value: unknown) => typeof value === "number" && value >= kShareMin && value <= 1 - kShareMin;
    const is_size = (value: unknown) => value === null || (typeof value === "number" && Number.isFinite(value) && value > 0);
    const sane = is_share(stored.mission) && is_share(stored.chart) && is_size(stored.side_px) && is_size(stored.timeline_px);
    if (!sane || !kSides.includes(stored.side) || typeof stored.charts_open !== "boolean") return kDefaultLayout;
    const { mission, chart, side_px, timeline_px, side, charts_open } = stored;
    return { mission, chart, side_px, timeline_px, side, charts_open, maximised: null };
  } catch {
    return kDefaultLayout;
  }
}

/** A share after its border moved by `pixels` of `whole`; each side keeps something. */
export function move_share(share: number, pixels: number, whole: number): number {
  return Math.min(Math.max(share + pixels / Math.max(whole, 1), kShareMin), 1 - kShareMin);
}

/** Sizes that nobody chose: the stage keeps three fifths of the window, with a violation's strip above it. */
export function default_sizes(window: { width: number; height: number }): { side_px: number; timeline_px: number } {
  const within = (value: number, min: number, max: number) => Math.round(Math.min(Math.max(value, min), max));
  return { side_px: within(window.width * 0.168, kSideMin_px, 380), timeline_px: within(window.height * 0.137, 96, 220) };
}

/** What of a panel's height is not its picture: its bars. */
const kBars_px = 78;

/** Whether the mission stands above map and chart, rather than beside them: whichever shows its picture larger. */
export function is_stacked(stage: { width: number; height: number }, picture: { width: number; height: number }, share: number): boolean {
  const scale = (width: number, height: number) => Math.min(width / Math.max(picture.width, 1), Math.max(height - kBars_px, 1) / Math.max(picture.height, 1));
  return scale(stage.width, stage.height * share) >= scale(stage.width * share, stage.height);
}
