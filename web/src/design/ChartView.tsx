import { useEffect, useMemo, useRef, useState } from "react";

import { Edge, Label, StateShape } from "../panels/charts/ChartPicture";
import { composites, FoldCount, FoldSign, useFolding } from "../panels/charts/folding";
import { follow_pointer } from "../picture/drag";
import { Minimap } from "../picture/Minimap";
import { mark_of, state_key, transition_key, useReached } from "../panels/reached/reached";
import { usePictureView } from "../picture/use_picture_view";
import type { OutlineChart, Rect } from "../protocol/types";
import { request } from "../store/store";
import { add_fresh_state, doc_of, gesture, go_to, obstacle, useDesign } from "./design";
import { line_start } from "./places";
import { payload_of, play_chart, useSimulation } from "./simulate";

/** A transition that is being drawn, in pixels of the picture, and the state that it would lead to. */
interface Line {
  from: [number, number];
  to: [number, number];
  onto: string | null;
}

/** How near to its outline a state is held by its edge, on either side. */
const kEdge_px = 7;

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
export function ChartView({ chart, file }: { chart: OutlineChart; file: string }) {
  const why_dim = useDesign(obstacle);
  const summary = useDesign((state) => state.summary);
  const version = useDesign((state) => doc_of(state)?.version ?? 0);
  const chosen = useDesign((state) => state.state);
  const played = useSimulation(({ on, file: of, chart_now }) => (on && of === file ? chart_now : null));

  const { shown, folded, closed, toggle } = useFolding(file, chart, version, (ids) =>
    request("design_fold", { file, closed: ids }).then((found) => (found.version === version ? found : null)),
  );
  const { layout } = shown;
  const box: Rect = useMemo(() => ({ x: 0, y: 0, ...layout.size }), [layout]);
  const at_chosen = shown.states.findIndex((at) => chosen !== null && chart.states[at]?.id === chosen);
  const [line, set_line] = useState<Line | null>(null);
  const drew = useRef(false);
  /** True: the press is at a state's edge, from which a transition is drawn. */
  const draw_transition = (event: PointerEvent): boolean => {
    const from = state_of(event.target);
    drew.current = false;
    if (event.button !== 0 || from === null || from.id === "" || why_dim !== null || !at_edge(from.element, event)) return false;
    const onto = (at: PointerEvent) => {
      const found = state_of(document.elementFromPoint(at.clientX, at.clientY));
      return found && found.id !== "" ? found.id : null;
    };
    const place = (at: { clientX: number; clientY: number }): [number, number] => {
      const box = svg.current!.getBoundingClientRect();
      return [at.clientX - box.left, at.clientY - box.top];
    };
    follow_pointer(event, {
      from_px: 4,
      move: (at) => {
        drew.current = true;
        set_line({ from: place(event), to: place(at), onto: onto(at) });
      },
      drop: (at) => {
        const target = onto(at);
        if (target !== null) useDesign.setState({ state: from.id, drawn_to: target, refused: null });
      },
      end: () => set_line(null),
    });
    return true;
  };
  const { svg, group, view } = usePictureView({
    box,
    limits: { min: 0.05, max: 4 },
    margin: 12,
    fit_max: 1.15,
    readable: { from: 0.42, scale: 0.85 },
    focus: () => layout.states[Math.max(at_chosen, 0)] ?? null,
    grab: (event) => draw_transition(event),
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

  const nests = useMemo(() => composites(layout), [layout]);
  const composite = useMemo(() => composites(chart.layout), [chart]);
  const lines = useMemo(() => new Set((summary?.findings ?? []).filter((found) => found.file === file && found.severity === "error").map(({ line }) => line)), [summary, file]);
  const active = useMemo(() => new Set(played?.active ?? []), [played]);
  const taken = useMemo(() => new Set(played?.taken ?? []), [played]);
  const enabled = useMemo(() => new Map((played?.enabled ?? []).map(({ transition, event }) => [transition, event] as const)), [played]);

  const never = useReached((state) => state.never.parts);
  const sought = useReached((state) => state.sought);

  const toggle_chosen = () => {
    const at = chart.states.findIndex(({ id }) => id === chosen);
    if (at >= 0 && composite.has(at)) toggle(chart.states[at]!.id);
  };
  const show_line = (line: number) => {
    const doc = doc_of(useDesign.getState());
    if (!doc || line < 1) return;
    go_to(doc.places.byte(line_start(doc.places.shown, line, true)));
  };
  const take = (transition: number) => {
    const event = enabled.get(transition);
    if (event === undefined) return;
    if (payload_of(event)) useSimulation.setState({ event });
    else void play_chart({ do: "send", event });
  };

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
          if (target?.closest("[data-transition]")) return;
          const on = state_of(target)?.id ?? "";
          // Into a state that has some inside already; the others are chosen by a click.
          const nested = composite.has(chart.states.findIndex(({ id }) => id === on)) ? on : "";
          if (on === "" || nested !== "") void add_fresh_state(nested);
        }}
        onKeyDown={(event) => {
          if (event.ctrlKey || event.metaKey || event.altKey) return;
          if (chosen && (event.key === "Delete" || event.key === "Backspace")) void gesture({ what: "remove_state", state: chosen });
          else if (chosen && (event.key === "c" || event.key === "C")) toggle_chosen();
          else if (chosen && event.key === "F2") document.getElementById("design-state")?.focus();
          else if (event.key === "Enter") document.getElementById("design-new-state")?.focus();
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
          const target = event.target instanceof Element ? event.target : null;
          const found = target?.closest("[data-line]") ?? null;
          const fold = target?.closest(".fold")?.getAttribute("data-fold");
          if (fold) return toggle(fold);
          const transition = found?.getAttribute("data-transition");
          if (transition) take(Number(transition));
          if (found) show_line(Number(found.getAttribute("data-line")));
          useDesign.setState({ state: found?.getAttribute("data-id") ?? null, refused: null });
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
                aria-label={`State ${drawn.name.join(" ") || drawn.kind}${active.has(at) ? ", active" : ""}${hidden > 0 ? `, ${hidden} states hidden in it` : ""}`}
                className={[lines.has(line) ? "wrong" : "", chosen !== null && id === chosen ? "chosen" : "", never.has(state_key(file, id)) ? "never" : ""].filter(Boolean).join(" ") || undefined}
              >
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
            const line = chart.transitions[at]?.line ?? 0;
            return (
              <g key={i} data-line={line} data-transition={at} data-enabled={played ? can : undefined} className={can ? "can-take" : mark_of(never.has(transition_key(file, line)), transition_key(file, line) === sought)}>
                {can && edge.label.width > 0 && <rect className="take" x={edge.label.x - 5} y={edge.label.y - 3} width={edge.label.width + 10} height={edge.label.height + 6} rx={6} />}
                <Edge edge={edge} last={taken.has(at)} />
                <Label edge={edge} last={taken.has(at)} whole={edge.lines.join(" ")} />
              </g>
            );
          })}
        </g>
        {line && (
          <g className={`drawn-transition${line.onto === null ? "" : " onto"}`}>
            <line x1={line.from[0]} y1={line.from[1]} x2={line.to[0]} y2={line.to[1]} />
            <circle cx={line.to[0]} cy={line.to[1]} r={4} />
          </g>
        )}
      </svg>
      <Minimap view={view} box={box} rects={layout.states} />
    </>
  );
}
