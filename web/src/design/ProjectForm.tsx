import "../styles/settings.css";

import { useMemo, useRef, useState } from "react";

import { follow_pointer } from "../picture/drag";
import type { Data, TreeNode } from "../protocol/types";
import { useStudio } from "../store/store";
import { broken, findings_of, gesture, kNoFiles, obstacle, useDesign, type Doc } from "./design";
import { EntryRows, first_skill } from "./EntryRows";
import { ChoiceField, set_value, ValueField } from "./settings";
import { duration_like, duration_of, entry, period_of, typed_text, yaml_values, type YamlValue } from "./yaml_places";

/** sentree.yaml as a form; what it does not show is edited as text beside it. */
export default function ProjectForm({ doc }: { doc: Doc }) {
  const text = doc.places.shown;
  const why_dim = useDesign(broken);
  const why_not = useDesign(obstacle);
  const found = useMemo(() => yaml_values(text), [text]);
  const kept = useRef<{ root: YamlValue; text: string } | null>(null);
  if (found) kept.current = { root: found, text };
  if (!kept.current) return <p className="empty">The text cannot be read as a project.</p>;
  return (
    <form className={`project-form scroll${why_dim ? " dim" : ""}`} aria-label="Project" tabIndex={0} onSubmit={(event) => event.preventDefault()} data-testid="project-form">
      <fieldset disabled={why_not !== null} title={why_not ?? undefined}>
        <Mission {...kept.current} />
        <Services {...kept.current} doc={doc} />
        <Skills {...kept.current} />
        <Models {...kept.current} />
        <Monitors {...kept.current} />
        <Deadlines {...kept.current} />
      </fieldset>
    </form>
  );
}

interface Part {
  root: YamlValue;
  text: string;
}

/** Files of the project that can be named, as they are named. */
function useFiles(kinds: readonly string[]): string[] {
  const files = useDesign((state) => state.summary?.files ?? kNoFiles);
  return useMemo(() => files.filter(({ kind }) => kinds.includes(kind)).map(({ file }) => file), [files, kinds]);
}
const kMissions = ["mission"];
const kWorlds = ["world"];
const kWatched = ["monitor", "requirement"];
const kSkills = ["skill"];
const kModels = ["model"];
const kNoNodes: readonly TreeNode[] = [];

function Mission({ root, text }: Part) {
  const missions = useFiles(kMissions);
  const worlds = useFiles(kWorlds);
  const mission = entry(root, "mission");
  const of = (name: string) => typed_text(entry(mission, name), text);
  return (
    <section aria-label="Mission">
      <h3>Mission</h3>
      <div className="settings-row">
        <ValueField label="file" path={["mission", "file"]} written={of("file")} options={missions} />
        <ValueField label="tree" path={["mission", "tree"]} written={of("tree")} hint="the main tree" is_text />
        <ValueField label="rate" path={["mission", "rate"]} written={of("rate")} hint="10 Hz" />
        <ChoiceField label="repeat" path={["mission", "repeat"]} written={of("repeat")} options={["true", "false"]} hint="false" />
        <ValueField label="world" path={["world"]} written={typed_text(entry(root, "world"), text)} options={worlds} hint="none" />
      </div>
    </section>
  );
}

const kAt = ["sim", "model", "topics"];

function Services({ root, text, doc }: Part & { doc: Doc }) {
  const interfaces = useDesign((state) => state.interfaces);
  const summary = useDesign((state) => state.summary);
  const [name, set_name] = useState("");
  const [kind, set_kind] = useState("");
  const services = entry(root, "services");
  const wrong = useMemo(() => findings_of(summary, doc.file).filter(({ severity }) => severity === "error"), [summary, doc.file]);
  const why = (value: YamlValue) => wrong.filter(({ from }) => from >= doc.places.byte(value.from) && from <= doc.places.byte(value.to)).map(({ message }) => message).join("; ");
  const chosen = kind || interfaces[0] || "";
  const taken = services?.entries.some(([key]) => key === name) ?? false;
  const add = () => {
    if (/^[A-Za-z_][\w/]*$/.test(name) && !taken && chosen !== "") void set_value(["services", name], { interface: chosen, at: "sim" }).then((done) => done && set_name(""));
  };
  return (
    <section aria-label="Services">
      <h3>Services</h3>
      {services?.entries.map(([key, value]) => (
        <div key={key} className="settings-row" data-service={key}>
          <strong className="settings-name mono">{key}</strong>
          <ChoiceField label="interface" path={["services", key, "interface"]} written={typed_text(entry(value, "interface"), text)} options={interfaces} />
          <ValueField label="at" path={["services", key, "at"]} written={typed_text(entry(value, "at"), text)} options={kAt} hint="sim" is_text wrong={why(value) !== ""} />
          <button type="button" className="button small" aria-label={`Delete service ${key}`} onClick={() => void gesture({ what: "yaml_remove", path: ["services", key] })}>
            Delete
          </button>
          {why(value) && <p className="inspector-finding error">{why(value)}</p>}
        </div>
      ))}
      <div className="settings-row add">
        <input className="field" aria-label="Name of a new service" placeholder="new service" spellCheck={false} value={name} onChange={(event) => set_name(event.target.value)} onKeyDown={(event) => event.key === "Enter" && add()} />
        <select className="field" aria-label="Its interface" value={chosen} onChange={(event) => set_kind(event.target.value)}>
          {interfaces.map((one) => (
            <option key={one}>{one}</option>
          ))}
        </select>
        <button type="button" className="button small" disabled={name === "" || taken} title={taken ? "There is a service of that name" : undefined} onClick={add}>
          Add the service
        </button>
      </div>
    </section>
  );
}

/** What a leaf runs, where it is not `skills/<ID>.scxml`. */
function Skills({ root, text }: Part) {
  const charts = useFiles(kSkills);
  const leaves = useStudio((studio) => studio.index?.model.tree.nodes) ?? kNoNodes;
  const names = useMemo(() => [...new Set(leaves.flatMap((node) => (node.message_name ? [node.message_name, node.type] : [])))], [leaves]);
  const protocols = entry(root, "protocols")?.entries.map(([key]) => key) ?? [];
  return (
    <section aria-label="Skills">
      <h3>Skills</h3>
      <p className="muted">A leaf runs skills/ID.scxml unless it is named here.</p>
      <EntryRows
        one="skill"
        path={["skills"]}
        value={entry(root, "skills")}
        text={text}
        names={names}
        first={(name) => first_skill(name, charts)}
        members={[
          { name: "file", options: charts, hint: "skills/ID.scxml", is_text: true },
          { name: "at", hint: "this process", is_text: true },
          { name: "data", hint: "{location: kitchen}" },
          { name: "protocol", options: protocols, hint: "Sentree’s" },
          { name: "subscribe", hint: "[battery.state]" },
          { name: "latest", hint: "[battery.state]" },
        ]}
      />
    </section>
  );
}

/** Charts that stand for components, and what `sentree verify` tries. */
function Models({ root, text }: Part) {
  const charts = useFiles(kModels);
  const verify = entry(root, "verify");
  const faults = entry(verify, "faults");
  return (
    <section aria-label="Models">
      <h3>Models</h3>
      <EntryRows
        one="model"
        path={["models"]}
        value={entry(root, "models")}
        text={text}
        first={{ file: charts[0] ?? "models/model.scxml" }}
        members={[
          { name: "file", options: charts, is_text: true },
          { name: "serves", hint: "[battery, navigation]" },
          { name: "subscribe", hint: "[battery.state]" },
          { name: "name", hint: "the file’s", is_text: true },
        ]}
      />
      <div className="settings-row">
        <ValueField label="fair" path={["verify", "fair"]} written={typed_text(entry(verify, "fair"), text)} hint="[model.choice]" />
        <ValueField label="faults at most" path={["verify", "faults", "at_most"]} written={typed_text(entry(faults, "at_most"), text)} hint="1" />
        <ValueField label="any of" path={["verify", "faults", "any_of"]} written={typed_text(entry(faults, "any_of"), text)} hint="[{kill: GoTo}]" />
      </div>
    </section>
  );
}

function Monitors({ root, text }: Part) {
  const watched = useFiles(kWatched);
  const monitors = entry(root, "monitors");
  const named = new Set(monitors?.items.map((item) => entry(item, "file")?.text));
  const left = watched.filter((file) => !named.has(file));
  const [file, set_file] = useState("");
  const chosen = left.includes(file) ? file : (left[0] ?? "");
  return (
    <section aria-label="Monitors">
      <h3>Monitors</h3>
      {monitors?.items.map((item, i) => {
        const called = entry(item, "file")?.text ?? "";
        const is_chart = called.endsWith(".scxml");
        return (
          <div key={i} className="settings-row" data-monitor={called}>
            <ValueField label="file" path={["monitors", i, "file"]} written={called} options={watched} />
            {is_chart && <ValueField label="violated in states" path={["monitors", i, "violated"]} written={typed_text(entry(item, "violated"), text)} hint="[violated]" />}
            {is_chart && <ValueField label="gate" path={["monitors", i, "gate"]} written={typed_text(entry(item, "gate"), text)} hint="vetoes nothing" />}
            <button type="button" className="button small" aria-label={`Delete monitor ${called}`} onClick={() => void gesture({ what: "yaml_remove", path: ["monitors", i] })}>
              Delete
            </button>
          </div>
        );
      })}
      {left.length > 0 && (
        <div className="settings-row add">
          <select className="field" aria-label="A file that nobody watches with" value={chosen} onChange={(event) => set_file(event.target.value)}>
            {left.map((one) => (
              <option key={one}>{one}</option>
            ))}
          </select>
          <button type="button" className="button small" onClick={() => void gesture({ what: "yaml_insert", path: ["monitors"], index: monitors?.items.length ?? 0, value: { file: chosen } satisfies Data })}>
            Watch with it
          </button>
        </div>
      )}
    </section>
  );
}

const kMillisecond_ns = 1e6;
const kDefaultRate = "10 Hz";
/** What must nest, with what each is of the budget unless it is written. */
const kNest = [
  { name: "call", part: 0.4, says: "a call to a service" },
  { name: "condition", part: 0.8, says: "a tick of a condition" },
  { name: "budget", part: 1, says: "all of a tick" },
] as const;
const kOthers = [
  { name: "halt", hint: "2 s" },
  { name: "unresponsive", hint: "2 s" },
  { name: "script", hint: "2 s" },
] as const;

function Deadlines({ root, text }: Part) {
  const deadlines = entry(root, "deadlines");
  const period = period_of(entry(entry(root, "mission"), "rate")?.text ?? kDefaultRate) ?? 1e8;
  const written = (name: string) => entry(deadlines, name)?.text;
  const budget = duration_of(written("budget")) ?? period;
  const [drag, set_drag] = useState<{ name: string; time_ns: number } | null>(null);
  const bars = kNest.map(({ name, part, says }) => ({ name, says, is_written: written(name) !== undefined, time_ns: drag?.name === name ? drag.time_ns : (duration_of(written(name)) ?? part * budget) }));
  const whole = Math.max(period, ...bars.map(({ time_ns }) => time_ns)) * 1.1;
  const percent = (time_ns: number) => `${(100 * time_ns) / whole}%`;
  const press = (name: string, event: React.PointerEvent<HTMLElement>) => {
    const lane = event.currentTarget.closest(".nest-lane")?.getBoundingClientRect();
    if (event.button !== 0 || !lane) return;
    let time_ns: number | null = null;
    follow_pointer(event, {
      from_px: 2,
      move: (moved) => {
        time_ns = Math.max(1, Math.round((((moved.clientX - lane.left) / lane.width) * whole) / kMillisecond_ns)) * kMillisecond_ns;
        set_drag({ name, time_ns });
      },
      drop: () => {
        if (time_ns !== null) void set_value(["deadlines", name], duration_like(time_ns, written(name) ?? "ms"));
      },
      end: () => set_drag(null),
    });
  };
  return (
    <section aria-label="Deadlines">
      <h3>Deadlines</h3>
      <p className="muted">call &lt; condition &lt; budget; a period of the mission is {duration_like(period, "ms")}.</p>
      <div className="deadline-nest" role="group" aria-label="How the deadlines nest">
        {bars.map(({ name, says, is_written, time_ns }, i) => {
          const inner = bars[i - 1];
          const broken = inner !== undefined && inner.time_ns >= time_ns;
          return (
            <div key={name} className="nest-lane" data-deadline={name} data-broken={broken}>
              <span className={`nest-bar${is_written ? "" : " default"}${broken ? " wrong" : ""}`} style={{ width: percent(time_ns) }} title={broken ? `${name} must be longer than ${inner.name}` : `${name}: ${says}`}>
                {name} {duration_like(time_ns, "ms")}
                {broken && ` ✗ not longer than ${inner.name}`}
              </span>
              <span className="nest-grip" style={{ left: percent(time_ns) }} onPointerDown={(event) => press(name, event)} />
            </div>
          );
        })}
        <span className="nest-period" style={{ left: percent(period) }} title="The period of the mission" />
      </div>
      <div className="settings-row">
        {kNest.map(({ name, part }) => (
          <ValueField key={name} label={name} path={["deadlines", name]} written={typed_text(entry(deadlines, name), text)} hint={duration_like(part * budget, "ms")} />
        ))}
        {kOthers.map(({ name, hint }) => (
          <ValueField key={name} label={name} path={["deadlines", name]} written={typed_text(entry(deadlines, name), text)} hint={hint} />
        ))}
      </div>
    </section>
  );
}
