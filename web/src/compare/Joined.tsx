import { useEffect, useLayoutEffect, useMemo } from "react";

import { arrow } from "../panels/charts/arrow";
import { Label, StateTexts } from "../panels/charts/ChartPicture";
import { curve, Outline, Texts } from "../panels/mission/TreePicture";
import { set_lens } from "../picture/lens";
import { Minimap } from "../picture/Minimap";
import { usePictureView } from "../picture/use_picture_view";
import type { Comparison, PartMark, Point, Rect } from "../protocol/types";
import { kSigns, part_of, type Part } from "./marks";

type Tree = NonNullable<Comparison["trees"]>[number];
type Chart = NonNullable<Comparison["chart"]>;

/** In a tree that is shown smaller, what differs cannot be enlarged so that it can be read; a chart has lines close to each other. */
const kTreeSmallest = 0.78;

interface Props {
  comparison: Comparison;
  tree: Tree | null;
  chart: Chart | null;
  /** Its part is brought into view and outlined. */
  current: number;
  choose(difference: number): void;
}

/** Both states as one picture. */
export function JoinedPicture({ comparison, tree, chart, current, choose }: Props) {
  const layout = tree?.layout ?? chart!.layout;
  const box: Rect = useMemo(() => ({ x: 0, y: 0, width: Math.max(layout.size.width, 60), height: Math.max(layout.size.height, 60) }), [layout]);
  const chosen = comparison.differences[current];
  const at = chosen ? part_of(comparison, chosen, tree) : null;
  const place = at && rect_of(at, tree, chart);
  const { svg, group, view, keys } = usePictureView({
    box,
    limits: { min: 0.05, max: 4 },
    margin: 14,
    fit_max: 1.15,
    readable: { from: tree ? kTreeSmallest : 1, scale: 1 },
    focus: () => place,
    change: (now, _, moved) => set_lens(moved, now.scale, true),
  });
  useLayoutEffect(() => set_lens(group.current, view.view.scale, true), [group, view, current, tree]);
  /** By part: the differences that are about it. */
  const about = useMemo(() => {
    const found = new Map<string, number[]>();
    comparison.differences.forEach((difference, i) => {
      const part = part_of(comparison, difference, tree);
      if (part) found.set(key_of(part), [...(found.get(key_of(part)) ?? []), i]);
    });
    return found;
  }, [comparison, tree]);
  useEffect(() => {
    if (place) view.show_chosen(place);
    // The place of one part does not change while the picture stays.
    // eslint-disable-next-line react-hooks/exhaustive-deps
  }, [current, comparison, tree, view]);

  const says = (part: Part) => (about.get(key_of(part)) ?? []).map((i) => comparison.differences[i]!.what).join("; ");
  const badge = (part: Part, x: number, y: number, mark: PartMark) => {
    if (!about.has(key_of(part)) || mark === "" || mark === "left") return null;
    return (
      <g className={`compare-sign ${mark}`} data-sign={mark} transform={`translate(${x} ${y})`}>
        <circle r={9.5} />
        <text y={4.5} textAnchor="middle">
          {kSigns[mark]}
        </text>
      </g>
    );
  };
  return (
    <>
      <svg
        ref={svg}
        className={`picture compare-picture ${tree ? "tree-picture" : "chart-picture"}`}
        role="group"
        aria-label={`What differs in ${comparison.file}`}
        tabIndex={0}
        data-testid="compare-picture"
        onDoubleClick={() => view.fit()}
        onClick={(event) => {
          const found = event.target instanceof Element ? event.target.closest("[data-part]")?.getAttribute("data-part") : null;
          const first = found ? about.get(found)?.[0] : undefined;
          if (first !== undefined) choose(first);
        }}
        onKeyDown={keys}
      >
        <g ref={group}>
          {tree ? <TreeParts tree={tree} chosen={at?.at ?? -1} says={says} badge={badge} /> : <ChartParts chart={chart!} says={says} badge={badge} />}
          {place && <rect className="compare-here" x={place.x - 6} y={place.y - 6} width={place.width + 12} height={place.height + 12} rx={9} />}
        </g>
      </svg>
      <Minimap view={view} box={box} rects={tree ? tree.layout.nodes : chart!.layout.states} />
    </>
  );
}

const key_of = ({ kind, at }: Part) => `${kind}-${at}`;

function rect_of({ kind, at }: Part, tree: Tree | null, chart: Chart | null): Rect | null {
  if (kind === "node") return tree?.layout.nodes[at] ?? null;
  if (kind === "state") return chart?.layout.states[at] ?? null;
  const edge = chart?.layout.edges.find((one) => one.transition === at);
  if (!edge) return null;
  if (edge.label.width > 0) return edge.label;
  const [x, y] = middle_of(edge.curve);
  return { x: x - 14, y: y - 14, width: 28, height: 28 };
}

function middle_of(points: readonly Point[]): Point {
  return points[Math.floor(points.length / 2)] ?? [0, 0];
}

interface PartsProps {
  says(part: Part): string;
  badge(part: Part, x: number, y: number, mark: PartMark): React.ReactNode;
}

function TreeParts({ tree, chosen, says, badge }: PartsProps & { tree: Tree; chosen: number }) {
  const { layout, marks, moves } = tree;
  return (
    <>
      {layout.edges.map((edge, i) => edge.length > 0 && <path key={i} className={`link compare-link ${marks[i] ?? ""}`} d={curve(edge)} />)}
      {moves.map(([from, to], i) => (
        <Move key={i} from={layout.nodes[from]!} to={layout.nodes[to]!} />
      ))}
      {layout.nodes.map((drawn, i) => {
        const mark = marks[i] ?? "";
        const part: Part = { kind: "node", at: i };
        const name = [drawn.symbol, ...drawn.title, ...drawn.lines].filter(Boolean).join(" ");
        return (
          <g key={i} className={`node compare-part ${mark}${i === chosen ? " chosen" : mark === "" ? "" : " near"}`} data-part={`node-${i}`} data-mark={mark} data-name={drawn.title.join(" ") || drawn.symbol} role="img" aria-label={[name, mark === "left" ? "was here" : mark].filter(Boolean).join(": ")}>
            <title>{[name, says(part)].filter(Boolean).join(": ")}</title>
            <Outline drawn={drawn} />
            <Texts drawn={drawn} middle={drawn.x + drawn.width / 2} />
          </g>
        );
      })}
      {layout.nodes.map((drawn, i) => (
        <g key={i}>{badge({ kind: "node", at: i }, drawn.x + drawn.width, drawn.y, marks[i] ?? "")}</g>
      ))}
    </>
  );
}

/** From where something was to where it is. */
function Move({ from, to }: { from: Rect; to: Rect }) {
  const centre = ({ x, y, width, height }: Rect): Point => [x + width / 2, y + height / 2];
  const edge = (rect: Rect, towards: Point): Point => {
    const [cx, cy] = centre(rect);
    const [dx, dy] = [towards[0] - cx, towards[1] - cy];
    const part = Math.min(dx === 0 ? Infinity : rect.width / 2 / Math.abs(dx), dy === 0 ? Infinity : rect.height / 2 / Math.abs(dy), 1);
    return [cx + dx * part, cy + dy * part];
  };
  const [a, b] = [edge(from, centre(to)), edge(to, centre(from))];
  const length = Math.max(Math.hypot(b[0] - a[0], b[1] - a[1]), 1);
  // A little to the side, so that it does not lie on the lines of the drawing.
  const [nx, ny] = [-(b[1] - a[1]) / length, (b[0] - a[0]) / length];
  const bow = Math.min(0.18 * length, 60);
  const bent = (t: number): Point => [a[0] + (b[0] - a[0]) * t + nx * bow, a[1] + (b[1] - a[1]) * t + ny * bow];
  const shape = arrow([a, bent(0.3), bent(0.7), b]);
  if (!shape) return null;
  return (
    <g className="compare-move">
      <path d={curve(shape.line)} />
      <path className="head" d={shape.head} />
    </g>
  );
}

function ChartParts({ chart, says, badge }: PartsProps & { chart: Chart }) {
  const { layout, states, transitions, moves } = chart;
  const nests = useMemo(() => new Set(layout.states.map(({ parent }) => parent)), [layout]);
  return (
    <>
      {layout.states.map((drawn, i) => {
        const mark = states[i] ?? "";
        const name = drawn.name.join(" ") || drawn.kind;
        const [x, y] = [drawn.x + drawn.width / 2, drawn.y + drawn.height / 2];
        return (
          <g key={i} className={`compare-part ${mark}`} data-part={`state-${i}`} data-mark={mark} data-name={name} role="img" aria-label={[`State ${name}`, mark === "left" ? "was here" : mark].filter(Boolean).join(": ")}>
            <title>{[name, says({ kind: "state", at: i })].filter(Boolean).join(": ")}</title>
            {drawn.kind === "initial" ? <circle className="dot" cx={x} cy={y} r={7} /> : drawn.kind.includes("history") ? <circle className="state" cx={x} cy={y} r={13} /> : <rect className={nests.has(i) ? "nest" : "state"} x={drawn.x} y={drawn.y} width={drawn.width} height={drawn.height} rx={9} />}
            {drawn.kind === "final" && <rect className="inner" x={drawn.x + 3.5} y={drawn.y + 3.5} width={drawn.width - 7} height={drawn.height - 7} rx={5.5} />}
            <StateTexts drawn={drawn} nest={nests.has(i)} />
          </g>
        );
      })}
      {layout.separators.map(([x1, y1, x2, y2], i) => (
        <line key={i} className="region" x1={x1} y1={y1} x2={x2} y2={y2} />
      ))}
      {layout.edges.map((edge, i) => {
        const mark = transitions[edge.transition] ?? "";
        const shape = arrow(edge.curve);
        return (
          <g key={i} className={`compare-part compare-edge ${mark}`} data-part={`transition-${edge.transition}`} data-mark={mark}>
            {shape && <path className="arrow" d={curve(shape.line)} />}
            {shape && <path className="head" d={shape.head} />}
            <Label edge={edge} last={false} whole={[edge.lines.join(" "), says({ kind: "transition", at: edge.transition })].filter(Boolean).join(": ")} />
          </g>
        );
      })}
      {moves.map(([from, to], i) => (
        <Move key={i} from={layout.states[from]!} to={layout.states[to]!} />
      ))}
      {layout.states.map((drawn, i) => (
        <g key={i}>{badge({ kind: "state", at: i }, drawn.x + drawn.width, drawn.y, states[i] ?? "")}</g>
      ))}
      {transitions.map((mark, at) => {
        const rect = mark === "" ? null : rect_of({ kind: "transition", at }, null, chart);
        return rect && <g key={at}>{badge({ kind: "transition", at }, rect.x - 13, rect.y + rect.height / 2, mark)}</g>;
      })}
    </>
  );
}
