import { create } from "zustand";

import type { Violation } from "../../protocol/types";
import { select, useStudio } from "../../store/store";
import { seek, stop_replay } from "../../store/time_travel";
import { go_to_panel } from "../../widgets/layout";
import { useCharts } from "../charts/charts";
import { said_first } from "./violation";

/** `shown`: the strip; otherwise a chip in the header remains. `story`: what happened, over the timeline. */
export const useViolations = create<{ shown: boolean; story: boolean; chosen: number | null }>()(() => ({ shown: true, story: false, chosen: null }));

/** The violation that strip and story are about. */
export function useViolation(): Violation | undefined {
  const violations = useStudio((studio) => studio.violations);
  const monitors = useStudio((studio) => studio.index?.model.monitors);
  const chosen = useViolations((state) => state.chosen);
  return violations[Math.min(chosen ?? said_first(violations, monitors ?? []), violations.length - 1)];
}

export function open_monitor_chart(monitor: string): void {
  const chart = useStudio.getState().index?.model.monitors.find((candidate) => candidate.name === monitor)?.chart;
  select({ monitor, ...(chart ? { chart } : {}) });
  go_to_panel(chart ? "charts" : "monitors");
}

/** Timeline, messages and every other panel show that moment. */
export function go_to(observation: { time: number; sequence: number }): void {
  stop_replay();
  select({ sequence: observation.sequence });
  seek(observation.time);
}

/** As `go_to`, and the tree shows the leaf that was at work, the chart its monitor. */
export function go_to_violation(violation: Violation): void {
  const { index } = useStudio.getState();
  const sources = violation.witness.flatMap(({ source, target }) => [source, target]).reverse();
  const leaf = sources.map((name) => index?.node_of_leaf.get(name)).find((node) => node !== undefined);
  const chart = index?.model.monitors.find(({ name }) => name === violation.monitor)?.chart;
  useCharts.setState({ grid: false, follow: false });
  select({ monitor: violation.monitor, ...(leaf ? { node: leaf.id } : {}), ...(chart ? { chart } : {}) });
  go_to(violation);
}
