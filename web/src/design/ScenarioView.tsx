import "../styles/settings.css";

import { useEffect, useMemo, useRef, useState } from "react";

import { clock_text } from "../draw/format";
import { fit, ticks, time_at, x_of, zoom, clamp, pan, type View } from "../panels/timeline/view";
import { follow_pointer } from "../picture/drag";
import { wheel_factor } from "../picture/viewport";
import { kInterventions, kKinds } from "../protocol/interventions";
import type { InterventionKind } from "../protocol/types";
import { useStudio } from "../store/store";
import { seek } from "../store/time_travel";
import { useCommand } from "../widgets/commands";
import { broken, choose_scenario, doc_of, findings_of, gesture, go_to, kNoFiles, obstacle, useDesign, version_now, type Doc } from "./design";
import { Editable } from "./Editable";
import { EntryRows, first_skill } from "./EntryRows";
import { names_of, new_injection, scenario_of, useScenario, type Injection, type ScenarioText } from "./scenario";
import { ChoiceField, set_value, ValueField } from "./settings";
import { in_turn } from "./turns";
import { useRoom } from "../widgets/use_room";
import { duration_like, entry, typed_text, type YamlValue } from "./yaml_places";

const kAxis_px = 30;
const kRow_px = 30;
const kMark_px = 7;
/** From an entry's moment to its words. */
const kWords_px = 13;
const kLabelHalf_px = 22;
const kDragFrom_px = 3;
/** To a tenth of a second; with Alt to the millisecond. */
const kGrid_ns = 1e8;
const kFineGrid_ns = 1e6;
/** Shown without a duration. */
const kSpan_ns = 60e9;

/** What is done to a scenario by key. */
const kAxisCommands: readonly { title: string; keys: string; key: string; held?: KeyboardEventInit }[] = [
  { title: "Choose the next entry", keys: "↓", key: "ArrowDown" },
  { title: "Choose the entry before", keys: "↑", key: "ArrowUp" },
  { title: "The chosen entry 0.1 s later", keys: "→", key: "ArrowRight" },
  { title: "The chosen entry 0.1 s earlier", keys: "←", key: "ArrowLeft" },
  { title: "The chosen entry 1 s later", keys: "Shift+→", key: "ArrowRight", held: { shiftKey: true } },
  { title: "The chosen entry 1 s earlier", keys: "Shift+←", key: "ArrowLeft", held: { shiftKey: true } },
  { title: "Delete the chosen entry", keys: "Del", key: "Delete" },
];

type Drag = { what: "entry"; i: number; time_ns: number } | { what: "end"; time_ns: number } | { what: "new"; kind: InterventionKind; time_ns: number; inside: boolean };

/** A scenario's timeline: entries are dragged along it, and written where they stand in the text. */
export default function ScenarioView({ doc }: { doc: Doc }) {
  const text = doc.places.shown;
  const frame = useRef<HTMLDivElement>(null);
  const svg = useRef<SVGSVGElement>(null);
  const room = useRoom(frame, true);
  const width = Math.max(room?.width ?? 0, 200);
  const why_dim = useDesign(broken);
  const why_not = useDesign(obstacle);
  const summary = useDesign((state) => state.summary);
  const chosen = useScenario((state) => state.chosen);
  const now = useStudio((studio) => studio.state?.time ?? null);
  // A text that is broken for the moment keeps its last picture.
  const found = useMemo(() => scenario_of(text), [text]);
  const kept = useRef<ScenarioText | null>(null);
  if (found) kept.current = found;
  const scenario = kept.current;
  const last = Math.max(0, ...(scenario?.injections.map(({ time_ns }) => time_ns ?? 0) ?? []));
  const end = Math.max(scenario?.duration_ns ?? kSpan_ns, last);
  const [by_hand, set_by_hand] = useState<View | null>(null);
  const view = by_hand ?? fit(0, end);
  const [drag, set_drag] = useState<Drag | null>(null);
  const latest = useRef({ view, width, drag, end });
  latest.current = { view, width, drag, end };
  useEffect(() => {
    useScenario.setState({ chosen: null });
    set_by_hand(null);
  }, [doc.file]);
  useEffect(() => {
    const element = svg.current;
    if (!element) return;
    const turn = (event: WheelEvent) => {
      event.preventDefault();
      const { view: seen, width: wide, end: whole } = latest.current;
      const at = time_at(seen, event.clientX - element.getBoundingClientRect().left, wide);
      set_by_hand(clamp(zoom(seen, 1 / wheel_factor(event.deltaY, event.deltaMode, event.ctrlKey), at), 0, whole));
    };
    element.addEventListener("wheel", turn, { passive: false });
    return () => element.removeEventListener("wheel", turn);
  }, []);

  const injections = scenario?.injections ?? [];
  const wrong = useMemo(() => findings_of(summary, doc.file).filter(({ severity }) => severity === "error"), [summary, doc.file]);
  const why = ({ value }: Injection) => {
    const [from, to] = [doc.places.byte(value.from), doc.places.byte(value.to)];
    return wrong.filter((one) => one.from >= from && one.from <= to).map(({ message }) => message).join("; ");
  };
  const x = (time_ns: number) => x_of(view, time_ns, width);
  const time_under = (event: { clientX: number; altKey: boolean }): number => {
    const left = svg.current?.getBoundingClientRect().left ?? 0;
    const grid = event.altKey ? kFineGrid_ns : kGrid_ns;
    return Math.max(0, Math.round(time_at(latest.current.view, event.clientX - left, latest.current.width) / grid) * grid);
  };
  const choose = (i: number | null) => {
    useScenario.setState({ chosen: i });
    const value = i === null ? undefined : injections[i]?.value;
    if (value) go_to(doc.places.byte(value.from));
  };
  const move = ({ i, at, time_ns }: Injection, to_ns: number, meant_of?: number) => (to_ns === time_ns ? Promise.resolve(true) : set_value(["timeline", i, "at"], duration_like(to_ns, at?.text ?? "s"), meant_of));
  /** Then the entry beside it is chosen. */
  const remove = (i: number) => {
    const left = injections.length - 1;
    useScenario.setState({ chosen: null });
    void gesture({ what: "yaml_remove", path: ["timeline", i] }).then((done) => done && left > 0 && useScenario.setState({ chosen: Math.min(i, left - 1) }));
  };
  const insert = (kind: InterventionKind, time_ns: number) => {
    const later = injections.findIndex((one) => (one.time_ns ?? 0) > time_ns);
    const index = later < 0 ? injections.length : later;
    void gesture({ what: "yaml_insert", path: ["timeline"], index, value: { at: duration_like(time_ns, "s"), ...new_injection(kind) } }).then((done) => {
      if (!done) return;
      useScenario.setState({ chosen: index });
      // The next keys are of what was added.
      svg.current?.focus({ preventScroll: true });
    });
  };
  const insert_now = (kind: InterventionKind) => insert(kind, Math.min(Math.round((now ?? 0) / kGrid_ns) * kGrid_ns, end));
  const follow = (event: React.PointerEvent, start: (time_ns: number, moved: PointerEvent) => Drag, drop: (dragged: Drag) => void) =>
    follow_pointer(event, {
      from_px: kDragFrom_px,
      move: (moved) => {
        const next = start(time_under(moved), moved);
        latest.current.drag = next;
        set_drag(next);
      },
      drop: () => latest.current.drag && drop(latest.current.drag),
      end: () => set_drag(null),
    });
  const press = (event: React.PointerEvent) => {
    if (event.button !== 0 || why_not) return;
    const target = event.target instanceof Element ? event.target : null;
    const pressed = target?.closest("[data-entry]")?.getAttribute("data-entry");
    const injection = pressed ? injections[Number(pressed)] : undefined;
    svg.current?.focus({ preventScroll: true });
    if (injection) {
      choose(injection.i);
      const version = version_now();
      follow(event, (time_ns) => ({ what: "entry", i: injection.i, time_ns }), ({ time_ns }) => void move(injection, time_ns, version));
    } else if (target?.closest("[data-end]")) {
      follow(event, (time_ns) => ({ what: "end", time_ns: Math.max(time_ns, kGrid_ns) }), ({ time_ns }) => void set_value(["duration"], duration_like(time_ns, scenario?.duration?.text ?? "s")));
    } else {
      const from = view;
      let panned = false;
      follow_pointer(event, {
        from_px: kDragFrom_px,
        move: (moved) => {
          panned = true;
          set_by_hand(clamp(pan(from, ((event.clientX - moved.clientX) / width) * (from.to - from.from)), 0, end));
        },
        drop: () => undefined,
        end: () => {
          if (panned) return;
          choose(null);
          // A click on the axis goes to that moment of the run below.
          if (target?.closest("[data-axis]") && now !== null) seek(time_under(event));
        },
      });
    }
  };
  const key = (event: React.KeyboardEvent) => {
    if (!in_turn(event)) return;
    if (event.ctrlKey || event.metaKey) return;
    const injection = chosen === null ? undefined : injections[chosen];
    const step = event.altKey ? kFineGrid_ns : event.shiftKey ? 10 * kGrid_ns : kGrid_ns;
    if (event.key === "ArrowDown" || event.key === "ArrowUp") choose(injections.length === 0 ? null : Math.min(Math.max((chosen ?? -1) + (event.key === "ArrowDown" ? 1 : -1), 0), injections.length - 1));
    else if (injection && (event.key === "ArrowLeft" || event.key === "ArrowRight")) void move(injection, Math.max(0, (injection.time_ns ?? 0) + (event.key === "ArrowRight" ? step : -step)));
    else if (injection && (event.key === "Delete" || event.key === "Backspace")) remove(injection.i);
    else if (event.key === "Escape") choose(null);
    else if (event.key === "0") set_by_hand(null);
    else if (event.key === "+" || event.key === "-") set_by_hand(clamp(zoom(view, event.key === "+" ? 0.7 : 1 / 0.7, injection?.time_ns ?? (view.from + view.to) / 2), 0, end));
    else return;
    event.preventDefault();
    event.stopPropagation();
  };

  const press_key = (name: string, held: KeyboardEventInit = {}) => {
    svg.current?.focus();
    svg.current?.dispatchEvent(new KeyboardEvent("keydown", { key: name, bubbles: true, cancelable: true, ...held }));
  };
  useCommand(
    { id: "design.scenario", title: "Go to the scenario’s time axis", group: "Scenario", run: () => svg.current?.focus() },
    ...kKinds.map((kind) => ({ id: `design.scenario.${kind}`, title: `Add to the scenario: ${kind}`, group: "Scenario", run: () => insert_now(kind) })),
    ...kAxisCommands.map(({ title, keys, key: name, held }) => ({ id: `design.scenario.${keys}`, title, group: "Scenario", keys_there: [keys], run: () => press_key(name, held) })),
  );

  const rows = injections.length + (drag?.what === "new" && drag.inside ? 1 : 0);
  const height = Math.max(kAxis_px + Math.max(rows, 1) * kRow_px + 8, (room?.height ?? 0) - 4);
  const end_ns = drag?.what === "end" ? drag.time_ns : scenario?.duration_ns;
  return (
    <div className={`scenario${why_dim ? " dim" : ""}`} data-testid="scenario">
      <div className="scenario-kinds" role="toolbar" aria-label="Drag onto the timeline">
        {kKinds.map((kind) => (
          <button
            key={kind}
            className="button small"
            data-kind={kind}
            title={`${kInterventions[kind].does}: drag it onto the timeline, or click to add it at the moment shown`}
            disabled={why_not !== null}
            onPointerDown={(event) => {
              if (event.button !== 0) return;
              const inside = (moved: PointerEvent) => {
                const box = frame.current?.getBoundingClientRect();
                return box !== undefined && moved.clientX >= box.left && moved.clientX <= box.right && moved.clientY >= box.top && moved.clientY <= box.bottom;
              };
              follow(
                event,
                (time_ns, moved) => ({ what: "new", kind, time_ns, inside: inside(moved) }),
                (dragged) => dragged.what === "new" && dragged.inside && insert(kind, dragged.time_ns),
              );
            }}
            onClick={() => insert_now(kind)}
          >
            {kind}
          </button>
        ))}
      </div>
      <div className="scenario-frame scroll" ref={frame}>
        <svg ref={svg} className="scenario-axis" width={width} height={height} role="group" aria-label={`Timeline of ${doc.file}`} tabIndex={0} data-testid="scenario-timeline" onPointerDown={press} onKeyDown={key}>
          <rect className="axis-band" data-axis="" width={width} height={kAxis_px} />
          {ticks(view, width).map(({ time, text: label }) => (
            <g key={time} className="tick">
              <line x1={x(time)} x2={x(time)} y1={kAxis_px - 6} y2={height} />
              <text x={x(time)} y={17} textAnchor={x(time) < kLabelHalf_px ? "start" : x(time) > width - kLabelHalf_px ? "end" : "middle"}>
                {label}
              </text>
            </g>
          ))}
          {now !== null && <line className="now" x1={x(now)} x2={x(now)} y1={kAxis_px - 6} y2={height} />}
          {end_ns !== null && end_ns !== undefined && (
            <g className="end" data-end="" role="img" aria-label={`Ends after ${duration_like(end_ns, scenario?.duration?.text ?? "s")}`}>
              <title>The scenario’s duration: drag</title>
              <rect x={x(end_ns) - 5} y={0} width={10} height={height} />
              <line x1={x(end_ns)} x2={x(end_ns)} y1={0} y2={height} />
            </g>
          )}
          {injections.map((injection) => {
            const { i, says } = injection;
            const time_ns = drag?.what === "entry" && drag.i === i ? drag.time_ns : (injection.time_ns ?? 0);
            return <Entry key={i} i={i} y={kAxis_px + i * kRow_px + kRow_px / 2} x={x(time_ns)} width={width} says={says} time={clock_text(time_ns)} chosen={chosen === i} why={why(injection)} />;
          })}
          {drag?.what === "new" && drag.inside && <Entry i={-1} y={kAxis_px + injections.length * kRow_px + kRow_px / 2} x={x(drag.time_ns)} width={width} says={drag.kind} time={clock_text(drag.time_ns)} chosen why="" />}
          {rows === 0 && (
            <text className="muted-text" x={width / 2} y={kAxis_px + 20} textAnchor="middle">
              Nothing happens to this run: drag something here
            </text>
          )}
        </svg>
      </div>
      {scenario && <Expectations scenario={scenario} text={text} />}
    </div>
  );
}

/** Its words stand where there is more room, and end there. */
function Entry({ i, x, y, width, says, time, chosen, why }: { i: number; x: number; y: number; width: number; says: string; time: string; chosen: boolean; why: string }) {
  const left = x > width / 2;
  const room = Math.max(0, (left ? x : width - x) - kWords_px);
  return (
    <g className={`injection${chosen ? " chosen" : ""}${why ? " wrong" : ""}`} data-entry={i < 0 ? undefined : i} role="img" aria-label={`${time} ${says}${why ? `: ${why}` : ""}`}>
      <title>{why || `${says}: drag, or the arrow keys`}</title>
      <rect className="lane" x={0} y={y - kRow_px / 2 + 1} width={width} height={kRow_px - 2} />
      <path className="mark" d={`M${x} ${y - kMark_px}L${x + kMark_px} ${y}L${x} ${y + kMark_px}L${x - kMark_px} ${y}Z`} />
      <foreignObject x={left ? 0 : x + kWords_px} y={y - kRow_px / 2 + 1} width={room} height={kRow_px - 2}>
        <div className={`words ellipsis${left ? " left" : ""}`}>
          <span className="time">{time}</span> {says}
        </div>
      </foreignObject>
    </g>
  );
}

const kVerdicts = ["undecided", "satisfied", "violated", "owed"];

/** What the scenario expects of mission and monitors. */
function Expectations({ scenario, text }: { scenario: ScenarioText; text: string }) {
  const model = useStudio((studio) => studio.index?.model ?? null);
  const expect = entry(scenario.root, "expect");
  const monitors = entry(expect, "monitors");
  const shadow = useDesign(({ summary, file }) => (summary?.shadow.current && file === `scenarios/${summary.scenario}.yaml` ? summary.shadow : null));
  const names = [...new Set([...(monitors?.entries.map(([name]) => name) ?? []), ...names_of(model).monitors])];
  return (
    <section className="scenario-expect" aria-label="What is expected">
      <h3>In the end</h3>
      <Editable>
        <ChoiceField label="mission" path={["expect", "mission"]} written={typed_text(entry(expect, "mission"), text)} options={["SUCCESS", "FAILURE", "RUNNING"]} hint="anything" />
        <ValueField label="reason" path={["expect", "reason"]} written={typed_text(entry(expect, "reason"), text)} hint="of the leaf that fails" is_text />
        {names.map((name) => (
          <ChoiceField key={name} label={name} path={["expect", "monitors", name]} written={typed_text(entry(monitors, name), text)} options={kVerdicts} hint="anything" />
        ))}
      </Editable>
      {shadow?.unmet.map((one) => (
        <p key={one} className="inspector-finding error" data-testid="unmet">
          {one}
        </p>
      ))}
    </section>
  );
}

/** The chosen entry, and what the whole scenario says. */
export function ScenarioForm() {
  const doc = useDesign(doc_of);
  const chosen = useScenario((state) => state.chosen);
  const text = doc?.places.shown ?? "";
  const scenario = useMemo(() => scenario_of(text), [text]);
  const clock = scenario && entry(scenario.root, "clock");
  if (!scenario) return <p className="empty">The text cannot be read as a scenario.</p>;
  const injection = chosen === null ? undefined : scenario.injections[chosen];
  const of = (name: string) => typed_text(entry(scenario.root, name), text);
  return (
    <form className="inspector-form scroll" aria-label="Scenario" onSubmit={(event) => event.preventDefault()} data-testid="scenario-form">
      <Editable>
        {injection ? (
          <EntryForm key={injection.i} injection={injection} text={text} />
        ) : (
          <p className="muted">Choose an entry of the timeline to say more of it. ↑ ↓ choose, ← → move it by 0.1 s (Shift 1 s, Alt 1 ms), Del deletes it.</p>
        )}
      </Editable>
      <RunIt file={doc?.file ?? ""} />
      <Editable>
        <h3 className="inspector-part">The scenario</h3>
        <ValueField label="description" path={["description"]} written={of("description")} is_text />
        <ValueField label="duration" path={["duration"]} written={of("duration")} hint="2 min" />
        <ValueField label="seed" path={["seed"]} written={of("seed")} />
        {clock?.kind === "map" ? <ValueField label="clock" path={["clock"]} written={of("clock")} /> : <ChoiceField label="clock" path={["clock"]} written={of("clock")} options={["virtual", "real"]} hint="virtual" />}
        <ChoiceField label="stop_when_violated" path={["stop_when_violated"]} written={of("stop_when_violated")} options={["true", "false"]} hint="false" />
        <Overrides root={scenario.root} text={text} />
      </Editable>
    </form>
  );
}

/** While another scenario runs below, its moments are not those of this one. */
function RunIt({ file }: { file: string }) {
  const name = /^scenarios\/(.*)\.yaml$/.exec(file)?.[1] ?? "";
  const runs = useDesign((state) => state.summary?.scenario ?? "");
  const offered = useDesign((state) => state.summary?.scenarios.includes(name) ?? false);
  if (!offered || runs === name) return null;
  return (
    <p className="inspector-actions muted">
      Below runs {runs === "" ? "the mission alone" : runs}.{" "}
      <button type="button" className="button small primary" data-testid="run-scenario" onClick={() => void choose_scenario(name)}>
        Run this scenario
      </button>
    </p>
  );
}

/** What is another for this scenario, and its processes. */
function Overrides({ root, text }: { root: YamlValue; text: string }) {
  const model = useStudio((studio) => studio.index?.model ?? null);
  const files = useDesign((state) => state.summary?.files ?? kNoFiles);
  const charts = useMemo(() => files.filter(({ kind }) => kind === "skill").map(({ file }) => file), [files]);
  const leaves = names_of(model).leaves;
  const override = entry(root, "override");
  const deadlines = entry(override, "deadlines");
  const addresses = (entry(root, "processes")?.entries ?? []).map(([key]) => `{${key}}`);
  return (
    <>
      <h3 className="inspector-part">Other skills</h3>
      <EntryRows
        one="skill"
        path={["override", "skills"]}
        value={entry(override, "skills")}
        text={text}
        names={leaves}
        first={(name) => first_skill(name, charts)}
        members={[
          { name: "file", options: charts, is_text: true },
          { name: "at", options: addresses, is_text: true },
          { name: "data" },
        ]}
      />
      <h3 className="inspector-part">Other services</h3>
      <EntryRows one="service" path={["override", "services"]} value={entry(override, "services")} text={text} names={model?.services.map(({ name }) => name) ?? []} first={{ at: "sim" }} members={[{ name: "at", options: ["sim", "model", ...addresses], is_text: true }]} />
      <h3 className="inspector-part">Processes</h3>
      <EntryRows
        one="process"
        path={["processes"]}
        value={entry(root, "processes")}
        text={text}
        names={[]}
        first={{ component: "sim", listen: "tcp://127.0.0.1:0" }}
        members={[
          { name: "component", options: ["sim"], is_text: true },
          { name: "skill", options: leaves, is_text: true },
          { name: "listen", hint: "unix:{run}/name.sock", is_text: true },
          { name: "restarts", hint: "0" },
        ]}
      />
      <h3 className="inspector-part">Other settings</h3>
      <ValueField label="mission" path={["override", "mission"]} written={typed_text(entry(override, "mission"), text)} hint="{repeat: true}" />
      <ValueField label="world" path={["override", "world"]} written={typed_text(entry(override, "world"), text)} hint="{battery: {initial: 50 %}}" />
      <ValueField label="monitors" path={["override", "monitors"]} written={typed_text(entry(override, "monitors"), text)} hint="[{file: …}]" />
      {["call", "condition", "budget"].map((name) => (
        <ValueField key={name} label={name} path={["override", "deadlines", name]} written={typed_text(entry(deadlines, name), text)} hint="the project’s" />
      ))}
    </>
  );
}

function EntryForm({ injection, text }: { injection: Injection; text: string }) {
  const model = useStudio((studio) => studio.index?.model ?? null);
  const names = useMemo(() => names_of(model), [model]);
  const path = ["timeline", injection.i];
  const options: Record<string, readonly string[]> = {
    call: injection.kind === "call" ? names.methods : names.replies,
    kill: names.parts,
    restart: names.parts,
    unreachable: names.replies,
    late: names.replies,
    leaf: names.leaves,
    message: names.messages,
    chart: names.charts,
    status: ["SUCCESS", "FAILURE", "RUNNING"],
    source: ["scenario", "studio", "control"],
  };
  // Every member of the kind, also those that are not written.
  const members = kKinds.flatMap((kind) => (kind === injection.kind ? (kInterventions[kind].members ?? []) : []));
  const what = entry(injection.value, injection.kind);
  const inner = what?.kind === "map" ? [...new Set([...members, ...what.entries.map(([key]) => key)])] : [];
  const args = entry(injection.value, "args");
  const method = injection.kind === "call" ? /^(.*)\.([^.]+)$/.exec(what?.text ?? "") : null;
  const declared = model?.services.find(({ name }) => name === method?.[1])?.methods.find(({ name }) => name === method?.[2])?.args ?? [];
  const arg_names = injection.kind === "call" ? [...new Set([...declared.map(({ name }) => name), ...(args?.entries.map(([key]) => key) ?? [])])] : [];
  return (
    <>
      <h2 className="inspector-title">
        <span className="ellipsis">{injection.kind || "entry"}</span>
        <button type="button" className="button small" title="Delete it (Del)" onClick={() => void gesture({ what: "yaml_remove", path }).then((done) => done && useScenario.setState({ chosen: null }))}>
          Delete
        </button>
      </h2>
      <ValueField label="at" path={[...path, "at"]} written={typed_text(injection.at, text)} hint="20 s" />
      {what?.kind === "scalar" && <ValueField label={injection.kind} path={[...path, injection.kind]} written={what.text} options={options[injection.kind] ?? []} />}
      {inner.map((name) => (
        <ValueField key={name} label={name} path={[...path, injection.kind, name]} written={typed_text(entry(what, name), text)} options={options[name] ?? []} />
      ))}
      {arg_names.map((name) => {
        const field = declared.find((one) => one.name === name);
        return <ValueField key={name} label={[name, field?.unit && `[${field.unit}]`].filter(Boolean).join(" ")} path={[...path, "args", name]} written={typed_text(entry(args, name), text)} hint={field ? field.type : "not in the interface"} is_text={field?.type === "string"} />;
      })}
    </>
  );
}
