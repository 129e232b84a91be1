import { kStatuses, type Rect, type State, type TreeNode } from "../../protocol/types";

export const kRunning = kStatuses.indexOf("RUNNING");
export const kHalting = kStatuses.indexOf("HALTING");

/** Nodes that are shown when the children of `collapsed` are hidden, in the order of their ids. */
export function shown(nodes: readonly TreeNode[], collapsed: ReadonlySet<number>): number[] {
  const hidden = new Set<number>();
  // A parent's id is less than its children's.
  for (const { id, parent } of nodes) {
    if (parent !== null && (hidden.has(parent) || collapsed.has(parent))) hidden.add(id);
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

/** Why the mission ended so, at a moment at which that is known. */
export function reason_at({ time, end, live, run }: Pick<State, "time" | "end" | "live" | "run">): string {
  return live || time >= end || kStatuses[kRunning] !== run.mission ? run.reason : "";
}

export type Arrow = "ArrowUp" | "ArrowDown" | "ArrowLeft" | "ArrowRight";

/** Which way the tree is drawn: down unless some child does not lie below its parent. */
export function drawn_down(rects: ReadonlyMap<number, Rect>, parent_of: (id: number) => number): boolean {
  for (const [id, rect] of rects) {
    const parent = rects.get(parent_of(id));
    if (parent && rect.y < parent.y + parent.height) return false;
  }
  return true;
}

/**
 * The node that an arrow key leads to, whichever way the tree is drawn: along its edges to the parent or the nearest
 * child, across them to the next node of the same depth. Null: there is none.
 */
export function neighbour(
  rects: ReadonlyMap<number, Rect>,
  parent_of: (id: number) => number,
  from: number,
  arrow: Arrow,
): number | null {
  const start = rects.get(from);
  if (!start) return null;
  const horizontal = arrow === "ArrowLeft" || arrow === "ArrowRight";
  const sign = arrow === "ArrowRight" || arrow === "ArrowDown" ? 1 : -1;
  const along_edges = horizontal !== drawn_down(rects, parent_of);
  const middle = (rect: Rect) => (horizontal === along_edges ? rect.y + rect.height / 2 : rect.x + rect.width / 2);
  if (along_edges && sign < 0) return rects.has(parent_of(from)) ? parent_of(from) : null;
  const level = depth(parent_of, from);
  let best: number | null = null;
  let best_distance = Infinity;
  for (const [id, rect] of rects) {
    if (along_edges ? parent_of(id) !== from : id === from || depth(parent_of, id) !== level) continue;
    const offset = middle(rect) - middle(start);
    if (!along_edges && sign * offset <= 0) continue;
    if (Math.abs(offset) < best_distance) [best, best_distance] = [id, Math.abs(offset)];
  }
  return best;
}

function depth(parent_of: (id: number) => number, id: number): number {
  let levels = 0;
  for (let at = parent_of(id); at >= 0; at = parent_of(at)) levels += 1;
  return levels;
}

/** The blackboard that a node sees: that of the innermost SubTree around it which has one. Where several SubTrees have one path, each is called by its number. */
export function scope_of(nodes: readonly TreeNode[], id: number, scopes: readonly string[]): string {
  const around = ancestors(nodes, id).filter((ancestor) => nodes[ancestor]?.kind === "subtree");
  // The name of each behind that of the one around it.
  const names = around.map((ancestor, i) => {
    const path = nodes[ancestor]?.path ?? "";
    const outer = around[i + 1];
    return outer === undefined ? path : path.slice((nodes[outer]?.path.length ?? 0) + 1);
  });
  for (let i = 0; i < around.length; i += 1) {
    const inner = around.slice(i).reverse();
    const found = scopes.find((scope) => {
      let rest = scope;
      const is_it = inner.every((ancestor, k) => {
        const own = names[around.length - 1 - k] ?? "";
        const number = new RegExp(`^[^.]+::${ancestor + 1}(?![^.])`).exec(rest)?.[0];
        const part = number ?? (rest === own || rest.startsWith(`${own}.`) ? own : null);
        if (part === null) return false;
        rest = rest.slice(part.length + 1);
        return true;
      });
      return is_it && rest === "";
    });
    if (found !== undefined) return found;
  }
  return "";
}
