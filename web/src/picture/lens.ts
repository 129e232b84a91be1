import type { Rect, Size } from "../protocol/types";
import type { Viewport } from "./viewport";

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

/** Names that would be smaller on the screen are left out, but for those of the chosen node and around it. */
const kLeast_px = 3;
/** Of the chosen node's name and of those around it: where they would have to be smaller to stay inside of their nodes, these grow. */
const kInside_px = 11.05;
/** Enlarged is by one of a few factors: each other one would be a style of every text. */
const kSteps = 10;
const kStep = kFar ** (1 / kSteps);

/** What is chosen can be read, and what is around it, however small the rest is; the lines below their names too, where they are asked for. Again where another node is chosen. */
export function set_lens(group: SVGGElement | null, scale: number, lines = false): void {
  if (!group) return;
  const enlarged = (px: number, drawn_px = kName_px) => Math.max(1, px / (drawn_px * scale));
  // Of the few that are concerned alone: what all would inherit is a style of all.
  for (const node of group.querySelectorAll<SVGGElement>(".node:is(.chosen, .near)")) {
    const wanted = enlarged(node.classList.contains("chosen") ? kChosen_px : kNear_px);
    let grown = 1;
    for (const name of node.querySelectorAll<SVGTextElement>(":scope > .name")) {
      const inside = fit_of(name);
      const lens = Math.min(wanted, Math.max(inside, enlarged(kInside_px)));
      name.style.setProperty("--lens", lens.toFixed(3));
      grown = Math.max(grown, lens / inside);
    }
    grow(node, grown);
  }
  if (lines) for (const line of group.querySelectorAll<SVGTextElement>(".node:is(.chosen, .near) > .detail")) line.style.setProperty("--lens", Math.min(enlarged(kNear_px, kDetail_px), fit_of(line)).toFixed(3));
  const far = enlarged(kFar_px);
  all_as(group, "names", "--far-lens", kName_px * scale < kLeast_px ? null : far <= kFar ? far : 1);
  const detail = enlarged(kFarDetail_px, kDetail_px);
  all_as(group, "details", "--detail-lens", detail <= kFar ? detail : null);
}

/** Draws a node's outline larger, about its middle. */
function grow(node: SVGGElement, by: number): void {
  const shape = by > 1 ? node.querySelector<SVGGraphicsElement>(":scope > .shape") : null;
  if (!shape) return void node.style.removeProperty("--grow");
  const { x, y, width, height } = shape.getBBox();
  node.style.setProperty("--grow", by.toFixed(3));
  node.style.setProperty("--middle", `${(x + width / 2).toFixed(2)}px ${(y + height / 2).toFixed(2)}px`);
}

/** By how much a text of a node may be enlarged inside of it; it is drawn with that. */
const fit_of = (text: SVGTextElement) => Number(text.style.getPropertyValue("--fit")) || Infinity;

/** Of larger trees only what is near to the view is drawn. */
const kAll = 400;
/** What is drawn is so many times the view, to either side. */
const kAround = 0.75;
/** Where the view is so much smaller than what is drawn, less is. */
const kTooMuch = 5;

/** Leaves out of a large picture what is far away from the view; whatever is read aloud is there all the same. */
export class InView {
  private region: Rect | null = null;
  private nodes: NodeListOf<SVGGElement> | null = null;

  /** Again where the picture is another one: with `anew`. */
  follow(group: SVGGElement | null, view: Viewport, size: Size, rect_of: (node: SVGGElement) => Rect | undefined, anew = false): void {
    if (!group || size.width === 0) return;
    if (anew || !this.nodes) {
      this.nodes = group.querySelectorAll<SVGGElement>(":scope > .node");
      this.region = null;
    }
    if (this.nodes.length <= kAll) return;
    const [width, height] = [size.width / view.scale, size.height / view.scale];
    const seen: Rect = { x: -view.x / view.scale, y: -view.y / view.scale, width, height };
    const { region } = this;
    if (region && contains(region, seen) && region.width < kTooMuch * width) return;
    const drawn: Rect = { x: seen.x - kAround * width, y: seen.y - kAround * height, width: (1 + 2 * kAround) * width, height: (1 + 2 * kAround) * height };
    this.region = drawn;
    for (const node of this.nodes) {
      const rect = rect_of(node);
      const away = rect !== undefined && (rect.x > drawn.x + drawn.width || rect.x + rect.width < drawn.x || rect.y > drawn.y + drawn.height || rect.y + rect.height < drawn.y);
      if (away !== (node.dataset["away"] !== undefined)) {
        if (away) node.dataset["away"] = "";
        else delete node.dataset["away"];
      }
    }
  }
}

function contains(outer: Rect, inner: Rect): boolean {
  return inner.x >= outer.x && inner.y >= outer.y && inner.x + inner.width <= outer.x + outer.width && inner.y + inner.height <= outer.y + outer.height;
}

/** Texts of a kind as they are drawn, enlarged, or left out (null). */
function all_as(group: SVGGElement, kind: "names" | "details", property: string, enlarged: number | null): void {
  const step = enlarged === null ? null : Math.min(Math.ceil(Math.log(enlarged) / Math.log(kStep)), kSteps);
  const look = step === null ? "none" : step === 0 ? "drawn" : String(step);
  if (group.dataset[kind] === look) return;
  group.dataset[kind] = look;
  if (step !== null && step > 0) group.style.setProperty(property, (kStep ** step).toFixed(3));
  else group.style.removeProperty(property);
}

/** Does something with a group all of which is drawn, and its texts as they are. */
export function without_lens<T>(group: SVGGElement, what: () => T): T {
  const { names, details } = group.dataset;
  const away = group.querySelectorAll<SVGGElement>(":scope > [data-away]");
  delete group.dataset["names"];
  delete group.dataset["details"];
  for (const node of away) delete node.dataset["away"];
  try {
    return what();
  } finally {
    if (names !== undefined) group.dataset["names"] = names;
    if (details !== undefined) group.dataset["details"] = details;
    for (const node of away) node.dataset["away"] = "";
  }
}

/** Whether a node is the parent, a child or a sibling of the chosen one; -1 and null: no parent. */
export function is_near(node: number, parent: number | null, chosen: number | null, chosen_parent: number | null): boolean {
  if (chosen === null || node === chosen) return false;
  const has_parent = parent !== null && parent >= 0;
  return node === chosen_parent || (has_parent && (parent === chosen || parent === chosen_parent));
}
