import type { ChartLayout, Rect } from "../../protocol/types";

/** Of a state that holds others: where its name stands. */
const kTitle = 26;

const holds = (a: Rect, b: Rect) => a !== b && a.x <= b.x && a.y <= b.y && a.x + a.width >= b.x + b.width && a.y + a.height >= b.y + b.height;

/** Where a chart's picture has what is read: states, the names of those that hold others, and what transitions say. */
export function read_in({ states, edges }: ChartLayout): Rect[] {
  return [...states.map((state) => (states.some((other) => holds(state, other)) ? { ...state, width: state.width / 2, height: kTitle } : state)), ...edges.map(({ label }) => label)];
}
