import type { Point, Size } from "../protocol/types";

/**
 * What pictures that are painted (the map) are painted with: on a canvas, many times a second, or into an SVG
 * document. Coordinates are CSS pixels.
 */
export interface Pen {
  polygon(points: readonly Point[], style: Style): void;
  polyline(points: readonly Point[], style: Style): void;
  /** Separate lines, from each even point to the odd one after it. */
  segments(points: readonly Point[], style: Style): void;
  circle(centre: Point, radius: number, style: Style): void;
  /** Many equal filled discs. */
  dots(centres: readonly Point[], radius: number, style: Style): void;
  text(at: Point, text: string, style: TextStyle): void;
  /** `matrix` takes the image's pixels to the screen, as CanvasRenderingContext2D.transform. */
  image(image: HTMLCanvasElement, matrix: Matrix, smooth: boolean): void;
}

export interface Style {
  fill?: string;
  stroke?: string;
  width?: number;
  dash?: readonly number[];
  alpha?: number;
  fill_alpha?: number;
}
export interface TextStyle {
  fill: string;
  size: number;
  weight?: number;
  italic?: boolean;
  anchor?: "start" | "middle" | "end";
  /** Outline in the ground's colour that keeps the text readable over lines. */
  halo?: string;
}
export type Matrix = readonly [a: number, b: number, c: number, d: number, e: number, f: number];

export const kFontFamily = "'Inter Variable', Inter, 'Segoe UI', 'Helvetica Neue', Arial, 'DejaVu Sans', sans-serif";

export class CanvasPen implements Pen {
  constructor(
    private readonly context: CanvasRenderingContext2D,
    private readonly font_family: string = kFontFamily,
  ) {}

  polygon(points: readonly Point[], style: Style): void {
    this.trace(points);
    this.context.closePath();
    this.finish(style);
  }

  polyline(points: readonly Point[], style: Style): void {
    this.trace(points);
    this.finish(without_fill(style));
  }

  segments(points: readonly Point[], style: Style): void {
    const { context } = this;
    context.beginPath();
    for (let i = 0; i + 1 < points.length; i += 2) {
      context.moveTo(points[i]![0], points[i]![1]);
      context.lineTo(points[i + 1]![0], points[i + 1]![1]);
    }
    this.finish(without_fill(style));
  }

  circle(centre: Point, radius: number, style: Style): void {
    this.context.beginPath();
    this.context.arc(centre[0], centre[1], radius, 0, 2 * Math.PI);
    this.finish(style);
  }

  dots(centres: readonly Point[], radius: number, style: Style): void {
    const { context } = this;
    context.beginPath();
    for (const [x, y] of centres) {
      context.moveTo(x + radius, y);
      context.arc(x, y, radius, 0, 2 * Math.PI);
    }
    this.finish(style);
  }

  text(at: Point, text: string, style: TextStyle): void {
    const { context } = this;
    context.font = `${style.italic ? "italic " : ""}${style.weight ?? 400} ${style.size}px ${this.font_family}`;
    context.textAlign = style.anchor === "middle" ? "center" : (style.anchor ?? "start");
    context.textBaseline = "alphabetic";
    if (style.halo) {
      context.strokeStyle = style.halo;
      context.lineWidth = 3;
      context.lineJoin = "round";
      context.setLineDash([]);
      context.strokeText(text, at[0], at[1]);
    }
    context.fillStyle = style.fill;
    context.fillText(text, at[0], at[1]);
  }

  image(image: HTMLCanvasElement, matrix: Matrix, smooth: boolean): void {
    const { context } = this;
    context.save();
    context.transform(...matrix);
    context.imageSmoothingEnabled = smooth;
    context.drawImage(image, 0, 0);
    context.restore();
  }

  private trace(points: readonly Point[]): void {
    const { context } = this;
    context.beginPath();
    points.forEach(([x, y], i) => (i === 0 ? context.moveTo(x, y) : context.lineTo(x, y)));
  }

  private finish(style: Style): void {
    const { context } = this;
    const alpha = style.alpha ?? 1;
    if (style.fill) {
      context.globalAlpha = alpha * (style.fill_alpha ?? 1);
      context.fillStyle = style.fill;
      context.fill();
    }
    if (style.stroke) {
      context.globalAlpha = alpha;
      context.strokeStyle = style.stroke;
      context.lineWidth = style.width ?? 1;
      context.lineJoin = "round";
      context.lineCap = style.dash ? "butt" : "round";
      context.setLineDash(style.dash ? [...style.dash] : []);
      context.stroke();
    }
    context.globalAlpha = 1;
  }
}

/** Collects the same strokes as an SVG document; attributes only, so that every drawing program reads it. */
export class SvgPen implements Pen {
  private readonly parts: string[] = [];

  polygon(points: readonly Point[], style: Style): void {
    if (points.length > 0) this.path(`M${points.map(pair).join("L")}Z`, style);
  }

  polyline(points: readonly Point[], style: Style): void {
    if (points.length > 0) this.path(`M${points.map(pair).join("L")}`, without_fill(style));
  }

  segments(points: readonly Point[], style: Style): void {
    let data = "";
    for (let i = 0; i + 1 < points.length; i += 2) data += `M${pair(points[i]!)}L${pair(points[i + 1]!)}`;
    if (data) this.path(data, without_fill(style));
  }

  circle(centre: Point, radius: number, style: Style): void {
    this.parts.push(`<circle cx="${number(centre[0])}" cy="${number(centre[1])}" r="${number(radius)}"${attributes(style)}/>`);
  }

  dots(centres: readonly Point[], radius: number, style: Style): void {
    const r = number(radius);
    const disc = ([x, y]: Point) => `M${number(x - radius)} ${number(y)}a${r} ${r} 0 1 0 ${number(2 * radius)} 0a${r} ${r} 0 1 0 ${number(-2 * radius)} 0`;
    if (centres.length > 0) this.path(centres.map(disc).join(""), style);
  }

  text(at: Point, text: string, style: TextStyle): void {
    const anchor = style.anchor && style.anchor !== "start" ? ` text-anchor="${style.anchor}"` : "";
    const weight = style.weight && style.weight !== 400 ? ` font-weight="${style.weight}"` : "";
    const slant = style.italic ? ' font-style="italic"' : "";
    const halo = style.halo ? ` stroke="${escape(style.halo)}" stroke-width="3" stroke-linejoin="round" paint-order="stroke"` : "";
    this.parts.push(
      `<text x="${number(at[0])}" y="${number(at[1])}" fill="${escape(style.fill)}" font-size="${style.size}"${weight}${slant}${anchor}${halo}>${escape(text)}</text>`,
    );
  }

  image(image: HTMLCanvasElement, matrix: Matrix, smooth: boolean): void {
    const rendering = smooth ? "" : ' image-rendering="pixelated"';
    this.parts.push(
      `<image width="${image.width}" height="${image.height}" transform="matrix(${matrix.map((n) => Number(n.toPrecision(9))).join(" ")})"${rendering} href="${image.toDataURL("image/png")}"/>`,
    );
  }

  document(size: Size, title: string, background: string): string {
    return svg_document(size, title, background, this.parts.join("\n"));
  }

  private path(data: string, style: Style): void {
    this.parts.push(`<path d="${data}"${attributes(style)}/>`);
  }
}

export function svg_document(size: Size, title: string, background: string, body: string): string {
  const [width, height] = [number(size.width), number(size.height)];
  return (
    `<svg xmlns="http://www.w3.org/2000/svg" width="${width}" height="${height}" viewBox="0 0 ${width} ${height}" ` +
    `role="img" font-family="${escape(kFontFamily)}">\n<title>${escape(title)}</title>\n` +
    `<rect width="${width}" height="${height}" fill="${escape(background)}"/>\n${body}\n</svg>\n`
  );
}

export function escape(text: string): string {
  const markup: Record<string, string> = { "&": "&amp;", "<": "&lt;", ">": "&gt;", '"': "&quot;" };
  // XML has no way to write these.
  // eslint-disable-next-line no-control-regex
  return text.replace(/[&<>"]/g, (c) => markup[c]!).replace(/[\u0000-\u0008\u000b\u000c\u000e-\u001f\ufffe\uffff]/g, "\ufffd");
}

function without_fill({ fill: _, ...style }: Style): Style {
  return style;
}

function number(value: number): string {
  return String(Math.round(value * 100) / 100 || 0);
}

function pair([x, y]: Point): string {
  return `${number(x)} ${number(y)}`;
}

function attributes(style: Style): string {
  let out = style.fill ? ` fill="${escape(style.fill)}"` : ' fill="none"';
  if (style.fill && style.fill_alpha !== undefined) out += ` fill-opacity="${number(style.fill_alpha)}"`;
  if (style.stroke) {
    out += ` stroke="${escape(style.stroke)}" stroke-width="${number(style.width ?? 1)}" stroke-linejoin="round"`;
    out += style.dash ? ` stroke-dasharray="${style.dash.join(" ")}"` : ' stroke-linecap="round"';
  }
  if (style.alpha !== undefined) out += ` opacity="${number(style.alpha)}"`;
  return out;
}
