import { memo, useEffect, useImperativeHandle, useLayoutEffect, useMemo, useRef, useState, type Ref } from "react";

import { svg_of_group } from "../../picture/export";
import { usePicture } from "../../picture/pictures";
import { PictureView } from "../../picture/picture_view";
import type { ChartLayout, ChartModel, Rect } from "../../protocol/types";
import { color } from "../../widgets/theme";
import { useStudio } from "../../store/store";
import { curve } from "../mission/TreePicture";
import { useSteering } from "../steer/steering";
import { arrow } from "./arrow";
import { StateMenu } from "./StateMenu";

export interface ChartHandle {
  fit(): void;
  zoom(factor: number): void;
}

/** A chart that can be panned and zoomed; states choose and have a menu. */
export function ChartPicture({ chart, handle }: { chart: ChartModel; handle: Ref<ChartHandle> }) {
  const svg = useRef<SVGSVGElement>(null);
  const group = useRef<SVGGElement>(null);
  const [menu, set_menu] = useState<{ state: number; x: number; y: number } | null>(null);
  const box: Rect = useMemo(() => ({ x: 0, y: 0, ...chart.layout.size }), [chart]);
  const [view] = useState(
    () =>
      new PictureView({
        limits: { min: 0.05, max: 4 },
        margin: 4,
        fit_max: 1.1,
        readable: { from: 0.5, scale: 0.72 },
        focus: () => active_box(chart),
        change: ({ scale, x, y }) => group.current?.setAttribute("transform", `translate(${x} ${y}) scale(${scale})`),
      }),
  );
  useEffect(() => {
    if (svg.current) view.attach(svg.current);
    return () => view.detach();
  }, [view]);
  useLayoutEffect(() => view.set_box(box), [view, box]);
  const active = useStudio((studio) => studio.state?.charts[chart.id]?.active.join() ?? "");
  useEffect(() => view.refocus(), [view, active]);
  useImperativeHandle(handle, () => ({ fit: () => view.fit(), zoom: (factor) => view.zoom(factor) }), [view]);
  usePicture(`chart:${chart.id}`, () =>
    group.current ? { name: chart.name, size: box, svg: svg_of_group(group.current, box, `${chart.kind} ${chart.name}`, color("surface")) } : null,
  );
  return (
    <>
      <svg
        ref={svg}
        className="picture chart-picture"
        role="group"
        aria-label={`Chart of ${chart.kind} ${chart.name}`}
        tabIndex={0}
        data-testid="chart"
        data-chart={chart.id}
        onKeyDown={(event) => {
          if (!view.key(event, true)) return;
          event.preventDefault();
          event.stopPropagation();
        }}
        onDoubleClick={() => view.fit()}
        onContextMenu={(event) => {
          event.preventDefault();
          const found = event.target instanceof Element ? event.target.closest("[data-state]") : null;
          if (found) set_menu({ state: Number(found.getAttribute("data-state")), x: event.clientX, y: event.clientY });
        }}
      >
        <g ref={group}>
          <ChartDrawing chart={chart} />
        </g>
      </svg>
      {menu && <StateMenu chart={chart} {...menu} close={() => set_menu(null)} />}
    </>
  );
}

/** Around the active states that hold no others; null: none is active. */
function active_box(chart: ChartModel): Rect | null {
  const active = useStudio.getState().state?.charts[chart.id]?.active ?? [];
  const inner = active.filter((s) => !active.some((other) => chart.layout.states[other]?.parent === s));
  const rects = inner.map((s) => chart.layout.states[s]).filter((rect) => rect !== undefined);
  if (rects.length === 0) return null;
  const [x, y] = [Math.min(...rects.map((r) => r.x)), Math.min(...rects.map((r) => r.y))];
  const right = Math.max(...rects.map((r) => r.x + r.width));
  return { x, y, width: right - x, height: Math.max(...rects.map((r) => r.y + r.height)) - y };
}

/** The chart's figure: nested states with the active ones lit, and the transition taken last. */
export const ChartDrawing = memo(function ChartDrawing({ chart }: { chart: ChartModel }) {
  const { layout } = chart;
  const nests = useMemo(() => {
    const out = layout.states.map(() => false);
    for (const { parent } of layout.states) if (parent >= 0) out[parent] = true;
    return out;
  }, [layout]);
  const last = useStudio((studio) => studio.state?.charts[chart.id]?.last ?? -1);
  const order = useMemo(() => layout.edges.map((_, i) => i), [layout]);
  return (
    <>
      {layout.states.map((_, s) => nests[s] && <StateView key={s} chart={chart} s={s} nest />)}
      {layout.separators.map(([x1, y1, x2, y2], i) => (
        <line key={`r${i}`} className="region" x1={x1} y1={y1} x2={x2} y2={y2} />
      ))}
      {order.map((i) => layout.edges[i]!.transition !== last && <Edge key={`e${i}`} edge={layout.edges[i]!} last={false} />)}
      {order.map((i) => layout.edges[i]!.transition === last && <Edge key={`e${i}`} edge={layout.edges[i]!} last />)}
      {layout.states.map((_, s) => !nests[s] && <StateView key={s} chart={chart} s={s} nest={false} />)}
      {layout.edges.map((edge, i) => (
        <Label key={`l${i}`} edge={edge} last={edge.transition === last} whole={label_text(chart, edge.transition)} />
      ))}
    </>
  );
});

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

const StateView = memo(function StateView({ chart, s, nest }: { chart: ChartModel; s: number; nest: boolean }) {
  const drawn = chart.layout.states[s]!;
  const active = useStudio((studio) => {
    const state = studio.state?.charts[chart.id];
    return state !== undefined && state.active.includes(s);
  });
  const id = chart.states[s]?.id ?? "";
  const stops = useSteering((steering) => steering.standing.some((entry) => entry.kind === "breakpoint" && entry.chart === chart.id && entry.state === id));
  const [middle, centre] = [drawn.x + drawn.width / 2, drawn.y + drawn.height / 2];
  const violated = useStudio((studio) => chart.kind === "monitor" && studio.state?.monitors[chart.name]?.verdict === "violated");
  const lit = active ? (violated ? " active violated" : " active") : "";
  const region = drawn.parent >= 0 && chart.layout.states[drawn.parent]?.kind === "parallel";
  const name = drawn.name.join(" ") || drawn.kind;
  const outline = () => {
    switch (drawn.kind) {
      case "initial":
        return <circle className="dot" cx={middle} cy={centre} r={7} />;
      case "history":
      case "history-shallow":
      case "history-deep":
      case "deep-history":
        return (
          <>
            <circle className={`state${lit}`} cx={middle} cy={centre} r={13} />
            <text className="name" x={middle} y={centre + 4.5} textAnchor="middle">
              {drawn.kind.includes("deep") ? "H*" : "H"}
            </text>
          </>
        );
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
    <g data-state={s} data-id={id} data-active={active} role="img" aria-label={`State ${name}${active ? ", active" : ""}`}>
      <title>{`${name}${active ? ": active" : ""}`}</title>
      {outline()}
      <StateTexts drawn={drawn} nest={nest} />
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

export const StateTexts = memo(function StateTexts({ drawn, nest }: { drawn: ChartLayout["states"][number]; nest: boolean }) {
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
