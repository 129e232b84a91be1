import { describe, expect, it } from "vitest";
import { Glide, kGlideLongest_ms } from "./glide";

describe("a gliding pose", () => {
  it("moves to the newest update in the time between the last two", () => {
    const glide = new Glide([0, 0, 0], 1000);
    glide.update([0.1, 0.2, 0.4], 1100, true);
    expect(glide.at(1100)).toEqual([0, 0, 0]);
    expect(glide.at(1150)[0]).toBeCloseTo(0.05);
    expect(glide.at(1150)[2]).toBeCloseTo(0.2);
    expect(glide.moving(1150)).toBe(true);
    expect(glide.at(1200)).toEqual([0.1, 0.2, 0.4]);
    expect(glide.moving(1200)).toBe(false);
  });

  it("turns the shorter way", () => {
    const glide = new Glide([0, 0, 3], 0);
    glide.update([0, 0, -3], 100, true);
    const half = glide.at(150)[2];
    expect(Math.abs(half)).toBeGreaterThan(3);
  });

  it("goes on from where it is drawn, without a leap back", () => {
    const glide = new Glide([0, 0, 0], 0);
    glide.update([0.2, 0, 0], 100, true);
    glide.update([0.4, 0, 0], 150, true);
    expect(glide.at(150)[0]).toBeCloseTo(0.1);
    expect(glide.at(200)[0]).toBeCloseTo(0.4);
  });

  it("leaps when the robot was carried, and when the past is shown", () => {
    const glide = new Glide([0, 0, 0], 0);
    glide.update([5, 0, 0], 100, true);
    expect(glide.at(100)).toEqual([5, 0, 0]);
    glide.update([5.1, 0, 0], 200, false);
    expect(glide.at(200)).toEqual([5.1, 0, 0]);
  });

  it("does not lag after a long pause", () => {
    const glide = new Glide([0, 0, 0], 0);
    glide.update([0.1, 0, 0], 60_000, true);
    expect(glide.at(60_000 + kGlideLongest_ms)[0]).toBe(0.1);
  });
});
