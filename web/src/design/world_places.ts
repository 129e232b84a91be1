import type { Point } from "../protocol/types";
import { angle_of, entry, number_of, yaml_values, type YamlValue } from "./yaml_places";

/** A pair of numbers of the text that is a place of the map; of a `ring` the place that it is around, and how far. */
export interface Spot {
  id: string;
  name: string;
  kind: "location" | "corner" | "door" | "obstacle" | "ring";
  x: YamlValue;
  y: YamlValue;
  heading: YamlValue | null;
  radius?: YamlValue;
  /** The location or area that it is of, which can be given another name. */
  place?: string | undefined;
}
export interface Shape {
  name: string;
  kind: "area" | "door";
  spots: Spot[];
}
/** What the laser sees: a disc, or a box of this size. */
export interface Obstacle {
  spot: Spot;
  ring: Spot | null;
  size: Point | null;
}

const point_of = (list: YamlValue | undefined | null): [YamlValue, YamlValue] | null => {
  const [x, y] = list?.items ?? [];
  return x && y && number_of(x) !== null && number_of(y) !== null ? [x, y] : null;
};

export interface Places {
  spots: Spot[];
  shapes: Shape[];
  obstacles: Obstacle[];
  /** Within which a robot charges. */
  rings: Spot[];
}

/** What a world has on its map; nothing while the text is broken. */
export function places_of(text: string): Places {
  const root = yaml_values(text);
  const all = (section: string) => entry(root, section)?.entries ?? [];
  const posed = (kind: Spot["kind"], section: string, name: string, pose: YamlValue | null): Spot[] => {
    const point = point_of(pose);
    const turn = pose?.items[2];
    return point ? [{ id: `${section} ${name}`, name, kind, x: point[0], y: point[1], heading: turn && angle_of(turn) !== null ? turn : null }] : [];
  };
  const ring = (around: Spot | undefined, id: string, radius: YamlValue | null): Spot[] => (around && radius && number_of(radius) !== null ? [{ ...around, id, kind: "ring", heading: null, radius, place: undefined }] : []);
  const locations = all("locations").flatMap(([name, value]) => posed("location", "location", name, entry(value, "pose") ?? value).map((spot): Spot => ({ ...spot, place: name })));
  const shapes: Shape[] = [];
  for (const [name, value] of all("areas")) {
    const corners = (entry(value, "corners")?.items ?? []).flatMap((corner, i) => posed("corner", "area", `${name} ${i + 1}`, corner).map((spot) => ({ ...spot, name: `${name}, corner ${i + 1}`, place: name })));
    if (corners.length > 1) shapes.push({ name, kind: "area", spots: corners });
  }
  for (const [name, value] of all("doors")) {
    const ends = ["from", "to"].flatMap((end) => posed("door", "door", `${name} ${end}`, entry(value, end)).map((spot) => ({ ...spot, name: `${name}, ${end}` })));
    if (ends.length === 2) shapes.push({ name, kind: "door", spots: ends });
  }
  const stations = all("stations").map(([name, value]) => ({ name, value, own: posed("location", "station", name, entry(value, "pose")) }));
  const spots = [...locations, ...stations.flatMap(({ own }) => own)];
  const rings = stations.flatMap(({ name, value, own }) => ring(own[0] ?? locations.find((one) => one.name === entry(value, "pose")?.text), `station ${name} tolerance`, entry(value, "linear_tolerance")).map((spot) => ({ ...spot, name: `tolerance of ${name}` })));
  const obstacles = all("obstacles").flatMap(([name, value]) =>
    posed("obstacle", "obstacle", name, entry(value, "pose")).map((spot): Obstacle => {
      const [width, height] = (entry(value, "size")?.items ?? []).map(number_of);
      return { spot, ring: ring(spot, `obstacle ${name} radius`, entry(value, "radius")).map((one) => ({ ...one, name: `radius of ${name}` }))[0] ?? null, size: typeof width === "number" && typeof height === "number" ? [width, height] : null };
    }),
  );
  return { spots, shapes, obstacles, rings };
}

/** Between what stands there and what is added. */
const kApart_m = 0.8;
const kStep_m = 0.5;
const kStepsMax = 40;

/** Where something new can be told from what is there: as near to the middle as that allows. */
export function free_place({ spots, shapes, obstacles }: Places, middle: Point): Point {
  const taken = [...spots, ...shapes.flatMap((shape) => shape.spots), ...obstacles.map(({ spot }) => spot)].map(({ x, y }): Point => [number_of(x)!, number_of(y)!]);
  const is_free = ([x, y]: Point) => taken.every(([a, b]) => Math.hypot(x - a, y - b) >= kApart_m);
  for (let ring = 0; ring < kStepsMax; ring += 1) {
    for (let turn = 0; turn < Math.max(8 * ring, 1); turn += 1) {
      const angle = (turn / Math.max(8 * ring, 1)) * 2 * Math.PI;
      const at: Point = [middle[0] + ring * kStep_m * Math.cos(angle), middle[1] + ring * kStep_m * Math.sin(angle)].map((metres) => Math.round(metres * 10) / 10) as Point;
      if (is_free(at)) return at;
    }
  }
  return middle;
}
