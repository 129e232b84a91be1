/**
 * The program counts bytes of UTF-8; the page's texts count units of UTF-16; the editor counts every end of line as one
 * and shows no byte order mark. What joins the three.
 */

const kEncoder = new TextEncoder();

/** By unit of `text`, and its end: the byte where it begins. Nothing where they are the same. */
function bytes_of(text: string): Uint32Array | null {
  // eslint-disable-next-line no-control-regex
  if (/^[\x00-\x7f]*$/.test(text)) return null;
  const starts = new Uint32Array(text.length + 1);
  let byte = 0;
  for (let i = 0; i < text.length; ) {
    const code = text.codePointAt(i) ?? 0;
    const units = code > 0xffff ? 2 : 1;
    for (let u = 0; u < units; u += 1) starts[i + u] = byte;
    byte += code < 0x80 ? 1 : code < 0x800 ? 2 : code > 0xffff ? 4 : 3;
    i += units;
  }
  starts[text.length] = byte;
  return starts;
}

/** The greatest place in `starts` that is not above `value`. */
function find(starts: Uint32Array, value: number): number {
  let [low, high] = [0, starts.length - 1];
  while (low < high) {
    const middle = (low + high + 1) >> 1;
    if ((starts[middle] ?? 0) <= value) low = middle;
    else high = middle - 1;
  }
  // Of the two halves of one character the first.
  while (low > 0 && starts[low - 1] === starts[low]) low -= 1;
  return low;
}

/** A text as the editor has it, and its places as the program counts them. */
export class Places {
  /** With "\n" for every end of line, without a byte order mark. */
  readonly shown: string;
  readonly end_of_line: "\n" | "\r\n" | "\r";
  private readonly bytes: Uint32Array | null;
  private readonly units: Uint32Array | null; // by unit of `shown`: the unit of `text`

  constructor(readonly text: string) {
    this.bytes = bytes_of(text);
    const begin = text.startsWith("\uFEFF") ? 1 : 0;
    this.shown = text.slice(begin).replace(/\r\n?/g, "\n");
    this.end_of_line = (/\r\n|\r|\n/.exec(text)?.[0] ?? "\n") as "\n" | "\r\n" | "\r";
    if (begin === 0 && this.shown.length === text.length) {
      this.units = null;
      return;
    }
    this.units = new Uint32Array(this.shown.length + 1);
    let at = begin;
    for (let i = 0; i <= this.shown.length; i += 1) {
      this.units[i] = at;
      at += text[at] === "\r" && text[at + 1] === "\n" ? 2 : 1;
    }
  }

  /** The byte of a place in the editor. */
  byte(shown: number): number {
    const unit = this.units ? (this.units[shown] ?? this.text.length) : shown;
    return this.bytes ? (this.bytes[unit] ?? 0) : unit;
  }

  /** The place in the editor of a byte. */
  at(byte: number): number {
    const unit = this.bytes ? find(this.bytes, byte) : Math.min(byte, this.text.length);
    return this.units ? find(this.units, unit) : unit;
  }
}

export interface Splice {
  from: number;
  to: number;
  text: string;
}

/** The one replacement that makes `after` of `before`; null: they are the same. */
export function splice_between(before: string, after: string): Splice | null {
  if (before === after) return null;
  const shorter = Math.min(before.length, after.length);
  let head = 0;
  while (head < shorter && before[head] === after[head]) head += 1;
  let tail = 0;
  while (tail < shorter - head && before[before.length - 1 - tail] === after[after.length - 1 - tail]) tail += 1;
  // Not between the halves of a character.
  const is_low = (text: string, i: number) => /[\uDC00-\uDFFF]/.test(text[i] ?? "");
  while (head > 0 && (is_low(before, head) || is_low(after, head))) head -= 1;
  while (tail > 0 && (is_low(before, before.length - tail) || is_low(after, after.length - tail))) tail -= 1;
  return { from: head, to: before.length - tail, text: after.slice(head, after.length - tail) };
}

/** Of what a caret at the end of a line is: the last letter of the line. */
export function caret_place(text: string, caret: number): number {
  const end = text.indexOf("\n", caret);
  if (text.slice(caret, end < 0 ? undefined : end).trim() !== "") return caret;
  const last = text.slice(text.lastIndexOf("\n", caret - 1) + 1, caret).trimEnd().length;
  return last === 0 ? caret : text.lastIndexOf("\n", caret - 1) + last;
}

/** Where a line of a text begins, counted from 1; `indented`: where what is in it begins. */
export function line_start(text: string, line: number, indented = false): number {
  let at = 0;
  for (let i = 1; i < line; i += 1) at = text.indexOf("\n", at) + 1;
  return indented ? at + (/^[ \t]*/.exec(text.slice(at))?.[0].length ?? 0) : at;
}

/** How many bytes a text takes. */
export function byte_length(text: string): number {
  return kEncoder.encode(text).length;
}
