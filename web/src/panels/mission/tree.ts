import { kStatuses, type Rect, type TreeNode } from "../../protocol/types";

export const kRunning = kStatuses.indexOf("RUNNING");
export const kHalting = kStatuses.indexOf("HALTING");

/** Nodes that are shown when the children of `collapsed` are hidden, in the order of their ids. */
export function shown(nodes: readonly TreeNode[], collapsed: ReadonlySet<number>): number[] {
  const hidden = new Set<number>();
  // A parent's id is less than its children's.
  for (const { id, parent } of nodes) {
    if (parent >= 0 && (hidden.has(parent) || collapsed.has(parent))) hidden.add(id);
  }
  return nodes.filter(({ id }) => !hidden.has(id)).map(({ id }) => id);
}

/** The nodes around `id`, from its parent to the root. */
export function ancestors(nodes: readonly TreeNode[], id: number): number[] {
  const out: number[] = [];
  for (let at = nodes[id]?.parent ?? -1; at >= 0; at = nodes[at]?.parent ?? -1) out.push(at);
  return out;
}

/** `collapsed` without what hides one of `ids`. */
export function uncover(nodes: readonly TreeNode[], collapsed: ReadonlySet<number>, ids: readonly number[]): Set<number> {
  const next = new Set(collapsed);
  for (const id of ids) for (const ancestor of ancestors(nodes, id)) next.delete(ancestor);
  return next;
}

/** How many nodes `id` hides while it is collapsed. */
export function descendants(children: readonly number[][], id: number): number {
  let count = 0;
  const open = [...(children[id] ?? [])];
  for (let next = open.pop(); next !== undefined; next = open.pop()) {
    count += 1;
    open.push(...(children[next] ?? []));
  }
  return count;
}

/** The node itself, or what hides it: its outermost collapsed ancestor. */
export function visible_for(nodes: readonly TreeNode[], collapsed: ReadonlySet<number>, id: number): number {
  return ancestors(nodes, id).findLast((ancestor) => collapsed.has(ancestor)) ?? id;
}

/** Nodes that match every word of `text` in name, type, path, or a port's name or value; in the tree's order. */
export function search(nodes: readonly TreeNode[], text: string): number[] {
  const words = text.toLowerCase().split(/\s+/).filter(Boolean);
  if (words.length === 0) return [];
  return nodes
    .filter((node) => {
      const ports = node.ports.map((port) => `${port.name}=${port.value}`).join(" ");
      const all = `${node.name} ${node.type} ${node.path} ${ports}`.toLowerCase();
      return words.every((word) => all.includes(word));
    })
    .map(({ id }) => id);
}

/** What the mission is at: RUNNING and HALTING nodes that have no such child. */
export function running(children: readonly number[][], status: readonly number[]): number[] {
  const at_work = (id: number) => status[id] === kRunning || status[id] === kHalting;
  const out: number[] = [];
  status.forEach((_, id) => {
    if (at_work(id) && !(children[id] ?? []).some(at_work)) out.push(id);
  });
  return out;
}

export type Arrow = "ArrowUp" | "ArrowDown" | "ArrowLeft" | "ArrowRight";

/**
 * The node that an arrow key leads to: along the tree's edges and between siblings, whichever way the tree is drawn;
 * beyond the last sibling the nearest node of the same depth. Null: there is none.
 */
export function neighbour(
  rects: ReadonlyMap<number, Rect>,
  parent_of: (id: number) => number,
  from: number,
  arrow: Arrow,
): number | null {
  const start = rects.get(from);
  if (!start) return null;
  const depth = (id: number) => {
    let levels = 0;
    for (let at = parent_of(id); at >= 0; at = parent_of(at)) levels += 1;
    return levels;
  };
  const level = depth(from);
  const along = arrow === "ArrowLeft" || arrow === "ArrowRight" ? 0 : 1;
  const sign = arrow === "ArrowRight" || arrow === "ArrowDown" ? 1 : -1;
  const middle = (rect: Rect) => [rect.x + rect.width / 2, rect.y + rect.height / 2] as const;
  const origin = middle(start);
  let best: number | null = null;
  let best_cost = Infinity;
  for (const [id, rect] of rects) {
    if (id === from) continue;
    const linked = parent_of(id) === from || parent_of(from) === id;
    if (!linked && depth(id) !== level) continue;
    const there = middle(rect);
    const forward = sign * (there[along] - origin[along]);
    if (forward <= 0) continue;
    // Parent and children lie beyond the node's side, nodes of the same depth beside it.
    const beyond = gap(start, rect, along) > 0;
    const beside = gap(start, rect, along === 0 ? 1 : 0) <= 0;
    if (!beyond || (!linked && !beside)) continue;
    const cost = (linked ? 0 : 1e6) + forward + 2 * Math.abs(there[along === 0 ? 1 : 0] - origin[along === 0 ? 1 : 0]);
    if (cost < best_cost) [best, best_cost] = [id, cost];
  }
  return best;
}

// Room between two boxes along an axis; negative where they overlap there.
function gap(a: Rect, b: Rect, along: 0 | 1): number {
  return along === 0 ? Math.max(b.x - a.x - a.width, a.x - b.x - b.width) : Math.max(b.y - a.y - a.height, a.y - b.y - b.height);
}
