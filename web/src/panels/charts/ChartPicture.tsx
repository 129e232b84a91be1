import { memo, useEffect, useImperativeHandle, useMemo, useState, type Ref } from "react";

import { svg_of_group } from "../../picture/export";
import { Minimap } from "../../picture/Minimap";
import { usePicture } from "../../picture/pictures";
import { usePictureView } from "../../picture/use_picture_view";
import { fit } from "../../picture/viewport";
import { read_in } from "./read_in";
import type { ChartFold, ChartLayout, ChartModel, Rect, Size } from "../../protocol/types";
import { color } from "../../widgets/theme";
import { request, useStudio } from "../../store/store";
import { curve } from "../mission/TreePicture";
import { mark_of, state_key, transition_key, useReached } from "../reached/reached";
import { useSteering } from "../steer/steering";
import { arrow } from "./arrow";
import { composites, FoldCount, FoldSign, useFolding } from "./folding";
import { StateMenu } from "./StateMenu";

export interface ChartHandle {
  fit(): void;
  zoom(factor: number): void;
  /** Closes all states that hold others, or opens them. */
  fold_all(closed: boolean): void;
}

/** Around what is shown, at the scale at which a part of a chart is. */
const kMargin_px = 4;
const kLimits = { min: 0.05, max: 4 };
const kFitMax = 1.1;
/** A chart that would be smaller is shown in part. */
export const kReadable = 0.85;
/** Of all of a chart in a panel of that size. */
export const whole_scale = ({ size }: ChartLayout, panel: Size) => fit({ x: 0, y: 0, ...size }, panel, kMargin_px, kFitMax, kLimits).scale;

/** A chart that can be panned and zoomed; states choose and have a menu. */
export function ChartPicture({ chart, handle }: { chart: ChartModel; handle: Ref<ChartHandle> }) {
  const boot = useStudio((studio) => studio.hello?.boot);
  const [menu, set_menu] = useState<{ state: number; x: number; y: number } | null>(null);
  const { shown, closed, toggle, set_closed } = useFolding(`${boot} ${chart.id}`, chart, chart, (ids) => request("fold_chart", { chart: chart.id, closed: ids }));
  const { layout } = shown;
  const box: Rect = useMemo(() => ({ x: 0, y: 0, ...layout.size }), [layout]);
  const read = useMemo(() => read_in(layout), [layout]);
  const { svg, group, view, keys } = usePictureView({
    box,
    limits: kLimits,
    margin: kMargin_px,
    fit_max: kFitMax,
    readable: { from: kReadable, scale: 1 },
    focus: () => active_box(chart, shown, view.size),
  });
  const composite = useMemo(() => composites(chart.layout), [chart]);
  const active = useStudio((studio) => studio.state?.charts[chart.id]?.active.join() ?? "");
  useEffect(() => view.refocus(), [view, active]);
  const fold_all = (close: boolean) => set_closed(close ? [...composite].flatMap((at) => chart.states[at]?.id || []) : []);
  useImperativeHandle(handle, () => ({ fit: () => view.fit(), zoom: (factor) => view.zoom(factor), fold_all }));
  usePicture(`chart:${chart.id}`, () =>
    group.current ? { name: chart.name, size: box, svg: svg_of_group(group.current, box, `${chart.kind} ${chart.name}`, color("surface")) } : null,
  );
  return (
    <div className="chart-frame">
      <svg
        ref={svg}
        className="picture chart-picture"
        role="group"
        aria-label={`Chart of ${chart.kind} ${chart.name}`}
        tabIndex={0}
        data-testid="chart"
        data-chart={chart.id}
        onKeyDown={keys}
        onClick={(event) => {
          const fold = event.target instanceof Element ? event.target.closest(".fold")?.getAttribute("data-fold") : null;
          if (fold) toggle(fold);
        }}
        onDoubleClick={(event) => {
          if (!(event.target instanceof Element && event.target.closest(".fold"))) view.fit();
        }}
        onContextMenu={(event) => {
          event.preventDefault();
          const found = event.target instanceof Element ? event.target.closest("[data-state]") : null;
          if (found) set_menu({ state: Number(found.getAttribute("data-state")), x: event.clientX, y: event.clientY });
        }}
      >
        <g ref={group}>
          <ChartDrawing chart={chart} shown={shown} closed={closed} />
        </g>
      </svg>
      <Minimap view={view} box={box} rects={layout.states} read={read} />
      {menu && <StateMenu chart={chart} {...menu} fold={composite.has(menu.state) ? { closed: closed.has(chart.states[menu.state]?.id ?? ""), toggle } : null} close={() => set_menu(null)} />}
    </div>
  );
}

/**
 * Around the active states that hold no others, as far as they are shown, with what the transition taken last says, or
 * those that lead to them where that is not known, if that has room in a panel of `size`; of a chart that is not at work
 * around where it was last, or begins.
 */
function active_box(chart: ChartModel, { layout, states, transitions }: ChartFold, size: Size): Rect | null {
  const now = useStudio.getState().state?.charts[chart.id];
  const drawn = layout.states.filter((_, i) => now?.active.includes(states[i]!));
  const rects = drawn.filter((rect) => !drawn.some(({ parent }) => layout.states[parent] === rect));
  const last = layout.edges.find(({ transition }) => transitions[transition] === now?.last);
  if (rects.length === 0) return layout.states[last?.target ?? -1] ?? layout.states.find(({ kind }) => kind === "initial") ?? null;
  const led = last ? [last] : layout.edges.filter(({ target }) => rects.includes(layout.states[target]!));
  const active = around(rects);
  const both = around([active, ...led.map(({ label }) => label).filter(({ width }) => width > 0)]);
  return both.width + 2 * kMargin_px <= size.width && both.height + 2 * kMargin_px <= size.height ? both : active;
}

function around(rects: readonly Rect[]): Rect {
  const [x, y] = [Math.min(...rects.map((r) => r.x)), Math.min(...rects.map((r) => r.y))];
  const right = Math.max(...rects.map((r) => r.x + r.width));
  return { x, y, width: right - x, height: Math.max(...rects.map((r) => r.y + r.height)) - y };
}

/** The chart's figure: nested states with the active ones lit, and the transition taken last. */
export const ChartDrawing = memo(function ChartDrawing({ chart, shown, closed }: { chart: ChartModel; shown?: ChartFold; closed?: ReadonlySet<string> }) {
  const layout = shown?.layout ?? chart.layout;
  const nests = useMemo(() => composites(layout), [layout]);
  const composite = useMemo(() => composites(chart.layout), [chart]);
  const last = useStudio((studio) => studio.state?.charts[chart.id]?.last ?? -1);
  const state = (nest: boolean) =>
    layout.states.map((drawn, i) => {
      if (nests.has(i) !== nest) return null;
      const s = shown?.states[i] ?? i;
      const id = chart.states[s]?.id ?? "";
      const region = layout.states[drawn.parent]?.kind === "parallel";
      return <StateView key={s} chart={chart} s={s} drawn={drawn} nest={nest} region={region} hidden={shown?.hidden[i] ?? 0} closed={closed && composite.has(s) ? closed.has(id) : null} />;
    });
  const edges = layout.edges.map((edge, i) => ({ edge, i, transition: shown?.transitions[edge.transition] ?? edge.transition }));
  return (
    <>
      {state(true)}
      {layout.separators.map(([x1, y1, x2, y2], i) => (
        <line key={`r${i}`} className="region" x1={x1} y1={y1} x2={x2} y2={y2} />
      ))}
      {edges.map(({ edge, i, transition }) => transition !== last && <MarkedEdge key={`e${i}`} chart={chart} transition={transition} edge={edge} last={false} />)}
      {edges.map(({ edge, i, transition }) => transition === last && <MarkedEdge key={`e${i}`} chart={chart} transition={transition} edge={edge} last />)}
      {state(false)}
      {edges.map(({ edge, i, transition }) => (
        <Label key={`l${i}`} edge={edge} last={transition === last} whole={label_text(chart, transition)} />
      ))}
    </>
  );
});

/** A transition, and whether no run has taken it. */
function MarkedEdge({ chart, transition, edge, last }: { chart: ChartModel; transition: number; edge: ChartLayout["edges"][number]; last: boolean }) {
  const key = transition_key(chart.file, chart.transitions[transition]?.line ?? 0);
  const never = useReached(({ never: { parts } }) => parts.has(key));
  const sought = useReached(({ sought: wanted }) => wanted === key);
  return (
    <g className={mark_of(never, sought)} data-line={chart.transitions[transition]?.line ?? 0}>
      <Edge edge={edge} last={last} />
    </g>
  );
}

/** The label of a transition, unwrapped and unshortened. */
export function label_text(chart: ChartModel, transition: number): string {
  const written = chart.transitions[transition];
  if (!written) return "";
  const { event, condition, actions } = written;
  return [event, condition && `[${condition}]`, actions && `/ ${actions}`].filter(Boolean).join(" ");
}

const kRadius = 9;
const kInset = 3.5;
const kPaddingX = 12;

interface StateProps {
  chart: ChartModel;
  /** Of the whole. */
  s: number;
  drawn: ChartLayout["states"][number];
  nest: boolean;
  region: boolean;
  hidden: number;
  /** Null: it cannot be closed. */
  closed: boolean | null;
}

const StateView = memo(function StateView({ chart, s, drawn, nest, region, hidden, closed }: StateProps) {
  const active = useStudio((studio) => {
    const state = studio.state?.charts[chart.id];
    return state !== undefined && state.active.includes(s);
  });
  const id = chart.states[s]?.id ?? "";
  const stops = useSteering((steering) => steering.standing.some((entry) => entry.kind === "breakpoint" && entry.chart === chart.id && entry.state === id));
  const [middle, centre] = [drawn.x + drawn.width / 2, drawn.y + drawn.height / 2];
  const violated = useStudio((studio) => chart.kind === "monitor" && studio.state?.monitors[chart.name]?.verdict === "violated");
  const never = useReached(({ never: { parts } }) => parts.has(state_key(chart.file, id)));
  const sought = useReached(({ sought: key }) => key !== null && key === state_key(chart.file, id));
  const lit = active ? (violated ? " active violated" : " active") : "";
  const name = drawn.name.join(" ") || drawn.kind;
  const outline = () => {
    switch (drawn.kind) {
      case "initial":
        return <circle className="dot" cx={middle} cy={centre} r={7} />;
      case "history":
      case "history-shallow":
      case "history-deep":
      case "deep-history":
        return <circle className={`state${lit}`} cx={middle} cy={centre} r={13} />;
      case "final":
        return (
          <>
            <rect className={`state${lit}`} x={drawn.x} y={drawn.y} width={drawn.width} height={drawn.height} rx={kRadius} />
            <rect className={`inner${lit}`} x={drawn.x + kInset} y={drawn.y + kInset} width={drawn.width - 2 * kInset} height={drawn.height - 2 * kInset} rx={kRadius - kInset} />
          </>
        );
      default:
        // A region with states inside has the dashed lines for an outline.
        return nest && region && !active ? (
          <rect className="hit" data-export="no" x={drawn.x} y={drawn.y} width={drawn.width} height={drawn.height} />
        ) : (
          <rect className={`${nest ? "nest" : "state"}${lit}`} x={drawn.x} y={drawn.y} width={drawn.width} height={drawn.height} rx={kRadius} />
        );
    }
  };
  return (
    <g data-state={s} data-id={id} data-active={active} className={mark_of(never, sought)} role="img" aria-label={`State ${name}${active ? ", active" : ""}${never ? ", never reached" : ""}${hidden > 0 ? `, ${hidden} states hidden in it` : ""}`}>
      <title>{`${name}${active ? ": active" : never ? ": never reached" : ""}`}</title>
      {outline()}
      <StateTexts drawn={drawn} nest={nest} />
      {hidden > 0 && <FoldCount hidden={hidden} x={middle} y={drawn.y + drawn.height} />}
      {closed !== null && id !== "" && <FoldSign id={id} closed={closed} hint="" x={drawn.x + drawn.width - (active && !nest ? 22 : 1)} y={drawn.y + 1} />}
      {active && !nest && (
        <g className={violated ? "violated" : "running"} transform={`translate(${drawn.x + drawn.width - 2} ${drawn.y + 2})`}>
          <circle className="badge-disc" r={8} />
          {violated ? <path className="badge-cross" d="M-3 -3L3 3M3 -3L-3 3" /> : <path className="badge-solid" d="M-2.5 -4L4.2 0L-2.5 4Z" />}
        </g>
      )}
      {stops && (
        <g className="steered" transform={`translate(${drawn.x} ${drawn.y})`}>
          <path className="breakpoint" d="M-3 -7H3L7 -3V3L3 7H-3L-7 3V-3Z" />
        </g>
      )}
    </g>
  );
});

/** A state of a chart that does not run, or runs by hand. */
export function StateShape({ drawn, nest, active }: { drawn: ChartLayout["states"][number]; nest: boolean; active: boolean }) {
  const lit = active ? " active" : "";
  const { x, y, width, height, kind } = drawn;
  const [middle, centre] = [x + width / 2, y + height / 2];
  const box = <rect className={`${nest ? "nest" : "state"}${lit}`} x={x} y={y} width={width} height={height} rx={kRadius} />;
  return (
    <>
      {kind === "initial" ? <circle className="dot" cx={middle} cy={centre} r={7} /> : kind.includes("history") ? <circle className={`state${lit}`} cx={middle} cy={centre} r={13} /> : box}
      {kind === "final" && <rect className={`inner${lit}`} x={x + kInset} y={y + kInset} width={width - 2 * kInset} height={height - 2 * kInset} rx={kRadius - kInset} />}
      <StateTexts drawn={drawn} nest={nest} />
    </>
  );
}

export const StateTexts = memo(function StateTexts({ drawn, nest }: { drawn: ChartLayout["states"][number]; nest: boolean }) {
  // Its circle has no room for a name.
  if (drawn.kind.includes("history"))
    return (
      <text className="name" x={drawn.x + drawn.width / 2} y={drawn.y + drawn.height / 2 + 4.5} textAnchor="middle">
        {drawn.kind.includes("deep") ? "H*" : "H"}
      </text>
    );
  const inset = drawn.kind === "final" ? kInset : 0;
  const ruled = drawn.name.length > 0 && drawn.lines.length > 0;
  const height = drawn.name.length * 18 + drawn.lines.length * 15 + (ruled ? 7 : 0);
  const parts = [];
  let y = nest ? drawn.y + 7 : drawn.y + drawn.height / 2 - height / 2;
  drawn.name.forEach((line, i) => {
    parts.push(
      <text key={`n${i}`} className="name" x={nest ? drawn.x + kPaddingX : drawn.x + drawn.width / 2} y={y + 13} textAnchor={nest ? "start" : "middle"}>
        {line}
      </text>,
    );
    y += 18;
  });
  if (ruled) {
    if (!nest) parts.push(<line key="rule" className="rule" x1={drawn.x + inset} y1={y + 3.5} x2={drawn.x + drawn.width - inset} y2={y + 3.5} />);
    y += 7;
  }
  drawn.lines.forEach((line, i) => {
    parts.push(
      <text key={`l${i}`} className="detail" x={drawn.x + kPaddingX + inset} y={y + 11}>
        {line}
      </text>,
    );
    y += 15;
  });
  return <>{parts}</>;
});

export const Edge = memo(function Edge({ edge, last }: { edge: ChartLayout["edges"][number]; last: boolean }) {
  const shape = arrow(edge.curve);
  if (!shape) return null;
  return (
    <g data-edge={edge.transition} className={last ? "last-taken" : undefined}>
      <path className={`arrow${last ? " last" : ""}`} d={curve(shape.line)} />
      <path className={`head${last ? " last" : ""}`} d={shape.head} />
    </g>
  );
});

export const Label = memo(function Label({ edge, last, whole }: { edge: ChartLayout["edges"][number]; last: boolean; whole: string }) {
  if (edge.lines.length === 0) return null;
  return (
    <g className={last ? "label last" : "label"}>
      <title>{whole}</title>
      {edge.lines.map((line, i) => (
        <text key={i} x={edge.label.x} y={edge.label.y + i * 14.5 + 10.5}>
          {line}
        </text>
      ))}
    </g>
  );
});
