import type { ChartModel } from "../../protocol/types";
import { Menu, type MenuEntry } from "../../widgets/Menu";
import { steer, useSteering, useWhyNot } from "../steer/steering";

/** What can be done with a state of a chart. */
export function StateMenu({ chart, state, x, y, close }: { chart: ChartModel; state: number; x: number; y: number; close(): void }) {
  const no_steering = useWhyNot();
  const standing = useSteering((steering) => steering.standing);
  const id = chart.states[state]?.id ?? "";
  const present = standing.find((entry) => entry.kind === "breakpoint" && entry.chart === chart.id && entry.state === id);
  const why_not = id === "" ? "This state has no name to stop at" : no_steering;
  const entries: MenuEntry[] = [
    {
      label: "Stop the run when it is entered",
      checked: present !== undefined,
      why_not,
      run: () => void (present ? steer("clear", { what: present.id }) : steer("breakpoint", { kind: "state", chart: chart.id, state: id })),
    },
    { label: "Copy its name", why_not: id === "" ? "It has none" : null, run: () => void navigator.clipboard?.writeText(id) },
  ];
  return <Menu x={x} y={y} close={close} label={`State ${id}`} head={<><strong>{id || "unnamed state"}</strong> <span className="muted">{chart.name}</span></>} entries={entries} />;
}
