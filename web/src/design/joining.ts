import { splice_between, type Splice } from "./places";

/** Texts with their line ends. */
const lines_of = (text: string) => text.split(/(?<=\n)/);

/** Lines that each text has once, in the order of both: the longest such list, as pairs of their places. */
function anchors(before: readonly string[], after: readonly string[]): [number, number][] {
  const once = (lines: readonly string[]) => {
    const places = new Map<string, number>();
    lines.forEach((line, i) => places.set(line, places.has(line) ? -1 : i));
    return places;
  };
  const there = once(after);
  const pairs = [...once(before)].flatMap(([line, i]): [number, number][] => (i >= 0 && (there.get(line) ?? -1) >= 0 ? [[i, there.get(line)!]] : []));
  // By length less one: the pair that ends a list of that length lowest, and the pair before each.
  const ends: number[] = [];
  const previous: number[] = [];
  pairs.forEach(([, at], i) => {
    let [low, high] = [0, ends.length];
    while (low < high) {
      const middle = (low + high) >> 1;
      if (pairs[ends[middle]!]![1] < at) low = middle + 1;
      else high = middle;
    }
    previous[i] = ends[low - 1] ?? -1;
    ends[low] = i;
  });
  const found: [number, number][] = [];
  for (let i = ends.at(-1) ?? -1; i >= 0; i = previous[i]!) found.push(pairs[i]!);
  return found.reverse();
}

/** The replacements that make `after` of `before`, by place: one between lines that both have. */
export function splices_between(before: string, after: string): Splice[] {
  const whole = splice_between(before, after);
  if (!whole) return [];
  const [a, b] = [lines_of(before), lines_of(after)];
  let head = 0;
  while (head < a.length && head < b.length && a[head] === b[head]) head += 1;
  let tail = 0;
  while (tail < a.length - head && tail < b.length - head && a[a.length - 1 - tail] === b[b.length - 1 - tail]) tail += 1;
  const [middle_a, middle_b] = [a.slice(head, a.length - tail), b.slice(head, b.length - tail)];
  const splices: Splice[] = [];
  let at = a.slice(0, head).join("").length;
  let [i, j] = [0, 0];
  for (const [to_i, to_j] of [...anchors(middle_a, middle_b), [middle_a.length, middle_b.length] as const]) {
    const [old, now] = [middle_a.slice(i, to_i).join(""), middle_b.slice(j, to_j).join("")];
    const splice = splice_between(old, now);
    if (splice) splices.push({ from: at + splice.from, to: at + splice.to, text: splice.text });
    at += old.length + (middle_a[to_i]?.length ?? 0);
    [i, j] = [to_i + 1, to_j + 1];
  }
  return splices;
}

/** `base` with what two have done to it: what either has written is there, what either has taken away is not. */
export function joined(base: string, mine: string, others: string): string {
  const theirs = splices_between(base, others);
  const is_theirs = ({ from, to, text }: Splice) => theirs.some((one) => one.from === from && one.to === to && one.text === text);
  const own = splices_between(base, mine).filter((splice) => !is_theirs(splice));
  let [text, at, gone] = ["", 0, 0];
  // What stands up to `to`, but for what is taken away before `gone`.
  const keep = (to: number) => {
    text += base.slice(Math.max(at, Math.min(gone, to)), to);
    at = to;
  };
  for (const splice of [...theirs, ...own].sort((a, b) => a.from - b.from)) {
    keep(splice.from);
    text += splice.text;
    gone = Math.max(gone, splice.to);
  }
  keep(base.length);
  return text;
}

/** Whether in what has become of `base` is what was done to it for `mine`. */
export function is_in(base: string, mine: string, now: string): boolean {
  const done = splice_between(base, mine);
  return !done || (done.text !== "" && splices_between(base, now).some(({ from, to, text }) => from <= done.to && done.from <= to && text.includes(done.text)));
}
