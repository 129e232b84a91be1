import type { Battery, Pose, Station } from "../../protocol/types";

/** The station at which a robot at `pose` charges; null: none. */
export function station_at(stations: readonly Station[], pose: Pose): Station | null {
  return (
    stations.find(({ x, y, theta, linear_tolerance, angular_tolerance }) => {
      const turned = Math.abs(Math.atan2(Math.sin(pose[2] - theta), Math.cos(pose[2] - theta)));
      return Math.hypot(pose[0] - x, pose[1] - y) <= linear_tolerance && turned <= angular_tolerance;
    }) ?? null
  );
}

/** How the robot's plug is, in words, and whether somebody could plug it in. */
export function plug_of(battery: Pick<Battery, "plugged">, stations: readonly Station[], pose: Pose): { text: string; is_possible: boolean } {
  const station = station_at(stations, pose);
  if (battery.plugged) return { text: `▪ plugged in${station ? ` at ${station.name}` : ""}`, is_possible: false };
  if (station) return { text: `▫ at ${station.name}, not plugged in`, is_possible: true };
  return { text: `▫ not at a station (${stations.map(({ name }) => name).join(", ")})`, is_possible: false };
}
