import { duration_text } from "../../draw/format";
import type { ChartModel } from "../../protocol/types";
import { select, useStudio } from "../../store/store";
import { jump_to } from "../mission/mission";
import { Table } from "../mission/Inspector";
import { label_text } from "./ChartPicture";

/** Beside a chart: what it is, its present states, the event that it took last, and its data. */
export function ChartSide({ chart }: { chart: ChartModel }) {
  const state = useStudio((studio) => studio.state?.charts[chart.id]);
  const node = useStudio((studio) => studio.index?.model.tree.nodes.find((entry) => entry.leaf === chart.id)?.id);
  const monitor = useStudio((studio) => (chart.kind === "monitor" ? studio.state?.monitors[chart.name] : undefined));
  const sentence = useStudio((studio) => studio.index?.model.monitors.find((entry) => entry.name === chart.name)?.sentence);
  // Recordings of before hold no more of a monitor than its states.
  const unrecorded = chart.kind === "monitor" && state !== undefined && state.data === undefined;
  const active = (state?.active ?? []).filter((s) => !state!.active.some((other) => chart.states[other]?.parent === s));
  return (
    <aside className="chart-side" aria-label={`Values of ${chart.name}`}>
      <p className="chart-name">
        <strong className="ellipsis">{chart.name}</strong>
      </p>
      <p className="muted chart-file" title={chart.file}>
        {chart.kind} · {chart.file.split("/").at(-1)}
      </p>
      {chart.kind === "skill" ? (
        <span className={`badge ${state?.running ? "running" : ""}`}>{state?.running ? "▸ RUNNING" : "○ NOT RUNNING"}</span>
      ) : (
        <span className={`badge ${monitor?.verdict ?? ""}`}>{verdict_text(monitor?.verdict)}</span>
      )}
      {sentence && <p className="chart-sentence">{sentence}</p>}
      <section className="values">
        <h3>Active state</h3>
        <p className="mono wrap">{active.map((s) => chart.states[s]?.id || chart.states[s]?.kind).join(", ") || "none"}</p>
        <StateAge id={chart.id} />
        <h3>Last event</h3>
        <p className={unrecorded ? "muted" : "mono wrap"}>{unrecorded ? "not in this recording" : state?.event || (chart.kind === "monitor" ? "time passed" : "none")}</p>
        {typeof state?.last === "number" && state.last >= 0 && (
          <>
            <h3>Last transition</h3>
            <p className="mono wrap">{label_text(chart, state.last) || "without event"}</p>
          </>
        )}
      </section>
      {unrecorded ? <Unrecorded /> : <Table title="Data" rows={Object.entries(state?.data ?? {}).map(([key, value]) => ({ key, value }))} />}
      {node !== undefined && (
        <button className="button small" onClick={() => jump_to(node)}>
          Show the leaf
        </button>
      )}
      {chart.kind === "monitor" && (
        <button className="button small" onClick={() => select({ monitor: chart.name })}>
          Show the verdict
        </button>
      )}
    </aside>
  );
}

function Unrecorded() {
  return (
    <section className="values">
      <h3>Data</h3>
      <p className="muted">not in this recording</p>
    </section>
  );
}

function StateAge({ id }: { id: string }) {
  const age = useStudio((studio) => {
    const since = studio.state?.charts[id]?.since;
    return studio.state && since !== undefined ? duration_text(Math.floor((studio.state.time - since) / 1e8) * 1e8) : "";
  });
  return age === "" ? null : <p className="muted number">for {age}</p>;
}

export function verdict_text(verdict: string | undefined): string {
  if (verdict === "violated") return "✗ VIOLATED";
  if (verdict === "satisfied") return "✓ SATISFIED";
  return "… UNDECIDED";
}
