import type { OutlineNode, OutlineTree } from "../protocol/types";

type Drawn = OutlineTree["layout"]["nodes"][number];

/** In what a picture shows of them. Each edit brings all nodes anew, most of them only at other bytes: those are not drawn again. */
export function is_same_node(a: OutlineNode, b: OutlineNode): boolean {
  return a === b || (a.element === b.element && a.id === b.id && a.name === b.name && a.kind === b.kind && a.known === b.known);
}

export function is_same_drawn(a: Drawn, b: Drawn): boolean {
  return a === b || (a.x === b.x && a.y === b.y && a.width === b.width && a.height === b.height && a.shape === b.shape && a.symbol === b.symbol && is_same_list(a.title, b.title) && is_same_list(a.lines, b.lines));
}

const is_same_list = (a: readonly string[], b: readonly string[]) => a.length === b.length && a.every((one, i) => one === b[i]);
