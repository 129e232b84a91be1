import { LostError } from "../protocol/client";
import type { Time } from "../protocol/types";
import { ask, useStudio } from "../store/store";
import { go_live, jump_to_violation, seek, start_replay, stop_replay } from "../store/time_travel";
import { useCommand } from "./commands";
import { confirm } from "./Confirm";
import { note, request } from "../store/store";

export const kSpeeds = [0.1, 0.25, 0.5, 1, 2, 4, 8, 16] as const;

/** The next faster (`1`) or slower (`-1`) speed. */
export function next_speed(speed: number, direction: 1 | -1): number {
  const faster = kSpeeds.find((candidate) => candidate > speed * 1.001);
  const slower = kSpeeds.findLast((candidate) => candidate < speed * 0.999);
  return (direction === 1 ? faster : slower) ?? speed;
}

/** Pauses or resumes the run; in the past, the replay. */
export function toggle_running(): void {
  const { state, hello, replay, replay_speed } = useStudio.getState();
  if (!state || !hello) return;
  if (!state.live || hello.mode === "recording" || state.run.state === "ended") {
    if (replay > 0) stop_replay();
    else start_replay(replay_speed);
  } else if (hello.steerable) {
    void ask(state.run.state === "paused" ? "resume" : "pause", {});
  }
}

/** One tick on: the run's next one, or in the past the next that was. */
export function next_tick(): void {
  const { state, hello } = useStudio.getState();
  if (!state || !hello) return;
  if (state.live && hello.steerable && state.run.state !== "ended") {
    void (async () => {
      if (state.run.state === "running") await ask("pause", {});
      await ask("step", { ticks: 1 });
    })();
  } else {
    void go_to_tick({ after: state.time });
  }
}

export function previous_tick(): void {
  const { state } = useStudio.getState();
  if (state) void go_to_tick({ before: state.time });
}

async function go_to_tick(where: { after: Time } | { before: Time }): Promise<void> {
  stop_replay();
  const found = await ask("find", { filter: { name: "mission.tick" }, ...where });
  if (found) seek(found.time);
}

export function change_speed(direction: 1 | -1): void {
  const { state, hello, replay, replay_speed } = useStudio.getState();
  if (!state || !hello) return;
  if (state.live && hello.steerable) {
    void ask("factor", { value: next_speed(state.run.factor, direction) });
    return;
  }
  const speed = next_speed(replay_speed, direction);
  useStudio.setState({ replay_speed: speed, ...(replay > 0 ? { replay: speed } : {}) });
}

/** Ends the run, once the person has said so. */
export function stop_run(): void {
  confirm({ text: "Stop the mission? All skills are halted, and the run cannot go on afterwards.", yes: "Stop", run: () => void ask("intervene", { stop: "mission" }) });
}

/** `refused` is told why it does not begin; without it the page notes that. */
export function run_again(how: { seed?: number; scenario?: string; choose?: string[] }, refused?: (why: string) => void): void {
  const begin = () =>
    void (refused
      ? request("run_again", how).catch((error: unknown) => {
          // Another run begins at this address, maybe before the program has answered.
          if (!(error instanceof LostError)) refused(error instanceof Error ? error.message : String(error));
        })
      : ask("run_again", how));
  const state = useStudio.getState().state?.run.state;
  if (state === undefined || state === "ended") begin();
  else confirm({ text: "Begin again? The run that goes on is ended.", yes: "Begin again", run: begin });
}

export function violation(direction: 1 | -1): void {
  if (!jump_to_violation(direction)) note("info", "No requirement has been violated in this run.");
}

/** What the page offers everywhere about run and time. */
export function useRunCommands(): void {
  const steerable = useStudio((studio) => studio.hello?.steerable ?? false);
  const repeatable = useStudio((studio) => studio.hello?.repeatable ?? false);
  useCommand(
    { id: "run.toggle", title: "Pause or resume the run; in the past, play or pause the replay", group: "Run and time", keys: ["Space"], run: toggle_running },
    { id: "run.step", title: "One tick on", group: "Run and time", keys: ["."], run: next_tick },
    { id: "time.back", title: "One tick back", group: "Run and time", keys: [","], run: previous_tick },
    { id: "time.live", title: "Back to live", group: "Run and time", keys: ["L"], run: go_live },
    { id: "time.violation", title: "Next violation", group: "Run and time", keys: ["N"], run: () => violation(1) },
    { id: "time.violation_before", title: "Previous violation", group: "Run and time", keys: ["Shift+N"], run: () => violation(-1) },
    { id: "run.faster", title: "Faster", group: "Run and time", keys: ["]"], run: () => change_speed(1) },
    { id: "run.slower", title: "Slower", group: "Run and time", keys: ["["], run: () => change_speed(-1) },
    { id: "time.begin", title: "Go to the beginning", group: "Run and time", keys: ["Home"], run: () => seek(useStudio.getState().state?.begin ?? 0) },
    ...(steerable ? [{ id: "run.stop", title: "Stop the mission (halts all skills)", group: "Run and time", run: stop_run }] : []),
    ...(repeatable ? [{ id: "run.again", title: "Run again", group: "Run and time", run: () => run_again({}) }] : []),
  );
}
