import { useSyncExternalStore } from "react";
import { create } from "zustand";

import { kDefaultLayout, kNarrow_px, kSides, parse_arrangements, parse_layout, placed, tabs_in, type Layout, type PanelId, type Place, type SideId } from "./arrangement";

const kStored = "sentree.layout";

export const useLayout = create<Layout>()(() => parse_layout(localStorage.getItem(kStored)));
useLayout.subscribe((layout) => localStorage.setItem(kStored, JSON.stringify(layout)));

/** What is open over the page for a moment; not kept. `side`: the column where it is a rail. */
export const useDrawers = create<{ side: boolean; steer: string | null }>()(() => ({ side: false, steer: null }));

export function toggle_maximised(id: PanelId): void {
  useLayout.setState(({ maximised }) => ({ maximised: maximised === id ? null : id }));
}

/** Shows a panel where it stands; one that is closed comes into the column, a plot beside the timeline. */
export function show_side(id: SideId): void {
  const place = useLayout.getState().places[id];
  place_panel(id, place !== "closed" ? place : id === "plot" ? "below" : "side");
}

export function place_panel(id: SideId, place: Place): void {
  useLayout.setState((layout) => placed(layout, id, place));
  if (place === "side") useDrawers.setState({ side: true });
}

/** Whether a panel is the tab that is shown in its place. */
export function is_tab_shown(layout: Layout, id: SideId): boolean {
  const place = layout.places[id];
  return place !== "closed" && tabs_in(layout, place).shown === id;
}

const kArrangements = "sentree.arrangements";

/** Arrangements by the names that they were saved with; `asking`: for the name of the present one. */
export const useArrangements = create<{ saved: Readonly<Record<string, Layout>>; asking: boolean }>()(() => ({ saved: parse_arrangements(localStorage.getItem(kArrangements)), asking: false }));
useArrangements.subscribe(({ saved }) => localStorage.setItem(kArrangements, JSON.stringify(saved)));

export function save_arrangement(name: string): void {
  useArrangements.setState(({ saved }) => ({ saved: { ...saved, [name]: { ...useLayout.getState(), maximised: null } }, asking: false }));
}

export function forget_arrangement(name: string): void {
  useArrangements.setState(({ saved: { [name]: _, ...saved } }) => ({ saved }));
}

/** Shows the panel and gives it the focus. */
export function go_to_panel(id: PanelId): void {
  useLayout.setState(({ maximised }) => ({ maximised: maximised === null || maximised === id ? maximised : null }));
  const side = kSides.find((one) => one === id);
  if (side) show_side(side);
  if (id === "charts") useLayout.setState({ charts_open: true });
  requestAnimationFrame(() => document.getElementById(`panel-${id}`)?.focus());
}

export function reset_layout(): void {
  useLayout.setState(kDefaultLayout);
}

function window_size(): string {
  return `${window.innerWidth} ${window.innerHeight}`;
}

/** The window, as it is now. */
export function useWindow(): { width: number; height: number; narrow: boolean } {
  const size = useSyncExternalStore((changed) => {
    window.addEventListener("resize", changed);
    return () => window.removeEventListener("resize", changed);
  }, window_size);
  const [width = 0, height = 0] = size.split(" ").map(Number);
  return { width, height, narrow: width < kNarrow_px };
}
