import { useEffect, useMemo, useState } from "react";

import { duration_text } from "../draw/format";
import { Fields } from "../panels/steer/Form";
import { arguments_draft, read_arguments, type DraftField } from "../panels/steer/idl";
import { StatusSign } from "../panels/mission/StatusSign";
import type { Data, IdlTypes, PlayedChart, PlayedTree } from "../protocol/types";
import { kStatuses } from "../protocol/types";
import { broken, doc_of, tree_of, useDesign } from "./design";
import { kAnswers, look, payload_of, play_chart, play_tree, session_text, simulate, useSimulation } from "./simulate";

/** The open chart or tree by hand: what it can do next, and the way back. Follows every edit. */
export function SimulatePanel() {
  const version = useDesign((state) => doc_of(state)?.version ?? 0);
  const file = useDesign((state) => state.file);
  const tree = useDesign((state) => tree_of(state)?.id);
  const why_not = useDesign(broken);
  const chart_now = useSimulation((state) => state.chart_now);
  const tree_now = useSimulation((state) => state.tree_now);
  const problem = useSimulation((state) => state.problem);
  useEffect(() => void look(), [version, file, tree]);
  return (
    <section className="simulate scroll" aria-label="Simulate" data-testid="simulate" data-version={chart_now?.version ?? tree_now?.version}>
      <h2 className="inspector-title">
        Simulate
        <button className="button small" onClick={() => simulate(false)}>
          End
        </button>
      </h2>
      {(why_not ?? problem) && (
        <p className="inspector-finding error" role="status">
          {why_not ?? problem}
        </p>
      )}
      {chart_now && <ChartPart played={chart_now} file={file ?? ""} />}
      {tree_now && <TreePart played={tree_now} />}
    </section>
  );
}

function ChartPart({ played, file }: { played: PlayedChart; file: string }) {
  const event = useSimulation((state) => state.event);
  const [seconds, set_seconds] = useState("1");
  const events = [...new Set(played.enabled.map((one) => one.event))];
  const running = played.status === "running";
  const set_event = (name: string) => useSimulation.setState({ event: name });
  const waits = Number(seconds);
  return (
    <>
      <p className="simulate-now" data-testid="simulate-now" data-status={played.status}>
        <strong>{played.status}</strong> at {duration_text(played.time)}
        {played.failure !== "" && <span className="muted">: {played.failure}</span>}
      </p>
      <div className="simulate-steps" role="group" aria-label="Steps">
        <button className="button small" disabled={played.steps.length === 0} onClick={() => void play_chart({ do: "back" })}>
          Back{played.steps.length > 0 ? ` ${played.steps.length}` : ""}
        </button>
        <button className="button small" onClick={() => void play_chart({ do: "start" })}>
          Begin again
        </button>
        <button className="button small" disabled={played.steps.length === 0} title="The steps as a file for sentree chart" onClick={() => save_session(file, played)}>
          Save the steps
        </button>
      </div>
      <h3 className="inspector-part">Events it waits for</h3>
      {events.length === 0 && <p className="muted">{running ? "None that is named." : "It has ended."}</p>}
      <ul className="simulate-events">
        {events.map((name) => (
          <li key={name}>
            <button className="button small" data-event={name} aria-pressed={name === event} onClick={() => (payload_of(name) ? set_event(name === event ? "" : name) : void play_chart({ do: "send", event: name }))}>
              {name}
            </button>
          </li>
        ))}
      </ul>
      <EventForm key={event} event={event} disabled={!running} />
      <h3 className="inspector-part">Time</h3>
      <form
        className="simulate-wait"
        onSubmit={(submitted) => {
          submitted.preventDefault();
          if (waits >= 0) void play_chart({ do: "wait", time: Math.round(waits * 1e9) });
        }}
      >
        <label htmlFor="simulate-wait">wait</label>
        <input id="simulate-wait" className="field" inputMode="decimal" value={seconds} onChange={(changed) => set_seconds(changed.target.value)} />
        <span>s</span>
        <button className="button small" disabled={!(waits >= 0) || seconds.trim() === "" || !running}>
          Wait
        </button>
      </form>
      {played.timers.map(({ due, event: sent }, i) => (
        <p key={i} className="muted">
          {sent} comes at {duration_text(due)}
        </p>
      ))}
      {Object.keys(played.data).length > 0 && (
        <>
          <h3 className="inspector-part">Data</h3>
          {Object.entries(played.data).map(([name, value]) => (
            <DataField key={name} name={name} value={value} all={played.data} />
          ))}
        </>
      )}
      <h3 className="inspector-part">The last step</h3>
      <ol className="simulate-trace mono" data-testid="simulate-trace">
        {played.trace.map(({ text }, i) => (
          <li key={i}>{text}</li>
        ))}
      </ol>
    </>
  );
}

/** A value of the chart's; another one begins again with it. */
function DataField({ name, value, all }: { name: string; value: Data; all: Record<string, Data> }) {
  const written = JSON.stringify(value);
  const [text, set_text] = useState(written);
  const [wrong, set_wrong] = useState(false);
  useEffect(() => set_text(written), [written]);
  const begin = () => {
    if (text === written) return;
    try {
      void play_chart({ do: "start", data: { ...all, [name]: JSON.parse(text) as Data } });
      set_wrong(false);
    } catch {
      set_wrong(true);
    }
  };
  return (
    <div className="inspector-field">
      <label htmlFor={`simulate-${name}`}>{name}</label>
      <input
        id={`simulate-${name}`}
        className="field mono"
        title="As JSON; Enter begins again with it"
        aria-invalid={wrong}
        spellCheck={false}
        value={text}
        onChange={(event) => set_text(event.target.value)}
        onKeyDown={(event) => event.key === "Enter" && begin()}
      />
    </div>
  );
}

/** What was given with an event the last time, in this page. */
const last_given = new Map<string, Record<string, DraftField>>();
const last_typed = new Map<string, string>();
const kNoTypes: IdlTypes = {};

/** Any event, with what it brings: a form where the interface says what, else JSON. */
function EventForm({ event, disabled }: { event: string; disabled: boolean }) {
  const described = useMemo(() => (event === "" ? null : payload_of(event)), [event]);
  const method = useMemo(() => ({ name: "reply", args: described?.fields ?? [], result: "void", oneway: false }), [described]);
  const types = described?.types ?? kNoTypes;
  const [drafts, set_drafts] = useState(() => last_given.get(event) ?? arguments_draft(method, types));
  const [name, set_name] = useState(event);
  const [typed, set_typed] = useState(() => last_typed.get(event) ?? "");
  const read = read_arguments(method, drafts, types);
  const json = (): Data | undefined => {
    if (typed.trim() === "") return undefined;
    try {
      return JSON.parse(typed) as Data;
    } catch {
      return undefined;
    }
  };
  const wrong = described ? read.errors.length > 0 : typed.trim() !== "" && json() === undefined;
  const send = () => {
    if (name === "" || wrong) return;
    if (described) last_given.set(event, drafts);
    else last_typed.set(name, typed);
    const data = described ? (read.value as Data) : json();
    void play_chart({ do: "send", event: name, ...(data === undefined ? {} : { data }) });
  };
  return (
    <form
      className="form simulate-form"
      aria-label="Event"
      onSubmit={(submitted) => {
        submitted.preventDefault();
        send();
      }}
    >
      {described ? (
        <>
          <strong className="mono">{event}</strong>
          <Fields fields={described.fields} drafts={drafts} types={types} errors={read.errors} change={set_drafts} />
        </>
      ) : (
        <>
          <input className="field" aria-label="Another event" placeholder="another event" spellCheck={false} value={name} onChange={(changed) => set_name(changed.target.value)} />
          <input className="field mono" aria-label="Its data as JSON" placeholder='data, e.g. {"x": 1}' spellCheck={false} value={typed} onChange={(changed) => set_typed(changed.target.value)} />
        </>
      )}
      <button className="button small primary" disabled={disabled || wrong || name === ""}>
        Send
      </button>
    </form>
  );
}

/** The browser's own way to keep a file. */
function save_session(file: string, played: PlayedChart): void {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(new Blob([session_text(file, played)], { type: "text/plain" }));
  link.download = `${file.split("/").at(-1)?.replace(/\.scxml$/, "") ?? "chart"}.steps`;
  link.click();
  URL.revokeObjectURL(link.href);
}

function TreePart({ played }: { played: PlayedTree }) {
  return (
    <>
      <p className="simulate-now" data-testid="simulate-now" data-status={played.result}>
        <Sign status={played.result} /> <strong>{played.result}</strong> after {played.ticks} {played.ticks === 1 ? "tick" : "ticks"}, at {duration_text(played.time)}
      </p>
      <div className="simulate-steps" role="group" aria-label="Steps">
        <button className="button small primary" onClick={() => void play_tree({ do: "tick" })}>
          Tick
        </button>
        <button className="button small" disabled={played.back === 0} onClick={() => void play_tree({ do: "back" })}>
          Back{played.back > 0 ? ` ${played.back}` : ""}
        </button>
        <button className="button small" onClick={() => void play_tree({ do: "start" })}>
          Begin again
        </button>
        {played.timer !== null && (
          <button className="button small" onClick={() => void play_tree({ do: "wait" })}>
            Wait until {duration_text(played.timer)}
          </button>
        )}
      </div>
      <h3 className="inspector-part">What the leaves answer</h3>
      <ul className="simulate-leaves">
        {played.leaves.map((leaf) => (
          <li key={leaf.leaf} data-leaf={leaf.leaf} data-answer={leaf.answer}>
            <span className="ellipsis" title={leaf.name}>
              <Sign status={leaf.status} /> {leaf.name}
            </span>
            <span className="tool-group" role="group" aria-label={`${leaf.name} answers`}>
              {kAnswers.map(({ status, sign, word }) =>
                status === "RUNNING" && leaf.condition ? null : (
                  <button key={status} className="button small" aria-pressed={leaf.answer === status} aria-label={word} title={word} onClick={() => void play_tree({ do: "answer", leaf: leaf.leaf, status })}>
                    {sign}
                  </button>
                ),
              )}
            </span>
          </li>
        ))}
      </ul>
      {played.leaves.length === 0 && <p className="muted">No leaf of it is a skill.</p>}
    </>
  );
}

function Sign({ status }: { status: string }) {
  const at = kStatuses.indexOf(status as (typeof kStatuses)[number]);
  if (at <= 0) return null;
  return (
    <svg className={`simulate-sign ${status.toLowerCase()}`} width="16" height="16" viewBox="-9 -9 18 18" aria-hidden="true">
      <StatusSign status={at} />
    </svg>
  );
}
