import "../styles/picture.css";
import "../styles/map.css";

import { useRef, useState } from "react";

import { PictureTools } from "../picture/PictureTools";
import { Icon } from "../widgets/Icon";
import { Menu } from "../widgets/Menu";
import { PanelTools } from "../widgets/PanelTools";
import { useCommand } from "../widgets/commands";
import { useStudio } from "../store/store";
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
  const [menu, set_menu] = useState<{ x: number; y: number } | null>(null);

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
        <button className="icon-button" aria-pressed={follow !== null} aria-label={follow ? `Following ${follow}` : "Follow the robot"} title="Follow the robot (R)" onClick={next_robot}>
          <Icon name="follow" />
        </button>
        <button
          className="icon-button"
          aria-label="Layers of the map"
          aria-haspopup="menu"
          title="Layers"
          onClick={(event) => {
            const box = event.currentTarget.getBoundingClientRect();
            set_menu({ x: box.left, y: box.bottom + 2 });
          }}
        >
          <Icon name="filter" />
        </button>
        <PictureTools id="map" name="map" fit={() => picture.current?.fit()} zoom={(factor) => picture.current?.zoom(factor)} />
      </PanelTools>
      <MapCanvas world={world} handle={picture} />
      {menu && (
        <Menu
          {...menu}
          label="Layers of the map"
          close={() => set_menu(null)}
          entries={kLayers.map((layer) => ({ label: kLayerTitles[layer], checked: layers.has(layer), run: () => toggle_layer(layer) }))}
        />
      )}
    </div>
  );
}
