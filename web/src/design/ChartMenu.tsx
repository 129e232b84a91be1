import { Menu, type MenuEntry } from "../widgets/Menu";
import { kStateKinds } from "./ChartForm";
import { transition_text } from "./chart_words";
import { add_fresh_state, choose_state, chosen_state, chosen_transition, doc_of, focus_field, fresh_id, gesture, gesture_then, obstacle, useDesign } from "./design";

/** States that a menu lists; the others are chosen at the right. */
const kListedMax = 12;

/** What can be done with the chosen state or transition, or with the chart. */
export function ChartMenu({ x, y, close }: { x: number; y: number; close(): void }) {
  const chart = useDesign((state) => doc_of(state)?.shown_chart ?? null);
  const state = useDesign(chosen_state);
  const transition = useDesign(chosen_transition);
  const why_not = useDesign(obstacle);
  if (!chart) return null;
  const holds = state === null || state.kind === "state" || state.kind === "parallel";
  const id = state?.id ?? "";
  const add: MenuEntry[] = kStateKinds
    .filter(({ kind }) => !kind.endsWith("history") || (state !== null && chart.states.some(({ inside }) => inside === id)))
    .map(({ kind }) => ({ label: `Add a ${kind.replace("-", " ")} ${state ? "inside" : ""}`, why_not, run: () => void add_fresh_state(id, kind) }));
  const entries: MenuEntry[] = transition
    ? [
        ...(transition.written ? [{ label: "Event and condition …", hint: "F2", run: () => focus_field("transition-event") }] : []),
        { label: "Target …", run: () => focus_field("transition-target") },
        "line",
        { label: "Delete", hint: "Del", why_not, run: () => void gesture({ what: "remove_transition", transition: transition.transition }) },
      ]
    : state
      ? [
          { label: "Rename …", hint: "F2", why_not, run: () => focus_field("design-state") },
          ...(state.kind.endsWith("history")
            ? []
            : [
                {
                  label: `${state.inside || "The chart"} begins with it`,
                  checked: state.initial,
                  why_not: state.initial ? "It does already" : why_not,
                  run: () => void gesture({ what: "set_initial", state: id }),
                },
                ...(["state", "parallel"] as const).map((kind) => ({ label: `Put it into a new ${kind}`, why_not, run: () => void wrap(id, kind) })),
              ]),
          ...(holds ? (["line", ...add] satisfies MenuEntry[]) : []),
          ...kStateKinds.filter(({ kind }) => kind !== state.kind && kind.endsWith("history") === state.kind.endsWith("history")).map(({ kind }) => ({ label: `Make it ${kind === "final" ? "final" : `a ${kind.replace("-", " ")}`}`, why_not, run: () => void gesture({ what: "set_kind", state: id, kind }) })),
          ...moves(id),
          "line",
          { label: "Delete", hint: "Del", why_not, run: () => void gesture({ what: "remove_state", state: id }) },
        ]
      : add;
  const head = transition ? transition_text(transition) : id;
  return <Menu x={x} y={y} close={close} label={head === "" ? "Chart" : head} head={head === "" ? undefined : <strong>{head}</strong>} entries={entries} />;

  function moves(moved: string): MenuEntry[] {
    const own = chart!.states.find((one) => one.id === moved)!;
    const to = chart!.states.filter((one) => one.id !== "" && one.id !== moved && one.id !== own.inside && chart!.states.some(({ inside }) => inside === one.id));
    const places = [...(own.inside === "" ? [] : [{ id: "", name: "the top level" }]), ...to.map((one) => ({ id: one.id, name: one.id }))].slice(0, kListedMax);
    if (places.length === 0) return [];
    return [{ heading: "Move to" }, ...places.map((place) => ({ label: place.name, why_not, run: () => void gesture_then({ what: "move_state", state: moved, inside: place.id }, () => choose_state(moved)) }))];
  }
}

async function wrap(state: string, kind: "state" | "parallel"): Promise<void> {
  const id = fresh_id();
  await gesture_then({ what: "wrap_state", state, id, kind }, () => {
    choose_state(id);
    focus_field("design-state", id);
  });
}
