import { useEffect, useLayoutEffect, useMemo, useRef, useState } from "react";

import { Edge, Label, StateTexts } from "../panels/charts/ChartPicture";
import { PictureView } from "../picture/picture_view";
import type { OutlineChart, Rect } from "../protocol/types";
import { doc_of, gesture, go_to, obstacle, useDesign } from "./design";

/** A chart as its text has it; what one clicks is shown in the text. */
export function ChartView({ chart, file }: { chart: OutlineChart; file: string }) {
  const svg = useRef<SVGSVGElement>(null);
  const group = useRef<SVGGElement>(null);
  const why_dim = useDesign(obstacle);
  const summary = useDesign((state) => state.summary);
  const { layout } = chart;
  const box: Rect = useMemo(() => ({ x: 0, y: 0, ...layout.size }), [layout]);
  const [view] = useState(
    () =>
      new PictureView({
        limits: { min: 0.05, max: 4 },
        margin: 12,
        fit_max: 1.15,
        change: ({ scale, x, y }) => group.current?.setAttribute("transform", `translate(${x} ${y}) scale(${scale})`),
      }),
  );
  useEffect(() => {
    if (svg.current) view.attach(svg.current);
    return () => view.detach();
  }, [view]);
  useLayoutEffect(() => view.set_box(box), [view, box]);
  const nests = useMemo(() => new Set(layout.states.map(({ parent }) => parent)), [layout]);
  const lines = useMemo(() => new Set((summary?.findings ?? []).filter((found) => found.file === file && found.severity === "error").map(({ line }) => line)), [summary, file]);

  const chosen = useDesign((state) => state.state);

  const show_line = (line: number) => {
    const doc = doc_of(useDesign.getState());
    if (!doc || line < 1) return;
    let at = 0;
    for (let i = 1; i < line; i += 1) at = doc.places.shown.indexOf("\n", at) + 1;
    const indented = at + (/^[ \t]*/.exec(doc.places.shown.slice(at))?.[0].length ?? 0);
    go_to(doc.places.byte(indented));
  };

  return (
    <svg
      ref={svg}
      className={`picture chart-picture design-picture${why_dim ? " dim" : ""}`}
      role="group"
      aria-label={`Chart ${file}`}
      tabIndex={0}
      data-testid="design-chart"
      onDoubleClick={() => view.fit()}
      onKeyDown={(event) => {
        if (chosen && (event.key === "Delete" || event.key === "Backspace")) void gesture({ what: "remove_state", state: chosen });
        else if (chosen && event.key === "F2") document.getElementById("design-state")?.focus();
        else if (event.key === "Enter") document.getElementById("design-new-state")?.focus();
        else if (!view.key(event, true)) return;
        event.preventDefault();
        event.stopPropagation();
      }}
      onClick={(event) => {
        const found = event.target instanceof Element ? event.target.closest("[data-line]") : null;
        if (found) show_line(Number(found.getAttribute("data-line")));
        useDesign.setState({ state: found?.getAttribute("data-id") ?? null, refused: null });
        svg.current?.focus({ preventScroll: true });
      }}
    >
      <g ref={group}>
        {layout.states.map((drawn, i) => {
          const nest = nests.has(i);
          const line = chart.states[i]?.line ?? 0;
          const [middle, centre] = [drawn.x + drawn.width / 2, drawn.y + drawn.height / 2];
          return (
            <g key={i} data-line={line} data-id={chart.states[i]?.id} role="img" aria-label={`State ${drawn.name.join(" ") || drawn.kind}`} className={[lines.has(line) ? "wrong" : "", chosen !== null && chart.states[i]?.id === chosen ? "chosen" : ""].filter(Boolean).join(" ") || undefined}>
              {drawn.kind === "initial" ? (
                <circle className="dot" cx={middle} cy={centre} r={7} />
              ) : drawn.kind.includes("history") ? (
                <circle className="state" cx={middle} cy={centre} r={13} />
              ) : (
                <rect className={nest ? "nest" : "state"} x={drawn.x} y={drawn.y} width={drawn.width} height={drawn.height} rx={9} />
              )}
              {drawn.kind === "final" && <rect className="inner" x={drawn.x + 3.5} y={drawn.y + 3.5} width={drawn.width - 7} height={drawn.height - 7} rx={5.5} />}
              <StateTexts drawn={drawn} nest={nest} />
            </g>
          );
        })}
        {layout.separators.map(([x1, y1, x2, y2], i) => (
          <line key={i} className="region" x1={x1} y1={y1} x2={x2} y2={y2} />
        ))}
        {layout.edges.map((edge, i) => (
          <g key={i} data-line={chart.transitions[edge.transition]?.line ?? 0}>
            <Edge edge={edge} last={false} />
            <Label edge={edge} last={false} whole={edge.lines.join(" ")} />
          </g>
        ))}
      </g>
    </svg>
  );
}
