import "../styles/world.css";

import { useEffect, useMemo, useRef, useState } from "react";

import { follow_pointer } from "../picture/drag";
import { Minimap } from "../picture/Minimap";
import { usePictureView } from "../picture/use_picture_view";
import { to_picture } from "../picture/viewport";
import { plan_image } from "../panels/map/floor_plan";
import type { Point, Rect } from "../protocol/types";
import { useStudio } from "../store/store";
import { useCommand } from "../widgets/commands";
import { useTheme } from "../widgets/theme";
import { broken, edit_text, findings_of, go_to, rename_place, useDesign, type Doc } from "./design";
import { places_of, type Spot } from "./world_places";
import { in_turn } from "./turns";
import { angle_of, angle_text, is_other, metres_text, number_of, type YamlValue } from "./yaml_places";

/** Of the picture, per metre. */
const kMetre = 60;
const kHeading_m = 0.55;
/** From a ring to what it is held by, which is not to lie on its middle. */
const kRingHandle_m = 0.3;
const kDragFrom_px = 3;

/** Where a spot is in the text. */
const still = (spot: Spot, heading: boolean): Drag => ({ id: spot.id, heading, x: number_of(spot.x)!, y: number_of(spot.y)!, angle: angle_of(spot.heading ?? undefined) ?? 0, radius: number_of(spot.radius) ?? 0 });

/** What is done on the map by key. */
const kMapCommands: readonly { title: string; keys: string; key: string }[] = [
  { title: "Choose the next place", keys: "S", key: "s" },
  { title: "Rename the chosen place wherever it is named", keys: "F2", key: "F2" },
  ...(["→", "←", "↑", "↓"] as const).map((keys, i) => ({ title: `Move the chosen place ${["right", "left", "up", "down"][i]!}`, keys, key: `Arrow${["Right", "Left", "Up", "Down"][i]!}` })),
];

interface Drag {
  id: string;
  heading: boolean;
  x: number;
  y: number;
  angle: number;
  radius: number;
}

/** Asks for another name of a place. */
function Renaming({ place, end }: { place: string; end(): void }) {
  const [name, set_name] = useState(place);
  const done = () => void rename_place(place, name.trim()).then((was) => was && end());
  return (
    <form
      className="world-renaming"
      onSubmit={(event) => {
        event.preventDefault();
        if (name.trim() === place) end();
        else done();
      }}
    >
      <label>
        <span className="muted">{place} becomes</span>
        <input className="field" aria-label={`Another name of ${place}`} spellCheck={false} autoComplete="off" value={name} autoFocus onFocus={(event) => event.target.select()} onChange={(event) => set_name(event.target.value)} onKeyDown={(event) => event.key === "Escape" && end()} />
      </label>
      <button className="button small primary" type="submit" title="In the world, the mission, charts, requirements, scenarios: wherever it is named">
        Rename everywhere
      </button>
      <button className="button small" type="button" onClick={end}>
        Cancel
      </button>
    </form>
  );
}

/** The places of a world on its floor plan: what one drags is written where it stands in the text. */
export default function WorldView({ doc }: { doc: Doc }) {
  const text = doc.places.shown;
  const canvas = useRef<HTMLCanvasElement>(null);
  const summary = useDesign((state) => state.summary);
  const why_dim = useDesign(broken);
  const map = useStudio((studio) => studio.index?.model.world?.map ?? null);
  const boot = useStudio((studio) => studio.hello?.boot);
  const theme = useTheme((state) => state.theme);
  const [cells, set_cells] = useState<Uint8Array | null>(null);
  const [drag, set_drag] = useState<Drag | null>(null);
  const [chosen, set_chosen] = useState<string | null>(null);
  const [renamed, set_renamed] = useState<string | null>(null);
  // A text that is broken for the moment keeps its last picture.
  const found = useMemo(() => places_of(text), [text]);
  const kept = useRef(found);
  if (found.spots.length > 0 || found.shapes.length > 0) kept.current = found;
  const { spots, shapes, obstacles, rings } = kept.current;

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

  const all = useMemo(() => [...spots, ...shapes.flatMap((shape) => shape.spots), ...obstacles.flatMap(({ spot, ring }) => (ring ? [spot, ring] : [spot])), ...rings], [spots, shapes, obstacles, rings]);
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
    const origin = still(spot, heading);
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
      const next = heading
        ? { ...origin, angle: snap(Math.atan2(y - origin.y, x - origin.x), turn) }
        : spot.radius
          ? { ...origin, radius: Math.max(snap(Math.hypot(x - origin.x, y - origin.y) - kRingHandle_m, grid), grid) }
          : { ...origin, x: snap(origin.x + x - from[0], grid), y: snap(origin.y + y - from[1], grid) };
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
    // Numbers that stay are not written anew: 3.0 stays 3.0.
    const edit = (value: YamlValue, number: number, written: string) => (is_other(value, number) ? [{ from: value.from, to: value.to, text: written }] : []);
    const edits = to.heading
      ? spot.heading
        ? edit(spot.heading, to.angle, angle_text(to.angle, spot.heading.text))
        : []
      : spot.radius
        ? edit(spot.radius, to.radius, metres_text(to.radius))
        : [...edit(spot.x, to.x, metres_text(to.x)), ...edit(spot.y, to.y, metres_text(to.y))];
    const changed = edits.filter((one) => text.slice(one.from, one.to) !== one.text);
    return changed.length > 0 ? edit_text(doc.file, text, changed, `${to.heading ? "turn" : spot.radius ? "change" : "move"} ${spot.name}`) : Promise.resolve();
  };
  const next_spot = (step: number) => {
    if (all.length === 0) return;
    const at = all.findIndex(({ id }) => id === chosen);
    const next = all.at((at + (at < 0 && step < 0 ? 0 : step)) % all.length)!;
    set_chosen(next.id);
    go_to(doc_byte(next.x.from));
  };
  const press_key = (name: string) => {
    svg.current?.focus();
    svg.current?.dispatchEvent(new KeyboardEvent("keydown", { key: name, bubbles: true, cancelable: true }));
  };
  useCommand(
    { id: "design.world", title: "Go to the map that is edited", group: "World", run: () => svg.current?.focus() },
    ...kMapCommands.map(({ title, keys, key }) => ({ id: `design.world.${keys}`, title, group: "World", keys_there: [keys], run: () => press_key(key) })),
  );
  const by_key = (event: React.KeyboardEvent) => {
    if (!in_turn(event)) return;
    const spot = all.find(({ id }) => id === chosen);
    if (event.ctrlKey || event.metaKey) return;
    const step = event.altKey ? 0.01 : event.shiftKey ? 0.5 : 0.05;
    const [dx, dy] = { ArrowLeft: [-step, 0], ArrowRight: [step, 0], ArrowUp: [0, step], ArrowDown: [0, -step] }[event.key] ?? [0, 0];
    if (spot && (dx !== 0 || dy !== 0)) {
      const from = still(spot, false);
      void write(spot, { ...from, x: from.x + dx!, y: from.y + dy!, radius: Math.max(from.radius + dx! + dy!, step) });
    }
    else if (event.key === "s" || event.key === "S") next_spot(event.shiftKey ? -1 : 1);
    else if (event.key === "Escape") set_chosen(null);
    else if (event.key === "F2" && spot?.place) set_renamed(spot.place);
    else if (event.altKey || !view.key(event, spot === undefined)) return;
    event.preventDefault();
    event.stopPropagation();
  };

  const by_double_click = (event: React.MouseEvent) => {
    const target = event.target instanceof Element ? event.target.closest("[data-place]") : null;
    if (target) set_renamed(target.getAttribute("data-place"));
    else view.fit();
  };
  const end_renaming = () => {
    set_renamed(null);
    svg.current?.focus({ preventScroll: true });
  };

  const wrong = useMemo(() => findings_of(summary, doc.file).filter(({ severity }) => severity === "error"), [summary, doc.file]);
  const line_of = (at: number) => text.slice(0, at).split("\n").length;
  const why = (spot: Spot) => wrong.filter(({ line }) => line === line_of(spot.x.from)).map(({ message }) => message).join("; ");
  /** As it is now: in the text, or where it is dragged. What is around a place goes with it. */
  const seen = (spot: Spot): Drag => {
    const moved = drag && !drag.heading && all.find(({ id }) => id === drag.id);
    if (!moved) return still(spot, false);
    return moved.id === spot.id || (moved.x === spot.x && !moved.radius) ? { ...drag, radius: moved.id === spot.id ? drag.radius : still(spot, false).radius } : still(spot, false);
  };
  const centre = (spot: Spot): Point => {
    const { x, y } = seen(spot);
    return [x * kMetre, -y * kMetre];
  };
  const reach = (spot: Spot) => seen(spot).radius * kMetre;
  const place = (spot: Spot): Point => (spot.radius ? [centre(spot)[0] + reach(spot) + kRingHandle_m * kMetre, centre(spot)[1]] : centre(spot));
  const angle = (spot: Spot) => (drag?.id === spot.id && drag.heading ? drag.angle : (angle_of(spot.heading ?? undefined) ?? 0));
  const handle = (spot: Spot) => {
    const [x, y] = place(spot);
    const problem = why(spot);
    return (
      <g key={spot.id} className={`world-spot ${spot.kind}${chosen === spot.id ? " chosen" : ""}${problem ? " wrong" : ""}`} data-spot={spot.id} data-place={spot.place} role="img" aria-label={`${spot.name}${spot.radius ? `: ${metres_text(seen(spot).radius)}` : ` at ${metres_text(x / kMetre)}, ${metres_text(-y / kMetre)}`}${problem ? `: ${problem}` : ""}`}>
        <title>{problem ? `${spot.name}: ${problem}` : `${spot.name}: drag, or the arrow keys${spot.place ? "; F2 or a double click gives it another name" : ""}`}</title>
        <circle cx={x} cy={y} r={spot.kind === "location" ? 10 : 7} />
      </g>
    );
  };
  const dragged = drag && all.find(({ id }) => id === drag.id);
  return (
    <>
      <canvas ref={canvas} className={`world-plan${why_dim ? " dim" : ""}`} aria-hidden="true" />
      <svg ref={svg} className={`picture world-picture${why_dim ? " dim" : ""}`} role="group" aria-label={`Map of ${doc.file}`} tabIndex={0} data-testid="design-world" onKeyDown={by_key} onDoubleClick={by_double_click} onClick={(event) => event.target === svg.current && set_chosen(null)}>
        <g ref={group}>
          {shapes.map((shape) => {
            const points = shape.spots.map(place);
            const is_area = shape.kind === "area";
            // Of an area at its corner: names of places are in its middle.
            const [x, y] = is_area
              ? [Math.min(...points.map((point) => point[0])), Math.min(...points.map((point) => point[1]))]
              : [points.reduce((sum, point) => sum + point[0], 0) / points.length, points.reduce((sum, point) => sum + point[1], 0) / points.length];
            return (
              <g key={`${shape.kind} ${shape.name}`} className={`world-shape ${shape.kind}`}>
                <path d={`M${points.map((point) => point.join(" ")).join("L")}${is_area ? "Z" : ""}`} />
                <text x={x} y={y} dx={is_area ? "0.7em" : 0} dy="1.4em" textAnchor={is_area ? "start" : "middle"} data-place={is_area ? shape.name : undefined}>
                  {shape.name}
                </text>
              </g>
            );
          })}
          {rings.map((ring) => (
            <circle key={ring.id} className="world-tolerance" cx={centre(ring)[0]} cy={centre(ring)[1]} r={reach(ring)} />
          ))}
          {obstacles.map(({ spot, ring, size }) => {
            const [x, y] = centre(spot);
            return (
              <g key={spot.id} className="world-obstacle">
                {size && <rect x={x - (size[0] * kMetre) / 2} y={y - (size[1] * kMetre) / 2} width={size[0] * kMetre} height={size[1] * kMetre} transform={`rotate(${(-angle(spot) * 180) / Math.PI} ${x} ${y})`} />}
                {ring && <circle cx={x} cy={y} r={reach(ring)} />}
                <text x={x} y={y} dy="1.7em" textAnchor="middle">
                  {spot.name}
                </text>
              </g>
            );
          })}
          {[...shapes.flatMap((shape) => shape.spots), ...obstacles.flatMap(({ spot, ring }) => (ring ? [ring, spot] : [spot])), ...rings].map(handle)}
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
                <text x={x} y={y} dy={spot.heading && Math.sin(turn) < -0.5 ? "-0.9em" : "1.7em"} textAnchor="middle">
                  {spot.name}
                </text>
              </g>
            );
          })}
        </g>
      </svg>
      {renamed !== null && <Renaming key={renamed} place={renamed} end={end_renaming} />}
      <Minimap view={view} box={box} rects={spots.map((spot) => ({ x: place(spot)[0] - 8, y: place(spot)[1] - 8, width: 16, height: 16 }))} />
      {drag && dragged && (
        <p className="world-readout mono" role="status">
          {dragged.name}: {drag.heading ? angle_text(drag.angle, "0 deg") : dragged.radius ? `${metres_text(drag.radius)} m` : `${metres_text(drag.x)} m, ${metres_text(drag.y)} m`}
        </p>
      )}
    </>
  );
}
