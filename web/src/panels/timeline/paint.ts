import type { Lane, Mark, Time } from "../../protocol/types";
import type { PastMark } from "./shown";
import { color } from "../../widgets/theme";
import { known_until, label_place, shown_label, value_range, type Placed } from "./lanes";
import { ticks, x_of, type View } from "./view";

export interface Picture {
  view: View;
  /** The moment that the page shows. */
  time: Time;
  /** The newest known. */
  end: Time;
  live: boolean;
  marks: readonly (Mark | PastMark)[];
  /** By monitor: when it was violated first. */
  violated: ReadonlyMap<string, Time>;
  /** Leaves that are conditions. */
  conditions: ReadonlySet<string>;
  hover: Time | null;
}

export const kRuler_px = 40;
/** Where the timeline is low. */
export const kLowRuler_px = 28;
const kFont = '500 11px "Inter Variable", system-ui, sans-serif';

/** Sizes the canvas for the screen's pixels, and gives a context that draws in CSS pixels. */
export function prepare(canvas: HTMLCanvasElement, width: number, height: number): CanvasRenderingContext2D | null {
  const ratio = window.devicePixelRatio || 1;
  const pixels_x = Math.max(1, Math.round(width * ratio));
  const pixels_y = Math.max(1, Math.round(height * ratio));
  if (canvas.width !== pixels_x || canvas.height !== pixels_y) {
    canvas.width = pixels_x;
    canvas.height = pixels_y;
  }
  const context = canvas.getContext("2d");
  context?.setTransform(ratio, 0, 0, ratio, 0, 0);
  context?.clearRect(0, 0, width, height);
  return context;
}

interface Look {
  fill: string;
  line: string;
  text: string;
  hatched: boolean;
}

function look(name: "running" | "success" | "failure" | "quiet" | "alarm", hatched = false): Look {
  return { fill: color(`${name}-fill`), line: color(name), text: color(name), hatched };
}
const plain = (): Look => ({ fill: color("nested"), line: color("line-strong"), text: color("ink"), hatched: false });

function look_of(lane: Lane, from: Time, label: string, violated: ReadonlyMap<string, Time>, quiet_no: boolean): Look {
  if (lane.kind === "monitor") {
    const since = violated.get(lane.name);
    if (label === "violated" || (since !== undefined && from >= since)) return look("alarm", true);
    if (label === "satisfied") return look("success");
    return plain();
  }
  switch (label.toUpperCase()) {
    case "RUNNING":
      return look("running");
    case "SUCCESS":
      return look("success");
    case "FAILURE":
      // A condition's no is an answer like any other.
      return quiet_no ? plain() : look("failure", true);
    case "SKIPPED":
    case "HALTING":
    case "HALTED":
      return look("quiet");
    default:
      return lane.kind === "skill" ? { ...look("running"), text: color("ink") } : plain();
  }
}

/** Failures have stripes: they are told apart without colour. */
function stripe(context: CanvasRenderingContext2D, x: number, y: number, width: number, height: number, line: string): void {
  context.save();
  context.beginPath();
  context.rect(x, y, width, height);
  context.clip();
  context.strokeStyle = line;
  context.globalAlpha = 0.35;
  context.lineWidth = 1;
  context.beginPath();
  const first = Math.floor((x - height) / 6) * 6;
  for (let at = first; at < x + width; at += 6) {
    context.moveTo(at, y + height);
    context.lineTo(at + height, y);
  }
  context.stroke();
  context.restore();
}

function paint_spans(context: CanvasRenderingContext2D, placed: Placed, y: number, width: number, picture: Picture, until: Time): void {
  const { lane, height } = placed;
  for (const [from, to, label] of lane.spans ?? []) {
    if (!shown_label(label)) continue;
    // What went on when the lanes were asked for goes on until now.
    const x_from = x_of(picture.view, from, width);
    const x_to = x_of(picture.view, to >= until ? Math.max(picture.end, to) : to, width);
    if (x_to < 0 || x_from > width) continue;
    const left = Math.max(x_from, -2);
    const right = Math.min(Math.max(x_to, x_from + 1), width + 2);
    const { fill, line, text, hatched } = look_of(lane, from, label, picture.violated, lane.kind === "leaf" && picture.conditions.has(lane.name));
    const wide = right - left;
    if (wide < 3) {
      context.fillStyle = line;
      context.fillRect(left, y + 2, wide, height - 4);
      continue;
    }
    context.fillStyle = fill;
    context.fillRect(left, y + 2, wide - 0.5, height - 4);
    if (hatched) stripe(context, left, y + 2, wide - 0.5, height - 4, line);
    context.fillStyle = line;
    if (x_from >= -2) context.fillRect(left, y + 2, 2, height - 4);
    context.fillRect(left, y + height - 3, wide - 0.5, 1);
    if (wide < 16) continue;
    const at = label_place(x_from, x_to, width, context.measureText(label).width);
    if (at === null) continue;
    context.fillStyle = text;
    context.fillText(label, at, y + height / 2 + 0.5);
  }
}

function paint_values(context: CanvasRenderingContext2D, placed: Placed, y: number, width: number, picture: Picture): void {
  const points = placed.lane.points ?? [];
  if (points.length === 0) return;
  const [low, high] = value_range(placed.lane);
  const inner = placed.height - 8;
  const y_of = (value: number) => y + 4 + inner - ((value - low) / (high - low)) * inner;
  context.strokeStyle = color("line");
  context.lineWidth = 1;
  context.strokeRect(-1, y + 2.5, width + 2, placed.height - 5);
  context.beginPath();
  let last = 0;
  for (const [i, [time, value]] of points.entries()) {
    const x = x_of(picture.view, time, width);
    if (i === 0) context.moveTo(x, y_of(value));
    else {
      context.lineTo(x, last);
      context.lineTo(x, y_of(value));
    }
    last = y_of(value);
  }
  context.lineTo(x_of(picture.view, picture.end, width), last);
  context.strokeStyle = color("accent");
  context.lineWidth = 1.5;
  context.lineJoin = "round";
  context.stroke();
  context.lineTo(x_of(picture.view, picture.end, width), y + 4 + inner);
  context.lineTo(x_of(picture.view, points[0]?.[0] ?? 0, width), y + 4 + inner);
  context.closePath();
  context.globalAlpha = 0.1;
  context.fillStyle = color("accent");
  context.fill();
  context.globalAlpha = 1;
}

function vertical(context: CanvasRenderingContext2D, x: number, height: number, line: string, dash: number[] = [], wide = 1): void {
  context.save();
  context.strokeStyle = line;
  context.lineWidth = wide;
  context.setLineDash(dash);
  context.beginPath();
  context.moveTo(Math.round(x) + 0.5, 0);
  context.lineTo(Math.round(x) + 0.5, height);
  context.stroke();
  context.restore();
}

function paint_moment(context: CanvasRenderingContext2D, width: number, height: number, picture: Picture): void {
  const { view } = picture;
  if (picture.hover !== null) vertical(context, x_of(view, picture.hover, width), height, color("line-strong"));
  for (const mark of picture.marks) {
    if (mark.kind === "violation") vertical(context, x_of(view, mark.time, width), height, color("alarm"), [3, 3]);
    if (mark.kind === "gap") paint_gap(context, x_of(view, mark.from ?? mark.time, width), x_of(view, mark.time, width), height);
  }
  // What has not happened yet is no white space like any other.
  const x_end = x_of(view, picture.end, width);
  if (x_end < width) {
    context.fillStyle = color("ground");
    context.globalAlpha = 0.5;
    context.fillRect(Math.max(x_end, 0), 0, width - Math.max(x_end, 0), height);
    context.globalAlpha = 1;
  }
  vertical(context, x_of(view, picture.time, width), height, color(picture.live ? "accent" : "past"), [], 2);
}

/** Nobody was there: what the lanes show in between is what they last showed. */
function paint_gap(context: CanvasRenderingContext2D, from: number, to: number, height: number): void {
  context.save();
  context.fillStyle = color("ground");
  context.globalAlpha = 0.75;
  context.fillRect(from, 0, Math.max(to - from, 3), height);
  context.restore();
  vertical(context, from, height, color("ink"), [2, 2]);
  vertical(context, to, height, color("ink"), [2, 2]);
}

/** The lanes between `scroll` and `scroll + height`. */
export function paint_lanes(canvas: HTMLCanvasElement, size: { width: number; height: number }, placed: readonly Placed[], lanes: readonly Lane[], scroll: number, picture: Picture): void {
  const context = prepare(canvas, size.width, size.height);
  if (!context) return;
  context.font = kFont;
  context.textBaseline = "middle";
  for (const { time } of ticks(picture.view, size.width)) vertical(context, x_of(picture.view, time, size.width), size.height, color("line"));
  const until = known_until(lanes);
  for (const entry of placed) {
    const y = entry.top - scroll;
    if (y > size.height || y + entry.height < 0) continue;
    if (entry.lane.kind === "value") paint_values(context, entry, y, size.width, picture);
    else paint_spans(context, entry, y, size.width, picture, until);
  }
  paint_moment(context, size.width, size.height, picture);
}

/** Each kind of mark has a shape of its own. */
function paint_mark(context: CanvasRenderingContext2D, kind: (Mark | PastMark)["kind"], x: number, y: number): void {
  context.beginPath();
  switch (kind) {
    case "past":
      // As a violation, but hollow: it is of another run.
      context.strokeStyle = color("alarm");
      context.lineWidth = 1.5;
      context.moveTo(x, y - 5);
      context.lineTo(x + 5, y + 4);
      context.lineTo(x - 5, y + 4);
      context.closePath();
      context.stroke();
      return;
    case "violation":
      context.fillStyle = color("alarm");
      context.moveTo(x, y - 6);
      context.lineTo(x + 6, y + 5);
      context.lineTo(x - 6, y + 5);
      break;
    case "injection":
      context.fillStyle = color("quiet");
      context.moveTo(x, y - 5);
      context.lineTo(x + 5, y);
      context.lineTo(x, y + 5);
      context.lineTo(x - 5, y);
      break;
    case "intervention":
      context.fillStyle = color("accent");
      context.rect(x - 4, y - 4, 8, 8);
      break;
    case "gap":
      context.fillStyle = color("ink");
      context.rect(x - 5, y - 6, 3, 11);
      context.rect(x + 1, y - 6, 3, 11);
      break;
    case "veto":
      context.fillStyle = color("past");
      context.arc(x, y, 5, 0, 2 * Math.PI);
      break;
    case "problem":
      context.fillStyle = color("failure");
      context.rect(x - 1.5, y - 6, 3, 8);
      context.rect(x - 1.5, y + 3.5, 3, 3);
      break;
  }
  context.closePath();
  context.fill();
  if (kind === "veto") {
    context.strokeStyle = color("surface");
    context.lineWidth = 2;
    context.beginPath();
    context.moveTo(x - 3, y);
    context.lineTo(x + 3, y);
    context.stroke();
  }
}

/** Ticks with their times, and marks below them. */
export function paint_ruler(canvas: HTMLCanvasElement, width: number, height: number, picture: Picture): void {
  const context = prepare(canvas, width, height);
  const line = height / 2;
  if (!context) return;
  context.font = kFont;
  context.textBaseline = "middle";
  for (const { time, text } of ticks(picture.view, width)) {
    const x = x_of(picture.view, time, width);
    context.fillStyle = color("line-strong");
    context.fillRect(Math.round(x), line - 6, 1, 6);
    context.fillStyle = color("muted");
    if (x + 4 + context.measureText(text).width < width) context.fillText(text, x + 4, line / 2 - 0.5);
  }
  context.fillStyle = color("line");
  context.fillRect(0, line, width, 1);
  paint_moment(context, width, height, { ...picture, marks: [] });
  for (const mark of picture.marks) {
    const x = x_of(picture.view, mark.time, width);
    if (x > -8 && x < width + 8) paint_mark(context, mark.kind, x, 0.75 * height);
  }
  // The handle of the moment shown.
  const x = x_of(picture.view, picture.time, width);
  context.fillStyle = color(picture.live ? "accent" : "past");
  context.beginPath();
  context.moveTo(x - 6, 0);
  context.lineTo(x + 7, 0);
  context.lineTo(x + 0.5, 9);
  context.closePath();
  context.fill();
}
