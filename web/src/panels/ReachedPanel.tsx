import { useEffect, useState } from "react";

import type { NotReached, Reached } from "../protocol/types";
import { request, select, useStudio } from "../store/store";
import { is_tab_shown, useLayout } from "../widgets/layout";
import { useCharts } from "./charts/charts";
import { jump_to } from "./mission/mission";
import { ReachedList } from "./reached/ReachedList";
import { show_marks, state_key, transition_key, useReached } from "./reached/reached";
import { open_monitor_chart } from "./violation/violations";

/** While a run goes on, what it has reached is asked for so often. */
const kRefresh_ms = 2000;

/** What this run has never reached, and its marks in tree and charts while this is open. */
export function ReachedPanel() {
  const open = useLayout((layout) => is_tab_shown(layout, "reached"));
  const known = useStudio((studio) => studio.hello?.coverage ?? false);
  const goes_on = useStudio((studio) => studio.state !== null && studio.state.run.state !== "ended");
  // Another run, or the same that a shadow run shows anew.
  const index = useStudio((studio) => studio.index);
  const [reached, set_reached] = useState<Reached | null>(null);
  const [why_not, set_why_not] = useState("");
  useEffect(() => {
    if (!open || !known || !index) return;
    let gone = false;
    const ask = () =>
      void request("coverage", {}).then(
        (found) => {
          if (gone) return;
          set_reached(found);
          set_why_not("");
          show_marks(found);
        },
        (error: unknown) => gone || set_why_not(error instanceof Error ? error.message : String(error)),
      );
    ask();
    const timer = goes_on ? window.setInterval(ask, kRefresh_ms) : 0;
    return () => {
      gone = true;
      window.clearInterval(timer);
      show_marks(null);
    };
  }, [open, known, index, goes_on]);
  if (!known || why_not) return <p className="empty">{why_not || "What was reached is not known here."}</p>;
  if (!reached) return <p className="empty">Looking what was reached …</p>;
  // Whether a requirement was put to the test is known at the end.
  return <ReachedList reached={reached} go={go} leads={({ kind }) => kind !== "methods"} without={goes_on ? ["requirements"] : []} />;
}

function go({ kind, of, what, file, line }: NotReached): void {
  const { index, selection } = useStudio.getState();
  if (!index) return;
  if (kind === "requirements") return open_monitor_chart(of);
  if (kind === "nodes") {
    const node = index.model.tree.nodes.find(({ path }) => path === of);
    if (node) jump_to(node.id);
    return;
  }
  const charts = index.model.charts.filter((chart) => chart.kind === "skill" && state_key(chart.file, "") === state_key(file, ""));
  const chart = charts.find(({ id }) => id === selection.chart) ?? charts[0];
  if (!chart) return;
  const node = index.node_of_leaf.get(chart.name);
  useReached.setState({ sought: kind === "states" ? state_key(file, what) : transition_key(file, line) });
  useCharts.setState({ grid: false, follow: false });
  useLayout.setState({ charts_open: true });
  select({ chart: chart.id, ...(node ? { node: node.id } : {}) });
}
