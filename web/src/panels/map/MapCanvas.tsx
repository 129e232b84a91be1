import { useEffect, useImperativeHandle, useRef, useState, type Ref } from "react";

import { Menu, type MenuEntry } from "../../widgets/Menu";
import { color, useTheme } from "../../widgets/theme";
import { note, useStudio } from "../../store/store";
import type { Point, WorldModel } from "../../protocol/types";
import { usePicture } from "../../picture/pictures";
import { useWhyNot } from "../steer/steering";
import { choose_tool } from "./map";
import { MapView, type Asked } from "./map_view";
import { add_obstacle, navigations, put_robot, remove_obstacle, send_robot, send_robot_to, set_door } from "./steer_map";

export interface MapHandle {
  fit(): void;
  zoom(factor: number): void;
}

/** The map on a canvas, drawn only when something on it has changed. */
export function MapCanvas({ world, handle }: { world: WorldModel; handle: Ref<MapHandle> }) {
  const canvas = useRef<HTMLCanvasElement>(null);
  const [view, set_view] = useState<MapView | null>(null);
  const [asked, set_asked] = useState<Asked | null>(null);
  const [readout, set_readout] = useState("");
  const boot = useStudio((studio) => studio.hello?.boot);
  const theme = useTheme(({ theme }) => theme);
  const why_not = useWhyNot();

  useEffect(() => {
    if (!canvas.current) return;
    const next = new MapView(canvas.current, world, { ask: set_asked, readout: set_readout });
    set_view(next);
    return () => next.stop();
  }, [world]);
  useEffect(() => {
    if (!view) return;
    const stop = new AbortController();
    fetch("./api/map", { signal: stop.signal })
      .then(async (answer) => (answer.ok ? new Uint8Array(await answer.arrayBuffer()) : Promise.reject(new Error(answer.statusText))))
      .then((cells) => view.set_cells(cells))
      .catch((error: unknown) => {
        if (!stop.signal.aborted) note("error", `floor plan: ${error instanceof Error ? error.message : String(error)}`);
      });
    return () => stop.abort();
  }, [view, boot]);
  useEffect(() => view?.set_theme(theme), [view, theme]);
  useImperativeHandle(handle, () => ({ fit: () => view?.fit(), zoom: (factor) => view?.zoom(factor) }), [view]);
  usePicture("map", () => view?.picture(color("surface")) ?? null);

  return (
    <>
      <canvas
        ref={canvas}
        className="picture map-picture"
        role="application"
        tabIndex={0}
        data-testid="map"
        aria-label={`Map with ${world.robots.map(({ name }) => name).join(", ")}. Arrows move it, + and − zoom, 0 shows all, Enter opens what can be done at its middle`}
        aria-describedby="map-readout"
        onKeyDown={(event) => {
          if (event.key === "Escape") choose_tool(null);
          else if (event.key === "Enter" || event.key === "ContextMenu") view?.ask_at_middle();
          else if (!view?.key(event.nativeEvent)) return;
          event.preventDefault();
          event.stopPropagation();
        }}
      />
      <output id="map-readout" className="map-readout number" data-testid="map-readout">
        {readout}
      </output>
      {asked && <PlaceMenu asked={asked} world={world} why_not={why_not} close={() => set_asked(null)} />}
    </>
  );
}

/** What can be done at a place of the map, and with what stands there. */
function PlaceMenu({ asked, world, why_not, close }: { asked: Asked; world: WorldModel; why_not: string | null; close(): void }) {
  const services = useStudio((studio) => studio.index?.model.services ?? []);
  const { hit, at, x, y } = asked;
  const here: Point = [round(at[0]), round(at[1])];
  const many = navigations(services);
  const no_goal = why_not ?? (many.length === 0 ? "No service of this run is a Navigation" : null);
  const entries: MenuEntry[] = [];
  if (hit?.kind === "obstacle") {
    entries.push({ label: `Remove ${hit.name}`, why_not, run: () => void remove_obstacle(hit.name) }, "line");
  }
  if (hit?.kind === "door") {
    entries.push({ label: hit.open ? `Close ${hit.name}` : `Open ${hit.name}`, why_not, run: () => void set_door(hit.name, !hit.open) }, "line");
  }
  const sends: MenuEntry[] = [];
  for (const robot of world.robots) {
    const heading = useStudio.getState().state?.robots[robot.name]?.pose[2] ?? 0;
    const name = world.robots.length > 1 ? robot.name : "the robot";
    entries.push({ label: `Put ${name} here`, why_not, run: () => void put_robot(robot.name, [...here, heading]) });
    if (hit?.kind === "location") sends.push({ label: `Send ${name} to ${hit.name}`, why_not: no_goal, run: () => void send_robot_to(robot.name, hit.name) });
    sends.push({ label: `Send ${name} here`, why_not: no_goal, run: () => void send_robot(robot.name, [...here, heading]) });
  }
  entries.push({ label: "Add an obstacle here", why_not, run: () => void add_obstacle(here, kObstacleRadius_m) });
  entries.push({ heading: "In place of the goal that the mission has set; it is not told" }, ...sends);
  return <Menu x={x} y={y} close={close} label="Place on the map" head={<><strong>{hit?.name ?? "Floor"}</strong> <span className="muted number">{`${here[0].toFixed(2)}, ${here[1].toFixed(2)} m`}</span></>} entries={entries} />;
}

/** Of an obstacle that is added by a click. */
export const kObstacleRadius_m = 0.25;

function round(metres: number): number {
  return Math.round(metres * 1000) / 1000;
}
