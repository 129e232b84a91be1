/** Of a node's name in a drawing. */
const kName_px = 13;
/** On the screen at least: of the chosen node's name, and of those around it. */
const kChosen_px = 11.5;
const kNear_px = 10.2;
/** All names are enlarged so far: then they still fit their nodes, more or less. */
const kFar = 1.45;

/** What is chosen can be read, and what is around it, however small the rest is. */
export function set_lens(group: SVGGElement | null, scale: number): void {
  group?.style.setProperty("--lens", String(Math.max(1, kChosen_px / (kName_px * scale))));
  const near = Math.max(1, kNear_px / (kName_px * scale));
  group?.style.setProperty("--near-lens", String(near));
  group?.style.setProperty("--far-lens", near <= kFar ? String(near) : "1");
}

/** Whether a node is the parent, a child or a sibling of the chosen one; -1 and null: no parent. */
export function is_near(node: number, parent: number | null, chosen: number | null, chosen_parent: number | null): boolean {
  if (chosen === null || node === chosen) return false;
  const has_parent = parent !== null && parent >= 0;
  return node === chosen_parent || (has_parent && (parent === chosen || parent === chosen_parent));
}
