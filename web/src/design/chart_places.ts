/** Comments and the like, or a tag with its attributes. */
const kTag = /<!--[^]*?-->|<!\[CDATA\[[^]*?\]\]>|<\?[^]*?\?>|<(\/?)[\w:.-]+(?:"[^"]*"|'[^']*'|[^'">])*?(\/?)>/g;

/** Of elements around places of an XML text, each innermost first: the lines on which their tags begin. */
export function lines_around(text: string, places: readonly number[]): number[][] {
  const sorted = [...places.keys()].sort((a, b) => places[a]! - places[b]!);
  const found: number[][] = places.map(() => []);
  const open: number[] = [];
  let [line, at, next] = [1, 0, 0];
  const tell = (before: number) => {
    for (; next < sorted.length && places[sorted[next]!]! < before; next += 1) found[sorted[next]!] = [...open].reverse();
  };
  for (const tag of text.matchAll(kTag)) {
    const end = tag.index + tag[0].length;
    tell(tag.index);
    for (; at < tag.index; at += 1) if (text[at] === "\n") line += 1;
    if (tag[1] === undefined) continue;
    const begins = tag[1] === "";
    if (begins) open.push(line);
    tell(end);
    if (!begins || tag[2] === "/") open.pop();
  }
  tell(Infinity);
  return found;
}

interface Parts {
  states: readonly { id: string; line: number }[];
  transitions: readonly { line: number }[];
}

/** The line of the innermost transition or state of a chart that is drawn around each place; 0: there is none. */
export function part_lines(chart: Parts, text: string, places: readonly number[]): number[] {
  const drawn = new Set([...chart.states, ...chart.transitions].map(({ line }) => line));
  return lines_around(text, places).map((lines) => lines.find((line) => line > 0 && drawn.has(line)) ?? 0);
}
