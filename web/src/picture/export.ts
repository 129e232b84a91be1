import type { Rect, Size } from "../protocol/types";
import { note } from "../store/store";
import { without_lens } from "./lens";
import { svg_document } from "./pen";

/** A picture that a person can save: drawn anew when asked for, as the panel shows it at that moment. */
export interface Picture {
  name: string;
  size: Size;
  svg: string;
}

/** Properties of style sheets that a drawing depends on; in a saved picture they are attributes. */
const kDrawn = [
  "fill",
  "fill-opacity",
  "stroke",
  "stroke-width",
  "stroke-dasharray",
  "stroke-linecap",
  "stroke-linejoin",
  "stroke-opacity",
  "opacity",
  "font-size",
  "font-weight",
  "font-style",
  "text-anchor",
  "paint-order",
] as const;
const kInitial: Partial<Record<(typeof kDrawn)[number], string>> = {
  "fill-opacity": "1",
  "stroke-width": "1px",
  "stroke-dasharray": "none",
  "stroke-linecap": "butt",
  "stroke-linejoin": "miter",
  "stroke-opacity": "1",
  stroke: "none",
  opacity: "1",
  "font-weight": "400",
  "font-style": "normal",
  "text-anchor": "start",
  "paint-order": "normal",
};
const kText = new Set(["font-size", "font-weight", "font-style", "text-anchor", "paint-order"]);
/** Attributes of the page, not of the drawing. */
const kKept = /^(d|x|y|x1|y1|x2|y2|cx|cy|r|rx|ry|width|height|points|transform|text-anchor|fill|stroke|stroke-width)$/;

/**
 * An SVG document of what a group of a shown drawing holds, all of it, whatever part of it the panel shows. Style sheets
 * become attributes and text stays text, so that every drawing program can edit it.
 */
export function svg_of_group(group: SVGGElement, box: Rect, title: string, background: string): string {
  const holder = document.createElementNS("http://www.w3.org/2000/svg", "g");
  without_lens(group, () => {
    for (const child of group.children) copy(child, holder);
  });
  holder.setAttribute("transform", `translate(${-box.x} ${-box.y})`);
  const body = new XMLSerializer().serializeToString(holder).replaceAll(' xmlns="http://www.w3.org/2000/svg"', "");
  return svg_document({ width: box.width, height: box.height }, title, background, body);
}

function copy(source: Element, into: Element): void {
  if (source.getAttribute("data-export") === "no") return;
  const style = getComputedStyle(source);
  if (style.display === "none" || style.visibility === "hidden") return;
  const target = document.createElementNS("http://www.w3.org/2000/svg", source.tagName);
  for (const { name, value } of source.attributes) if (kKept.test(name)) target.setAttribute(name, value);
  const is_text = source.tagName === "text" || source.tagName === "tspan";
  const is_group = source.tagName === "g";
  if (source.tagName !== "title") {
    for (const property of kDrawn) {
      if (is_group && property !== "opacity") continue;
      if (!is_text && kText.has(property)) continue;
      const value = style.getPropertyValue(property);
      if (value && value !== kInitial[property]) target.setAttribute(property, value);
    }
  }
  for (const child of source.childNodes) {
    if (child.nodeType === Node.TEXT_NODE) target.append(child.textContent ?? "");
    else if (child instanceof Element) copy(child, target);
  }
  into.append(target);
}

export const kPngScale = 2;
/** Wider or higher pictures are saved smaller: browsers refuse larger canvases. */
export const kPngSide_max = 8192;

/** Pixels of a PNG per pixel of the picture. */
export function png_scale(size: Size): number {
  return Math.min(kPngScale, kPngSide_max / Math.max(size.width, size.height, 1));
}

async function png_of(picture: Picture): Promise<Blob> {
  const image = new Image();
  const address = URL.createObjectURL(new Blob([picture.svg], { type: "image/svg+xml" }));
  try {
    await new Promise<void>((resolve, reject) => {
      image.onload = () => resolve();
      image.onerror = () => reject(new Error("the browser cannot draw the picture"));
      image.src = address;
    });
    const scale = png_scale(picture.size);
    const canvas = document.createElement("canvas");
    canvas.width = Math.max(1, Math.round(picture.size.width * scale));
    canvas.height = Math.max(1, Math.round(picture.size.height * scale));
    canvas.getContext("2d")?.drawImage(image, 0, 0, canvas.width, canvas.height);
    return await new Promise<Blob>((resolve, reject) =>
      canvas.toBlob((blob) => (blob ? resolve(blob) : reject(new Error("the browser cannot write the picture"))), "image/png"),
    );
  } finally {
    URL.revokeObjectURL(address);
  }
}

/** `recharge-experiment1-GoToKitchen-0m52.300s.svg`: letters, digits and what no file system minds. */
export function file_name(parts: readonly string[], ending: string): string {
  const stem = parts
    .map((part) => part.normalize("NFKD").replace(/[^A-Za-z0-9._-]+/g, "-").replace(/^[-.]+|[-.]+$/g, ""))
    .filter(Boolean)
    .join("-");
  return `${(stem || "picture").slice(0, 120)}.${ending}`;
}

export function download(content: Blob | string, name: string, type = "text/plain"): void {
  const blob = typeof content === "string" ? new Blob([content], { type }) : content;
  const address = URL.createObjectURL(blob);
  const link = document.createElement("a");
  link.href = address;
  link.download = name;
  link.click();
  window.setTimeout(() => URL.revokeObjectURL(address), 10_000);
}

/** Saves the picture as a file of the person's browser; `parts` name the file. */
export async function save_picture(picture: Picture, parts: readonly string[], ending: "svg" | "png"): Promise<void> {
  try {
    const name = file_name([...parts, picture.name], ending);
    download(ending === "svg" ? new Blob([picture.svg], { type: "image/svg+xml" }) : await png_of(picture), name);
    note("info", `Saved ${name}`);
  } catch (error) {
    note("error", `export: ${error instanceof Error ? error.message : String(error)}`);
  }
}
