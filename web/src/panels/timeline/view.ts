import { clock_text, kSecond_ns } from "../../draw/format";
import type { Time } from "../../protocol/types";

/** The piece of run time that the timeline shows. */
export interface View {
  from: Time;
  to: Time;
}

export const kSpanMin_ns = 1e6;
/** Room to the right of the newest, as a part of what is shown. */
const kMargin = 0.03;

export const span_of = (view: View): Time => view.to - view.from;
export const x_of = (view: View, time: Time, width: number): number => ((time - view.from) / span_of(view)) * width;
export const time_at = (view: View, x: number, width: number): Time => view.from + (x / width) * span_of(view);

/** Within what is known, with a margin; never narrower than kSpanMin_ns nor wider than everything. */
export function clamp(view: View, begin: Time, end: Time): View {
  const whole = Math.max(end - begin, kSecond_ns) * (1 + 2 * kMargin);
  const span = Math.min(Math.max(span_of(view), kSpanMin_ns), whole);
  const lowest = begin - span * kMargin;
  const highest = Math.max(lowest + span, end + span * kMargin);
  const from = Math.min(Math.max(view.from, lowest), highest - span);
  return { from, to: from + span };
}

/** Everything. */
export function fit(begin: Time, end: Time): View {
  const span = Math.max(end - begin, kSecond_ns);
  return { from: begin - span * kMargin, to: begin + span * (1 + kMargin) };
}

/** The newest `span`. */
export function newest(span: Time, begin: Time, end: Time): View {
  const from = Math.max(begin, end - span * (1 - kMargin));
  return { from, to: from + span };
}

/** Keeps `at` where it is; a factor below 1 shows less. */
export function zoom(view: View, factor: number, at: Time): View {
  const span = Math.max(span_of(view) * factor, kSpanMin_ns);
  const part = (at - view.from) / span_of(view);
  const from = at - part * span;
  return { from, to: from + span };
}

export function pan(view: View, by: Time): View {
  return { from: view.from + by, to: view.to + by };
}

/** Moves only as far as needed for `time` to be inside, away from the borders. */
export function keep_in_view(view: View, time: Time): View {
  const span = span_of(view);
  if (time > view.to - span * 0.02) return pan(view, time - (view.from + span * 0.8));
  if (time < view.from + span * 0.02) return pan(view, time - (view.from + span * 0.2));
  return view;
}

/** Lanes are asked for this much beyond what is shown on each side, so that panning has something to show. */
export const kBeyond = 0.5;

/** What is asked for when `view` is shown. */
export function around(view: View, begin: Time): View {
  const beyond = span_of(view) * kBeyond;
  return { from: Math.round(Math.max(begin, view.from - beyond)), to: Math.round(view.to + beyond) };
}

/** Whether what was asked for holds all of `view` that there is, about as fine as it is shown; nothing is before the run, nor after it. */
export function covers(asked: View, view: View, begin: Time, end: Time): boolean {
  const has_all = Math.max(view.from, begin) >= asked.from && (view.to <= asked.to || asked.to > end);
  return has_all && span_of(asked) < span_of(view) * 3 && span_of(asked) > span_of(view) * 0.9;
}

const kSteps_s = [0.0001, 0.0002, 0.0005, 0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 30, 60, 120, 300, 600, 1200, 1800, 3600, 7200, 14400];

/** Round times at least `room` pixels apart. */
export function ticks(view: View, width: number, room = 90): { time: Time; text: string }[] {
  const step_s = kSteps_s.find((step) => ((step * kSecond_ns) / span_of(view)) * width >= room) ?? 28800;
  const step = step_s * kSecond_ns;
  const decimals = Math.max(0, Math.ceil(-Math.log10(step_s) - 1e-9));
  const found = [];
  for (let i = Math.ceil(view.from / step); i * step <= view.to; i++) found.push({ time: i * step, text: clock_text(i * step, decimals) });
  return found;
}
