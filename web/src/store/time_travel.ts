import type { Time } from "../protocol/types";
import { ask, useStudio } from "./store";

/** Where seeks go to; tests give another. */
export interface SeekPort {
  seek(time: Time): Promise<unknown>;
  live(): Promise<unknown>;
}

/**
 * Asks for one moment at a time: while an answer is awaited, only the newest wish is kept. Thus scrubbing and replay go
 * as fast as the program answers, and never queue.
 */
export class Seeker {
  private busy = false;
  private next: Time | "live" | null = null;
  /** The newest wish, fulfilled or not. */
  latest: Time | "live" | null = null;

  constructor(
    private readonly port: SeekPort,
    private readonly wanted: (time: Time | null) => void,
  ) {}

  get idle(): boolean {
    return !this.busy;
  }

  seek(time: Time): void {
    this.next = this.latest = Math.round(time);
    this.wanted(this.next);
    void this.drain();
  }

  live(): void {
    this.next = this.latest = "live";
    this.wanted(null);
    void this.drain();
  }

  private async drain(): Promise<void> {
    if (this.busy) return;
    this.busy = true;
    try {
      while (this.next !== null) {
        const now = this.next;
        this.next = null;
        if (now === "live") await this.port.live();
        else await this.port.seek(now);
      }
    } finally {
      this.busy = false;
      this.wanted(null);
    }
  }
}

const seeker = new Seeker(
  { seek: (time) => ask("seek", { time }), live: () => ask("live", {}) },
  (wanted) => useStudio.setState({ wanted }),
);

/** All panels show the state of this moment. */
export function seek(time: Time): void {
  const state = useStudio.getState().state;
  if (!state) return;
  seeker.seek(Math.min(Math.max(time, state.begin), state.end));
}

/** The present was asked for last, or nothing yet. */
export const wants_live = (): boolean => typeof seeker.latest !== "number";

/** All panels follow the present again (of a recording: its end). */
export function go_live(): void {
  stop_replay();
  seeker.live();
}

// ---- replay ----

let frame = 0;
let last_ms = 0;
let position: Time = 0;

/** Plays the past from the moment shown, at `speed` times the run's own time, and stops at the end. */
export function start_replay(speed: number): void {
  const { state } = useStudio.getState();
  if (!state) return;
  stop_replay();
  position = state.time >= state.end ? state.begin : state.time;
  last_ms = performance.now();
  useStudio.setState({ replay: speed, replay_speed: speed });
  seeker.seek(position);
  frame = requestAnimationFrame(advance);
}

export function stop_replay(): void {
  cancelAnimationFrame(frame);
  useStudio.setState({ replay: 0 });
}

function advance(now_ms: number): void {
  const { state, replay } = useStudio.getState();
  if (!state || replay === 0) return;
  position += Math.max(0, now_ms - last_ms) * 1e6 * replay;
  last_ms = now_ms;
  if (position >= state.end) {
    seeker.seek(state.end);
    stop_replay();
    return;
  }
  // The next moment is asked for only after the last one has been shown.
  if (seeker.idle) seeker.seek(position);
  frame = requestAnimationFrame(advance);
}

/** Times of violations, in order, each once. */
export function violation_times(): Time[] {
  return [...new Set(useStudio.getState().violations.map((violation) => violation.time))];
}

/** To the nearest violation after (`1`) or before (`-1`) the moment shown; false when there is none. */
export function jump_to_violation(direction: 1 | -1): boolean {
  const { state } = useStudio.getState();
  if (!state) return false;
  const times = violation_times();
  const target = direction === 1 ? times.find((time) => time > state.time) : times.findLast((time) => time < state.time);
  // Round again, so that one key walks through all.
  const chosen = target ?? (direction === 1 ? times[0] : times.at(-1));
  if (chosen === undefined) return false;
  stop_replay();
  seek(chosen);
  return true;
}
