import { useEffect, useState } from "react";

import type { NotReached, Reached } from "../protocol/types";
import { request, select, useStudio } from "../store/store";
import { is_tab_shown, useLayout } from "../widgets/layout";
import { useCharts } from "./charts/charts";
import { jump_to } from "./mission/mission";
import { ReachedList } from "./reached/ReachedList";
import { show_marks, state_key, transition_key, useReached } from "./reached/reached";
import { kNotVerified, VerifiedNote } from "./reached/VerifiedNote";
import { open_monitor_chart } from "./violation/violations";

/** While a run goes on, what it has reached is asked for so often. */
const kRefresh_ms = 2000;

/** What this run has never reached, or no behaviour that was verified, and its marks in tree and charts while this is open. */
export function ReachedPanel() {
  const open = useLayout((layout) => is_tab_shown(layout, "reached"));
  const known = useStudio((studio) => studio.hello?.coverage ?? false);
  const goes_on = useStudio((studio) => studio.state !== null && studio.state.run.state !== "ended");
  // Another run, or the same that a shadow run shows anew.
  const index = useStudio((studio) => studio.index);
  const [every, set_every] = useState(false);
  const [reached, set_reached] = useState<Reached | null>(null);
  const [why_not, set_why_not] = useState("");
  useEffect(() => {
    if (!open || !known || !index) return;
    let gone = false;
    const ask = () =>
      void request("coverage", { verification: every }).then(
        (found) => {
          if (gone) return;
          set_reached(found);
          set_why_not(found ? "" : kNotVerified);
          show_marks(found);
        },
        (error: unknown) => gone || set_why_not(error instanceof Error ? error.message : String(error)),
      );
    ask();
    const timer = goes_on && !every ? window.setInterval(ask, kRefresh_ms) : 0;
    return () => {
      gone = true;
      window.clearInterval(timer);
      show_marks(null);
    };
  }, [open, known, index, goes_on, every]);
  if (!known) return <p className="empty">What was reached is not known here.</p>;
  return (
    <div className="reached-below">
      <label className="reached-of">
        Reached by{" "}
        <select
          className="field"
          aria-label="Whose"
          value={every ? "every" : "run"}
          onChange={(event) => {
            set_reached(null);
            set_why_not("");
            set_every(event.target.value === "every");
          }}
        >
          <option value="run">this run</option>
          <option value="every">any behaviour (verified)</option>
        </select>
      </label>
      {why_not !== "" ? (
        <p className="empty">{why_not}</p>
      ) : !reached ? (
        <p className="empty">Looking what was reached …</p>
      ) : (
        <>
          <VerifiedNote of={reached.verification} />
          {/* Whether a requirement was put to the test is known at the end. */}
          <ReachedList reached={reached} go={go} leads={({ kind }) => kind !== "methods"} without={goes_on && !every ? ["requirements"] : []} />
        </>
      )}
    </div>
  );
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
