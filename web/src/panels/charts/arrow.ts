import type { Point } from "../../protocol/types";

const kHeadLength = 9;
const kHeadWidth = 3.6;

/** The line up to the neck of the arrow's head, and the head; as chart_svg.cpp draws them. */
export function arrow(points: readonly Point[]): { line: Point[]; head: string } | null {
  const tip = points.at(-1);
  if (points.length < 4 || !tip) return null;
  // The direction of arrival: from the nearest point that is not the tip itself.
  const before = points.findLast(([x, y]) => x !== tip[0] || y !== tip[1]) ?? [tip[0], tip[1] - 1];
  const length = Math.hypot(tip[0] - before[0], tip[1] - before[1]);
  const along: Point = [(tip[0] - before[0]) / length, (tip[1] - before[1]) / length];
  const neck: Point = [tip[0] - along[0] * kHeadLength, tip[1] - along[1] * kHeadLength];
  const line = [...points.slice(0, -1), [tip[0] - along[0] * kHeadLength * 0.8, tip[1] - along[1] * kHeadLength * 0.8] as Point];
  const text = (point: Point) => `${round(point[0])} ${round(point[1])}`;
  const left: Point = [neck[0] - along[1] * kHeadWidth, neck[1] + along[0] * kHeadWidth];
  const right: Point = [neck[0] + along[1] * kHeadWidth, neck[1] - along[0] * kHeadWidth];
  return { line, head: `M${text(tip)}L${text(left)}L${text(right)}Z` };
}

function round(value: number): number {
  return Math.round(value * 100) / 100;
}
