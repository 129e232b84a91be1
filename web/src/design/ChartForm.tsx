import { useEffect, useState } from "react";

import { doc_of, focus_field, gesture, useDesign } from "./design";

/** The chosen state of a chart, and what can be added to the chart. */
export function ChartForm() {
  const chart = useDesign((state) => doc_of(state)?.shown_chart ?? null);
  const chosen = useDesign((state) => state.state);
  const states = chart?.states.map(({ id }) => id).filter((id) => id !== "") ?? [];
  const state = chosen !== null && states.includes(chosen) ? chosen : null;
  const [name, set_name] = useState("");
  const [fresh, set_fresh] = useState("");
  const [final, set_final] = useState(false);
  const [inside, set_inside] = useState(false);
  const [event, set_event] = useState("");
  const [condition, set_condition] = useState("");
  const [target, set_target] = useState("");
  useEffect(() => set_name(state ?? ""), [state]);
  const drawn_to = useDesign((now) => now.drawn_to);
  useEffect(() => {
    if (drawn_to === null) return;
    set_target(drawn_to);
    useDesign.setState({ drawn_to: null });
    focus_field("design-event");
  }, [drawn_to]);

  const rename = () => {
    if (state && name !== "" && name !== state) void gesture({ what: "rename_state", state, id: name }).then((done) => (done ? useDesign.setState({ state: name }) : set_name(state)));
  };
  const add_state = () => {
    if (fresh === "") return;
    void gesture({ what: "add_state", inside: inside && state ? state : "", id: fresh, final }).then((done) => {
      if (!done) return;
      useDesign.setState({ state: fresh });
      set_fresh("");
    });
  };
  const add_transition = () => {
    if (!state) return;
    void gesture({ what: "add_transition", state, target, event, condition }).then((done) => {
      if (!done) return;
      set_event("");
      set_condition("");
    });
  };
  return (
    <form className="inspector-form scroll" aria-label="Chart" onSubmit={(submitted) => submitted.preventDefault()} data-testid="chart-form">
      <h2 className="inspector-title">{state ?? "Chart"}</h2>
      {state ? (
        <>
          <Field id="design-state" label="id, here and wherever it is named" value={name} set={set_name} done={rename} />
          <h3 className="inspector-part">Transition from {state}</h3>
          <Field id="design-event" label="event" value={event} set={set_event} done={add_transition} />
          <Field id="design-condition" label="condition" value={condition} set={set_condition} done={add_transition} />
          <div className="inspector-field">
            <label htmlFor="design-target">target</label>
            <select id="design-target" className="field" value={target} onChange={(changed) => set_target(changed.target.value)}>
              <option value="">none</option>
              {states.map((id) => (
                <option key={id}>{id}</option>
              ))}
            </select>
          </div>
          <button type="button" className="button small" disabled={event === "" && condition === "" && target === ""} onClick={add_transition}>
            Add the transition
          </button>
          <button type="button" className="button small" title="Delete the state (Del)" onClick={() => void gesture({ what: "remove_state", state })}>
            Delete {state}
          </button>
        </>
      ) : (
        <p className="muted">Choose a state to rename it, or to add a transition.</p>
      )}
      <h3 className="inspector-part">New state</h3>
      <Field id="design-new-state" label="id" value={fresh} set={set_fresh} done={add_state} />
      <label className="inspector-check">
        <input type="checkbox" checked={final} onChange={(changed) => set_final(changed.target.checked)} /> final
      </label>
      {state && (
        <label className="inspector-check">
          <input type="checkbox" checked={inside} onChange={(changed) => set_inside(changed.target.checked)} /> inside {state}
        </label>
      )}
      <button type="button" className="button small" disabled={fresh === ""} onClick={add_state}>
        Add the state
      </button>
    </form>
  );
}

function Field({ id, label, value, set, done }: { id: string; label: string; value: string; set(text: string): void; done(): void }) {
  return (
    <div className="inspector-field">
      <label htmlFor={id}>{label}</label>
      <input id={id} className="field" spellCheck={false} autoComplete="off" value={value} onChange={(changed) => set(changed.target.value)} onKeyDown={(pressed) => pressed.key === "Enter" && done()} />
    </div>
  );
}
