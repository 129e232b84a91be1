import type { Lane, Mark, Time } from "../../protocol/types";
import { x_of, type View } from "./view";

/** Heights of lanes, and what is between them and between kinds of them. */
export interface Rows {
  state: number;
  value: number;
  gap: number;
  group: number;
}
export const kRows: Rows = { state: 20, value: 40, gap: 2, group: 8 };
/** Where the timeline is low. */
export const kLowRows: Rows = { state: 15, value: 30, gap: 0, group: 2 };

const kOrder: Record<Lane["kind"], number> = { mission: 0, monitor: 2, leaf: 3, skill: 4, value: 5 };
/** The lane of all that is at work stands below the mission's. */
const order = (lane: Lane): number => (lane.id === kWork ? 1 : kOrder[lane.kind]);
export const kWork = "work";

/** A lane with its place in the whole list of lanes. */
export interface Placed {
  lane: Lane;
  top: number;
  height: number;
}

const kIdleLabels = new Set(["", "IDLE", "idle", "not running"]);

/** True if nothing happens in the lane within what was asked for. */
export function is_idle(lane: Lane): boolean {
  if (lane.kind === "mission" || lane.kind === "value") return false;
  const spans = lane.spans ?? [];
  if (lane.kind === "monitor") return spans.length === 0;
  return spans.every(([, , label]) => kIdleLabels.has(label));
}

export function shown_label(label: string): boolean {
  return !kIdleLabels.has(label);
}

/**
 * Spans of the same label with less than `gap` between them become one. Conditions under reactive nodes are idle between
 * ticks; seen from far away that is no news, and from near the gaps are there.
 */
export function merge_close(lane: Lane, gap: Time): Lane {
  if (!lane.spans || lane.kind === "monitor") return lane;
  const spans: [Time, Time, string][] = [];
  for (const [from, to, label] of lane.spans) {
    const last = spans.at(-1);
    if (last && last[2] === label && from - last[1] < gap) last[1] = to;
    else spans.push([from, to, label]);
  }
  return { ...lane, spans };
}

/** Which leaf is at work, of all in one lane; of several at a time the one that began last. */
export function at_work(lanes: readonly Lane[]): Lane | null {
  const begun = lanes
    .filter(({ kind }) => kind === "leaf")
    .flatMap(({ name, spans }) => (spans ?? []).filter(([, , label]) => label === "RUNNING").map(([from, to]): [Time, Time, string] => [from, to, name]))
    .sort((a, b) => a[0] - b[0]);
  if (begun.length === 0) return null;
  // What is still at work when a later one has ended is at work again.
  const spans: [Time, Time, string][] = [];
  const open: [Time, Time, string][] = [];
  const show = (from: Time, to: Time, label: string) => {
    const last = spans.at(-1);
    if (last && last[2] === label && last[1] === from) last[1] = to;
    else if (to > from) spans.push([from, to, label]);
  };
  const pass = (until: Time) => {
    for (let top = open.at(-1); top; top = open.at(-1)) {
      const to = Math.min(top[1], until);
      show(Math.max(top[0], spans.at(-1)?.[1] ?? top[0]), to, top[2]);
      if (top[1] > until) return;
      open.pop();
    }
  };
  for (const span of begun) {
    pass(span[0]);
    open.push(span);
  }
  pass(Infinity);
  return { id: kWork, kind: "skill", name: "at work", spans };
}

/** From top to bottom: mission, what is at work, monitors (those that are violated first), leaves, skills, values; within a kind as the program lists them. */
export function place(lanes: readonly Lane[], hide_idle: boolean, rows: Rows = kRows, violated: ReadonlySet<string> = new Set()): { placed: Placed[]; height: number } {
  const late = (lane: Lane) => (lane.kind === "monitor" && !violated.has(lane.name) ? 1 : 0);
  const sorted = lanes
    .filter((lane) => !hide_idle || !is_idle(lane))
    .map((lane, i) => ({ lane, i }))
    .sort((a, b) => order(a.lane) - order(b.lane) || late(a.lane) - late(b.lane) || a.i - b.i);
  const placed: Placed[] = [];
  let top = rows.gap;
  let kind: Lane["kind"] | null = null;
  for (const { lane } of sorted) {
    if (kind !== null && kind !== lane.kind && lane.id !== kWork) top += rows.group;
    kind = lane.kind;
    const height = lane.kind === "value" ? rows.value : rows.state;
    placed.push({ lane, top, height });
    top += height + rows.gap;
  }
  return { placed, height: top + rows.gap };
}

export function lane_at(placed: readonly Placed[], y: number): Placed | undefined {
  return placed.find(({ top, height }) => y >= top && y < top + height);
}

export function span_at(lane: Lane, time: Time): readonly [Time, Time, string] | undefined {
  return lane.spans?.find(([from, to]) => time >= from && time < to);
}

/** The value at `time`: the last one before it. */
export function value_at(lane: Lane, time: Time): number | undefined {
  return lane.points?.findLast(([at]) => at <= time)?.[1] ?? lane.points?.[0]?.[1];
}

/** Where the text of a span goes: at its beginning, or at the left border while that is out of view; null: no room. */
export function label_place(x_from: number, x_to: number, width: number, text_width: number): number | null {
  const kPad = 5;
  const left = Math.max(x_from, 0) + kPad;
  const right = Math.min(x_to, width) - kPad;
  return right - left >= text_width ? left : null;
}

/** The newest end of the spans: those that end there go on. */
export function known_until(lanes: readonly Lane[]): Time {
  let last = -Infinity;
  for (const lane of lanes) {
    const end = lane.spans?.at(-1)?.[1];
    if (end !== undefined && end > last) last = end;
  }
  return last;
}

const kUnit = /\s*\[([^\]]+)\]$/;

/** The name without its unit: "battery of robot [%]" has one. */
export function lane_title(lane: Lane): string {
  return lane.name.replace(kUnit, "");
}

/** Range of a value lane: 0 to 100 for percentages, else what occurs. */
export function value_range(lane: Lane): [number, number] {
  const unit = kUnit.exec(lane.name)?.[1];
  if (unit === "%") return [0, 100];
  let low = Infinity;
  let high = -Infinity;
  for (const [, value] of lane.points ?? []) {
    low = Math.min(low, value);
    high = Math.max(high, value);
  }
  if (low > high) return [0, 1];
  return high > low ? [low, high] : [low - 1, low + 1];
}

export function value_text(lane: Lane, value: number): string {
  const unit = kUnit.exec(lane.name)?.[1];
  return `${unit === "%" ? value.toFixed(1) : Number(value.toPrecision(4))}${unit ? ` ${unit}` : ""}`;
}

/** How far from a mark, in pixels, it is still meant. */
const kReach_px = 7;

export function mark_at<Found extends Pick<Mark, "time">>(marks: readonly Found[], view: View, x: number, width: number): Found | undefined {
  let best: Found | undefined;
  let distance = kReach_px;
  for (const mark of marks) {
    const away = Math.abs(x_of(view, mark.time, width) - x);
    if (away <= distance) {
      best = mark;
      distance = away;
    }
  }
  return best;
}
