import "../styles/settings.css";

import { useMemo, useState } from "react";

import { useStudio } from "../store/store";
import { doc_of, gesture, useDesign } from "./design";
import { Editable } from "./Editable";
import { EntryRows } from "./EntryRows";
import { set_value, ValueField } from "./settings";
import { free_place, places_of } from "./world_places";
import { entry, typed_text, yaml_values, type YamlValue } from "./yaml_places";

/** What stands in the world, by name: added near the middle of the map, from where it is dragged. */
export default function PlacesForm() {
  const text = useDesign((state) => doc_of(state)?.places.shown ?? "");
  const root = useMemo(() => yaml_values(text), [text]);
  const map = useStudio((studio) => studio.index?.model.world?.map ?? null);
  if (!root) return <p className="empty">The text cannot be read as a world.</p>;
  const [x, y] = free_place(places_of(text), map ? [map.origin[0] + (map.width * map.resolution) / 2, map.origin[1] + (map.height * map.resolution) / 2] : [0, 0]);
  const places = entry(root, "locations")?.entries.map(([name]) => name) ?? [];
  const rows = { text, names: [] };
  return (
    <form className="inspector-form scroll" aria-label="World" onSubmit={(event) => event.preventDefault()} data-testid="places-form">
      <Editable>
        <p className="muted">What is added stands near the middle of the map; drag it where it belongs.</p>
        <h3 className="inspector-part">Locations</h3>
        <Locations value={entry(root, "locations")} text={text} first={[x, y, "0 deg"]} />
        <h3 className="inspector-part">Areas</h3>
        <EntryRows {...rows} one="area" path={["areas"]} value={entry(root, "areas")} first={{ corners: [[x - 1, y - 1], [x + 1, y - 1], [x + 1, y + 1], [x - 1, y + 1]] }} members={[{ name: "corners" }]} />
        <h3 className="inspector-part">Doors</h3>
        <EntryRows {...rows} one="door" path={["doors"]} value={entry(root, "doors")} first={{ from: [x - 0.5, y], to: [x + 0.5, y] }} members={[{ name: "open", is_choice: true, options: ["true", "false"], hint: "false" }, { name: "on_map", is_choice: true, options: ["true", "false"], hint: "true" }]} />
        <h3 className="inspector-part">Stations</h3>
        <EntryRows
          {...rows}
          one="station"
          path={["stations"]}
          value={entry(root, "stations")}
          first={{ pose: places[0] ?? [x, y, 0], linear_tolerance: 0.5, angular_tolerance: "20 deg" }}
          members={[{ name: "pose", options: places, is_text: true }, { name: "linear_tolerance" }, { name: "angular_tolerance" }]}
        />
        <h3 className="inspector-part">Obstacles</h3>
        <EntryRows {...rows} one="obstacle" path={["obstacles"]} value={entry(root, "obstacles")} first={{ pose: [x, y], radius: 0.25 }} members={[{ name: "radius" }, { name: "size" }, { name: "on_map", is_choice: true, options: ["true", "false"], hint: "false" }]} />
      </Editable>
    </form>
  );
}

function Locations({ value, text, first }: { value: YamlValue | null; text: string; first: (number | string)[] }) {
  const [name, set_name] = useState("");
  const rows = value?.entries ?? [];
  const taken = rows.some(([key]) => key === name);
  const add = () => {
    if (name !== "" && !taken) void set_value(["locations", name], first).then((done) => done && set_name(""));
  };
  return (
    <>
      {rows.map(([key, row]) => (
        <div key={key} className="settings-row" data-entry-row={`locations.${key}`}>
          <ValueField label={key} path={["locations", key]} written={typed_text(row, text)} />
          <button type="button" className="button small" aria-label={`Delete location ${key}`} onClick={() => void gesture({ what: "yaml_remove", path: ["locations", key] })}>
            Delete
          </button>
        </div>
      ))}
      <div className="settings-row add">
        <input className="field" aria-label="Name of a new location" placeholder="new location" spellCheck={false} value={name} onChange={(event) => set_name(event.target.value)} onKeyDown={(event) => event.key === "Enter" && add()} />
        <button type="button" className="button small" disabled={name === "" || taken} onClick={add}>
          Add a location
        </button>
      </div>
    </>
  );
}
