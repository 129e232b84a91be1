import { useSyncExternalStore } from "react";
import { create } from "zustand";

import { kDefaultLayout, kNarrow_px, kSides, parse_layout, type Layout, type PanelId, type SideId } from "./arrangement";

const kStored = "sentree.layout";

export const useLayout = create<Layout>()(() => parse_layout(localStorage.getItem(kStored)));
useLayout.subscribe((layout) => localStorage.setItem(kStored, JSON.stringify(layout)));

/** What is open over the page for a moment; not kept. `side`: the column where it is a rail. */
export const useDrawers = create<{ side: boolean; steer: string | null }>()(() => ({ side: false, steer: null }));

export function toggle_maximised(id: PanelId): void {
  useLayout.setState(({ maximised }) => ({ maximised: maximised === id ? null : id }));
}

export function show_side(side: SideId): void {
  useLayout.setState({ side });
  useDrawers.setState({ side: true });
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
