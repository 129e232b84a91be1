import { create } from "zustand";

import { kLayers, type Layer } from "./scene";

/** What a press on the map does; null: it pans, and drags robots and obstacles. */
export type Tool = "goal" | "obstacle";

const kStored = "sentree.map.layers";

function stored_layers(): Set<Layer> {
  const hidden = (localStorage.getItem(kStored) ?? "").split(",");
  return new Set(kLayers.filter((layer) => !hidden.includes(layer)));
}

export const useMap = create<{ follow: string | null; tool: Tool | null; layers: ReadonlySet<Layer> }>()(() => ({
  follow: null,
  tool: null,
  layers: stored_layers(),
}));

export function choose_tool(tool: Tool | null): void {
  useMap.setState({ tool });
}

export function toggle_layer(layer: Layer): void {
  const layers = new Set(useMap.getState().layers);
  if (!layers.delete(layer)) layers.add(layer);
  useMap.setState({ layers });
  localStorage.setItem(kStored, kLayers.filter((name) => !layers.has(name)).join());
}
