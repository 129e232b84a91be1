import { Menu, type MenuEntry } from "../widgets/Menu";
import { kStateKinds } from "./ChartForm";
import { transition_text } from "./chart_words";
import { add_fresh_state, chosen_state, chosen_states, chosen_transition, doc_of, focus_field, gesture, obstacle, useDesign } from "./design";
import { clipboard_text } from "./clipboard";
import { duplicate_states, keep_states, move_states, named_states, paste_states, remove_states, wrap_states } from "./states";

/** States that a menu lists; the others are chosen at the right. */
const kListedMax = 12;

/** What can be done with the chosen states or transition, or with the chart. */
export function ChartMenu({ x, y, close }: { x: number; y: number; close(): void }) {
  const chart = useDesign((state) => doc_of(state)?.shown_chart ?? null);
  const state = useDesign(chosen_state);
  const transition = useDesign(chosen_transition);
  const also = useDesign((now) => now.also_states);
  const why_not = useDesign(obstacle);
  if (!chart) return null;
  const holds = state === null || state.kind === "state" || state.kind === "parallel";
  const id = state?.id ?? "";
  const all = chosen_states({ state: state?.id ?? null, also_states: also }, chart).map((one) => one.id);
  const wraps: MenuEntry[] = (["state", "parallel"] as const).map((kind) => ({ label: `Put ${all.length > 1 ? "them" : "it"} into a new ${kind}`, ...(kind === "state" ? { hint: "W" } : {}), why_not, run: () => void wrap_states(kind) }));
  const paste: MenuEntry = { label: "Paste", hint: "Ctrl+V", why_not, run: () => void clipboard_text().then(paste_states) };
  const copies: MenuEntry[] = [
    { label: "Duplicate", hint: "D", why_not, run: duplicate_states },
    { label: "Copy", hint: "Ctrl+C", run: () => keep_states(false) },
    { label: "Cut", hint: "Ctrl+X", why_not, run: () => keep_states(true) },
    paste,
  ];
  const remove: MenuEntry = { label: "Delete", hint: "Del", why_not, run: remove_states };
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
    : all.length > 1
      ? [...wraps, ...moves(all), "line", ...copies, "line", remove]
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
                ...wraps,
              ]),
          ...(holds ? (["line", ...add] satisfies MenuEntry[]) : []),
          ...kStateKinds.filter(({ kind }) => kind !== state.kind && kind.endsWith("history") === state.kind.endsWith("history")).map(({ kind }) => ({ label: `Make it ${kind === "final" ? "final" : `a ${kind.replace("-", " ")}`}`, why_not, run: () => void gesture({ what: "set_kind", state: id, kind }) })),
          ...moves([id]),
          "line",
          ...copies,
          "line",
          remove,
        ]
      : [...add, "line", paste];
  const head = transition ? transition_text(transition) : all.length > 0 ? named_states(all) : "";
  return <Menu x={x} y={y} close={close} label={head === "" ? "Chart" : head} head={head === "" ? undefined : <strong>{head}</strong>} entries={entries} />;

  function moves(moved: readonly string[]): MenuEntry[] {
    const inside = new Set(chart!.states.filter((one) => moved.includes(one.id)).map((one) => one.inside));
    const is_there = (place: string) => inside.size === 1 && inside.has(place);
    const to = chart!.states.filter((one) => one.id !== "" && !moved.includes(one.id) && !is_there(one.id) && chart!.states.some((other) => other.inside === one.id));
    const places = [...(is_there("") ? [] : [{ id: "", name: "the top level" }]), ...to.map((one) => ({ id: one.id, name: one.id }))].slice(0, kListedMax);
    if (places.length === 0) return [];
    return [{ heading: "Move to" }, ...places.map((place) => ({ label: place.name, why_not, run: () => move_states(moved, place.id) }))];
  }
}
