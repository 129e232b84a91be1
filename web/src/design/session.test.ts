import { afterEach, beforeEach, expect, it, vi } from "vitest";

const request = vi.fn();
vi.mock("../store/store", () => ({ request, note: vi.fn(), ask: vi.fn(), on_design: () => () => undefined }));
vi.mock("../store/edit", () => ({ useEdit: { subscribe: vi.fn(), getState: () => ({ wanted: null }), setState: vi.fn() } }));
vi.mock("../store/time_travel", () => ({ go_live: vi.fn() }));
vi.stubGlobal("localStorage", { getItem: () => null, setItem: () => undefined });
vi.stubGlobal("window", globalThis);

const { Session, useDesign } = await import("./design");
const { Places } = await import("./places");

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
