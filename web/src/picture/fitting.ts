import type { TreeLayout } from "../protocol/types";

/** How texts of a node are drawn. */
export interface TextLook {
  size_px: number;
  weight: number;
  /** Between letters where it is enlarged, of its size: as styles/mission.css has it. */
  spacing: number;
}
export const kNameText: TextLook = { size_px: 13, weight: 600, spacing: -0.03 };
export const kDetailText: TextLook = { size_px: 11, weight: 400, spacing: -0.065 };

const kFamily = '"Inter Variable", sans-serif';
const widths = new Map<string, number>();
let context: CanvasRenderingContext2D | null | undefined;

/** In a drawing; 0: that cannot be told here. */
function width_of(text: string, { size_px, weight, spacing }: TextLook): number {
  const key = `${weight} ${text}`;
  const known = widths.get(key);
  if (known !== undefined) return known;
  context ??= typeof document === "undefined" ? null : document.createElement("canvas").getContext("2d");
  if (!context) return 0;
  const font = `${weight} ${size_px}px ${kFamily}`;
  context.font = font;
  const width = context.measureText(text).width + spacing * size_px * text.length;
  // Not what another font would take.
  if (document.fonts.check(font)) widths.set(key, width);
  return width;
}

/** Between a text and the outline that it is in. */
const kMargin_px = 1.2;
/** Half the height of its letters, of its size. */
const kHalf = 0.42;
/** So far nothing is enlarged. */
const kUnbound = 9;
/** Halvings of what is between the least and that. */
const kRounds = 10;

/**
 * By how much a line of a node's text may be enlarged, about its middle at `y`, so that it stays inside of the outline.
 * `point`: of a decorator's sides; `side`: of the double lines of a subtree.
 */
export function largest({ y: top, width, height, shape }: TreeLayout["nodes"][number], text: string, look: TextLook, y: number, point: number, side: number, measure = width_of): number {
  const needed = measure(text, look);
  if (needed === 0) return kUnbound;
  const off = Math.abs(y - (top + height / 2));
  const half = look.size_px * kHalf;
  const room = (factor: number) => {
    const above = Math.min((off + half * factor) / (height / 2), 1);
    if (shape === "condition") return width * Math.sqrt(1 - above * above);
    if (shape === "decorator") return width - 2 * point * above;
    return shape === "subtree" ? width - 2 * side : width;
  };
  // The larger it is the less room there is for it.
  let [low, high] = [1, Math.max(1, Math.min((height / 2 - off - kMargin_px) / half, kUnbound))];
  for (let round = 0; round < kRounds; round += 1) {
    const factor = (low + high) / 2;
    if (factor * needed <= room(factor) - 2 * kMargin_px) low = factor;
    else high = factor;
  }
  return low;
}
