import type { Pose } from "../../protocol/types";
import { wrap_angle } from "./geometry";

/** A robot that moves further between two updates was carried, or another moment is shown: it is drawn there at once. */
export const kCarried_m = 1;
/** Updates that are further apart do not make the drawing lag. */
export const kGlideLongest_ms = 250;

/** Draws a pose between its updates: from where it is drawn now to the newest one, within the usual time between two. */
export class Glide {
  private from: Pose;
  private to: Pose;
  private start_ms: number;
  private length_ms = 0;

  constructor(pose: Pose, now_ms: number) {
    this.from = pose;
    this.to = pose;
    this.start_ms = now_ms;
  }

  /** The newest update; `glide` false: it is shown at once (the past is being looked at). */
  update(pose: Pose, now_ms: number, glide: boolean): void {
    const [x, y, theta] = this.to;
    if (pose[0] === x && pose[1] === y && pose[2] === theta) return;
    const drawn = this.at(now_ms);
    const carried = Math.hypot(pose[0] - x, pose[1] - y) > kCarried_m;
    const since_ms = now_ms - this.start_ms;
    this.from = glide && !carried ? drawn : pose;
    this.to = pose;
    this.length_ms = glide && !carried ? Math.min(Math.max(since_ms, 0), kGlideLongest_ms) : 0;
    this.start_ms = now_ms;
  }

  at(now_ms: number): Pose {
    const part = this.length_ms > 0 ? Math.min((now_ms - this.start_ms) / this.length_ms, 1) : 1;
    if (part >= 1) return this.to;
    const turn = wrap_angle(this.to[2] - this.from[2]);
    return [
      this.from[0] + part * (this.to[0] - this.from[0]),
      this.from[1] + part * (this.to[1] - this.from[1]),
      wrap_angle(this.from[2] + part * turn),
    ];
  }

  moving(now_ms: number): boolean {
    return now_ms - this.start_ms < this.length_ms;
  }
}
