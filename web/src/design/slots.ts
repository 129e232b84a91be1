import type { OutlineTree, Point } from "../protocol/types";

/** A place for a node in the tree, and the mark between its ends that shows it. */
export interface SlotPlace {
  parent: number;
  index: number;
  a: Point;
  b: Point;
}

const kBeside = 11;
const kHalf = 16;

/** All places between, before, behind and below the nodes of a tree. */
export function slots(tree: OutlineTree): SlotPlace[] {
  const down = tree.direction === "down";
  const found: SlotPlace[] = [];
  const bar = (x: number, y: number, across: boolean): Pick<SlotPlace, "a" | "b"> =>
    across ? { a: [x, y - kHalf], b: [x, y + kHalf] } : { a: [x - kHalf, y], b: [x + kHalf, y] };
  const rect = (i: number) => tree.layout.nodes[i]!;
  const children: number[][] = tree.nodes.map(() => []);
  tree.nodes.forEach(({ parent }, i) => children[parent]?.push(i));
  if (tree.nodes.length === 0) return [{ parent: tree.element, index: 0, a: [14, 30], b: [46, 30] }];
  tree.nodes.forEach((node, i) => {
    const below = children[i]!;
    if (below.length === 0) {
      const { x, y, width, height } = rect(i);
      const mark = down ? bar(x + width / 2, y + height + kBeside, false) : bar(x + width + kBeside, y + height / 2, true);
      found.push({ parent: node.element, index: 0, ...mark });
      return;
    }
    for (let at = 0; at <= below.length; at += 1) {
      const before = at > 0 ? rect(below[at - 1]!) : null;
      const after = at < below.length ? rect(below[at]!) : null;
      const side = before ?? after!;
      // A pair of neighbours may lie far apart: the mark stands beside the first.
      if (down) {
        const x = before && after ? Math.min((before.x + before.width + after.x) / 2, before.x + before.width + 2 * kBeside) : before ? before.x + before.width + kBeside : after!.x - kBeside;
        found.push({ parent: node.element, index: at, ...bar(x, side.y + side.height / 2, true) });
      } else {
        const y = before && after ? Math.min((before.y + before.height + after.y) / 2, before.y + before.height + 2 * kBeside) : before ? before.y + before.height + kBeside : after!.y - kBeside;
        found.push({ parent: node.element, index: at, ...bar(side.x + side.width / 2, y, false) });
      }
    }
  });
  return found;
}

/** Where something that is dropped at a point goes: onto a node means into it, else the nearest place. */
export function near(tree: OutlineTree, [x, y]: Point): SlotPlace | null {
  const on = tree.layout.nodes.findIndex((node) => {
    const [inset_x, inset_y] = [node.width * 0.2, node.height * 0.2];
    return x > node.x + inset_x && x < node.x + node.width - inset_x && y > node.y + inset_y && y < node.y + node.height - inset_y;
  });
  if (on >= 0) {
    const { x: left, y: top, width, height } = tree.layout.nodes[on]!;
    const count = tree.nodes.filter(({ parent }) => parent === on).length;
    return { parent: tree.nodes[on]!.element, index: count, a: [left, top + height + 4], b: [left + width, top + height + 4] };
  }
  let best: SlotPlace | null = null;
  let least = Infinity;
  for (const slot of slots(tree)) {
    const distance = Math.hypot((slot.a[0] + slot.b[0]) / 2 - x, (slot.a[1] + slot.b[1]) / 2 - y);
    if (distance < least) [best, least] = [slot, distance];
  }
  return best;
}

/** Which node takes what is dropped, and where among its children. */
export function slot_words(tree: OutlineTree, { parent, index }: Pick<SlotPlace, "parent" | "index">): string {
  const at = tree.nodes.findIndex(({ element }) => element === parent);
  const called = (node: OutlineTree["nodes"][number]) => node.name || node.id;
  if (at < 0) return `the root of ${tree.id}`;
  const children = tree.nodes.filter((node) => node.parent === at);
  const [before, after] = [children[index - 1], children[index]];
  return `into ${called(tree.nodes[at]!)}${before ? `, after ${called(before)}` : after ? `, before ${called(after)}` : ""}`;
}
