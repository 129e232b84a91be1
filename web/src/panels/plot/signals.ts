import type { Data, State } from "../../protocol/types";

/** A number of the run over time: `messages`, a name, and what of its data; or a part of the state, and what of it. */
export type Signal = readonly string[];

export const kSignalsMax = 8;

/** Signals that were stored; what is damaged is left out. */
export function parse_signals(text: string | null): Signal[] {
  try {
    const stored: unknown = JSON.parse(text ?? "[]");
    return Array.isArray(stored) ? stored.filter((signal): signal is string[] => Array.isArray(signal) && signal.every((key) => typeof key === "string")).slice(0, kSignalsMax) : [];
  } catch {
    return [];
  }
}

/** What people read and type: the keys, with `/` between them. */
export const title_of = (signal: Signal) => signal.join("/");

/** With one more, at its end; the oldest makes room. */
export function with_signal(signals: readonly Signal[], signal: Signal): readonly Signal[] {
  return signals.some((known) => title_of(known) === title_of(signal)) ? signals : [...signals, signal].slice(-kSignalsMax);
}

/** Numbers and truth values in some data, however deep, at most so many. */
export function numbers_in(data: Data | undefined, before: Signal, found: Signal[], max = 400): void {
  if (found.length >= max || data === undefined || data === null) return;
  if (typeof data === "number" || typeof data === "boolean") found.push(before);
  else if (typeof data === "object") for (const [key, value] of Object.entries(data)) numbers_in(value as Data, [...before, key], found, max);
}

/** Keys of a robot that are long lists of points, and no signals. */
const kPictures = new Set(["scan", "scan_pose", "path", "particles", "goal"]);

/** What can be plotted of what is known at this moment, but for messages. */
export function candidates(state: State | null): Signal[] {
  if (!state) return [];
  const found: Signal[] = [];
  for (const [robot, parts] of Object.entries(state.robots)) {
    for (const [key, value] of Object.entries(parts)) if (!kPictures.has(key)) numbers_in(value as Data, ["robots", robot, key], found);
  }
  for (const [chart, { data }] of Object.entries(state.charts)) numbers_in(data as Data, ["charts", chart, "data"], found);
  numbers_in(state.blackboard as Data, ["blackboard"], found);
  return found;
}

/** Each once. */
export function together(some: readonly Signal[], others: readonly Signal[]): Signal[] {
  return [...new Map([...some, ...others].map((signal) => [title_of(signal), signal])).values()];
}

type Points = readonly (readonly [number, number])[];

/** The value that holds at a time: that of the last point at it or before. */
export function held_at(points: Points, time: number): number | null {
  let from = 0;
  let to = points.length;
  while (from < to) {
    const middle = (from + to) >> 1;
    if (points[middle]![0] <= time) from = middle + 1;
    else to = middle;
  }
  return points[from - 1]?.[1] ?? null;
}

/** One axis of time for several signals: what each holds at every time at which one of them changes. */
export function on_one_axis(signals: readonly Points[]): [number[], ...(number | null)[][]] {
  const times = [...new Set(signals.flatMap((points) => points.map(([time]) => time)))].sort((a, b) => a - b);
  return [
    times,
    ...signals.map((points) => {
      let at = 0;
      return times.map((time) => {
        while (at < points.length && points[at]![0] <= time) at++;
        return points[at - 1]?.[1] ?? null;
      });
    }),
  ];
}

export type Side = "left" | "right";

/** A signal that takes less than this part of its axis looks flat. */
const kFlat = 1 / 8;

/** Of the signal that is the flattest so: the part of its axis that it takes. */
function flattest(ranges: readonly (readonly [number, number] | null)[], sides: readonly Side[]): number {
  let least = 1;
  for (const side of ["left", "right"] as const) {
    const own = ranges.filter((range, i) => range !== null && sides[i] === side) as (readonly [number, number])[];
    const all = Math.max(...own.map(([, most]) => most)) - Math.min(...own.map(([low]) => low));
    // What never changes is flat on any axis.
    for (const [low, most] of own) if (most > low) least = Math.min(least, (most - low) / all);
  }
  return least;
}

/**
 * The axis of each signal: the left one, unless some are so much smaller than others that they would look flat there. As
 * `before`, as long as that will do: axes do not change with every new value.
 */
export function sides_of(signals: readonly Points[], before: readonly Side[]): Side[] {
  const ranges = signals.map((points) => {
    if (points.length === 0) return null;
    let [low, most] = [Infinity, -Infinity];
    for (const [, value] of points) [low, most] = [Math.min(low, value), Math.max(most, value)];
    return [low, most] as const;
  });
  const alone = signals.map((): Side => "left");
  const all_left = flattest(ranges, alone);
  if (before.length === signals.length && before.includes("right") ? all_left >= 2 * kFlat : all_left >= kFlat) return alone;
  if (before.length === signals.length && before.includes("right") && flattest(ranges, before) >= kFlat) return [...before];
  let best = alone;
  let least = all_left;
  // The first stays on the left; there are few.
  for (let which = 1; which < 1 << Math.max(signals.length - 1, 0); which++) {
    const tried = signals.map((_, i): Side => (i > 0 && (which >> (i - 1)) & 1 ? "right" : "left"));
    const now = flattest(ranges, tried);
    if (now > 2 * least || (best !== alone && now > least)) [best, least] = [tried, now];
  }
  return best;
}
