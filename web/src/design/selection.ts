import type { OutlineNode, OutlineTree, Rect } from "../protocol/types";

/** But those that are inside of others of them: they go along. In the order of the text. */
export function outermost(tree: OutlineTree, nodes: readonly OutlineNode[]): OutlineNode[] {
  const chosen = new Set(nodes);
  const inside: boolean[] = [];
  return tree.nodes.filter((node, i) => {
    const above = tree.nodes[node.parent];
    inside[i] = above !== undefined && (chosen.has(above) || inside[node.parent]!);
    return chosen.has(node) && !inside[i];
  });
}

/** Where the first and the last of them stand among the children of their node; null: they have several. */
export function span_of(tree: OutlineTree, nodes: readonly OutlineNode[]): { parent: number; first: number; last: number } | null {
  const [one] = nodes;
  if (!one || nodes.some(({ parent }) => parent !== one.parent)) return null;
  const siblings = tree.nodes.filter(({ parent }) => parent === one.parent);
  const places = nodes.map((node) => siblings.indexOf(node));
  return { parent: tree.nodes[one.parent]?.element ?? tree.element, first: Math.min(...places), last: Math.max(...places) };
}

/** Nodes that lie in a part of the picture as a whole. */
export function nodes_inside({ nodes, layout }: OutlineTree, part: Rect): OutlineNode[] {
  return nodes.filter((_, i) => {
    const { x, y, width, height } = layout.nodes[i]!;
    return x >= part.x && y >= part.y && x + width <= part.x + part.width && y + height <= part.y + part.height;
  });
}
