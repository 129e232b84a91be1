import type { Theme } from "../../widgets/theme";
import type { MapInfo } from "./geometry";

/** Occupancy from which a cell is drawn as a wall. */
export const kOccupied = 65;

type Rgb = readonly [number, number, number];
const kColors: Record<Theme, { wall: Rgb; free: Rgb; unknown: Rgb }> = {
  light: { wall: [55, 62, 71], free: [255, 255, 255], unknown: [225, 229, 234] },
  dark: { wall: [148, 160, 173], free: [18, 24, 32], unknown: [34, 42, 51] },
};

/**
 * Pixels (RGBA) of the floor plan, its first row the map's last. `cells` come row by row from the bottom: 0 free to 100
 * occupied, 255 unknown.
 */
export function plan_pixels(map: Pick<MapInfo, "width" | "height">, cells: Uint8Array, theme: Theme): Uint8ClampedArray<ArrayBuffer> {
  const { wall, free, unknown } = kColors[theme];
  const pixels = new Uint8ClampedArray(map.width * map.height * 4);
  for (let row = 0; row < map.height; ++row) {
    let to = (map.height - 1 - row) * map.width * 4;
    for (let column = 0; column < map.width; ++column, to += 4) {
      const cell = cells[row * map.width + column] ?? 255;
      const color = cell > 100 ? unknown : cell >= kOccupied ? wall : free;
      // Between free and occupied: what the map's maker was not sure of.
      const part = cell > 0 && cell < kOccupied ? (cell / kOccupied) * 0.5 : 0;
      for (let c = 0; c < 3; ++c) pixels[to + c] = color[c]! + part * (wall[c]! - color[c]!);
      pixels[to + 3] = 255;
    }
  }
  return pixels;
}

export function plan_image(map: MapInfo, cells: Uint8Array, theme: Theme): HTMLCanvasElement {
  const canvas = document.createElement("canvas");
  canvas.width = map.width;
  canvas.height = map.height;
  canvas.getContext("2d")?.putImageData(new ImageData(plan_pixels(map, cells, theme), map.width, map.height), 0, 0);
  return canvas;
}
