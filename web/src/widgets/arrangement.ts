export type PanelId = "map" | "mission" | "charts" | "monitors" | "messages" | "reached" | "plot" | "timeline" | "steer";
/** Panels that stand where one wants them: as tabs in the column at the side, or beside the timeline, or nowhere. */
export const kSides = ["monitors", "messages", "reached", "plot"] as const;
export type SideId = (typeof kSides)[number];
export const kPlaces = ["side", "below", "closed"] as const;
export type Place = (typeof kPlaces)[number];

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
  places: Readonly<Record<SideId, Place>>;
  /** The tab that is shown in the column, and beside the timeline. */
  side: SideId;
  below: SideId;
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
  places: { monitors: "side", messages: "side", reached: "side", plot: "closed" },
  side: "monitors",
  below: "plot",
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
    const placed = typeof stored.places === "object" && kSides.every((id) => kPlaces.includes(stored.places[id]));
    if (!sane || !placed || !kSides.includes(stored.side) || !kSides.includes(stored.below) || typeof stored.charts_open !== "boolean") return kDefaultLayout;
    const { mission, chart, side_px, timeline_px, places, side, below, charts_open } = stored;
    return { mission, chart, side_px, timeline_px, places, side, below, charts_open, maximised: null };
  } catch {
    return kDefaultLayout;
  }
}

/** The panels that are tabs in a place, and which of them is shown; null: there is none. */
export function tabs_in({ places, side, below }: Layout, place: "side" | "below"): { tabs: readonly SideId[]; shown: SideId | null } {
  const tabs = kSides.filter((id) => places[id] === place);
  const wanted = place === "side" ? side : below;
  return { tabs, shown: tabs.includes(wanted) ? wanted : (tabs[0] ?? null) };
}

/** The layout with a panel in another place, and shown there. */
export function placed(layout: Layout, id: SideId, place: Place): Layout {
  return { ...layout, places: { ...layout.places, [id]: place }, ...(place === "closed" ? {} : { [place]: id }) };
}

/** Arrangements that were saved by name; what is damaged is left out. */
export function parse_arrangements(text: string | null): Record<string, Layout> {
  try {
    const stored = JSON.parse(text ?? "{}") as Record<string, unknown>;
    const read = Object.entries(stored).map(([name, layout]) => [name, parse_layout(JSON.stringify(layout))] as const);
    return Object.fromEntries(read.filter(([, layout]) => layout !== kDefaultLayout));
  } catch {
    return {};
  }
}

/** A share after its border moved by `pixels` of `whole`; each side keeps something. */
export function move_share(share: number, pixels: number, whole: number): number {
  return Math.min(Math.max(share + pixels / Math.max(whole, 1), kShareMin), 1 - kShareMin);
}

/** Sizes that nobody chose: the stage keeps three fifths of the window, with a violation's strip above it. */
export function default_sizes(window: { width: number; height: number }, below = false): { side_px: number; timeline_px: number } {
  const within = (value: number, min: number, max: number) => Math.round(Math.min(Math.max(value, min), max));
  if (below) return { ...default_sizes(window), timeline_px: within(window.height * 0.26, 180, 320) };
  return { side_px: within(window.width * 0.155, kSideMin_px, 380), timeline_px: within(window.height * (window.width < kNarrow_px ? 0.18 : 0.16), 96, 220) };
}

/** What of a panel's height is not its picture: its bars. */
const kBars_px = 78;

/** How much larger the other way must show the picture before everything moves: a strip above the stage is not enough. */
const kWorthIt = 1.2;

/** Whether the mission stands above map and chart, rather than beside them: whichever shows its picture larger. `before`: as it is now. */
export function is_stacked(stage: { width: number; height: number }, picture: { width: number; height: number }, share: number, before?: boolean): boolean {
  const scale = (width: number, height: number) => Math.min(width / Math.max(picture.width, 1), Math.max(height - kBars_px, 1) / Math.max(picture.height, 1));
  const stays = before === undefined ? 1 : before ? kWorthIt : 1 / kWorthIt;
  return scale(stage.width, stage.height * share) * stays >= scale(stage.width * share, stage.height);
}
