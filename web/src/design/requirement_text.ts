/** A definition of a file of requirements: `let level [%] = reply(…)`, `event asked = request(…)`. */
export interface Definition {
  name: string;
  /** Name, parameters and unit as they are written. */
  head: string;
  /** What it stands for, on one line. */
  expression: string;
  /** Where the definition begins, and where its expression stands, in the text. */
  at: number;
  from: number;
  to: number;
}

/** The definitions of a text; one goes on over lines that are indented deeper, and ends before a comment. */
export function definitions_of(text: string): Definition[] {
  const found: Definition[] = [];
  for (const one of text.matchAll(/^([ \t]*)(let|event)[ \t]+([\w.]+)((?:[ \t]*\([^)\n]*\))?(?:[ \t]*\[[^\]\n]*\])?)[ \t]*=[ \t]*/gm)) {
    const from = one.index + one[0].length;
    const indent = one[1]!.length;
    let to = from;
    for (let line = from; ; ) {
      const end = text.indexOf("\n", line) < 0 ? text.length : text.indexOf("\n", line);
      const [said = ""] = text.slice(line, end).split("#");
      to = line + said.trimEnd().length;
      const next = text.slice(end + 1, text.indexOf("\n", end + 1) < 0 ? text.length : text.indexOf("\n", end + 1));
      if (said.length < end - line || !/\S/.test(next) || (/^[ \t]*/.exec(next)?.[0].length ?? 0) <= indent) break;
      line = end + 1;
    }
    if (to > from) found.push({ name: one[3]!, head: `${one[2] === "event" ? "event " : ""}${one[3]}${one[4]}`.replace(/[ \t]+/g, " ").trim(), expression: text.slice(from, to).replace(/\s+/g, " "), at: one.index + indent, from, to });
  }
  return found;
}
