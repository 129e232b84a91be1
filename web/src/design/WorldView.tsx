import "../styles/world.css";

import { useEffect, useMemo, useRef, useState } from "react";

import { follow_pointer } from "../picture/drag";
import { Minimap } from "../picture/Minimap";
import { usePictureView } from "../picture/use_picture_view";
import { to_picture } from "../picture/viewport";
import { plan_image } from "../panels/map/floor_plan";
import type { Point, Rect } from "../protocol/types";
import { useStudio } from "../store/store";
import { useTheme } from "../widgets/theme";
import { edit_text, findings_of, go_to, useDesign, type Doc } from "./design";
import { angle_of, angle_text, entry, metres_text, number_of, yaml_values, type YamlValue } from "./yaml_places";

/** Of the picture, per metre. */
const kMetre = 60;
const kHeading_m = 0.55;
const kDragFrom_px = 3;

/** A pair of numbers of the text that is a place of the map. */
interface Spot {
  id: string;
  name: string;
  kind: "location" | "corner" | "door";
  x: YamlValue;
  y: YamlValue;
  heading: YamlValue | null;
}
interface Shape {
  name: string;
  kind: "area" | "door";
  spots: Spot[];
}

const point_of = (list: YamlValue | undefined | null): [YamlValue, YamlValue] | null => {
  const [x, y] = list?.items ?? [];
  return x && y && number_of(x) !== null && number_of(y) !== null ? [x, y] : null;
};

function read(text: string): { spots: Spot[]; shapes: Shape[]; stations: { name: string; at: string; tolerance: number }[] } {
  const root = yaml_values(text);
  const spots: Spot[] = [];
  const shapes: Shape[] = [];
  for (const [name, value] of entry(root, "locations")?.entries ?? []) {
    const point = point_of(value);
    if (point) spots.push({ id: `location ${name}`, name, kind: "location", x: point[0], y: point[1], heading: angle_of(value.items[2]) === null ? null : value.items[2]! });
  }
  for (const [name, value] of entry(root, "areas")?.entries ?? []) {
    const corners = (entry(value, "corners")?.items ?? []).flatMap((corner, i): Spot[] => {
      const point = point_of(corner);
      return point ? [{ id: `area ${name} ${i + 1}`, name: `${name}, corner ${i + 1}`, kind: "corner", x: point[0], y: point[1], heading: null }] : [];
    });
    if (corners.length > 1) shapes.push({ name, kind: "area", spots: corners });
  }
  for (const [name, value] of entry(root, "doors")?.entries ?? []) {
    const ends = ["from", "to"].flatMap((end): Spot[] => {
      const point = point_of(entry(value, end));
      return point ? [{ id: `door ${name} ${end}`, name: `${name}, ${end}`, kind: "door", x: point[0], y: point[1], heading: null }] : [];
    });
    if (ends.length === 2) shapes.push({ name, kind: "door", spots: ends });
  }
  const stations = (entry(root, "stations")?.entries ?? []).flatMap(([name, value]) => {
    const tolerance = number_of(entry(value, "linear_tolerance") ?? undefined);
    return tolerance === null ? [] : [{ name, at: entry(value, "pose")?.text ?? "", tolerance }];
  });
  return { spots, shapes, stations };
}

interface Drag {
  id: string;
  heading: boolean;
  x: number;
  y: number;
  angle: number;
}

/** The places of a world on its floor plan: what one drags is written where it stands in the text. */
export default function WorldView({ doc }: { doc: Doc }) {
  const text = doc.places.shown;
  const canvas = useRef<HTMLCanvasElement>(null);
  const summary = useDesign((state) => state.summary);
  const map = useStudio((studio) => studio.index?.model.world?.map ?? null);
  const boot = useStudio((studio) => studio.hello?.boot);
  const theme = useTheme((state) => state.theme);
  const [cells, set_cells] = useState<Uint8Array | null>(null);
  const [drag, set_drag] = useState<Drag | null>(null);
  const [chosen, set_chosen] = useState<string | null>(null);
  // A text that is broken for the moment keeps its last picture.
  const found = useMemo(() => read(text), [text]);
  const kept = useRef(found);
  if (found.spots.length > 0 || found.shapes.length > 0) kept.current = found;
  const { spots, shapes, stations } = kept.current;

  useEffect(() => {
    if (!map) return;
    const stop = new AbortController();
    fetch("./api/map", { signal: stop.signal })
      .then(async (answer) => (answer.ok ? new Uint8Array(await answer.arrayBuffer()) : null))
      .then(set_cells)
      .catch(() => undefined);
    return () => stop.abort();
  }, [map, boot]);
  const plan = useMemo(() => (map && cells && cells.length === map.width * map.height ? plan_image(map, cells, theme) : null), [map, cells, theme]);

  const all = useMemo(() => [...spots, ...shapes.flatMap((shape) => shape.spots)], [spots, shapes]);
  const box: Rect = useMemo(() => {
    const xs = all.map(({ x }) => number_of(x)!);
    const ys = all.map(({ y }) => number_of(y)!);
    if (map) {
      xs.push(map.origin[0], map.origin[0] + map.width * map.resolution);
      ys.push(map.origin[1], map.origin[1] + map.height * map.resolution);
    }
    const [left, right, low, high] = [Math.min(...xs) - 0.5, Math.max(...xs) + 0.5, Math.min(...ys) - 0.5, Math.max(...ys) + 0.5];
    return all.length > 0 || map ? { x: left * kMetre, y: -high * kMetre, width: (right - left) * kMetre, height: (high - low) * kMetre } : { x: 0, y: 0, width: 100, height: 100 };
  }, [all, map]);

  const latest = useRef(drag);
  latest.current = drag;
  const paint = useRef<() => void>(() => undefined);
  const press = useRef<(spot: Spot, heading: boolean, event: PointerEvent) => void>(() => undefined);
  const { svg, group, view } = usePictureView({
    box,
    limits: { min: 0.05, max: 8 },
    margin: 12,
    fit_max: 3,
    change: ({ scale }, _size, moved) => {
      moved?.style.setProperty("--unit", String(1 / scale));
      paint.current();
    },
    grab: (event) => {
      const target = event.target instanceof Element ? event.target.closest("[data-spot]") : null;
      const spot = all.find(({ id }) => id === target?.getAttribute("data-spot"));
      if (!spot) return false;
      press.current(spot, target!.getAttribute("data-heading") === "true", event);
      return true;
    },
  });
  paint.current = () => {
    const context = canvas.current?.getContext("2d");
    if (!canvas.current || !context) return;
    const ratio = window.devicePixelRatio || 1;
    const { width, height } = view.size;
    canvas.current.width = width * ratio;
    canvas.current.height = height * ratio;
    if (!plan || !map) return;
    const { scale, x, y } = view.view;
    const pixel = scale * kMetre * map.resolution;
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.imageSmoothingEnabled = pixel < 1;
    context.translate(x + scale * kMetre * map.origin[0], y - scale * kMetre * map.origin[1]);
    context.rotate(-map.origin[2]);
    context.drawImage(plan, 0, -pixel * map.height, pixel * map.width, pixel * map.height);
  };
  useEffect(() => paint.current(), [plan]);

  const begin = (spot: Spot, heading: boolean, event: PointerEvent) => {
    set_chosen(spot.id);
    go_to(doc_byte(spot.x.from));
    svg.current?.focus({ preventScroll: true });
    const origin: Drag = { id: spot.id, heading, x: number_of(spot.x)!, y: number_of(spot.y)!, angle: angle_of(spot.heading ?? undefined) ?? 0 };
    const at = (moved: { clientX: number; clientY: number }): Point => {
      const frame = svg.current!.getBoundingClientRect();
      const [x, y] = to_picture(view.view, [moved.clientX - frame.left, moved.clientY - frame.top]);
      return [x / kMetre, -y / kMetre];
    };
    const from = at(event);
    const move = (moved: PointerEvent) => {
      const [x, y] = at(moved);
      // To 5 cm and 5 degrees; with Alt to the centimetre and the degree.
      const grid = moved.altKey ? 0.01 : 0.05;
      const snap = (value: number, step: number) => Math.round(value / step) * step;
      const turn = (moved.altKey ? 1 : 5) * (Math.PI / 180);
      const next = heading ? { ...origin, angle: snap(Math.atan2(y - origin.y, x - origin.x), turn) } : { ...origin, x: snap(origin.x + x - from[0], grid), y: snap(origin.y + y - from[1], grid) };
      latest.current = next;
      set_drag(next);
    };
    follow_pointer(event, {
      from_px: kDragFrom_px,
      move,
      drop: () => {
        if (latest.current) void write(spot, latest.current);
      },
      end: () => set_drag(null),
    });
  };
  press.current = begin;
  const doc_byte = (at: number) => useDesign.getState().docs[doc.file]?.places.byte(at) ?? 0;
  const write = (spot: Spot, to: Drag) => {
    const edits = to.heading
      ? spot.heading
        ? [{ from: spot.heading.from, to: spot.heading.to, text: angle_text(to.angle, spot.heading.text) }]
        : []
      : [
          { from: spot.x.from, to: spot.x.to, text: metres_text(to.x) },
          { from: spot.y.from, to: spot.y.to, text: metres_text(to.y) },
        ];
    const changed = edits.filter((edit) => text.slice(edit.from, edit.to) !== edit.text);
    return changed.length > 0 ? edit_text(doc.file, text, changed, `${to.heading ? "turn" : "move"} ${spot.name}`) : Promise.resolve();
  };
  const by_key = (event: React.KeyboardEvent) => {
    const spot = all.find(({ id }) => id === chosen);
    if (event.ctrlKey || event.metaKey) return;
    const step = event.altKey ? 0.01 : event.shiftKey ? 0.5 : 0.05;
    const [dx, dy] = { ArrowLeft: [-step, 0], ArrowRight: [step, 0], ArrowUp: [0, step], ArrowDown: [0, -step] }[event.key] ?? [0, 0];
    if (spot && (dx !== 0 || dy !== 0)) void write(spot, { id: spot.id, heading: false, x: number_of(spot.x)! + dx!, y: number_of(spot.y)! + dy!, angle: 0 });
    else if (event.key === "Escape") set_chosen(null);
    else if (event.altKey || !view.key(event, spot === undefined)) return;
    event.preventDefault();
    event.stopPropagation();
  };

  const wrong = useMemo(() => findings_of(summary, doc.file).filter(({ severity }) => severity === "error"), [summary, doc.file]);
  const line_of = (at: number) => text.slice(0, at).split("\n").length;
  const why = (spot: Spot) => wrong.filter(({ line }) => line === line_of(spot.x.from)).map(({ message }) => message).join("; ");
  const place = (spot: Spot): Point => {
    const dragged = drag?.id === spot.id && !drag.heading ? drag : null;
    return [(dragged?.x ?? number_of(spot.x)!) * kMetre, -(dragged?.y ?? number_of(spot.y)!) * kMetre];
  };
  const angle = (spot: Spot) => (drag?.id === spot.id && drag.heading ? drag.angle : (angle_of(spot.heading ?? undefined) ?? 0));
  const handle = (spot: Spot) => {
    const [x, y] = place(spot);
    const problem = why(spot);
    return (
      <g key={spot.id} className={`world-spot ${spot.kind}${chosen === spot.id ? " chosen" : ""}${problem ? " wrong" : ""}`} data-spot={spot.id} role="img" aria-label={`${spot.name} at ${metres_text(x / kMetre)}, ${metres_text(-y / kMetre)}${problem ? `: ${problem}` : ""}`}>
        <title>{problem ? `${spot.name}: ${problem}` : `${spot.name}: drag, or the arrow keys`}</title>
        <circle cx={x} cy={y} r={spot.kind === "location" ? 10 : 7} />
      </g>
    );
  };
  const dragged = drag && all.find(({ id }) => id === drag.id);
  return (
    <>
      <canvas ref={canvas} className="world-plan" aria-hidden="true" />
      <svg ref={svg} className="picture world-picture" role="group" aria-label={`Map of ${doc.file}`} tabIndex={0} data-testid="design-world" onKeyDown={by_key} onDoubleClick={() => view.fit()} onClick={(event) => event.target === svg.current && set_chosen(null)}>
        <g ref={group}>
          {shapes.map((shape) => {
            const points = shape.spots.map(place);
            const [x, y] = [points.reduce((sum, point) => sum + point[0], 0) / points.length, points.reduce((sum, point) => sum + point[1], 0) / points.length];
            return (
              <g key={`${shape.kind} ${shape.name}`} className={`world-shape ${shape.kind}`}>
                <path d={`M${points.map((point) => point.join(" ")).join("L")}${shape.kind === "area" ? "Z" : ""}`} />
                <text x={x} y={y} dy={shape.kind === "door" ? "1.4em" : "0.35em"} textAnchor="middle">
                  {shape.name}
                </text>
              </g>
            );
          })}
          {stations.map(({ name, at, tolerance }) => {
            const spot = spots.find((one) => one.name === at);
            const [x, y] = spot ? place(spot) : [NaN, NaN];
            return spot && <circle key={name} className="world-tolerance" cx={x} cy={y} r={tolerance * kMetre} />;
          })}
          {shapes.flatMap((shape) => shape.spots.map(handle))}
          {spots.map((spot) => {
            const [x, y] = place(spot);
            const turn = angle(spot);
            const [hx, hy] = [x + Math.cos(turn) * kHeading_m * kMetre, y - Math.sin(turn) * kHeading_m * kMetre];
            return (
              <g key={spot.id} className="world-location">
                {spot.heading && <line x1={x} y1={y} x2={hx} y2={hy} />}
                {handle(spot)}
                {spot.heading && (
                  <circle className="world-heading" cx={hx} cy={hy} r={6} data-spot={spot.id} data-heading="true">
                    <title>{`Heading of ${spot.name}`}</title>
                  </circle>
                )}
                <text x={x} y={y} dy="1.7em" textAnchor="middle">
                  {spot.name}
                </text>
              </g>
            );
          })}
        </g>
      </svg>
      <Minimap view={view} box={box} rects={spots.map((spot) => ({ x: place(spot)[0] - 8, y: place(spot)[1] - 8, width: 16, height: 16 }))} />
      {drag && dragged && (
        <p className="world-readout mono" role="status">
          {dragged.name}: {drag.heading ? angle_text(drag.angle, "0 deg") : `${metres_text(drag.x)} m, ${metres_text(drag.y)} m`}
        </p>
      )}
    </>
  );
}
