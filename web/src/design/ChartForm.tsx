import { useEffect, useMemo, useState } from "react";

import type { EditedChart, EditedState, EditedTransition, StateKind } from "../protocol/types";
import { useStudio } from "../store/store";
import { Actions } from "./Actions";
import { part_lines } from "./chart_places";
import { condition_words, event_words, is_history, leads_out, transition_text } from "./chart_words";
import { choose_state, choose_transition, chosen_state, chosen_states, chosen_transition, doc_of, findings_of, focus_field, focus_picture, fresh_id, gesture, gesture_then, rename_state, take_back_made, useDesign } from "./design";
import { Editable } from "./Editable";
import { Wrong } from "./Inspector";
import { duplicate_states, keep_states, move_states, named_states, remove_states, wrap_states } from "./states";
import { Options, TextField } from "./TextField";

export const kStateKinds: readonly { kind: StateKind; name: string }[] = [
  { kind: "state", name: "state" },
  { kind: "parallel", name: "parallel: all inside at once" },
  { kind: "final", name: "final" },
  { kind: "history", name: "history" },
  { kind: "deep-history", name: "deep history" },
];
const kData: Readonly<Record<string, string>> = { "a value": '<data id="name" expr="0"/>', "a port": '<data id="name"/>' };

/** Of a condition in a field of one line. */
const kLine = 30;

const kNone: readonly never[] = [];
export const useServices = () => useStudio((studio) => studio.index?.model.services) ?? kNone;

/** The chosen state or transition of a chart, and what can be added to the chart. */
export function ChartForm() {
  const chart = useDesign((state) => doc_of(state)?.shown_chart ?? null);
  const state = useDesign(chosen_state);
  const transition = useDesign(chosen_transition);
  const also = useDesign((now) => now.also_states);
  if (!chart) return null;
  const several = chosen_states({ state: state?.id ?? null, also_states: also }, chart);
  if (several.length > 1) return <StatesForm chart={chart} states={several} />;
  return (
    <form className="inspector-form scroll" aria-label="Chart" onSubmit={(submitted) => submitted.preventDefault()} data-testid="chart-form">
      <PartFindings chart={chart} line={transition?.line ?? state?.line ?? null} />
      {transition ? <TransitionPart key={transition.transition} chart={chart} transition={transition} /> : state ? <StatePart key={state.id} chart={chart} state={state} /> : <WholePart chart={chart} />}
      <NewState state={state} />
    </form>
  );
}

/** Several states: what can be done to all of them. */
function StatesForm({ chart, states }: { chart: EditedChart; states: readonly EditedState[] }) {
  const ids = states.map(({ id }) => id);
  const inside = new Set(states.map((state) => state.inside));
  const done: readonly [string, string, () => void][] = [
    ["Put them into a new state", "W", () => void wrap_states("state")],
    ["Put them into a new parallel", "", () => void wrap_states("parallel")],
    ["Duplicate them", "D", duplicate_states],
    ["Copy them", "Ctrl+C", () => keep_states(false)],
    ["Cut them, to paste them elsewhere", "Ctrl+X", () => keep_states(true)],
    ["Delete them", "Del", remove_states],
  ];
  return (
    <form className="inspector-form scroll" aria-label="Chosen states" onSubmit={(submitted) => submitted.preventDefault()} data-testid="states-form">
      <h2 className="inspector-title">{named_states(ids)}</h2>
      <p className="muted">{ids.join(", ")}</p>
      <Editable>
        <Select id="design-inside" label="inside" value={inside.size === 1 ? [...inside][0]! : kNew} tell={(value) => move_states(ids, value)}>
          {inside.size > 1 && <option value={kNew}>different ones</option>}
          <option value="">nothing: the top level</option>
          {chart.states.filter((one) => one.id !== "" && !ids.includes(one.id) && (one.kind === "state" || one.kind === "parallel")).map((one) => (
            <option key={one.id}>{one.id}</option>
          ))}
        </Select>
        <p className="inspector-actions">
          {done.map(([name, keys, run]) => (
            <button key={name} type="button" className="button small" title={keys} onClick={run}>
              {name}
            </button>
          ))}
        </p>
      </Editable>
    </form>
  );
}

/** What is wrong with the chosen part. */
function PartFindings({ chart, line }: { chart: EditedChart; line: number | null }) {
  const summary = useDesign((state) => state.summary);
  const doc = useDesign(doc_of);
  const wrong = useMemo(() => {
    if (!doc || line === null) return [];
    const findings = findings_of(summary, doc.file);
    const lines = part_lines(chart, doc.places.shown, findings.map(({ from }) => doc.places.at(from)));
    return findings.filter((_, i) => lines[i] === line);
  }, [summary, doc, chart, line]);
  return (
    <Editable>
      <Wrong findings={wrong} />
    </Editable>
  );
}

function WholePart({ chart }: { chart: EditedChart }) {
  return (
    <>
      <h2 className="inspector-title">Chart</h2>
      <p className="muted">Double click on the ground: a state. From a state’s edge: a transition. Drag a state into another. With Shift or Ctrl several are chosen, by clicks or by a band. The right button, or M, says what else.</p>
      <Editable>
        <Actions id="chart-data" title="Data and ports" place={{ state: "", block: "datamodel" }} actions={chart.data} offered={kData} />
      </Editable>
    </>
  );
}

function StatePart({ chart, state }: { chart: EditedChart; state: EditedState }) {
  const { id, kind } = state;
  const states = chart.states.filter((one) => one.id !== "" && one.id !== id);
  const rename = (name: string) => void rename_state(id, name).then((done) => done && focus_picture());
  return (
    <>
      <h2 className="inspector-title">{id}</h2>
      <Editable>
        <TextField id="design-state" label="id, here and wherever it is named" value={id} tell={rename} escape={() => void take_back_made(id)} left={() => useDesign.setState({ made: null })} />
        <Select id="design-kind" label="kind" value={kind} tell={(value) => void gesture({ what: "set_kind", state: id, kind: value as StateKind })}>
          {kStateKinds.filter((one) => is_history(one.kind) === is_history(kind)).map((one) => (
            <option key={one.kind} value={one.kind}>
              {one.name}
            </option>
          ))}
        </Select>
        <Select id="design-inside" label="inside" value={state.inside} tell={(value) => move_states([id], value)}>
          <option value="">nothing: the top level</option>
          {states.filter((one) => one.kind === "state" || one.kind === "parallel").map((one) => (
            <option key={one.id}>{one.id}</option>
          ))}
        </Select>
        {!is_history(kind) && (
          <label className="inspector-check">
            <input type="checkbox" checked={state.initial} disabled={state.initial} onChange={() => void gesture({ what: "set_initial", state: id })} /> {state.inside || "the chart"} begins with it
          </label>
        )}
      </Editable>
      <TransitionList chart={chart} state={state} />
      <Editable>
        {leads_out(kind) && <NewTransition chart={chart} source={id} />}
        {!is_history(kind) && (
          <>
            <Actions id="entry" title="On entry" place={{ state: id, block: "onentry" }} actions={state.onentry} />
            <Actions id="exit" title="On exit" place={{ state: id, block: "onexit" }} actions={state.onexit} />
          </>
        )}
        <button type="button" className="button small" title="Delete the state and the transitions to it (Del)" onClick={remove_states}>
          Delete {id}
        </button>
      </Editable>
    </>
  );
}

/** Out of the state, the first that can be taken is. */
function TransitionList({ chart, state }: { chart: EditedChart; state: EditedState }) {
  const own = chart.transitions.filter(({ source, written }) => written && source === state.id);
  if (own.length === 0) return null;
  return (
    <>
      <h3 className="inspector-part">Transitions, the first that can be taken is</h3>
      <ul className="transition-list">
        {own.map((transition) => (
          <li key={transition.transition}>
            <button type="button" className="button small ellipsis" title={transition_text(transition)} onClick={() => choose_transition(transition)}>
              {transition_text(transition)}
            </button>
          </li>
        ))}
      </ul>
    </>
  );
}

function TransitionPart({ chart, transition }: { chart: EditedChart; transition: EditedTransition }) {
  const services = useServices();
  const { source, written } = transition;
  const at = transition.transition;
  const ids = chart.states.map(({ id }) => id).filter((id) => id !== "");
  const own = chart.transitions.filter((one) => one.written && one.source === source);
  const place = own.indexOf(transition);
  const move = (to: number, state = source) =>
    void gesture_then({ what: "move_transition", transition: at, state, index: to }, () => {
      const now = doc_of(useDesign.getState())?.shown_chart?.transitions.filter((one) => one.written && one.source === state) ?? [];
      choose_transition(now[Math.min(to > place && state === source ? to - 1 : to, now.length - 1)] ?? null);
    });
  return (
    <>
      <h2 className="inspector-title">{written ? `From ${source}` : `${source || "The chart"} begins`}</h2>
      <Editable>
        {written && (
          <>
            <TextField id="transition-event" label="event" value={transition.event} options={event_words(chart, services)} hint="none: taken at once" tell={(event) => void gesture({ what: "set_transition", transition: at, event })} />
            <TextField id="transition-condition" label="condition" value={transition.condition} area={transition.condition.length > kLine} options={condition_words(chart, transition.event, services)} tell={(condition) => void gesture({ what: "set_transition", transition: at, condition })} />
          </>
        )}
        <TextField id="transition-target" label={written ? "target; of parallel states several" : "with"} value={transition.target} options={ids} hint="none: it stays where it is" tell={(target) => void gesture({ what: "set_transition", transition: at, target })} />
        {written && place >= 0 && (
          <>
            <Select id="transition-source" label="from" value={source} tell={(state) => move(Number.MAX_SAFE_INTEGER, state)}>
              {chart.states.filter(({ kind }) => kind === "state" || kind === "parallel").map(({ id }) => (
                <option key={id}>{id}</option>
              ))}
            </Select>
            {own.length > 1 && (
              <p className="transition-order">
                {place + 1} of {own.length}
                <button type="button" className="button small" disabled={place === 0} onClick={() => move(place - 1)}>
                  Earlier
                </button>
                <button type="button" className="button small" disabled={place + 1 === own.length} onClick={() => move(place + 2)}>
                  Later
                </button>
              </p>
            )}
            <Actions id="transition" title="What is done" place={{ transition: at }} actions={transition.actions} />
          </>
        )}
        <button type="button" className="button small" title="Delete the transition (Del)" onClick={() => void gesture({ what: "remove_transition", transition: at })}>
          Delete the transition
        </button>
      </Editable>
      {source !== "" && (
        <button type="button" className="button small" onClick={() => choose_state(source)}>
          To {source}
        </button>
      )}
    </>
  );
}

/** No state has such an id. */
const kNew = " new";

function NewTransition({ chart, source }: { chart: EditedChart; source: string }) {
  const services = useServices();
  const [event, set_event] = useState("");
  const [condition, set_condition] = useState("");
  const [target, set_target] = useState("");
  /** Of a target that is made for it; null: it leads to one that is there, or stays. */
  const [fresh, set_fresh] = useState<string | null>(null);
  const drawn_to = useDesign((now) => now.drawn_to);
  useEffect(() => {
    if (drawn_to === null) return;
    set_target(drawn_to);
    set_fresh(drawn_to === "" ? fresh_id() : null);
    useDesign.setState({ drawn_to: null });
    focus_field("design-event");
  }, [drawn_to]);
  const nothing = event === "" && condition === "" && target === "" && !fresh;
  const add = () => {
    if (nothing) return;
    void gesture_then({ what: "add_transition", state: source, target: fresh ?? target, event, condition, fresh: fresh !== null }, focus_picture).then((done) => done && clear());
  };
  const clear = () => {
    set_event("");
    set_condition("");
    if (fresh !== null) set_fresh(null);
  };
  /** Nothing of it is there yet. */
  const leave = () => {
    clear();
    set_target("");
    focus_picture();
  };
  return (
    <>
      <h3 className="inspector-part">New transition from {source}</h3>
      <Field id="design-event" label="event" value={event} set={set_event} done={add} leave={leave} options={event_words(chart, services)} />
      <Field id="design-condition" label="condition" value={condition} set={set_condition} done={add} leave={leave} options={condition_words(chart, event, services)} />
      <Select
        id="design-target"
        label="target"
        value={fresh === null ? target : kNew}
        tell={(value) => {
          set_fresh(value === kNew ? fresh_id() : null);
          set_target(value === kNew ? "" : value);
        }}
      >
        <option value="">none</option>
        <option value={kNew}>a new state</option>
        {chart.states.filter(({ id }) => id !== "").map(({ id }) => (
          <option key={id}>{id}</option>
        ))}
      </Select>
      {fresh !== null && <Field id="design-target-id" label="its id" value={fresh} set={set_fresh} done={add} leave={leave} options={[]} />}
      <button type="button" className="button small" disabled={nothing} onClick={add}>
        Add the transition
      </button>
    </>
  );
}

function NewState({ state }: { state: EditedState | null }) {
  const [fresh, set_fresh] = useState("");
  const [kind, set_kind] = useState<StateKind>("state");
  const [inside, set_inside] = useState(false);
  const can_hold = state !== null && (state.kind === "state" || state.kind === "parallel");
  const add = () => {
    if (fresh === "") return;
    const choose = () => {
      choose_state(fresh);
      focus_picture();
    };
    void gesture_then({ what: "add_state", inside: can_hold && (inside || is_history(kind)) ? state.id : "", id: fresh, kind }, choose).then((done) => done && set_fresh(""));
  };
  return (
    <>
      <Editable>
        <h3 className="inspector-part">New state</h3>
        <Field
          id="design-new-state"
          label="id"
          value={fresh}
          set={set_fresh}
          done={add}
          leave={() => {
            set_fresh("");
            focus_picture();
          }}
          options={[]}
        />
        <Select id="design-new-kind" label="kind" value={kind} tell={(value) => set_kind(value as StateKind)}>
          {kStateKinds.map((one) => (
            <option key={one.kind} value={one.kind}>
              {one.name}
            </option>
          ))}
        </Select>
        {can_hold && (
          <label className="inspector-check">
            <input type="checkbox" checked={inside || is_history(kind)} disabled={is_history(kind)} onChange={(changed) => set_inside(changed.target.checked)} /> inside {state.id}
          </label>
        )}
        <button type="button" className="button small" disabled={fresh === ""} onClick={add}>
          Add the state
        </button>
      </Editable>
    </>
  );
}

function Select({ id, label, value, tell, children }: { id: string; label: string; value: string; tell(value: string): void; children: React.ReactNode }) {
  return (
    <div className="inspector-field">
      <label htmlFor={id}>{label}</label>
      <select id={id} className="field" value={value} onChange={(changed) => tell(changed.target.value)}>
        {children}
      </select>
    </div>
  );
}

/** Escape leaves it with nothing done. */
function Field({ id, label, value, set, done, leave, options }: { id: string; label: string; value: string; set(text: string): void; done(): void; leave(): void; options: readonly string[] }) {
  const keys = (pressed: React.KeyboardEvent) => {
    if (pressed.key === "Enter") done();
    else if (pressed.key === "Escape") leave();
    else return;
    pressed.stopPropagation();
  };
  return (
    <div className="inspector-field">
      <label htmlFor={id}>{label}</label>
      <input id={id} className="field" list={options.length > 0 ? `${id}-options` : undefined} spellCheck={false} autoComplete="off" value={value} onChange={(changed) => set(changed.target.value)} onKeyDown={keys} />
      <Options id={id} options={options} />
    </div>
  );
}
