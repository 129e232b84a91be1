import { afterEach, beforeEach, expect, it, vi } from "vitest";

const request = vi.fn();
vi.mock("../store/store", () => ({ request, note: vi.fn(), ask: vi.fn(), on_design: () => () => undefined }));
vi.mock("../store/edit", () => ({ useEdit: { subscribe: vi.fn(), getState: () => ({ wanted: null }), setState: vi.fn() } }));
vi.mock("../store/time_travel", () => ({ go_live: vi.fn() }));
vi.stubGlobal("localStorage", { getItem: () => null, setItem: () => undefined });
vi.stubGlobal("window", globalThis);

const { Session, useDesign } = await import("./design");
const { joined: both, splices_between } = await import("./joining");
const { Places } = await import("./places");
const { BusyError, LostError, RefusedError } = await import("../protocol/client");

/** The program takes so long for each edit. */
const kSlow_ms = 1500;
let version = 0;
let joined: boolean[] = [];

function is_now(text: string): void {
  version += 1;
  const doc = { file: "mission.xml", text, version, places: new Places(text) };
  useDesign.setState({ docs: { "mission.xml": doc } as never });
}

beforeEach(() => {
  vi.useFakeTimers();
  joined = [];
  is_now("");
  request.mockImplementation(async (_op: string, { edits, join }: { edits: { from: number; to: number; text: string }[]; join: boolean }) => {
    await new Promise((settle) => setTimeout(settle, kSlow_ms));
    joined.push(join);
    const { text } = useDesign.getState().docs["mission.xml"]!;
    const [edit] = edits;
    is_now(text.slice(0, edit!.from) + edit!.text + text.slice(edit!.to));
    return { version };
  });
});
afterEach(() => vi.useRealTimers());

it("what is typed without a pause is one step, however slow the program is", async () => {
  const session = new Session("mission.xml");
  for (let typed = 1; typed <= 40; typed += 1) {
    session.typed("x".repeat(typed));
    await vi.advanceTimersByTimeAsync(100);
  }
  await vi.advanceTimersByTimeAsync(10 * kSlow_ms);
  expect(useDesign.getState().docs["mission.xml"]!.text).toBe("x".repeat(40));
  expect(joined.length).toBeGreaterThan(2);
  expect(joined).toEqual(joined.map((_, i) => i > 0));
  // After a pause another step begins.
  session.typed("y".repeat(40));
  await vi.advanceTimersByTimeAsync(10 * kSlow_ms);
  expect(joined.at(-1)).toBe(false);
});

/** The program does each edit, and it is noted whether that joins the step before. */
function program_edits(): void {
  request.mockImplementation(async (_op: string, { edits, join }: { edits: { from: number; to: number; text: string }[]; join: boolean }) => {
    joined.push(join);
    const { text } = useDesign.getState().docs["mission.xml"]!;
    is_now(text.slice(0, edits[0]!.from) + edits[0]!.text + text.slice(edits[0]!.to));
    return { version };
  });
}

it("a line is a step of its own, and so is what is typed on for long", async () => {
  const session = new Session("mission.xml");
  const type = async (text: string) => {
    const { text: before } = useDesign.getState().docs["mission.xml"]!;
    session.typed(before + text);
    await vi.advanceTimersByTimeAsync(100);
  };
  program_edits();
  for (const letter of ["a", "b", "\n  ", "c", "d"]) await type(letter);
  expect(joined).toEqual([false, true, true, false, true]);
  joined = [];
  for (let i = 0; i < 120; i += 1) await type("x");
  expect(joined.filter((joins) => !joins).length).toBe(2);
});

it("what another page types in between ends the step", async () => {
  const session = new Session("mission.xml");
  const type = async (text: string) => {
    session.typed(text);
    await vi.advanceTimersByTimeAsync(100);
  };
  program_edits();
  await type("a");
  await type("ab");
  is_now("zab");
  session.came();
  await type("zabc");
  await type("zabcd");
  expect(joined).toEqual([false, true, false, true]);
});

/** From 0 up to below `bound`. */
function chance(seed: number): (bound: number) => number {
  return (bound) => {
    seed = (seed * 1664525 + 1013904223) >>> 0;
    return Math.floor((seed / 2 ** 32) * bound);
  };
}

it("the replacements between two texts make one of the other, and leave the lines between them", () => {
  const seed = Number(process.env.SEED ?? Date.now() % 100_000);
  const draw = chance(seed);
  for (let round = 0; round < 300; round += 1) {
    const lines = (count: number) => Array.from({ length: count }, () => "abcdefgh"[draw(8)]! + (draw(5) === 0 ? "" : "\n"));
    const [before, after] = [lines(draw(12)).join(""), lines(draw(12)).join("")];
    const made = splices_between(before, after).reduceRight((text, { from, to, text: put }) => text.slice(0, from) + put + text.slice(to), before);
    expect(made, `seed ${seed}, round ${round}`).toBe(after);
    expect(both(before, after, before), `seed ${seed}, round ${round}`).toBe(after);
    expect(both(before, before, after), `seed ${seed}, round ${round}`).toBe(after);
  }
  expect(splices_between("a\nb\nc\nd\n", "a1\nb\nc\nd2\n")).toEqual([
    { from: 1, to: 1, text: "1" },
    { from: 7, to: 7, text: "2" },
  ]);
  // What one writes where the other takes away is there still.
  expect(both("a\nbcd\ne\n", "a\nbcXd\ne\n", "a\ne\n")).toBe("a\nXe\n");
});

/** The program with one file: as it does, it refuses what changes lines that were changed since `base`. */
class Program {
  private log: { version: number; from: number; to: number; put: number }[] = [];
  constructor(public text: string) {
    is_now(text);
  }
  write(from: number, to: number, put: string): void {
    this.text = this.text.slice(0, from) + put + this.text.slice(to);
    is_now(this.text);
    this.log.push({ version, from, to, put: put.length });
  }
  edit(base: number, from: number, to: number, put: string): boolean {
    for (const done of this.log.filter((one) => one.version > base)) {
      const shift = done.put - (done.to - done.from);
      const line = (at: number) => this.text.slice(0, at).split("\n").length;
      if (done.to < from) [from, to] = [from + shift, to + shift];
      else if (done.from <= to) return false;
      if (Math.abs(line(done.from) - line(from)) <= 1 && done.from !== from) return false;
    }
    this.write(from, to, put);
    return true;
  }
}

it("nothing that is typed is lost, and nothing of what others write meanwhile, also while the connection is", async () => {
  const first = Number(process.env.SEED ?? Date.now() % 100_000);
  for (let seed = first; seed < first + 60; seed += 1) {
    const draw = chance(seed);
    const program = new Program("line 1\nline 2\nline 3\nline 4\nline 5\nline 6\nmine: \nline 8\nline 9\ntheirs: \nlast\n");
    const same_line = seed % 3 === 0;
    let lost = false;
    request.mockImplementation(async (_op: string, { base, edits }: { base: number; edits: [{ from: number; to: number; text: string }] }) => {
      const [{ from, to, text }] = edits;
      if (lost) throw new LostError("not connected");
      await new Promise((settle) => setTimeout(settle, draw(400)));
      // Before it was done, or after.
      if (lost && draw(2) === 0) throw new LostError("the connection was lost");
      if (!program.edit(base, from, to, text)) throw new Error("the same lines have been changed meanwhile");
      session.came();
      if (lost) throw new LostError("the connection was lost");
      return { version };
    });
    const session = new Session("mission.xml");
    let editor = session.text;
    let caret = editor.indexOf("mine: ") + 6;
    session.show = (text) => {
      for (const { from, to, text: put } of splices_between(editor, text).reverse()) {
        if (to <= caret) caret += put.length - (to - from);
        else if (from < caret) caret = from + put.length;
      }
      editor = text;
    };
    const [mine, theirs] = ["abcdefghijklmnopqrstuvwxyz", "0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZ"];
    let [typed, written] = [0, 0];
    while (typed < mine.length || written < theirs.length) {
      if (typed < mine.length && draw(2) === 0) {
        editor = editor.slice(0, caret) + mine[typed++]! + editor.slice(caret++);
        session.typed(editor);
      } else if (written < theirs.length) {
        const at = same_line ? program.text.indexOf("mine: ") + (draw(2) === 0 ? 0 : 6) : program.text.indexOf("theirs: ") + 8 + written;
        program.write(at, at, theirs[written++]!);
        if (!lost) session.came();
        if (draw(6) === 0) {
          const end = program.text.indexOf("\n");
          program.write(0, end, `line ${draw(1000)}`);
          if (!lost) session.came();
        }
      }
      if (draw(20) === 0) lost = true;
      await vi.advanceTimersByTimeAsync(draw(150));
      if (lost && draw(3) === 0) {
        lost = false;
        session.came();
      }
    }
    lost = false;
    for (let i = 0; i < 5; i += 1) {
      await vi.advanceTimersByTimeAsync(20_000);
      session.came();
    }
    const said = `seed ${seed}: ${program.text}`;
    expect(editor, said).toBe(program.text);
    if (!same_line) expect(program.text, said).toMatch(new RegExp(`\nmine: ${mine}\n[^]*\ntheirs: ${theirs}\n`));
    for (const letter of mine + theirs) expect(program.text.replace(/line \d+|mine: |theirs: |last/g, "").split(letter).length - 1, `${letter} of ${said}`).toBe(1);
  }
});

it("half a character is told as one that nobody knows", async () => {
  request.mockImplementation(async (_op: string, { edits: [edit] }: { edits: [{ text: string }] }) => is_now(edit.text));
  const session = new Session("mission.xml");
  const shown: string[] = [];
  session.show = (text) => shown.push(text);
  session.typed("a\ud800b\ud83d\ude00");
  await vi.advanceTimersByTimeAsync(1000);
  expect(useDesign.getState().docs["mission.xml"]!.text).toBe("a\ufffdb\u{1f600}");
  expect(shown).toEqual(["a\ufffdb\u{1f600}"]);
});

it("what is typed while edits are refused for a while is kept, and told later", async () => {
  const is_held = (held_by: string) => useDesign.setState({ summary: { files: [], held_by } as never });
  const tells = request.getMockImplementation()!;
  for (const refusal of [new BusyError("too many requests wait for an answer"), new RefusedError("not yet: the project is being opened"), new RefusedError("another edits this project")]) {
    is_now("");
    is_held(refusal.message.startsWith("another") ? "another" : "");
    request.mockImplementation(() => Promise.reject(refusal));
    const session = new Session("mission.xml");
    session.typed("precious");
    await vi.advanceTimersByTimeAsync(5000);
    expect(session.text, refusal.message).toBe("precious");
    is_held("");
    request.mockImplementation(tells);
    await vi.advanceTimersByTimeAsync(10 * kSlow_ms);
    expect(useDesign.getState().docs["mission.xml"]!.text, refusal.message).toBe("precious");
  }
  // What is refused for good is not.
  is_now("");
  useDesign.setState(({ docs }) => ({ docs: { "mission.xml": { ...docs["mission.xml"]!, theirs: null } } }));
  request.mockImplementation(() => Promise.reject(new RefusedError("that is no UTF-8")));
  const session = new Session("mission.xml");
  session.typed("x");
  await vi.advanceTimersByTimeAsync(5000);
  expect(session.text).toBe("");
});
