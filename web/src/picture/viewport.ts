import type { Point, Rect, Size } from "../protocol/types";

/** Where a picture lies in its panel: screen = scale · picture + (x, y), in CSS pixels with y down. */
export interface Viewport {
  readonly scale: number;
  readonly x: number;
  readonly y: number;
}
export interface Limits {
  min: number;
  max: number;
}

export function to_screen(view: Viewport, point: Point): Point {
  return [view.scale * point[0] + view.x, view.scale * point[1] + view.y];
}

export function to_picture(view: Viewport, point: Point): Point {
  return [(point[0] - view.x) / view.scale, (point[1] - view.y) / view.scale];
}

export function pan(view: Viewport, dx: number, dy: number): Viewport {
  return { scale: view.scale, x: view.x + dx, y: view.y + dy };
}

/** What is under the screen's point `at` stays there. */
export function zoom_at(view: Viewport, at: Point, factor: number, limits: Limits): Viewport {
  const scale = clamp(view.scale * factor, limits.min, limits.max);
  const real = scale / view.scale;
  return { scale, x: at[0] - real * (at[0] - view.x), y: at[1] - real * (at[1] - view.y) };
}

/** Shows all of `box`, centred, with `margin` pixels around it; never enlarged beyond `scale_max`. */
export function fit(box: Rect, size: Size, margin: number, scale_max: number, limits: Limits): Viewport {
  const width = Math.max(size.width - 2 * margin, 1);
  const height = Math.max(size.height - 2 * margin, 1);
  const wanted = Math.min(width / Math.max(box.width, 1e-9), height / Math.max(box.height, 1e-9), scale_max);
  const scale = clamp(wanted, limits.min, limits.max);
  return {
    scale,
    x: size.width / 2 - scale * (box.x + box.width / 2),
    y: size.height / 2 - scale * (box.y + box.height / 2),
  };
}

export function centre_on(view: Viewport, point: Point, size: Size): Viewport {
  return { scale: view.scale, x: size.width / 2 - view.scale * point[0], y: size.height / 2 - view.scale * point[1] };
}

/** The least move after which `box` lies at least `margin` pixels inside; a box that is too large is shown from its start. */
export function reveal(view: Viewport, box: Rect, size: Size, margin: number): Viewport {
  const shift = (from: number, length: number, room: number) => {
    if (length > room - 2 * margin || from < margin) return margin - from;
    const beyond = from + length - (room - margin);
    return beyond > 0 ? -beyond : 0;
  };
  const [left, top] = to_screen(view, [box.x, box.y]);
  return pan(
    view,
    shift(left, view.scale * box.width, size.width),
    shift(top, view.scale * box.height, size.height),
  );
}

/** The nearest view that shows no more ground around `box` than `margin`; a box that has room is centred. */
export function within(view: Viewport, box: Rect, size: Size, margin: number): Viewport {
  const place = (at: number, from: number, length: number, room: number) =>
    length <= room - 2 * margin ? (room - length) / 2 - from : clamp(at, room - margin - length - from, margin - from);
  const { scale, x, y } = view;
  return {
    scale,
    x: place(x, scale * box.x, scale * box.width, size.width),
    y: place(y, scale * box.y, scale * box.height, size.height),
  };
}

/** The view after two fingers moved from `before` to `now`. */
export function pinch(view: Viewport, before: [Point, Point], now: [Point, Point], limits: Limits): Viewport {
  const middle = ([a, b]: [Point, Point]): Point => [(a[0] + b[0]) / 2, (a[1] + b[1]) / 2];
  const apart = ([a, b]: [Point, Point]) => Math.max(Math.hypot(a[0] - b[0], a[1] - b[1]), 1);
  const [from, to] = [middle(before), middle(now)];
  return zoom_at(pan(view, to[0] - from[0], to[1] - from[1]), to, apart(now) / apart(before), limits);
}

/** How much one turn of the wheel enlarges; trackpads send many small turns, mice few large ones. */
export function wheel_factor(delta: number, delta_mode: number, pinching: boolean): number {
  const pixels = delta * (delta_mode === 1 ? 16 : delta_mode === 2 ? 400 : 1);
  return Math.exp(-clamp(pixels, -240, 240) * (pinching ? 0.01 : 0.002));
}

export function clamp(value: number, min: number, max: number): number {
  return Math.min(Math.max(value, min), max);
}
