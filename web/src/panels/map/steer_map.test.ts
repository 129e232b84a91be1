import { expect, it } from "vitest";

import type { ServiceModel } from "../../protocol/types";
import { navigation_of } from "./steer_map";

const service = (name: string, robot: string | null, method: string): ServiceModel => ({
  name,
  interface: "Navigation",
  at: robot === null ? "tcp://127.0.0.1:9090" : "sim",
  robot,
  methods: [{ name: method, args: [], result: "void", oneway: false }],
  types: {},
});
const goal = "gotoTargetByAbsoluteLocation";

it("a robot is sent by its own navigation, whatever that is called", () => {
  const services = [service("battery", "right", "getBatteryState"), service("navigation", "left", goal), service("navigation2", "right", goal)];
  expect(navigation_of(services, "right")?.name).toBe("navigation2");
  expect(navigation_of(services, "left")?.name).toBe("navigation");
});

it("no robot is sent by another one's navigation, but by one that is nobody's", () => {
  expect(navigation_of([service("navigation", "left", goal)], "right")).toBeNull();
  expect(navigation_of([service("navigation", null, goal)], "right")?.name).toBe("navigation");
});
