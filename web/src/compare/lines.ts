/** A line of two texts: in both, or in one of them; numbers count from 1. */
export interface ComparedLine {
  text: string;
  before: number | null;
  after: number | null;
}

/** Pairs of lines that are looked at; beyond, what is between the first and the last difference counts as replaced. */
const kPairsMax = 4_000_000;

/** The lines of two texts in one list, as few as possible in one of them only. */
export function compare_lines(before: string, after: string): ComparedLine[] {
  // The end of the last line begins none, unless just one of them lacks it.
  const ended = [before, after].every((text) => text === "" || text.endsWith("\n"));
  const lines_of = (text: string) => (text === "" ? [] : (ended ? text.slice(0, -1) : text).split("\n"));
  const [a, b] = [lines_of(before), lines_of(after)];
  let head = 0;
  while (head < a.length && head < b.length && a[head] === b[head]) head += 1;
  let tail = 0;
  while (tail < a.length - head && tail < b.length - head && a[a.length - 1 - tail] === b[b.length - 1 - tail]) tail += 1;
  const lines: ComparedLine[] = a.slice(0, head).map((text, i) => ({ text, before: i + 1, after: i + 1 }));
  const [rows, columns] = [a.length - head - tail, b.length - head - tail];
  // The longest common subsequence of what is behind each pair of places.
  const common = rows * columns <= kPairsMax ? new Uint32Array((rows + 1) * (columns + 1)) : null;
  const of = (i: number, j: number) => common?.[i * (columns + 1) + j] ?? 0;
  if (common) {
    for (let i = rows - 1; i >= 0; i -= 1) {
      for (let j = columns - 1; j >= 0; j -= 1) common[i * (columns + 1) + j] = a[head + i] === b[head + j] ? of(i + 1, j + 1) + 1 : Math.max(of(i + 1, j), of(i, j + 1));
    }
  }
  let [i, j] = [0, 0];
  while (i < rows || j < columns) {
    if (common && i < rows && j < columns && a[head + i] === b[head + j]) {
      lines.push({ text: a[head + i]!, before: head + i + 1, after: head + j + 1 });
      i += 1;
      j += 1;
    } else if (i < rows && (j === columns || of(i + 1, j) >= of(i, j + 1))) {
      lines.push({ text: a[head + i]!, before: head + i + 1, after: null });
      i += 1;
    } else {
      lines.push({ text: b[head + j]!, before: null, after: head + j + 1 });
      j += 1;
    }
  }
  for (let t = tail; t > 0; t -= 1) lines.push({ text: a[a.length - t]!, before: a.length - t + 1, after: b.length - t + 1 });
  return lines;
}
