import { memo, useEffect, useImperativeHandle, useLayoutEffect, useMemo, useState, type Ref } from "react";

import { duration_text } from "../../draw/format";
import { svg_of_group } from "../../picture/export";
import { usePicture } from "../../picture/pictures";
import { InView, is_near, set_lens } from "../../picture/lens";
import { kDetailText, kNameText, largest, type TextLook } from "../../picture/fitting";
import { Minimap } from "../../picture/Minimap";
import type { PictureView } from "../../picture/picture_view";
import { usePictureView } from "../../picture/use_picture_view";
import { last_word } from "../../protocol/statuses";
import { kStatuses, type Point, type Rect, type TreeLayout, type TreeNode } from "../../protocol/types";
import { color } from "../../widgets/theme";
import { select, useStudio, type Index } from "../../store/store";
import { FoldCount } from "../charts/folding";
import { is_on, useSteering } from "../steer/steering";
import { is_never, useReached } from "../reached/reached";
import { open_skill, toggle, useMission } from "./mission";
import { NodeMenu } from "./NodeMenu";
import { LastSign, StatusSign } from "./StatusSign";
import { descendants, neighbour, running, visible_for, type Arrow } from "./tree";

export interface TreeHandle {
  fit(): void;
  zoom(factor: number): void;
}

type Drawn = TreeLayout["nodes"][number];
const kAges_ms = 250;
/** A tree that would be smaller as a whole is shown in part, this large. */
const kSmallest = 0.54;
const kReadable = 0.85;

/** The tree as the program lays it out; only nodes whose status changed are drawn anew. */
export function TreePicture({ index, handle }: { index: Index; handle: Ref<TreeHandle> }) {
  const drawn = useMission((mission) => mission.drawn);
  const collapsed = useMission((mission) => mission.collapsed);
  const chosen = useStudio((studio) => studio.selection.node);
  const [menu, set_menu] = useState<{ node: number; x: number; y: number } | null>(null);

  const { nodes } = index.model.tree;
  const layout = drawn?.layout ?? index.model.tree.layout;
  const ids = useMemo(() => drawn?.nodes ?? nodes.map((node) => node.id), [drawn, nodes]);
  const rects = useMemo(() => new Map(ids.map((id, i) => [id, layout.nodes[i]!] as const)), [ids, layout]);
  const box: Rect = useMemo(() => ({ x: 0, y: 0, ...layout.size }), [layout]);

  const [in_view] = useState(() => new InView());
  const rect_of = (node: SVGGElement) => rects.get(Number(node.dataset["node"]));
  const { svg, group, view } = usePictureView({
    box,
    limits: { min: 0.05, max: 4 },
    margin: 8,
    fit_max: 1.15,
    readable: { from: kSmallest, scale: kReadable },
    focus: () => rects.get(chosen ?? -1) ?? rects.get(ids[0] ?? -1) ?? null,
    change: (now, size, moved) => {
      set_lens(moved, now.scale);
      in_view.follow(moved, now, size, rect_of);
    },
  });
  useLayoutEffect(() => set_lens(group.current, view.view.scale), [group, view, chosen, ids]);
  useLayoutEffect(() => in_view.follow(group.current, view.view, view.size, (node) => rects.get(Number(node.dataset["node"])), true), [in_view, group, view, rects]);
  useImperativeHandle(handle, () => ({ fit: () => view.fit(), zoom: (factor) => view.zoom(factor) }), [view]);
  useFollow(index, view, rects);
  useAges(svg, rects);
  usePicture("mission", () =>
    group.current ? { name: "mission", size: box, svg: svg_of_group(group.current, box, `Mission ${nodes[0]?.name ?? ""}`, color("surface")) } : null,
  );

  // Shown when asked for elsewhere: by a jump, or by a choice in another panel.
  const wanted = useMission((mission) => mission.wanted);
  useEffect(() => {
    const rect = wanted && rects.get(wanted.node);
    if (!rect) return;
    if (view.view.scale < kSmallest) view.centre([rect.x + rect.width / 2, rect.y + rect.height / 2], kReadable);
    else view.reveal(rect);
  }, [wanted, rects, view]);

  const choose = (node: number, reveal: boolean) => {
    const leaf = nodes[node]?.leaf;
    select(leaf ? { node, chart: leaf } : { node });
    const rect = rects.get(node);
    if (reveal && rect) view.reveal(rect);
  };
  const node_at = (event: { target: EventTarget }): number | null => {
    const found = event.target instanceof Element ? event.target.closest("[data-node]") : null;
    return found ? Number(found.getAttribute("data-node")) : null;
  };
  const open_chart = (node: number) => {
    if (nodes[node]?.leaf) open_skill(nodes[node].leaf, node);
    else if ((index.children[node]?.length ?? 0) > 0) toggle(node);
  };
  const key = (event: React.KeyboardEvent) => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const at = chosen ?? nodes[0]?.id ?? 0;
    const shown = visible_for(nodes, collapsed, at);
    if (event.key.startsWith("Arrow")) {
      const next = chosen === null ? at : neighbour(rects, (id) => nodes[id]?.parent ?? -1, shown, event.key as Arrow);
      if (next !== null) choose(next, true);
    } else if (event.key === "Enter") open_chart(shown);
    else if (event.key === "Home") choose(nodes[0]?.id ?? 0, true);
    else if (event.key === "Escape") select({ node: null });
    else if (event.key === "ContextMenu" || (event.key === "F10" && event.shiftKey)) {
      const element = svg.current?.querySelector(`[data-node="${shown}"]`)?.getBoundingClientRect();
      if (element) set_menu({ node: shown, x: element.left + element.width / 2, y: element.bottom });
    } else if (!view.key(event, false)) return;
    event.preventDefault();
    event.stopPropagation();
  };

  return (
    <>
      <svg
        ref={svg}
        className="picture tree-picture"
        role="tree"
        aria-label="Mission"
        aria-activedescendant={chosen === null ? undefined : `node-${visible_for(nodes, collapsed, chosen)}`}
        tabIndex={0}
        data-testid="tree"
        onKeyDown={key}
        onClick={(event) => {
          const node = node_at(event);
          if (event.target instanceof Element && event.target.closest(".fold") && node !== null) toggle(node);
          else if (node !== null) choose(node, false);
          else select({ node: null });
        }}
        onDoubleClick={(event) => {
          const node = node_at(event);
          if (node !== null) open_chart(node);
          else view.fit();
        }}
        onContextMenu={(event) => {
          event.preventDefault();
          const node = node_at(event);
          if (node === null) return;
          choose(node, false);
          set_menu({ node, x: event.clientX, y: event.clientY });
        }}
      >
        <g ref={group}>
          <Links layout={layout} />
          {in_front(ids, chosen).map((id) => (
            <NodeView
              key={id}
              node={nodes[id]!}
              drawn={rects.get(id)!}
              folded={collapsed.has(id)}
              hidden={collapsed.has(id) ? descendants(index.children, id) : 0}
              parent_of_some={(index.children[id]?.length ?? 0) > 0}
            />
          ))}
        </g>
      </svg>
      <Minimap view={view} box={box} rects={layout.nodes} />
      {menu && <NodeMenu index={index} {...menu} close={() => set_menu(null)} />}
    </>
  );
}

/** The lines from parents to children. */
export const Links = memo(function Links({ layout }: { layout: TreeLayout }) {
  return (
    <g className="links">
      {layout.edges.map((edge, i) => edge.length > 0 && <path key={i} className="link" d={curve(edge)} />)}
    </g>
  );
});

/** SVG path data of a chain of cubic Bézier pieces. */
export function curve(points: readonly Point[]): string {
  const pair = (point: Point | undefined) => (point ? `${round(point[0])} ${round(point[1])}` : "");
  let data = `M${pair(points[0])}`;
  for (let i = 1; i + 2 < points.length; i += 3) data += `C${pair(points[i])} ${pair(points[i + 1])} ${pair(points[i + 2])}`;
  return data;
}

function round(value: number): number {
  return Math.round(value * 100) / 100;
}

const fitting = (drawn: Drawn, line: string, look: TextLook, y: number) => ({ "--fit": largest(drawn, line, look, y, kPoint, kDoubleSide).toFixed(3) }) as React.CSSProperties;

const kTitleHeight = 17;
const kLineHeight = 14.5;
const kPoint = 12;
const kDoubleSide = 5;

/** Where a sign sits at the upper right of a node's outline. */
export function corner(drawn: Drawn): string {
  const inset = drawn.shape === "condition" ? drawn.width * 0.25 : drawn.shape === "decorator" ? kPoint : 0;
  const drop = drawn.shape === "condition" ? drawn.height * 0.067 : 0;
  return `translate(${round(drawn.x + drawn.width - inset)} ${round(drawn.y + drop)})`;
}

/** The chosen node is drawn last, over its neighbours. */
function in_front(ids: readonly number[], chosen: number | null): readonly number[] {
  return chosen === null || !ids.includes(chosen) ? ids : [...ids.filter((id) => id !== chosen), chosen];
}

interface NodeProps {
  node: TreeNode;
  drawn: Drawn;
  folded: boolean;
  hidden: number;
  parent_of_some: boolean;
}

const NodeView = memo(function NodeView({ node, drawn, folded, hidden, parent_of_some }: NodeProps) {
  const { id } = node;
  // One number, so that one selector per node is enough.
  const look = useStudio(({ state, index, selection: { node: at } }) => {
    const near = is_near(id, node.parent, at, at === null ? null : (index?.model.tree.nodes[at]?.parent ?? null));
    return (state?.tree.status[id] ?? 0) + 8 * (state?.tree.last[id] ?? 0) + (at === id ? 64 : near ? 128 : 0);
  });
  const found = useMission((mission) => mission.found.has(id));
  const never = useReached(({ never: { nodes } }) => is_never(nodes.get(node.path), node.kind));
  const marks = useSteering((steering) => steering.standing.filter((entry) => is_on(entry, node)).map((entry) => `${entry.kind}:${entry.status ?? ""}`).join());
  const [status, last, chosen, near] = [look & 7, (look >> 3) & 7, (look & 64) !== 0, look >= 128];
  const word = (kStatuses[status] ?? "IDLE").toLowerCase();
  const middle = drawn.x + drawn.width / 2;
  const badge = corner(drawn);
  // That a condition does not hold is an answer like any other.
  const no = node.kind === "condition" && word === "failure";
  const classes = ["node", no ? "no" : word, chosen ? "chosen" : near ? "near" : "", found ? "found" : "", never ? "never-ticked" : ""].filter(Boolean).join(" ");
  // What is read aloud begins with what is to be seen.
  const said = `${[drawn.symbol, ...drawn.title, ...drawn.lines].filter(Boolean).join(" ") || node.name}, ${node.type}: ${word}${status === 0 && last > 0 ? `, last ${last_word(last)}` : ""}${never ? ", never reached" : ""}`;
  return (
    <g
      id={`node-${id}`}
      className={classes}
      data-node={id}
      data-status={kStatuses[status]}
      role="treeitem"
      aria-label={said}
      aria-selected={chosen}
      aria-expanded={parent_of_some ? !folded : undefined}
    >
      <title>{said}</title>
      {(chosen || found) && <rect className="halo" data-export="no" x={drawn.x - 5} y={drawn.y - 5} width={drawn.width + 10} height={drawn.height + 10} rx={7} />}
      <Outline drawn={drawn} />
      <Texts drawn={drawn} middle={middle} />
      {status > 0 ? (
        <g transform={badge}>
          <StatusSign status={status} />
        </g>
      ) : (
        last > 0 && <LastSign last={last} transform={badge} />
      )}
      {folded && <FoldCount hidden={hidden} x={round(middle)} y={round(drawn.y + drawn.height)} />}
      {parent_of_some && (
        <g className="fold" data-export="no" transform={`translate(${round(drawn.x)} ${round(drawn.y + drawn.height)})`}>
          <title>{folded ? "Show what is below" : "Hide what is below"}</title>
          <circle r={7} />
          <path d={folded ? "M-3.500 0H3.500M0 -3.500V3.500" : "M-3.500 0H3.500"} />
        </g>
      )}
      {marks !== "" && (
        <g className="steered" transform={`translate(${round(drawn.x - 1)} ${round(drawn.y)})`}>
          {marks.includes("breakpoint") && <path className="breakpoint" d="M-3 -7H3L7 -3V3L3 7H-3L-7 3V-3Z" />}
          {marks.includes("force") && (
            <>
              <rect className="forced" x={marks.includes("breakpoint") ? 9 : -7} y={-7} width={14} height={14} rx={3} />
              <text className="forced-text" x={marks.includes("breakpoint") ? 16 : 0} y={4} textAnchor="middle">
                F
              </text>
            </>
          )}
        </g>
      )}
      <text className="age" data-age={id} x={middle} y={drawn.y + drawn.height + 11} textAnchor="middle" />
    </g>
  );
});

export const Outline = memo(function Outline({ drawn }: { drawn: Drawn }) {
  const { x, y, width, height } = drawn;
  const [right, bottom, middle] = [x + width, y + height, y + height / 2];
  switch (drawn.shape) {
    case "condition":
      return <ellipse className="shape" cx={x + width / 2} cy={middle} rx={width / 2} ry={height / 2} />;
    case "decorator":
      return <path className="shape" d={`M${x + kPoint} ${y}L${right - kPoint} ${y}L${right} ${middle}L${right - kPoint} ${bottom}L${x + kPoint} ${bottom}L${x} ${middle}Z`} />;
    case "subtree":
      return (
        <>
          <rect className="shape" x={x} y={y} width={width} height={height} rx={2} />
          <path className="side" d={`M${x + kDoubleSide} ${y}V${bottom}M${right - kDoubleSide} ${y}V${bottom}`} />
        </>
      );
    default:
      return <rect className="shape" x={x} y={y} width={width} height={height} rx={2} />;
  }
});

export const Texts = memo(function Texts({ drawn, middle }: { drawn: Drawn; middle: number }) {
  const sign = drawn.symbol !== "" && [...drawn.symbol].length <= 3;
  const symbol_height = drawn.symbol === "" ? 0 : sign ? 24 : kTitleHeight;
  const height = symbol_height + drawn.title.length * kTitleHeight + drawn.lines.length * kLineHeight;
  let y = drawn.y + drawn.height / 2 - height / 2;
  const parts = [];
  if (drawn.symbol !== "") {
    parts.push(<Symbol key="symbol" symbol={drawn.symbol} x={middle} y={y + symbol_height / 2 - (drawn.title.length > 0 ? 1 : 0)} sign={sign} />);
    y += symbol_height;
  }
  drawn.title.forEach((line, i) => {
    // A space between two texts, for whoever reads them as one.
    parts.push(" ", <text key={`t${i}`} className="name" style={fitting(drawn, line, kNameText, y + kTitleHeight / 2)} x={middle} y={y + kTitleHeight - 4.5} textAnchor="middle">{line}</text>);
    y += kTitleHeight;
  });
  drawn.lines.forEach((line, i) => {
    parts.push(" ", <text key={`l${i}`} className="detail" style={fitting(drawn, line, kDetailText, y + kLineHeight / 2)} x={middle} y={y + kLineHeight - 4} textAnchor="middle">{line}</text>);
    y += kLineHeight;
  });
  return <>{parts}</>;
});

function Symbol({ symbol, x, y, sign }: { symbol: string; x: number; y: number; sign: boolean }) {
  const arrow = (at: number) => `M${x - 12} ${at}H${x + 12}M${x + 7.5} ${at - 4}L${x + 12} ${at}L${x + 7.5} ${at + 4}`;
  if (symbol === "→") return <path className="symbol" d={arrow(y)} />;
  if (symbol === "⇉") return <path className="symbol" d={arrow(y - 6) + arrow(y + 6)} />;
  if (sign) return <text className="symboltext" x={x} y={y + 7} textAnchor="middle">{symbol}</text>;
  return <text className="name" x={x} y={y + 4.5} textAnchor="middle">{symbol}</text>;
}

/** Keeps what is at work in view. */
function useFollow(index: Index, view: PictureView, rects: ReadonlyMap<number, Rect>): void {
  const follow = useMission((mission) => mission.follow);
  const collapsed = useMission((mission) => mission.collapsed);
  const at_work = useStudio((studio) => (follow && studio.state ? running(index.children, studio.state.tree.status).join() : ""));
  useEffect(() => {
    if (!follow || at_work === "") return;
    const shown = at_work.split(",").map((id) => rects.get(visible_for(index.model.tree.nodes, collapsed, Number(id))));
    const boxes = shown.filter((rect) => rect !== undefined);
    if (boxes.length === 0) return;
    const [x, y] = [Math.min(...boxes.map((b) => b.x)), Math.min(...boxes.map((b) => b.y))];
    const right = Math.max(...boxes.map((b) => b.x + b.width));
    view.reveal({ x, y, width: right - x, height: Math.max(...boxes.map((b) => b.y + b.height)) - y });
  }, [follow, at_work, rects, view, index, collapsed]);
}

/** Writes below each node what it last said and how long ago. A few times a second is enough, and no node is drawn anew. */
function useAges(svg: React.RefObject<SVGSVGElement | null>, rects: unknown): void {
  const ages = useMission((mission) => mission.ages);
  useEffect(() => {
    const write = () => {
      const state = useStudio.getState().state;
      for (const text of svg.current?.querySelectorAll("[data-age]") ?? []) {
        const id = Number(text.getAttribute("data-age"));
        const last = state?.tree.last[id] ?? 0;
        const since = state?.tree.since[id] ?? 0;
        const word = state?.tree.status[id] ? (kStatuses[last] ?? "").toLowerCase() : last_word(last);
        const words = !ages || !state || last === 0 ? "" : `${word} ${duration_text(Math.floor((state.time - since) / 1e8) * 1e8).replace(/^0 s$/, "now")}`;
        if (text.textContent !== words) text.textContent = words;
      }
    };
    write();
    if (!ages) return;
    const timer = window.setInterval(write, kAges_ms);
    return () => window.clearInterval(timer);
  }, [ages, svg, rects]);
}
