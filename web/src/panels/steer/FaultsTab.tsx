import { useMemo, useState } from "react";

import type { ServiceModel } from "../../protocol/types";
import { note, useStudio } from "../../store/store";
import { Editor } from "./Form";
import { new_draft, read_draft, reply_fields, type Draft } from "./idl";
import { intervene } from "./steering";

const kKinds = [
  { id: "falsify", title: "Falsify a reply" },
  { id: "delay", title: "Delay messages" },
  { id: "unreachable", title: "Calls find nobody" },
  { id: "late", title: "Answers come too late" },
  { id: "force", title: "Force a leaf's result" },
  { id: "breakpoint", title: "Stop at a message" },
] as const;
type KindId = (typeof kKinds)[number]["id"];
const kNone: readonly ServiceModel[] = [];

/** Forms for what goes wrong, or is held. Nodes and states are stopped at by their menus. */
export function FaultsTab() {
  const [kind, set_kind] = useState<KindId>("falsify");
  return (
    <>
      <div className="row">
        <select className="field small grow" aria-label="What to do" value={kind} onChange={(event) => set_kind(event.target.value as KindId)} data-testid="fault-kind">
          {kKinds.map(({ id, title }) => (
            <option key={id} value={id}>
              {title}
            </option>
          ))}
        </select>
      </div>
      {kind === "falsify" && <Falsify />}
      {kind === "delay" && <Delay />}
      {(kind === "unreachable" || kind === "late") && <Outage key={kind} op={kind} />}
      {kind === "force" && <Force />}
      {kind === "breakpoint" && <AtMessage />}
    </>
  );
}

/** How many messages; empty: until it is cleared. */
function Count({ value, set }: { value: string; set(value: string): void }) {
  return (
    <div className="form-row">
      <label className="form-label" htmlFor="fault-count">
        How often
      </label>
      <input id="fault-count" className="field small number" inputMode="numeric" placeholder="until cleared" value={value} onChange={(event) => set(event.target.value)} aria-invalid={count_of(value) === null} />
    </div>
  );
}

/** Undefined: without end; null: not a number of messages. */
function count_of(text: string): number | undefined | null {
  if (text.trim() === "") return undefined;
  const count = Number(text);
  return Number.isInteger(count) && count > 0 ? count : null;
}

function with_count(count: number | undefined): { count?: number } {
  return count === undefined ? {} : { count };
}

const replying = (service: ServiceModel) => service.methods.filter((method) => method.result !== "void");
const with_replies = (services: readonly ServiceModel[]) => services.filter((service) => !service.name.endsWith("simulation") && replying(service).length > 0);

/** A method that has a reply, of one of these services. */
function MethodPick({ services, service, method, set }: { services: readonly ServiceModel[]; service: ServiceModel; method: string; set(chosen: { service: string; method: string }): void }) {
  return (
    <div className="row">
      <select className="field small grow" aria-label="Service" value={service.name} onChange={(event) => set({ service: event.target.value, method: "" })}>
        {services.map(({ name }) => (
          <option key={name}>{name}</option>
        ))}
      </select>
      <select className="field small grow" aria-label="Method" value={method} onChange={(event) => set({ service: service.name, method: event.target.value })}>
        {replying(service).map(({ name }) => (
          <option key={name}>{name}</option>
        ))}
      </select>
    </div>
  );
}

const kOutages = {
  unreachable: { button: "Cut off", says: "Each call ends at once as unreachable, as if nobody were there, until it is cleared." },
  late: { button: "Let them be late", says: "Calls are served, but whoever has called hears “late” when its time is over, until it is cleared." },
} as const;

function Outage({ op }: { op: keyof typeof kOutages }) {
  const all = useStudio((studio) => studio.index?.model.services) ?? kNone;
  const services = useMemo(() => with_replies(all), [all]);
  const [at, set_at] = useState({ service: "", method: "" });
  const service = services.find(({ name }) => name === at.service) ?? services[0];
  const method = service && (replying(service).find(({ name }) => name === at.method) ?? replying(service)[0]);
  if (!service || !method) return <p className="muted">No service of this run has a reply.</p>;
  return (
    <form
      className="form"
      onSubmit={(event) => {
        event.preventDefault();
        void intervene(op === "late" ? { late: `${service.name}.${method.name}` } : { unreachable: `${service.name}.${method.name}` });
      }}
    >
      <MethodPick services={services} service={service} method={method.name} set={set_at} />
      <p className="muted">{kOutages[op].says}</p>
      <div className="row end">
        <button type="submit" className="button small primary">
          {kOutages[op].button}
        </button>
      </div>
    </form>
  );
}

function Falsify() {
  const all = useStudio((studio) => studio.index?.model.services) ?? kNone;
  const services = useMemo(() => with_replies(all), [all]);
  const [at, set_at] = useState({ service: "", method: "", path: "" });
  const [edited, set_edited] = useState<{ of: string; draft: Draft } | null>(null);
  const [count, set_count] = useState("");
  const service = services.find(({ name }) => name === at.service) ?? services[0];
  const methods = service ? replying(service) : [];
  const method = methods.find(({ name }) => name === at.method) ?? methods[0];
  const fields = useMemo(() => (service && method ? reply_fields(method, service.types) : []), [service, method]);
  const field = fields.find(({ path }) => path === at.path) ?? fields.find(({ path }) => !path.startsWith("header")) ?? fields[0];
  const key = `${service?.name}.${method?.name}/${field?.path}`;
  const fresh = useMemo(() => (service && field ? new_draft(field.type, service.types) : null), [service, field]);
  if (!service || !method || !field || !fresh) return <p className="muted">No service of this run has a reply.</p>;
  const draft = edited?.of === key ? edited.draft : fresh;
  const read = read_draft(draft, field.type, service.types, field.path);
  const times = count_of(count);
  return (
    <form
      className="form"
      onSubmit={(event) => {
        event.preventDefault();
        if (read.errors.length > 0 || times === null) return;
        void intervene({ falsify: { call: `${service.name}.${method.name}`, ...(field.path === "" ? {} : { path: field.path }), value: read.value, ...with_count(times) } }).then((done) => {
          if (done) note("info", `${service.name}.${method.name} now says ${field.path || "its result"} = ${String(read.value)}`);
        });
      }}
    >
      <MethodPick services={services} service={service} method={method.name} set={(chosen) => set_at({ ...chosen, path: "" })} />
      <div className="form-row">
        <label className="form-label" htmlFor="fault-field">
          Member
        </label>
        <select id="fault-field" className="field small" value={field.path} onChange={(event) => set_at({ service: service.name, method: method.name, path: event.target.value })}>
          {fields.map(({ path, unit }) => (
            <option key={path} value={path}>
              {path || "the result"}
              {unit ? ` [${unit}]` : ""}
            </option>
          ))}
        </select>
      </div>
      <div className="form-row">
        <label className="form-label" htmlFor="fault-value">
          becomes <span className="form-type">{field.unit ?? ""}</span>
        </label>
        <Editor id="fault-value" label="Value" type={field.type} draft={draft} types={service.types} errors={read.errors} path={field.path} change={(next) => set_edited({ of: key, draft: next })} />
      </div>
      <Count value={count} set={set_count} />
      <div className="row end">
        <button type="submit" className="button small primary" disabled={read.errors.length > 0 || times === null}>
          Falsify
        </button>
      </div>
    </form>
  );
}

/** Names of messages that can be held back, or stopped at. */
function useMessageNames(kind: "delay" | "stop"): string[] {
  const index = useStudio((studio) => studio.index);
  return useMemo(() => {
    const leaves = index?.model.tree.nodes.flatMap((node) => (node.message_name ? [node.message_name] : [])) ?? [];
    const calls = index?.model.services.filter(({ name }) => !name.endsWith("simulation")).flatMap((service) => service.methods.map((method) => `${service.name}.${method.name}`)) ?? [];
    return kind === "delay"
      ? [...calls.flatMap((call) => [`${call}.reply`, call]), ...leaves.flatMap((leaf) => [`${leaf}.tick`, `${leaf}.halt`])]
      : ["mission.status", ...calls.flatMap((call) => [`${call}.request`, `${call}.reply`, `${call}.error`]), ...leaves.flatMap((leaf) => [`${leaf}.tick.request`, `${leaf}.tick.reply`])];
  }, [index, kind]);
}

function Delay() {
  const names = useMessageNames("delay");
  const [message, set_message] = useState("");
  const [by, set_by] = useState("500");
  const [count, set_count] = useState("");
  const milliseconds = Number(by);
  const times = count_of(count);
  const chosen = message || (names[0] ?? "");
  const fine = milliseconds > 0 && times !== null && chosen !== "";
  return (
    <form
      className="form"
      onSubmit={(event) => {
        event.preventDefault();
        if (fine) void intervene({ delay: { message: chosen, by: `${milliseconds} ms`, ...with_count(times) } });
      }}
    >
      <Pattern id="delay-message" label="Message" names={names} value={message} set={set_message} />
      <div className="form-row">
        <label className="form-label" htmlFor="delay-by">
          by <span className="form-type">ms</span>
        </label>
        <input id="delay-by" className="field small number" inputMode="decimal" value={by} onChange={(event) => set_by(event.target.value)} aria-invalid={!(milliseconds > 0)} />
      </div>
      <Count value={count} set={set_count} />
      <div className="row end">
        <button type="submit" className="button small primary" disabled={!fine}>
          Delay
        </button>
      </div>
    </form>
  );
}

function Pattern({ id, label, names, value, set }: { id: string; label: string; names: readonly string[]; value: string; set(value: string): void }) {
  return (
    <div className="form-row">
      <label className="form-label" htmlFor={id}>
        {label}
      </label>
      <input id={id} className="field small" list={`${id}-names`} placeholder={names[0]} title="* stands for any text" value={value} spellCheck={false} autoComplete="off" onChange={(event) => set(event.target.value)} />
      <datalist id={`${id}-names`}>
        {names.map((name) => (
          <option key={name} value={name} />
        ))}
      </datalist>
    </div>
  );
}

function Force() {
  const nodes = useStudio((studio) => studio.index?.model.tree.nodes);
  const chosen = useStudio((studio) => studio.selection.node);
  const leaves = useMemo(() => nodes?.flatMap((node) => (node.message_name ? [node.message_name] : [])) ?? [], [nodes]);
  const selected = chosen === null ? null : (nodes?.[chosen]?.message_name ?? null);
  const [leaf, set_leaf] = useState("");
  const [status, set_status] = useState<"SUCCESS" | "FAILURE" | "RUNNING">("FAILURE");
  const [once, set_once] = useState(false);
  const target = leaf || selected || leaves[0];
  if (!target) return <p className="muted">This mission has no leaves that run skills.</p>;
  return (
    <form
      className="form"
      onSubmit={(event) => {
        event.preventDefault();
        void intervene({ force: { leaf: target, status, ...with_count(once ? 1 : undefined) } });
      }}
    >
      <div className="form-row">
        <label className="form-label" htmlFor="force-leaf">
          Leaf
        </label>
        <select id="force-leaf" className="field small" value={target} onChange={(event) => set_leaf(event.target.value)}>
          {leaves.map((name) => (
            <option key={name}>{name}</option>
          ))}
        </select>
      </div>
      <div className="form-row">
        <label className="form-label" htmlFor="force-status">
          answers
        </label>
        <select id="force-status" className="field small" value={status} onChange={(event) => set_status(event.target.value as typeof status)}>
          <option>SUCCESS</option>
          <option>FAILURE</option>
          <option>RUNNING</option>
        </select>
      </div>
      <div className="form-row">
        <label className="form-label" htmlFor="force-once">
          Only once
        </label>
        <span className="form-check">
          <input id="force-once" type="checkbox" checked={once} onChange={(event) => set_once(event.target.checked)} />
        </span>
      </div>
      <div className="row end">
        <button type="submit" className="button small primary">
          Force
        </button>
      </div>
    </form>
  );
}

function AtMessage() {
  const names = useMessageNames("stop");
  const [pattern, set_pattern] = useState("");
  return (
    <form
      className="form"
      onSubmit={(event) => {
        event.preventDefault();
        void intervene({ breakpoint: { message: pattern || (names[0] ?? "") } });
      }}
    >
      <Pattern id="stop-message" label="Message" names={names} value={pattern} set={set_pattern} />
      <p className="muted">The menus of nodes and of states of charts set breakpoints there.</p>
      <div className="row end">
        <button type="submit" className="button small primary">
          Stop there
        </button>
      </div>
    </form>
  );
}
