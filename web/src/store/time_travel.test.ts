import { describe, expect, it } from "vitest";

import { Seeker, type SeekPort } from "./time_travel";

/** Answers when the test says so. */
class SlowProgram implements SeekPort {
  asked: (number | "live")[] = [];
  private answers: (() => void)[] = [];
  seek(time: number) {
    this.asked.push(time);
    return new Promise<void>((resolve) => this.answers.push(resolve));
  }
  live() {
    this.asked.push("live");
    return new Promise<void>((resolve) => this.answers.push(resolve));
  }
  async answer() {
    this.answers.shift()?.();
    for (let i = 0; i < 5; i++) await Promise.resolve();
  }
}

describe("scrubbing", () => {
  it("asks for one moment at a time, and then for the newest wish only", async () => {
    const program = new SlowProgram();
    const seeker = new Seeker(program, () => undefined);
    seeker.seek(1);
    seeker.seek(2);
    seeker.seek(3);
    expect(program.asked).toEqual([1]);
    expect(seeker.idle).toBe(false);
    await program.answer();
    expect(program.asked).toEqual([1, 3]);
    await program.answer();
    expect(seeker.idle).toBe(true);
  });

  it("back to live wins over moments that wait", async () => {
    const program = new SlowProgram();
    const seeker = new Seeker(program, () => undefined);
    seeker.seek(1);
    seeker.seek(2);
    seeker.live();
    await program.answer();
    await program.answer();
    expect(program.asked).toEqual([1, "live"]);
  });

  it("says which moment is wanted until it is shown", async () => {
    const program = new SlowProgram();
    const wanted: (number | null)[] = [];
    const seeker = new Seeker(program, (time) => wanted.push(time));
    seeker.seek(1.4);
    expect(wanted).toEqual([1]);
    await program.answer();
    expect(wanted).toEqual([1, null]);
  });
});
