import { describe, expect, it } from "vitest";
import { plug_of, station_at } from "./plug";

const dock = { name: "dock", x: 8.2, y: 5.2, theta: Math.PI, linear_tolerance: 0.5, angular_tolerance: 0.35 };

describe("the plug", () => {
  it("reaches a robot within both tolerances of a station, also where headings begin anew", () => {
    expect(station_at([dock], [8.5, 5.4, -3.0])).toBe(dock);
    expect(station_at([dock], [8.8, 5.2, Math.PI])).toBeNull();
    expect(station_at([dock], [8.2, 5.2, 2.7])).toBeNull();
  });
  it("says why it cannot be plugged in", () => {
    expect(plug_of({ plugged: false }, [dock], [1, 1, 0])).toEqual({ text: "▫ not at a station (dock)", is_possible: false });
    expect(plug_of({ plugged: false }, [dock], [8.2, 5.2, Math.PI])).toEqual({ text: "▫ at dock, not plugged in", is_possible: true });
    expect(plug_of({ plugged: true }, [dock], [8.2, 5.2, Math.PI])).toEqual({ text: "▪ plugged in at dock", is_possible: false });
  });
});
