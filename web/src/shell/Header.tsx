import { useRef } from "react";

import { apply_edits, record, show_recording, useMode } from "../design/mode";
import { useStudio } from "../store/store";
import { go_live } from "../store/time_travel";
import { ask, retry } from "../store/store";
import { clock_text, duration_text } from "../draw/format";
import { useCommand } from "../widgets/commands";
import { Dialog } from "../widgets/Dialog";
import { Icon } from "../widgets/Icon";
import { MenuButton } from "../picture/PictureTools";
import { open_help } from "./Help";
import { Notes } from "./Notes";
import { open_palette } from "./Palette";
import { Panels } from "./Panels";
import { useTight } from "./use_tight";
import { open_what_if } from "./WhatIf";
import { kSpeeds, next_tick, run_again, stop_run, toggle_running } from "../widgets/run_commands";
import { toggle_theme, useTheme } from "../widgets/theme";
import { by_name } from "../widgets/natural";
import { MissionStatus } from "../panels/mission/MissionStatus";
import { useViolations } from "../panels/violation/violations";

function Clock() {
  const time = useStudio((studio) => studio.state?.time ?? 0);
  const tick = useStudio((studio) => studio.state?.tick ?? 0);
  const kind = useStudio((studio) => studio.hello?.clock ?? "");
  return (
    <span className="clock" title={`Run time (${kind} clock) and number of the tick`}>
      <time className="clock-time mono" data-testid="clock">
        {clock_text(time)}
      </time>
      <span className="muted number">tick {tick}</span>
    </span>
  );
}

/** Whether the page shows the present, and what the run is doing. */
function Presence() {
  const live = useStudio((studio) => studio.state?.live ?? true);
  const run = useStudio((studio) => studio.state?.run.state ?? "running");
  const stopped = useStudio((studio) => studio.state?.run.stopped_at ?? null);
  const recording = useStudio((studio) => studio.hello?.mode === "recording");
  const lost = useStudio((studio) => studio.phase !== "open");
  if (lost) return <span className="presence ended">○ no connection</span>;
  if (recording) return <span className="presence recording" data-testid="presence">◼ Recording</span>;
  if (!live) return <span className="presence past" data-testid="presence">◀ Past</span>;
  if (stopped) return <span className="presence paused" data-testid="presence">❚❚ Stopped at {stopped.what}</span>;
  if (run === "paused") return <span className="presence paused" data-testid="presence">❚❚ Paused</span>;
  if (run === "ended") return <span className="presence ended" data-testid="presence">■ Ended</span>;
  return <span className="presence live" data-testid="presence"><span className="pulse" aria-hidden="true">●</span> Live</span>;
}

function RunControls() {
  const steerable = useStudio((studio) => studio.hello?.steerable ?? false);
  const run = useStudio((studio) => studio.state?.run.state ?? "ended");
  const live = useStudio((studio) => studio.state?.live ?? true);
  const factor = useStudio((studio) => studio.state?.run.factor ?? 1);
  const connected = useStudio((studio) => studio.phase === "open");
  const is_design = useStudio((studio) => studio.hello?.design ?? false);
  if (!steerable) return null;
  // There another is begun; the header has no room for what nobody can press.
  if (is_design && live && run === "ended") return null;
  const enabled = connected && live && run !== "ended";
  const speeds = kSpeeds.some((speed) => speed === factor) ? kSpeeds : [...kSpeeds, factor].sort((a, b) => a - b);
  return (
    <div className="run-controls" role="group" aria-label="Run">
      <button className="button" disabled={!enabled} onClick={toggle_running} title={run === "paused" ? "Resume (Space)" : "Pause (Space)"} data-testid="pause">
        <Icon name={run === "paused" ? "play" : "pause"} />
        <span className="room-2">{run === "paused" ? "Resume" : "Pause"}</span>
      </button>
      <button className="button" disabled={!enabled} onClick={next_tick} title="Pause, and go on for one tick (.)" data-testid="step">
        <span className="tight-2">
          <Icon name="step" />
        </span>
        <span className="room-2">Step</span>
      </button>
      <select className="field" aria-label="Speed of the run" title="Run time per wall time ([ and ])" value={factor} disabled={!enabled} onChange={(event) => void ask("factor", { value: Number(event.target.value) })}>
        {speeds.map((speed) => (
          <option key={speed} value={speed}>
            {speed > 0 && speed < 1e6 ? `${speed}×` : "as fast as possible"}
          </option>
        ))}
      </select>
      <button className="button" disabled={!enabled} onClick={stop_run} title="Halts all skills and ends the run">
        <span className="tight-2">
          <Icon name="stop" />
        </span>
        <span className="room-2">Stop</span>
      </button>
    </div>
  );
}

/** The same run once more, or with another seed or scenario; one that goes on is ended first. */
function RunAgain() {
  const repeatable = useStudio((studio) => studio.hello?.repeatable ?? false);
  const connected = useStudio((studio) => studio.phase === "open");
  const seed = useStudio((studio) => studio.hello?.seed ?? 0);
  const scenarios = useStudio((studio) => studio.index?.model.scenarios);
  const present = useStudio((studio) => studio.index?.model.scenario?.name);
  if (!repeatable || !connected) return null;
  return (
    <MenuButton
      label="Run again"
      text="Run again"
      data_view="run"
      entries={[
        { label: "The same once more", hint: `seed ${seed}`, run: () => run_again({}) },
        { label: "With another seed", run: () => run_again({ seed: Math.floor(Math.random() * 1e6) }) },
        { label: "What if a model had chosen otherwise …", run: open_what_if },
        ...(scenarios && scenarios.length > 0 ? [{ heading: "Scenario" }] : []),
        ...[...(scenarios ?? [])].sort(by_name).map((scenario) => ({ label: scenario, checked: scenario === present, run: () => run_again({ scenario }) })),
      ]}
    />
  );
}

/** The two views of a project that is edited. */
function ModeSwitch() {
  const is_design = useStudio((studio) => studio.hello?.design ?? false);
  const mode = useMode((state) => state.mode);
  if (!is_design) return null;
  return (
    <div className="mode-switch" role="group" aria-label="View of the project">
      <button className="button" aria-pressed={mode === "design"} onClick={() => useMode.setState({ mode: "design" })}>
        Design
      </button>
      <button className="button" aria-pressed={mode === "run"} title="The shadow run, or the recording that is open, in all panels" onClick={() => useMode.setState({ mode: "run" })}>
        Run
      </button>
    </div>
  );
}

const kPaces: readonly { label: string; hint?: string; how: Parameters<typeof record>[0] }[] = [
  { label: "In step with the clock", hint: "1×", how: {} },
  { label: "Four times as fast", hint: "4×", how: { factor: 4 } },
  { label: "Sixteen times as fast", hint: "16×", how: { factor: 16 } },
  { label: "In real time, with threads", how: { real_time: true } },
];

/** A run beside the project: begun, steered and recorded from here. */
function Recording() {
  const is_design = useStudio((studio) => studio.hello?.design ?? false);
  const connected = useStudio((studio) => studio.phase === "open");
  const may = useStudio((studio) => studio.may_steer);
  const { on_show, goes_on, continues, outdated } = useMode((state) => state.runs);
  const here = is_design && connected && may;
  useCommand(
    ...(here && goes_on === null ? kPaces.map(({ label, how }) => ({ id: `record.${label}`, title: `Record a run of the scenario: ${label.toLowerCase()}`, group: "Design", run: () => void record(how) })) : []),
    ...(here && goes_on !== null && outdated ? [{ id: "record.apply", title: "Apply the edits to the run that goes on", group: "Design", run: () => void apply_edits() }] : []),
    ...(here && on_show !== "" ? [{ id: "record.shadow", title: "Show the shadow run again", group: "Design", run: () => void show_recording("") }] : []),
  );
  if (!here) return null;
  return (
    <>
      {goes_on === null ? (
        <MenuButton
          label="Record a run of the scenario, steered by hand"
          text="Record"
          data_view="recording"
          entries={kPaces.map(({ label, hint, how }) => ({ label, ...(hint ? { hint } : {}), run: () => void record(how) }))}
        />
      ) : (
        <span className="presence recording" role="status" title={`runs/${goes_on}`} data-testid="records">
          ● Records
        </span>
      )}
      {goes_on !== null && outdated && (
        <button className="button small" title="The run goes on with the texts as they are, saved or not, from its next tick" data-testid="apply" onClick={() => void apply_edits()}>
          Apply edits
        </button>
      )}
      <Refused />
      {continues !== "" && (
        <button className="button small" title={`With the edits the run is another one: it begins where they were applied. What was before is runs/${continues}`} data-testid="before-edits" onClick={() => void show_recording(continues)}>
          Before<span className="room-3"> the edits</span>
        </button>
      )}
      {goes_on !== null && on_show !== goes_on && (
        <button className="button small" onClick={() => void show_recording(goes_on)}>
          Show the run
        </button>
      )}
      {on_show !== "" && (
        <button className="button small" title={`Shown is runs/${on_show}`} data-testid="to-shadow" onClick={() => void show_recording("")}>
          <span className="tight-3">
            <Icon name="rewind" />
          </span>
          <span className="room-3">Shadow run</span>
        </button>
      )}
    </>
  );
}

/** What stands in the way of the edits in the run that goes on. */
function Refused() {
  const why = useMode(({ refused }) => refused);
  if (why === null) return null;
  const close = () => useMode.setState({ refused: null });
  return (
    <Dialog label="The run cannot go on with these edits now" className="confirm refusals" close={close}>
      <h2>The run cannot go on with these edits now</h2>
      <ul data-testid="refusals">
        {why.refused.map(({ file, line, message }, i) => (
          <li key={i}>
            {message}
            {file !== "" && <span className="mono muted"> {line > 0 ? `${file}:${line}` : file}</span>}
          </li>
        ))}
      </ul>
      <p className="muted">It goes on as it did.{why.later && " What is at work must be there in the edited project; try again once it is not at work any more."}</p>
      <div className="row end">
        <button className="button" onClick={close} autoFocus>
          Close
        </button>
        {why.later && (
          <button
            className="button primary"
            onClick={() => {
              close();
              void apply_edits();
            }}
          >
            Try again
          </button>
        )}
      </div>
    </Dialog>
  );
}

function Violations() {
  const count = useStudio((studio) => studio.violations.length);
  const shown = useViolations((state) => state.shown);
  if (count === 0 || shown) return null;
  return (
    <button className="violation-chip" onClick={() => useViolations.setState({ shown: true })}>
      <Icon name="alarm" />
      {count} {count === 1 ? "violation" : "violations"}
    </button>
  );
}

export function Header() {
  const title = useStudio((studio) => studio.hello?.title ?? "Sentree Studio");
  const description = useStudio((studio) => studio.hello?.description ?? "");
  const boot = useStudio((studio) => studio.hello?.boot);
  const mode = useMode((state) => state.mode);
  const dark = useTheme(({ theme }) => theme === "dark");
  const compares = useStudio((studio) => studio.hello?.compare ?? false);
  const is_design = useStudio((studio) => studio.hello?.design ?? false);
  const designs = compares || (is_design && mode === "design");
  const project = useMode((state) => state.project);
  // Also while the shadow run is of a scenario, or there is none yet.
  const of_project = designs && !compares && project !== "";
  const row = useRef<HTMLElement>(null);
  useTight(row);
  return (
    <header className="header" data-boot={boot} ref={row}>
      <img className="logo" src="./icon.svg" alt="" width="22" height="22" />
      <h1 className="title ellipsis" title={description}>
        {compares ? "Differences" : of_project ? project : title}
        {of_project ? title !== project && <span className="description">{title}</span> : description && <span className="description">{description}</span>}
      </h1>
      <ModeSwitch />
      <Recording />
      {!designs && <MissionStatus />}
      {!designs && <Violations />}
      {designs && !compares ? <Notes over /> : <span className="header-space" />}
      {!designs && <Presence />}
      {!designs && <Clock />}
      <RunControls />
      <RunAgain />
      {!designs && <Panels />}
      <span className="header-space short" />
      <button className="button find" onClick={open_palette} title="Find a command, a node, a chart (Ctrl+K)">
        <Icon name="search" />
        <span className="room-1">
          Find <kbd className="kbd">Ctrl K</kbd>
        </span>
      </button>
      <button className="button" onClick={toggle_theme} title={designs ? "Light or dark" : "Light or dark (D)"}>
        <span className="tight-1">
          <Icon name={dark ? "sun" : "moon"} />
        </span>
        <span className="room-1">{dark ? "Light" : "Dark"}</span>
      </button>
      <button className="button" onClick={open_help} title="Help and keys (?)">
        <span className="tight-1">
          <Icon name="help" />
        </span>
        <span className="room-1">Help</span>
      </button>
    </header>
  );
}

/** Says plainly when the page has lost the program; and, where one `travels`, when it does not show the present. */
export function TravelStrip({ travels }: { travels: boolean }) {
  const phase = useStudio((studio) => studio.phase);
  const attempt = useStudio((studio) => studio.attempt);
  const known = useStudio((studio) => studio.hello !== null);
  const mode = useStudio((studio) => studio.hello?.mode);
  const state = useStudio((studio) => studio.state);
  const replay = useStudio((studio) => studio.replay);
  if (phase === "lost" || (phase === "connecting" && known)) {
    return (
      <div className="strip lost" role="alert">
        <Icon name="warning" />
        <strong>No connection to the program.</strong>
        <span>{known ? "The page shows what it knew last" : "Is it still running"}{known ? "; attempt" : "? Attempt"} {attempt} to reach it …</span>
        <button className="button small" onClick={retry}>
          Try now
        </button>
      </div>
    );
  }
  if (!travels || !state || state.live || mode === "recording") return null;
  return (
    <div className="strip past" role="status" data-testid="past-strip">
      <Icon name="rewind" />
      <strong>You look at the past:</strong>
      <span className="number">
        {clock_text(state.time)}, {duration_text(state.end - state.time)} before the newest{replay > 0 ? `, replaying at ${replay}×` : ""}. Every panel shows this moment
        {state.run.state === "running" ? "; the run goes on." : "."}
      </span>
      <button className="button small" onClick={go_live} data-testid="back-to-live">
        <Icon name="live" />
        Back to live <kbd className="kbd">L</kbd>
      </button>
    </div>
  );
}
