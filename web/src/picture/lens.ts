/** Of a node's name in a drawing. */
const kName_px = 13;
/** On the screen at least: of the chosen node's name, of those around it, and of all others where that is possible. */
const kChosen_px = 11.5;
const kNear_px = 11.1;
const kFar_px = 10.2;
/** All names are enlarged so far: then they still fit their nodes, more or less. */
const kFar = 1.45;
/** Of the lines below a name in a drawing, and on the screen at least: where they would be smaller they are left out. */
const kDetail_px = 11;
const kFarDetail_px = 10.1;

/** What is chosen can be read, and what is around it, however small the rest is. */
export function set_lens(group: SVGGElement | null, scale: number): void {
  const enlarged = (px: number, drawn_px = kName_px) => Math.max(1, px / (drawn_px * scale));
  group?.style.setProperty("--lens", String(enlarged(kChosen_px)));
  group?.style.setProperty("--near-lens", String(enlarged(kNear_px)));
  const far = enlarged(kFar_px);
  group?.style.setProperty("--far-lens", far <= kFar ? String(far) : "1");
  const detail = enlarged(kFarDetail_px, kDetail_px);
  group?.style.setProperty("--detail-lens", detail <= kFar ? String(detail) : "0");
}

/** Whether a node is the parent, a child or a sibling of the chosen one; -1 and null: no parent. */
export function is_near(node: number, parent: number | null, chosen: number | null, chosen_parent: number | null): boolean {
  if (chosen === null || node === chosen) return false;
  const has_parent = parent !== null && parent >= 0;
  return node === chosen_parent || (has_parent && (parent === chosen || parent === chosen_parent));
}
