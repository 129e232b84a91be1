import type { ChartModel } from "../../protocol/types";
import { useEditing } from "../../store/edit";
import { Menu, type MenuEntry } from "../../widgets/Menu";
import { intervene, useSteering, useWhyNot } from "../steer/steering";

/** What can be done with a state of a chart. */
export function StateMenu({ chart, state, x, y, fold, close }: { chart: ChartModel; state: number; x: number; y: number; fold: { closed: boolean; toggle(id: string): void } | null; close(): void }) {
  const no_steering = useWhyNot();
  const standing = useSteering((steering) => steering.standing);
  const edit = useEditing();
  const id = chart.states[state]?.id ?? "";
  const present = standing.find((entry) => entry.kind === "breakpoint" && entry.chart === chart.id && entry.state === id);
  const why_not = id === "" ? "This state has no name to stop at" : no_steering;
  const entries: MenuEntry[] = [
    {
      label: "Stop the run when it is entered",
      checked: present !== undefined,
      why_not,
      run: () => void (present ? intervene({ clear: present.id }) : intervene({ breakpoint: { chart: chart.id, state: id } })),
    },
    ...(fold && id !== "" ? [{ label: fold.closed ? "Show what is in it" : "Hide what is in it", run: () => fold.toggle(id) }] : []),
    ...(edit && chart.file !== "" ? [{ label: "Edit it", run: () => edit({ file: chart.file, state: id }) }] : []),
    { label: "Copy its name", why_not: id === "" ? "It has none" : null, run: () => void navigator.clipboard?.writeText(id) },
  ];
  return <Menu x={x} y={y} close={close} label={`State ${id}`} head={<><strong>{id || "unnamed state"}</strong> <span className="muted">{chart.name}</span></>} entries={entries} />;
}
