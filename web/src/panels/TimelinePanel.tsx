import { useEffect, useRef, useState } from "react";

import { clock_text } from "../draw/format";
import { useCommand } from "../widgets/commands";
import { MenuButton } from "../picture/PictureTools";
import { Icon } from "../widgets/Icon";
import { PanelTools } from "../widgets/PanelTools";
import { kSpeeds, next_tick, previous_tick, violation } from "../widgets/run_commands";
import { useTheme } from "../widgets/theme";
import { useStudio } from "../store/store";
import { go_live, start_replay, stop_replay } from "../store/time_travel";
import { select_lane, Timeline, type Shown } from "./timeline/controller";
import { usePastMarks } from "./timeline/shown";
import { kWork, lane_title, value_at, value_text, type Placed } from "./timeline/lanes";

const kHideIdle = "sentree.timeline.hide_idle";

function Tools({ timeline, shown, hide_idle, set_hide_idle }: { timeline: Timeline | null; shown: Shown; hide_idle: boolean; set_hide_idle(hide: boolean): void }) {
  const replay = useStudio((studio) => studio.replay);
  const speed = useStudio((studio) => studio.replay_speed);
  const live = useStudio((studio) => studio.state?.live ?? true);
  const recording = useStudio((studio) => studio.hello?.mode === "recording");
  const violations = useStudio((studio) => studio.violations.length);
  return (
    <>
      <div className="tool-group" role="group" aria-label="Replay">
        <button className="button small" onClick={() => violation(-1)} disabled={violations === 0} aria-label="Previous violation" title="Previous violation (Shift+N)">
          ‹ Violation
        </button>
        <button className="button small" onClick={previous_tick} aria-label="−1 tick: one tick back" title="One tick back (,)">
          −1 tick
        </button>
        <button className="button small" onClick={() => (replay > 0 ? stop_replay() : start_replay(speed))} aria-pressed={replay > 0} title="Replay from the moment shown (Space, in the past)" data-testid="replay">
          <Icon name={replay > 0 ? "pause" : "play"} />
          {replay > 0 ? "Stop" : "Replay"}
        </button>
        <select
          className="field small"
          aria-label="Speed of the replay"
          value={speed}
          onChange={(event) => useStudio.setState({ replay_speed: Number(event.target.value), ...(replay > 0 ? { replay: Number(event.target.value) } : {}) })}
        >
          {kSpeeds.map((value) => (
            <option key={value} value={value}>
              {value}×
            </option>
          ))}
        </select>
        {!live && (
          <button className="button small" onClick={next_tick} aria-label="+1 tick: one tick on" title="One tick on (.)">
          +1 tick
        </button>
        )}
        <button className="button small" onClick={() => violation(1)} disabled={violations === 0} aria-label="Next violation" title="Next violation (N)">
          Violation ›
        </button>
        {!recording && (
          <button className="button small" onClick={go_live} disabled={live} title="Follow the present (L)">
            <Icon name="live" />
            Live
          </button>
        )}
      </div>
      <span className="tool-space" />
      <Readout />
      <MenuButton
        label="View of the timeline"
        data_view="timeline"
        entries={[
          { label: "Show all", hint: "0", checked: shown.following === "all", run: () => timeline?.set_following(shown.following === "all" ? "newest" : "all") },
          { label: "Follow the newest", checked: shown.following === "newest", run: () => timeline?.set_following("newest") },
          { label: "Show less time", hint: "+", run: () => timeline?.zoom_by(0.7) },
          { label: "Show more time", hint: "−", run: () => timeline?.zoom_by(1 / 0.7) },
          "line",
          { label: "Hide idle lanes", hint: "H", checked: hide_idle, run: () => set_hide_idle(!hide_idle) },
        ]}
      />
    </>
  );
}

function Readout() {
  const end = useStudio((studio) => studio.state?.end ?? 0);
  return (
    <span className="muted number readout" title="Newest known">
      of {clock_text(end, 0)}
    </span>
  );
}

/** The value of a lane at the moment shown. */
function Value({ placed }: { placed: Placed }) {
  const time = useStudio((studio) => Math.round((studio.state?.time ?? 0) / 2e8) * 2e8);
  const value = value_at(placed.lane, time);
  return <span className="lane-value number">{value === undefined ? "–" : value_text(placed.lane, value)}</span>;
}

function Names({ shown }: { shown: Shown }) {
  const selection = useStudio((studio) => studio.selection);
  const index = useStudio((studio) => studio.index);
  const chosen_leaf = selection.node === null ? null : index?.model.tree.nodes[selection.node]?.message_name;
  return (
    <ul className="lane-names" aria-label="Lanes">
      {shown.placed.map((placed, i) => {
        const { lane, top, height } = placed;
        const first_of_kind = shown.placed[i - 1]?.lane.kind !== lane.kind;
        const chosen = lane.kind === "leaf" ? lane.name === chosen_leaf : lane.kind === "monitor" ? lane.name === selection.monitor : lane.id === selection.chart;
        return (
          <li key={lane.id} style={{ top, height }} className={`lane-name kind-${lane.kind}${chosen ? " chosen" : ""}`} data-lane={lane.id}>
            <button className="ellipsis" onClick={() => select_lane(lane, useStudio.getState().state?.time ?? 0)} title={lane.id === kWork ? "The leaf that is at work" : `${lane.kind}: ${lane.name}`} tabIndex={-1}>
              {lane_title(lane)}
            </button>
            {lane.kind === "value" ? <Value placed={placed} /> : first_of_kind && lane.kind !== "mission" && lane.id !== kWork && <span className="lane-kind">{lane.kind}</span>}
          </li>
        );
      })}
    </ul>
  );
}

export function TimelinePanel() {
  const all = useRef<HTMLDivElement>(null);
  const ruler = useRef<HTMLCanvasElement>(null);
  const lanes = useRef<HTMLCanvasElement>(null);
  const scroll = useRef<HTMLDivElement>(null);
  const tip = useRef<HTMLDivElement>(null);
  const [timeline, set_timeline] = useState<Timeline | null>(null);
  const [shown, set_shown] = useState<Shown>({ placed: [], height: 0, following: "newest", low: false });
  const [hide_idle, set_hide_idle] = useState(() => localStorage.getItem(kHideIdle) === "yes");
  const theme = useTheme((current) => current.theme);
  const begin = useStudio((studio) => studio.state?.begin ?? 0);
  // Screen readers get seconds; the canvases redraw by themselves.
  const seconds = useStudio((studio) => Math.round((studio.state?.time ?? 0) / 1e9));
  const end_seconds = useStudio((studio) => Math.round((studio.state?.end ?? 0) / 1e9));
  const live = useStudio((studio) => studio.state?.live ?? true);

  useEffect(() => {
    if (!all.current || !ruler.current || !lanes.current || !scroll.current || !tip.current) return;
    const made = new Timeline({ all: all.current, ruler: ruler.current, lanes: lanes.current, scroll: scroll.current, tip: tip.current }, set_shown);
    set_timeline(made);
    return () => made.destroy();
  }, []);
  useEffect(() => timeline?.redraw(), [timeline, theme]);
  useEffect(() => {
    localStorage.setItem(kHideIdle, hide_idle ? "yes" : "no");
    timeline?.set_hide_idle(hide_idle);
  }, [timeline, hide_idle]);
  const past = usePastMarks(({ marks }) => marks);
  useCommand({ id: "timeline.idle", title: "Hide idle lanes", group: "Timeline", keys: ["H"], run: () => set_hide_idle(!hide_idle) });

  return (
    <div ref={all} className={shown.low ? "timeline low" : "timeline"}>
      <PanelTools>
        <Tools timeline={timeline} shown={shown} hide_idle={hide_idle} set_hide_idle={set_hide_idle} />
      </PanelTools>
      {past.length > 0 && (
        <ul className="hidden-text" aria-label="In other runs">
          {past.map(({ time, text }) => (
            <li key={text} data-past-mark={time}>
              {text} at {clock_text(time)}
            </li>
          ))}
        </ul>
      )}
      <div className="timeline-ruler">
        <span className="timeline-corner muted">drag to scrub</span>
        <canvas ref={ruler} aria-hidden="true" />
      </div>
      <div
        ref={scroll}
        className="scroll timeline-scroll"
        onKeyDown={(event) => {
          if (event.ctrlKey || event.metaKey || event.altKey || !timeline?.key(event)) return;
          event.preventDefault();
          event.stopPropagation();
        }}
      >
        <div className="timeline-all" style={{ height: shown.height }}>
          <Names shown={shown} />
          <canvas
            ref={lanes}
            className="timeline-lanes"
            role="slider"
            tabIndex={0}
            aria-label="Moment shown"
            aria-valuemin={Math.round(begin / 1e9)}
            aria-valuemax={end_seconds}
            aria-valuenow={seconds}
            aria-valuetext={`${clock_text(seconds * 1e9, 0)} of ${clock_text(end_seconds * 1e9, 0)}${live ? ", live" : ", the past"}`}
          />
        </div>
      </div>
      <div ref={tip} className="timeline-tip" hidden />
    </div>
  );
}
