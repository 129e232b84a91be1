import type { Point, Pose, ServiceModel } from "../../protocol/types";
import { useStudio } from "../../store/store";
import { call_service as call } from "../steer/call";
import { test_control } from "../steer/steering";
import { free_name } from "./picking";

/** Services that take goals. */
export function navigations(services: readonly ServiceModel[]): ServiceModel[] {
  return services.filter((service) => service.methods.some(({ name }) => name === "gotoTargetByAbsoluteLocation"));
}

/** What drives a robot: its own navigation, or one outside of the simulated world, which is nobody's. */
export function navigation_of(services: readonly ServiceModel[], robot: string): ServiceModel | null {
  const all = navigations(services);
  return all.find((service) => service.robot === robot) ?? all.find((service) => service.robot === null) ?? null;
}

const services = () => useStudio.getState().index?.model.services ?? [];
const robots = () => useStudio.getState().index?.model.world?.robots ?? [];

/** Obstacles and doors are of the whole world: any robot's test control reaches them. */
function world_control(): string | null {
  const first = robots()[0]?.name;
  return first === undefined ? null : test_control(services(), robots(), first);
}

export async function put_robot(robot: string, [x, y, theta]: Pose): Promise<boolean> {
  const control = test_control(services(), robots(), robot);
  return control !== null && call(control, "setRobotPose", { pose: { x, y, theta } });
}

export async function send_robot(robot: string, [x, y, theta]: Pose, service?: string): Promise<boolean> {
  const navigation = service ?? navigation_of(services(), robot)?.name;
  if (!navigation) return false;
  return call(navigation, "gotoTargetByAbsoluteLocation", { target: { map_id: "", pose: { x, y, theta } } });
}

export async function send_robot_to(robot: string, location: string, service?: string): Promise<boolean> {
  const navigation = service ?? navigation_of(services(), robot)?.name;
  return navigation !== undefined && call(navigation, "gotoTargetByLocationName", { name: location });
}

export async function add_obstacle(centre: Point, radius: number): Promise<boolean> {
  const control = world_control();
  const taken = useStudio.getState().state?.obstacles.map(({ name }) => name) ?? [];
  if (control === null) return false;
  return call(control, "addObstacle", { id: free_name(taken, "obstacle"), centre: { x: centre[0], y: centre[1] }, radius });
}

export async function move_obstacle(id: string, centre: Point): Promise<boolean> {
  const control = world_control();
  return control !== null && call(control, "moveObstacle", { id, centre: { x: centre[0], y: centre[1] } });
}

export async function remove_obstacle(id: string): Promise<boolean> {
  const control = world_control();
  return control !== null && call(control, "removeObstacle", { id });
}

export async function set_door(id: string, open: boolean): Promise<boolean> {
  const control = world_control();
  return control !== null && call(control, "setDoor", { id, open });
}
