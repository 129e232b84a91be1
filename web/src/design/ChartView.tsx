import { useEffect, useMemo, useRef, useState } from "react";

import { Edge, Label, StateShape } from "../panels/charts/ChartPicture";
import { composites, FoldCount, FoldSign, useFolding } from "../panels/charts/folding";
import { read_in } from "../panels/charts/read_in";
import { follow_pointer } from "../picture/drag";
import { Minimap } from "../picture/Minimap";
import { mark_of, state_key, transition_key, useReached } from "../panels/reached/reached";
import { usePictureView } from "../picture/use_picture_view";
import { to_picture } from "../picture/viewport";
import { useCommand } from "../widgets/commands";
import { curve } from "../panels/mission/TreePicture";
import type { EditedChart, EditedTransition, Rect } from "../protocol/types";
import { request } from "../store/store";
import { useServices } from "./ChartForm";
import { ChartMenu } from "./ChartMenu";
import { part_lines } from "./chart_places";
import { event_words, leads_out, transition_text } from "./chart_words";
import { clipboard_text, usePaste } from "./clipboard";
import { add_fresh_state, broken, choose_state, choose_states, choose_transition, chosen_states, chosen_transition, doc_of, findings_of, focus_field, gesture, go_to, obstacle, refusal, toggle_state, useDesign } from "./design";
import { LabelField } from "./LabelField";
import { line_start } from "./places";
import { outermost_states, states_inside } from "./selection";
import { payload_of, play_chart, useSimulation } from "./simulate";
import { duplicate_states, keep_states, move_states, named_states, paste_states, remove_states, useKeptStates, wrap_states } from "./states";
import { in_turn } from "./turns";

/** A transition that is being drawn, in pixels of the picture, and the state that it would lead to. */
interface Line {
  from: [number, number];
  to: [number, number];
  onto: string | null;
}

/** States that are being moved, where the pointer is in the window, and the state that they would go into ("": the top level). */
interface Carried {
  ids: readonly string[];
  x: number;
  y: number;
  into: string | null;
  why_not: string | null;
}

/** What is done to a chart by key. */
const kChartCommands: readonly { title: string; keys: string }[] = [
  { title: "Add a state", keys: "Enter" },
  { title: "Add a transition from CHOSEN", keys: "N" },
  { title: "Choose the next state", keys: "S" },
  { title: "Choose the next state, too", keys: "A" },
  { title: "Choose the next transition", keys: "T" },
  { title: "Rename CHOSEN, or say its event", keys: "F2" },
  { title: "Put CHOSEN into a new state", keys: "W" },
  { title: "Another CHOSEN beside it", keys: "D" },
  { title: "Copy CHOSEN", keys: "Ctrl+C" },
  { title: "Cut CHOSEN, to paste it elsewhere", keys: "Ctrl+X" },
  { title: "Paste states", keys: "Ctrl+V" },
  { title: "What else can be done to CHOSEN", keys: "M" },
  { title: "Hide what is inside of CHOSEN, or show it", keys: "C" },
  { title: "Delete CHOSEN", keys: "Del" },
];
const kKeyNames: Readonly<Record<string, string>> = { Del: "Delete" };
/** Of one state alone. */
const kAlone = ["n", "F2"];

/** How near to its outline a state is held by its edge, on either side. */
const kEdge_px = 7;

/** Chooses beside what is chosen. */
const adds = (event: { shiftKey: boolean; ctrlKey: boolean; metaKey: boolean }) => event.shiftKey || event.ctrlKey || event.metaKey;

function state_of(target: EventTarget | null): { element: Element; id: string } | null {
  const element = target instanceof Element ? target.closest("[data-id]") : null;
  return element ? { element, id: element.getAttribute("data-id") ?? "" } : null;
}

function at_edge(element: Element, { clientX, clientY }: PointerEvent): boolean {
  const { left, right, top, bottom } = (element.querySelector(".shape, rect, circle") ?? element).getBoundingClientRect();
  const depth = Math.min(clientX - left, right - clientX, clientY - top, bottom - clientY);
  // Of a small one the middle is left for choosing it.
  return depth <= Math.min(kEdge_px, (right - left) / 4, (bottom - top) / 4);
}

/** A chart as its text has it; what one clicks is shown in the text. */
export function ChartView({ chart, file }: { chart: EditedChart; file: string }) {
  const why_dim = useDesign(broken);
  const why_not = useDesign(obstacle);
  const summary = useDesign((state) => state.summary);
  const version = useDesign((state) => doc_of(state)?.version ?? 0);
  const chosen = useDesign((state) => state.state);
  const also = useDesign((state) => state.also_states);
  const all_chosen = useMemo(() => chosen_states({ state: chosen, also_states: also }, chart).map(({ id }) => id), [chosen, also, chart]);
  const services = useServices();
  const kept = useKeptStates((state) => (state.kept?.cut && state.kept.file === file ? state.kept.states : null));
  const chosen_edge = useDesign(chosen_transition);
  const played = useSimulation(({ on, file: of, chart_now }) => (on && of === file ? chart_now : null));

  const { shown, folded, closed, toggle } = useFolding(file, chart, version, (ids) =>
    request("design_fold", { file, closed: ids }).then((found) => (found.version === version ? found : null)),
  );
  const { layout } = shown;
  const box: Rect = useMemo(() => ({ x: 0, y: 0, ...layout.size }), [layout]);
  const read = useMemo(() => read_in(layout), [layout]);
  const at_chosen = shown.states.findIndex((at) => chosen !== null && chart.states[at]?.id === chosen);
  const [line, set_line] = useState<Line | null>(null);
  const [carried, set_carried] = useState<Carried | null>(null);
  const [menu, set_menu] = useState<{ x: number; y: number } | null>(null);
  /** The transition whose label is written, of which version, and where in the window. */
  const [labelled, set_labelled] = useState<{ transition: EditedTransition; version: number; x: number; y: number } | null>(null);
  const [band, set_band] = useState<Rect | null>(null);
  const in_band = useMemo(() => new Set(band ? states_inside(chart, shown, band) : []), [band, chart, shown]);
  const drew = useRef(false);
  const latest = useRef(carried);
  latest.current = carried;
  const composite = useMemo(() => composites(chart.layout), [chart]);
  const holds = (id: string) => composite.has(chart.states.findIndex((state) => state.id === id));
  /** The state under the pointer; "": the ground; null: not in the picture. */
  const under = (at: PointerEvent) => {
    const element = document.elementFromPoint(at.clientX, at.clientY);
    return element && svg.current?.contains(element) ? (state_of(element)?.id ?? "") : null;
  };
  const new_transition = () => {
    const kind = chart.states.find(({ id }) => id === chosen)?.kind ?? "state";
    if (leads_out(kind)) focus_field("design-event");
    else useDesign.setState({ refused: `${chosen} is ${kind === "final" ? "final" : `a ${kind.replace("-", " ")}`}: no transition of one's own leads out of it` });
  };
  const draw_transition = (from: string, event: PointerEvent) => {
    const place = (at: { clientX: number; clientY: number }): [number, number] => {
      const box = svg.current!.getBoundingClientRect();
      return [at.clientX - box.left, at.clientY - box.top];
    };
    follow_pointer(event, {
      from_px: 4,
      move: (at) => {
        drew.current = true;
        set_line({ from: place(event), to: place(at), onto: under(at) || null });
      },
      drop: (at) => {
        const target = under(at);
        if (target !== null) useDesign.setState({ state: from, also_states: [], transition: null, drawn_to: target, refused: null });
      },
      end: () => set_line(null),
    });
  };
  /** With all that are chosen, if it is one of them. */
  const carry = (id: string, event: PointerEvent) => {
    const ids = all_chosen.includes(id) ? outermost_states(chart, chart.states.filter((one) => all_chosen.includes(one.id))).map((one) => one.id) : [id];
    const stay = new Set(ids.map((one) => chart.states.find((state) => state.id === one)?.inside ?? ""));
    follow_pointer(event, {
      from_px: 6,
      move: (at) => {
        drew.current = true;
        const found = under(at);
        const into = found === null || ids.includes(found) || (stay.size === 1 && stay.has(found)) ? null : found;
        const same = latest.current?.into === into;
        set_carried({ ids, x: at.clientX, y: at.clientY, into, why_not: same ? (latest.current?.why_not ?? null) : null });
        if (into === null || same) return;
        void refusal({ what: "move_state", states: ids, inside: into }).then((why_not) => set_carried((now) => (now?.into === into ? { ...now, why_not } : now)));
      },
      drop: () => {
        const into = latest.current?.into ?? null;
        if (into !== null) move_states(ids, into);
      },
      end: () => set_carried(null),
    });
  };
  const at_picture = ({ clientX, clientY }: PointerEvent) => {
    const { left, top } = svg.current!.getBoundingClientRect();
    return to_picture(view.view, [clientX - left, clientY - top]);
  };
  /** A band takes what is in it beside what is chosen; a click what it is on. */
  const draw_band = (event: PointerEvent, on: string) => {
    const [from_x, from_y] = at_picture(event);
    const to = (moved: PointerEvent): Rect => {
      const [x, y] = at_picture(moved);
      return { x: Math.min(x, from_x), y: Math.min(y, from_y), width: Math.abs(x - from_x), height: Math.abs(y - from_y) };
    };
    follow_pointer(event, {
      from_px: 5,
      move: (moved) => {
        drew.current = true;
        set_band(to(moved));
      },
      drop: (dropped) => {
        svg.current?.focus({ preventScroll: true });
        const inside = states_inside(chart, shown, to(dropped));
        if (inside.length > 0) choose_states([...all_chosen.filter((id) => !inside.includes(id)), ...inside]);
      },
      click: () => {
        svg.current?.focus({ preventScroll: true });
        if (on === "") return;
        toggle_state(on);
        show_line(chart.states.find(({ id }) => id === useDesign.getState().state)?.line ?? 0);
      },
      end: () => set_band(null),
    });
    return true;
  };
  /** True: the press is at a state, from which a transition is drawn, or which is moved; or it chooses beside what is chosen. */
  const grab = (event: PointerEvent): boolean => {
    const from = state_of(event.target);
    drew.current = false;
    if (event.button !== 0) return false;
    if (adds(event)) return draw_band(event, from?.id ?? "");
    if (from === null || from.id === "" || why_not !== null) return false;
    if (at_edge(from.element, event)) draw_transition(from.id, event);
    // What holds others fills the picture: it is moved once it is chosen.
    else if (!holds(from.id) || all_chosen.includes(from.id)) carry(from.id, event);
    else return false;
    return true;
  };
  const { svg, group, view } = usePictureView({
    box,
    limits: { min: 0.05, max: 4 },
    margin: 12,
    fit_max: 1.15,
    readable: { from: 0.7, scale: 1 },
    focus: () => layout.states[Math.max(at_chosen, 0)] ?? null,
    grab,
  });
  // What was opened or closed is shown as far as it fits.
  useEffect(() => {
    if (folded) view.fit_readable();
  }, [folded, view]);
  useEffect(() => {
    const rect = layout.states[at_chosen];
    if (rect) view.reveal(rect);
    // Once when it is chosen; an edit leaves the picture where it is.
    // eslint-disable-next-line react-hooks/exhaustive-deps
  }, [at_chosen, view]);

  const edge_at = chosen_edge === null ? -1 : layout.edges.findIndex((edge) => chart.transitions[shown.transitions[edge.transition]!] === chosen_edge);
  const edge_key = chosen_edge && `${chosen_edge.transition} ${chosen_edge.source}`;
  useEffect(() => {
    const edge = layout.edges[edge_at];
    if (edge && edge.label.width > 0) view.reveal(edge.label);
    if (chosen_edge && !useDesign.getState().transition?.at_caret) show_line(chosen_edge.line);
    // As above.
    // eslint-disable-next-line react-hooks/exhaustive-deps
  }, [edge_key, view]);

  const nests = useMemo(() => composites(layout), [layout]);
  const places = useDesign((state) => doc_of(state)?.places ?? null);
  // By line of its part: its worst finding, and what there is to say.
  const wrong = useMemo(() => {
    const found = new Map<number, { look: "wrong" | "doubtful"; said: string }>();
    const findings = findings_of(summary, file);
    const lines = places ? part_lines(chart, places.shown, findings.map(({ from }) => places.at(from))) : [];
    findings.forEach(({ severity, message }, i) => {
      const line = lines[i] ?? 0;
      if (line === 0) return;
      const before = found.get(line);
      found.set(line, { look: severity === "error" || before?.look === "wrong" ? "wrong" : "doubtful", said: before ? `${before.said}; ${message}` : message });
    });
    return found;
  }, [summary, file, chart, places]);
  const active = useMemo(() => new Set(played?.active ?? []), [played]);
  // What became active comes into view.
  const active_before = useRef<ReadonlySet<number>>(new Set());
  useEffect(() => {
    const entered = shown.states.findLastIndex((at) => active.has(at) && !active_before.current.has(at));
    active_before.current = active;
    const rect = layout.states[entered];
    if (rect) view.reveal(rect);
  }, [active, shown, layout, view]);
  const taken = useMemo(() => new Set(played?.taken ?? []), [played]);
  const enabled = useMemo(() => new Map((played?.enabled ?? []).map(({ transition, event }) => [transition, event] as const)), [played]);

  const never = useReached((state) => state.never.parts);
  const sought = useReached((state) => state.sought);

  const toggle_chosen = () => {
    all_chosen.filter(holds).forEach(toggle);
  };
  const show_line = (line: number) => {
    const doc = doc_of(useDesign.getState());
    if (!doc || line < 1) return;
    go_to(doc.places.byte(line_start(doc.places.shown, line, true)));
  };
  const choose_at = (target: EventTarget | null) => {
    const element = target instanceof Element ? target : null;
    const at = element?.closest("[data-transition]")?.getAttribute("data-transition");
    if (at) choose_transition(chart.transitions[Number(at)] ?? null);
    else choose_state(state_of(element)?.id || null);
  };
  const ids = useMemo(() => chart.states.map(({ id }) => id).filter((id) => id !== ""), [chart]);
  /** `too`: beside what is chosen. */
  const next_state = (step: number, too = false) => {
    const at = ids.indexOf(chosen ?? chosen_edge?.source ?? "");
    const next = ids.at((at + (at < 0 && step < 0 ? 0 : step)) % ids.length) ?? null;
    if (too && next !== null) choose_states([...all_chosen.filter((id) => id !== next), next]);
    else choose_state(next);
    show_line(chart.states.find(({ id }) => id === next)?.line ?? 0);
  };
  /** Of the chosen state, or of all. */
  const next_transition = (step: number) => {
    const source = chosen ?? chosen_edge?.source;
    const own = chart.transitions.filter((transition) => source === undefined || transition.source === source);
    const at = chosen_edge ? own.indexOf(chosen_edge) : step > 0 ? -1 : 0;
    choose_transition(own.at((at + step) % own.length) ?? null);
  };
  const take = (transition: number) => {
    const event = enabled.get(transition);
    if (event === undefined) return;
    if (payload_of(event)) useSimulation.setState({ event });
    else void play_chart({ do: "send", event });
  };

  // The same by name, for who does not know the keys.
  const press_key = (keys: string) => {
    const [key = "", held] = keys.split("+").reverse();
    svg.current?.focus();
    svg.current?.dispatchEvent(new KeyboardEvent("keydown", { key: kKeyNames[key] ?? key, ctrlKey: held === "Ctrl", bubbles: true, cancelable: true }));
  };
  const open_menu = () => {
    const box = (svg.current?.querySelector(".chosen") ?? svg.current)!.getBoundingClientRect();
    set_menu({ x: box.left + Math.min(box.width, 120), y: box.top + Math.min(box.height, 60) });
  };
  usePaste(svg, paste_states);
  useCommand(
    { id: "design.chart", title: "Go to the chart", group: "Chart", run: () => svg.current?.focus() },
    ...kChartCommands.map(({ title, keys }) => ({ id: `design.chart.${keys}`, title: title.replace("CHOSEN", all_chosen.length > 0 ? named_states(all_chosen) : (chosen_edge ? transition_text(chosen_edge) : "what is chosen")), group: "Chart", keys_there: [keys], run: () => press_key(keys) })),
  );

  return (
    <>
      <svg
        ref={svg}
        className={`picture chart-picture design-picture${why_dim ? " dim" : ""}`}
        role="group"
        aria-label={`Chart ${file}`}
        tabIndex={0}
        data-testid="design-chart"
        onDoubleClick={(event) => {
          const target = event.target instanceof Element ? event.target : null;
          const edge = target?.closest("[data-transition]");
          if (edge) {
            const transition = chart.transitions[Number(edge.getAttribute("data-transition"))];
            if (!transition?.written) return focus_field("transition-target");
            if (why_not !== null) return useDesign.setState({ refused: why_not });
            const box = edge.querySelector(".label text")?.getBoundingClientRect();
            return set_labelled({ transition, version, x: (box?.left ?? event.clientX) - 8, y: (box?.top ?? event.clientY) - 6 });
          }
          const on = state_of(target)?.id ?? "";
          // Into a state that has some inside already; the others get another name.
          if (on === "" || holds(on)) void add_fresh_state(on);
          else focus_field("design-state");
        }}
        onContextMenu={(event) => {
          event.preventDefault();
          if (!all_chosen.includes(state_of(event.target)?.id ?? "")) choose_at(event.target);
          set_menu({ x: event.clientX, y: event.clientY });
        }}
        onKeyDown={(event) => {
          if (!in_turn(event)) return;
          const letter = event.key.toLowerCase();
          if (event.ctrlKey || event.metaKey) {
            if (event.shiftKey) return;
            if (letter === "a") choose_states(ids);
            // What one presses comes with what is in the clipboard, as an event of its own.
            else if (letter === "v" && event.nativeEvent.isTrusted) return;
            else if (letter === "v") void clipboard_text().then(paste_states);
            else if (chosen && (letter === "c" || letter === "x")) keep_states(letter === "x");
            else return;
            event.preventDefault();
            event.stopPropagation();
            return;
          }
          if (event.altKey) return;
          const remove = event.key === "Delete" || event.key === "Backspace";
          if (remove && chosen_edge) void gesture({ what: "remove_transition", transition: chosen_edge.transition });
          else if (remove && chosen) remove_states();
          else if (all_chosen.length > 1 && kAlone.includes(event.key)) useDesign.setState({ refused: `${all_chosen.length} states are chosen; this is done to one of them alone` });
          else if (chosen && letter === "c") toggle_chosen();
          else if (chosen && letter === "w") void wrap_states("state");
          else if (chosen && letter === "d") duplicate_states();
          else if (event.key === "F2" && (chosen_edge || chosen)) focus_field(chosen_edge ? (chosen_edge.written ? "transition-event" : "transition-target") : "design-state");
          else if (event.key === "Enter") focus_field("design-new-state");
          else if (chosen && letter === "n") new_transition();
          else if (letter === "t") next_transition(event.shiftKey ? -1 : 1);
          else if (letter === "s") next_state(event.shiftKey ? -1 : 1);
          else if (letter === "a") next_state(event.shiftKey ? -1 : 1, true);
          else if (letter === "m" || event.key === "ContextMenu") open_menu();
          else if (event.key === "Escape" && (chosen || chosen_edge)) choose_state(null);
          else if (!view.key(event, true)) return;
          event.preventDefault();
          event.stopPropagation();
        }}
        onClick={(event) => {
          // The end of a drag is no click.
          if (drew.current) {
            drew.current = false;
            return;
          }
          if (adds(event)) return;
          const target = event.target instanceof Element ? event.target : null;
          const found = target?.closest("[data-line]") ?? null;
          const fold = target?.closest(".fold")?.getAttribute("data-fold");
          if (fold) return toggle(fold);
          const transition = found?.getAttribute("data-transition");
          if (transition) take(Number(transition));
          if (found) show_line(Number(found.getAttribute("data-line")));
          choose_at(target);
          svg.current?.focus({ preventScroll: true });
        }}
      >
        <g ref={group}>
          {layout.states.map((drawn, i) => {
            const at = shown.states[i]!;
            const { id, line } = chart.states[at] ?? { id: "", line: 0 };
            const nest = nests.has(i);
            const hidden = shown.hidden[i] ?? 0;
            const middle = drawn.x + drawn.width / 2;
            return (
              <g
                key={at}
                data-line={line}
                data-id={id}
                data-active={played ? active.has(at) : undefined}
                role="img"
                aria-label={`State ${drawn.name.join(" ") || drawn.kind}${active.has(at) ? ", active" : ""}${hidden > 0 ? `, ${hidden} states hidden in it` : ""}${wrong.has(line) ? `; ${wrong.get(line)!.said}` : ""}`}
                className={[wrong.get(line)?.look ?? "", id !== "" && (all_chosen.includes(id) || in_band.has(id)) ? "chosen" : "", kept?.includes(id) || carried?.ids.includes(id) ? "faded" : "", carried !== null && id !== "" && id === carried.into ? (carried.why_not ? "refused" : "onto") : "", never.has(state_key(file, id)) ? "never" : ""].filter(Boolean).join(" ") || undefined}
              >
                {wrong.has(line) && <title>{wrong.get(line)!.said}</title>}
                <StateShape drawn={drawn} nest={nest} active={active.has(at)} />
                {hidden > 0 && <FoldCount hidden={hidden} x={middle} y={drawn.y + drawn.height} />}
                {id !== "" && composite.has(at) && <FoldSign id={id} closed={closed.has(id)} hint=" (C)" x={drawn.x + drawn.width - 1} y={drawn.y + 1} />}
              </g>
            );
          })}
          {layout.separators.map(([x1, y1, x2, y2], i) => (
            <line key={i} className="region" x1={x1} y1={y1} x2={x2} y2={y2} />
          ))}
          {layout.edges.map((edge, i) => {
            const at = shown.transitions[edge.transition]!;
            const can = enabled.has(at);
            const part = chart.transitions[at];
            const line = part?.line ?? 0;
            const mark = can ? "can-take" : mark_of(never.has(transition_key(file, line)), transition_key(file, line) === sought);
            return (
              <g key={i} data-line={line} data-transition={at} data-enabled={played ? can : undefined} className={[mark, wrong.get(line)?.look ?? "", part !== undefined && part === chosen_edge ? "chosen" : ""].filter(Boolean).join(" ") || undefined} role="img" aria-label={part ? `Transition ${part.source} ${transition_text(part)}` : undefined}>
                <path className="hold" d={curve(edge.curve)} />
                {can && edge.label.width > 0 && <rect className="take" x={edge.label.x - 5} y={edge.label.y - 3} width={edge.label.width + 10} height={edge.label.height + 6} rx={6} />}
                <Edge edge={edge} last={taken.has(at)} />
                <Label edge={edge} last={taken.has(at)} whole={edge.lines.join(" ")} />
              </g>
            );
          })}
          {band && <rect className="band" data-testid="band" {...band} />}
        </g>
        {line && (
          <g className={`drawn-transition${line.onto === null ? "" : " onto"}`}>
            <line x1={line.from[0]} y1={line.from[1]} x2={line.to[0]} y2={line.to[1]} />
            <circle cx={line.to[0]} cy={line.to[1]} r={4} />
          </g>
        )}
      </svg>
      <Minimap view={view} box={box} rects={layout.states} read={read} />
      {carried && (
        <div className={`drag-label${carried.why_not ? " refused" : ""}`} style={{ left: carried.x + 14, top: carried.y + 12 }} role="status" data-testid="drag-label">
          {named_states(carried.ids)}
          {carried.into !== null && ` → ${carried.into || "the top level"}`}
          {carried.why_not && <span> ✗ {carried.why_not}</span>}
        </div>
      )}
      {labelled && <LabelField {...labelled} options={event_words(chart, services)} close={() => set_labelled(null)} />}
      {menu && <ChartMenu {...menu} close={() => set_menu(null)} />}
    </>
  );
}
