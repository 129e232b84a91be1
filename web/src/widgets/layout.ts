import { create } from "zustand";

import { kDefaultLayout, parse_layout, type Layout, type PanelId } from "./arrangement";

const kStored = "sentree.layout";

export const useLayout = create<Layout>()(() => parse_layout(localStorage.getItem(kStored)));
useLayout.subscribe((layout) => localStorage.setItem(kStored, JSON.stringify(layout)));

export function toggle_collapsed(id: PanelId): void {
  useLayout.setState(({ collapsed, maximised }) => ({
    collapsed: collapsed.includes(id) ? collapsed.filter((other) => other !== id) : [...collapsed, id],
    maximised: maximised === id ? null : maximised,
  }));
}

export function toggle_maximised(id: PanelId): void {
  useLayout.setState(({ collapsed, maximised }) => ({
    collapsed: collapsed.filter((other) => other !== id),
    maximised: maximised === id ? null : id,
  }));
}

/** Shows the panel and gives it the focus. */
export function go_to_panel(id: PanelId): void {
  useLayout.setState(({ collapsed, maximised }) => ({
    collapsed: collapsed.filter((other) => other !== id),
    maximised: maximised === null || maximised === id ? maximised : null,
  }));
  requestAnimationFrame(() => document.getElementById(`panel-${id}`)?.focus());
}

export function reset_layout(): void {
  useLayout.setState(kDefaultLayout);
}
