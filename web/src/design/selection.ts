import type { ChartFold, EditedChart, EditedState, OutlineNode, OutlineTree, Rect } from "../protocol/types";

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

const lies_in = ({ x, y, width, height }: Rect, part: Rect) => x >= part.x && y >= part.y && x + width <= part.x + part.width && y + height <= part.y + part.height;

/** Nodes that lie in a part of the picture as a whole. */
export function nodes_inside({ nodes, layout }: OutlineTree, part: Rect): OutlineNode[] {
  return nodes.filter((_, i) => lies_in(layout.nodes[i]!, part));
}

/** As `outermost`, of a chart. */
export function outermost_states(chart: EditedChart, chosen: readonly EditedState[]): EditedState[] {
  const ids = new Set(chosen.map(({ id }) => id));
  const by_id = new Map(chart.states.map((state) => [state.id, state] as const));
  const is_inside = ({ inside }: EditedState): boolean => inside !== "" && (ids.has(inside) || is_inside(by_id.get(inside)!));
  return chart.states.filter((state) => ids.has(state.id) && !is_inside(state));
}

/** Ids of the states that lie in a part of what is shown of a chart as a whole. */
export function states_inside(chart: EditedChart, { layout, states }: ChartFold, part: Rect): string[] {
  return states.flatMap((at, i) => (lies_in(layout.states[i]!, part) ? chart.states[at]?.id || [] : []));
}
