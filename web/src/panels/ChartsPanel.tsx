import "../styles/picture.css";
import "../styles/charts.css";

import { useEffect, useRef } from "react";

import { PictureTools } from "../picture/PictureTools";
import { PanelTools } from "../widgets/PanelTools";
import { useCommand } from "../widgets/commands";
import { useLayout } from "../widgets/layout";
import { useRoom } from "../widgets/use_room";
import { select, useStudio } from "../store/store";
import type { ChartModel } from "../protocol/types";
import { ChartPicture, kReadable, whole_scale, type ChartHandle } from "./charts/ChartPicture";
import { ChartSide } from "./charts/ChartSide";
import { composites } from "./charts/folding";
import { Grid } from "./charts/Grid";
import { chart_to_follow, kTilesMax, open_chart, useCharts } from "./charts/charts";

/** The values beside a chart. */
const kSide_px = 168;

export function ChartsPanel() {
  const index = useStudio((studio) => studio.index);
  const chosen = useStudio((studio) => studio.selection.chart);
  const node = useStudio((studio) => studio.selection.node);
  const { grid, follow, values, pinned } = useCharts();
  const picture = useRef<ChartHandle>(null);
  const body = useRef<HTMLDivElement>(null);
  const charts = index?.model.charts ?? [];
  const chart = charts.find(({ id }) => id === chosen) ?? charts[0];

  useCommand(
    { id: "charts.grid", title: "All charts side by side", group: "Charts", keys: ["G"], run: () => useCharts.setState({ grid: !grid }) },
    { id: "charts.follow", title: "Follow the leaf at work in the charts", group: "Charts", run: () => useCharts.setState({ follow: !follow }) },
    { id: "charts.values", title: "Values beside the chart", group: "Charts", run: () => useCharts.setState({ values: !values }) },
    { id: "charts.next", title: "Next chart", group: "Charts", keys: ["C"], run: () => step(charts, chart, 1) },
    { id: "charts.previous", title: "Previous chart", group: "Charts", keys: ["Shift+C"], run: () => step(charts, chart, -1) },
  );
  // Follows the leaf that is chosen or, with `follow`, the one at work.
  const leaf = node === null ? null : (index?.model.tree.nodes[node]?.leaf ?? null);
  const at_work = useStudio((studio) => (follow && studio.index ? chart_to_follow(studio.index, studio.state, studio.selection.chart) : null));
  useEffect(() => {
    const { selection } = useStudio.getState();
    // A violation brings its leaf and its own chart.
    const of_monitor = selection.monitor !== null && selection.chart === index?.model.monitors.find(({ name }) => name === selection.monitor)?.chart;
    if (leaf && !of_monitor) select({ chart: leaf });
  }, [leaf, index]);
  const followed = useRef(at_work);
  useEffect(() => {
    followed.current = at_work;
    if (at_work) select({ chart: at_work });
  }, [at_work]);
  useEffect(() => {
    // Another chart than the followed one: somebody picked it, here or in another panel. What was followed before may be
    // the one of this rendering, while the next one is chosen already.
    const now = useStudio.getState().selection.chart;
    if (now !== null && followed.current !== null && now !== followed.current) useCharts.setState({ follow: false });
  }, [chosen]);

  const room = useRoom(body, !grid && chart !== undefined);
  // Values that alone are in the way of a whole chart make room.
  const is_whole = (width: number) => room !== null && chart !== undefined && whole_scale(chart.layout, { width, height: room.height }) >= kReadable;
  const yields = room !== null && is_whole(room.width) && !is_whole(room.width - kSide_px);

  if (!index || !chart) return <div className="empty">{index ? "This mission has no charts." : "Waiting for the charts …"}</div>;
  const tiles = pinned.map((id) => index.chart.get(id)).filter((entry) => entry !== undefined);
  return (
    <div className="charts">
      <PanelTools>
        {!grid && <Pick charts={charts} chart={chart} />}
        <button className="button small" aria-pressed={grid} title="All charts side by side (G)" onClick={() => useCharts.setState({ grid: !grid })}>
          All
        </button>
        <PictureTools
          panel="charts"
          id={grid ? null : `chart:${chart.id}`}
          name="chart"
          fit={() => picture.current?.fit()}
          zoom={(factor) => picture.current?.zoom(factor)}
          more={[
            { label: "Follow the leaf at work", checked: follow, run: () => useCharts.setState({ follow: !follow }) },
            { label: "Values beside the chart", checked: values, run: () => useCharts.setState({ values: !values }) },
            ...(grid || composites(chart.layout).size === 0
              ? []
              : [
                  { label: "Close states that hold others", run: () => picture.current?.fold_all(true) },
                  { label: "Open all states", run: () => picture.current?.fold_all(false) },
                ]),
          ]}
        />
        <button className="button small" title="The chart goes; choosing a leaf, monitor or state brings it back" onClick={() => useLayout.setState({ charts_open: false })}>
          Close
        </button>
      </PanelTools>
      {grid ? (
        <Grid charts={tiles.length > 0 ? tiles : charts.slice(0, kTilesMax)} all={charts} pinned={pinned} open={open_chart} />
      ) : (
        <div className="charts-body" ref={body}>
          <ChartPicture key={chart.id} chart={chart} handle={picture} />
          {values && !yields && <ChartSide key={`side ${chart.id}`} chart={chart} />}
        </div>
      )}
    </div>
  );
}

function step(charts: readonly ChartModel[], chart: ChartModel | undefined, by: number): void {
  if (!chart || charts.length === 0) return;
  const next = charts[(charts.indexOf(chart) + by + charts.length) % charts.length];
  if (next) open_chart(next.id);
}

/** Skills and monitors by name, those at work marked. */
function Pick({ charts, chart }: { charts: readonly ChartModel[]; chart: ChartModel }) {
  const states = useStudio((studio) => charts.map(({ id }) => (studio.state?.charts[id]?.running ? "▸" : " ")).join(""));
  const violated = useStudio((studio) => charts.map(({ kind, name }) => (kind === "monitor" && studio.state?.monitors[name]?.verdict === "violated" ? "✗" : " ")).join(""));
  const options = (kind: ChartModel["kind"]) =>
    charts.map((entry, i) =>
      entry.kind === kind ? (
        <option key={entry.id} value={entry.id}>
          {entry.name}
          {violated[i] === "✗" ? "  ✗ violated" : kind === "skill" && states[i] === "▸" ? "  ▸ running" : ""}
        </option>
      ) : null,
    );
  return (
    <select className="field chart-pick" aria-label="Chart" value={chart.id} onChange={(event) => open_chart(event.target.value)} data-testid="chart-pick">
      <optgroup label="Skills">{options("skill")}</optgroup>
      <optgroup label="Monitors">{options("monitor")}</optgroup>
    </select>
  );
}
