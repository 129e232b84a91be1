import "../styles/picture.css";
import "../styles/map.css";

import { useRef } from "react";

import { PictureTools } from "../picture/PictureTools";
import { PanelTools } from "../widgets/PanelTools";
import { useCommand } from "../widgets/commands";
import { note, useStudio } from "../store/store";
import { MapCanvas, type MapHandle } from "./map/MapCanvas";
import { kLayers, type Layer } from "./map/scene";
import { choose_tool, toggle_layer, useMap, type Tool } from "./map/map";
import { navigations } from "./map/steer_map";
import { useWhyNot } from "./steer/steering";

const kLayerTitles: Record<Layer, string> = {
  areas: "Areas",
  places: "Locations and stations",
  laser: "Laser",
  particles: "Particles of the localization",
  path: "Path and goal",
  estimate: "Where the robot believes to be",
  obstacles: "Obstacles",
  names: "Names",
};

export function MapPanel() {
  const world = useStudio((studio) => studio.index?.model.world ?? null);
  const services = useStudio((studio) => studio.index?.model.services);
  const waiting = useStudio((studio) => studio.index === null);
  const why_not = useWhyNot();
  const { follow, layers, tool } = useMap();
  const picture = useRef<MapHandle>(null);

  const robots = world?.robots ?? [];
  const next_robot = () => {
    const names = [null, ...robots.map(({ name }) => name)];
    useMap.setState({ follow: names[(names.indexOf(follow) + 1) % names.length] ?? null });
  };
  const no_control = services?.some(({ name }) => name.endsWith("simulation")) ? null : "There is no simulated world behind this run";
  const no_goal = why_not ?? (navigations(services ?? []).length > 0 ? null : "No service of this run is a Navigation");
  const no_obstacle = why_not ?? no_control;
  const tool_of = (wanted: Tool, reason: string | null) => () => {
    if (reason === null) choose_tool(tool === wanted ? null : wanted);
    else note("info", `${reason}.`);
  };
  useCommand(
    { id: "map.follow", title: "Follow the robot on the map", group: "Map", keys: ["R"], run: next_robot },
    { id: "map.goal", title: "Set a goal by hand on the map", group: "Map", keys: ["T"], run: tool_of("goal", no_goal) },
    { id: "map.obstacle", title: "Add obstacles on the map", group: "Map", keys: ["O"], run: tool_of("obstacle", no_obstacle) },
    ...kLayers.map((layer) => ({ id: `map.layer.${layer}`, title: `Map: ${kLayerTitles[layer]}`, group: "Map", run: () => toggle_layer(layer) })),
  );

  if (!world) return <div className="empty">{waiting ? "Waiting for the map …" : "This project has no simulated world, hence no map."}</div>;
  return (
    <div className="map">
      <PanelTools>
        <button className="button small" aria-pressed={tool === "goal"} aria-disabled={no_goal !== null} title={no_goal ?? "Set a goal by hand: press where, drag which way (T)"} onClick={tool_of("goal", no_goal)} data-testid="tool-goal">
          Goal
        </button>
        <button className="button small" aria-pressed={tool === "obstacle"} aria-disabled={no_obstacle !== null} title={no_obstacle ?? "Add an obstacle: click where, or drag its size (O)"} onClick={tool_of("obstacle", no_obstacle)} data-testid="tool-obstacle">
          Obstacle
        </button>
        <PictureTools
          panel="map"
          id="map"
          name="map"
          fit={() => picture.current?.fit()}
          zoom={(factor) => picture.current?.zoom(factor)}
          more={[
            ...robots.map(({ name }) => ({ label: robots.length > 1 ? `Follow ${name}` : "Follow the robot", hint: "R", checked: follow === name, run: () => useMap.setState({ follow: follow === name ? null : name }) })),
            { heading: "Layers" },
            ...kLayers.map((layer) => ({ label: kLayerTitles[layer], checked: layers.has(layer), run: () => toggle_layer(layer) })),
          ]}
        />
      </PanelTools>
      <MapCanvas world={world} handle={picture} />
      {tool === "goal" && (
        <p className="map-hint" role="status" data-testid="goal-hint">
          Press where, drag which way. This replaces the goal that the mission has set; it is not told. Escape: no goal.
        </p>
      )}
    </div>
  );
}
