import { useEffect, useRef, useState } from "react";

import { useStudio, type Studio } from "../../store/store";
import { call_service } from "./call";
import { plug_of } from "./plug";
import { test_control, useWhyNot } from "./steering";

/** What the simulated robots can be made to do. */
export function Robots() {
  const world = useStudio((studio) => studio.index?.model.world ?? null);
  return world?.robots.map(({ name }) => <Robot key={name} name={name} alone={world.robots.length === 1} />);
}

function Robot({ name, alone }: { name: string; alone: boolean }) {
  const control = useStudio((studio) => test_control(studio.index?.model.services ?? [], studio.index?.model.world?.robots ?? [], name));
  const battery = useStudio((studio) => studio.state?.robots[name]?.battery ?? null);
  const navigation = useStudio((studio) => studio.state?.robots[name]?.navigation ?? "");
  const frozen = useWhyNot() !== null;
  const has_station = useStudio((studio) => (studio.index?.model.world?.stations.length ?? 0) > 0);
  if (!battery) return null;
  const charge = battery.percentage * 100;
  const electric = [battery.voltage === null ? "" : `${battery.voltage.toFixed(1)} V`, `${battery.current.toFixed(2)} A`, navigation].filter(Boolean).join(" · ");
  return (
    <section className="robot" aria-label={alone ? "Battery" : `Battery of ${name}`}>
      <h3 title={electric}>{alone ? "Battery" : name}</h3>
      <Charge name={name} charge={charge} disabled={control === null} set={(percent) => call_service(control!, "setBatteryCharge", { percent })} />
      <span className={`badge ${charge < 20 ? "failure" : charge < 30 ? "halting" : ""}`}>{charge < 20 ? "very low" : charge < 30 ? "low" : battery.charging ? "charging" : "in use"}</span>
      {!frozen && has_station && <Plug name={name} control={control} />}
    </section>
  );
}

/** As a person at a station would: where there is none, it says so. */
function Plug({ name, control }: { name: string; control: string | null }) {
  const text = useStudio((studio) => plug(studio, name).text);
  const is_possible = useStudio((studio) => plug(studio, name).is_possible);
  const plugged = useStudio((studio) => studio.state?.robots[name]?.battery?.plugged === true);
  return (
    <div className="plug">
      <button type="button" className="button small" disabled={control === null || !is_possible} title={text} onClick={() => void call_service(control!, "plugIn", {})}>
        Plug in
      </button>
      <button type="button" className="button small" disabled={control === null || !plugged} title={text} onClick={() => void call_service(control!, "unplug", {})}>
        Unplug
      </button>
      <span className="muted ellipsis" data-testid={`plug-${name}`} title={text}>
        {text}
      </span>
    </div>
  );
}

function plug({ state, index }: Studio, name: string) {
  const robot = state?.robots[name];
  return plug_of(robot?.battery ?? { plugged: false }, index?.model.world?.stations ?? [], robot?.pose ?? [NaN, NaN, NaN]);
}

/** Shows the live charge until somebody takes the slider; sets it when it is let go, or the key that moves it. */
function Charge({ name, charge, disabled, set }: { name: string; charge: number; disabled: boolean; set(percent: number): Promise<unknown> }) {
  const slider = useRef<HTMLInputElement>(null);
  const [held, set_held] = useState<number | null>(null);
  const by_key = useRef(false);
  const tell = () => {
    by_key.current = false;
    const percent = Number(slider.current!.value);
    // What is pressed before the robot has it goes on from there.
    void set(percent).then(() => set_held((now) => (now === percent ? null : now)));
  };
  const latest = useRef(tell);
  latest.current = tell;
  useEffect(() => {
    const element = slider.current;
    // The event of letting go, and of each press of a key; React's onChange is that of every move.
    const done = () => !by_key.current && latest.current();
    element?.addEventListener("change", done);
    return () => element?.removeEventListener("change", done);
  }, []);
  const key_done = () => by_key.current && held !== null && tell();
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
        onKeyDown={() => (by_key.current = true)}
        onKeyUp={key_done}
        onBlur={key_done}
      />
      <output className="number charge-value">{held === null ? `${charge.toFixed(1)} %` : `→ ${held} %`}</output>
    </div>
  );
}
