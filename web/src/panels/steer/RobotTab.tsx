import { useEffect, useRef, useState } from "react";

import { Icon } from "../../widgets/Icon";
import { kSpeeds, toggle_running } from "../../widgets/run_commands";
import { ask, useStudio, type Studio } from "../../store/store";
import { call_service } from "./call";
import { plug_of } from "./plug";
import { test_control } from "./steering";

/** The run's pace, and what the simulated robots can be made to do. */
export function RobotTab() {
  const world = useStudio((studio) => studio.index?.model.world ?? null);
  return (
    <>
      <Pace />
      {world?.robots.map(({ name }) => <Robot key={name} name={name} alone={world.robots.length === 1} />)}
      {!world && <p className="muted">There is no simulated world behind this run.</p>}
    </>
  );
}

function Pace() {
  const run = useStudio((studio) => studio.state?.run.state ?? "ended");
  const factor = useStudio((studio) => studio.state?.run.factor ?? 1);
  const missed = useStudio((studio) => studio.state?.run.missed_ticks ?? 0);
  const [ticks, set_ticks] = useState("1");
  const count = Math.round(Number(ticks));
  const at = kSpeeds.findLastIndex((speed) => speed <= factor * 1.001);
  const step = async () => {
    if (run === "running") await ask("pause", {});
    await ask("step", { ticks: count });
  };
  return (
    <div className="row pace">
      <button type="button" className="button small" onClick={toggle_running}>
        <Icon name={run === "paused" ? "play" : "pause"} />
        {run === "paused" ? "Resume" : "Pause"}
      </button>
      <span className="joined">
        <button type="button" className="button small" disabled={!(count >= 1)} onClick={() => void step()} title="Pause, and go on for this many ticks">
          <Icon name="step" />
          Step
        </button>
        <input className="field small number" type="number" min={1} max={100000} aria-label="Ticks of a step" value={ticks} onChange={(event) => set_ticks(event.target.value)} />
      </span>
      <label className="speed" title="Run seconds per second of the wall clock">
        <span className="muted">Speed</span>
        <input type="range" min={0} max={kSpeeds.length - 1} step={1} value={Math.max(at, 0)} aria-valuetext={`${factor}×`} onChange={(event) => void ask("factor", { value: kSpeeds[Number(event.target.value)] ?? 1 })} />
        <span className="number">{factor > 0 ? `${factor}×` : "max"}</span>
      </label>
      {missed > 0 && <span className="badge skipped">{missed} ticks missed</span>}
    </div>
  );
}

function Robot({ name, alone }: { name: string; alone: boolean }) {
  const control = useStudio((studio) => test_control(studio.index?.model.services ?? [], studio.index?.model.world?.robots ?? [], name));
  const battery = useStudio((studio) => studio.state?.robots[name]?.battery ?? null);
  const navigation = useStudio((studio) => studio.state?.robots[name]?.navigation ?? "");
  if (!battery) return null;
  const no_control = control === null;
  const charge = battery.percentage * 100;
  return (
    <section className="robot" aria-label={alone ? "Battery" : `Battery of ${name}`}>
      <div className="row">
        <h3>{alone ? "Battery" : name}</h3>
        <span className={`badge ${charge < 20 ? "failure" : charge < 30 ? "halting" : ""}`}>{charge < 20 ? "✗ very low" : charge < 30 ? "! low" : battery.charging ? "charging" : "in use"}</span>
        <span className="muted number values-line">
          {[battery.voltage === null ? "" : `${battery.voltage.toFixed(1)} V`, `${battery.current.toFixed(2)} A`, navigation].filter(Boolean).join(" · ")}
        </span>
      </div>
      <Charge name={name} charge={charge} disabled={no_control} set={(percent) => void call_service(control!, "setBatteryCharge", { percent })} />
      <Plug name={name} control={control} />
    </section>
  );
}

/** As a person at a station would: where there is none, it says so. */
function Plug({ name, control }: { name: string; control: string | null }) {
  const text = useStudio((studio) => plug(studio, name).text);
  const is_possible = useStudio((studio) => plug(studio, name).is_possible);
  const plugged = useStudio((studio) => studio.state?.robots[name]?.battery?.plugged === true);
  return (
    <div className="row">
      <button type="button" className="button small" disabled={control === null || !is_possible} title={text} onClick={() => void call_service(control!, "plugIn", {})}>
        Plug in
      </button>
      <button type="button" className="button small" disabled={control === null || !plugged} title={text} onClick={() => void call_service(control!, "unplug", {})}>
        Unplug
      </button>
      <span className="muted" data-testid={`plug-${name}`}>
        {text}
      </span>
    </div>
  );
}

function plug({ state, index }: Studio, name: string) {
  const robot = state?.robots[name];
  return plug_of(robot?.battery ?? { plugged: false }, index?.model.world?.stations ?? [], robot?.pose ?? [NaN, NaN, NaN]);
}

/** Shows the live charge until somebody takes the slider; sets it when it is let go. */
function Charge({ name, charge, disabled, set }: { name: string; charge: number; disabled: boolean; set(percent: number): void }) {
  const slider = useRef<HTMLInputElement>(null);
  const [held, set_held] = useState<number | null>(null);
  const latest = useRef(set);
  latest.current = set;
  useEffect(() => {
    const element = slider.current;
    // The event of letting go; React's onChange is that of every move.
    const done = () => {
      latest.current(Number(element!.value));
      set_held(null);
    };
    element?.addEventListener("change", done);
    return () => element?.removeEventListener("change", done);
  }, []);
  const shown = held ?? charge;
  return (
    <div className="charge">
      <input
        ref={slider}
        type="range"
        min={0}
        max={100}
        step={1}
        disabled={disabled}
        value={Math.round(shown)}
        aria-label={`Charge of ${name} in percent`}
        aria-valuetext={`${shown.toFixed(0)} percent`}
        data-testid={`battery-${name}`}
        onChange={(event) => set_held(Number(event.target.value))}
        onBlur={() => set_held(null)}
      />
      <output className="number charge-value">{held === null ? `${charge.toFixed(1)} %` : `→ ${held} %`}</output>
      <span className="charge-ticks" aria-hidden="true">
        {[10, 20, 30, 50].map((percent) => (
          <button key={percent} type="button" className="charge-tick number" tabIndex={-1} disabled={disabled} onClick={() => set(percent)} title={`Set to ${percent} %`}>
            {percent}
          </button>
        ))}
      </span>
    </div>
  );
}
