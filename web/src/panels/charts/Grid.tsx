import { memo, useRef } from "react";

import { svg_of_group } from "../../picture/export";
import { save_picture_of, usePicture } from "../../picture/pictures";
import { MenuButton } from "../../picture/PictureTools";
import type { ChartModel } from "../../protocol/types";
import { color } from "../../widgets/theme";
import { useStudio } from "../../store/store";
import { ChartDrawing } from "./ChartPicture";
import { verdict_text } from "./ChartSide";
import { kTilesMax, useCharts } from "./charts";

/** Charts side by side, each fitted into its tile. */
export function Grid({ charts, all, pinned, open }: { charts: readonly ChartModel[]; all: readonly ChartModel[]; pinned: readonly string[]; open(id: string): void }) {
  const toggle = (id: string) =>
    useCharts.setState({ pinned: pinned.includes(id) ? pinned.filter((other) => other !== id) : [...pinned, id] });
  return (
    <div className="grid">
      <ul className="grid-picks" aria-label="Charts in the grid; none chosen: all">
        {all.map((chart) => (
          <li key={chart.id}>
            <button className="pick" aria-pressed={pinned.includes(chart.id)} title={`${chart.kind} ${chart.name}`} onClick={() => toggle(chart.id)}>
              {chart.name}
            </button>
          </li>
        ))}
        {pinned.length === 0 && all.length > kTilesMax && <li className="muted">the first {kTilesMax} of {all.length}</li>}
      </ul>
      <div className="tiles scroll">
        {charts.map((chart) => (
          <Tile key={chart.id} chart={chart} open={open} />
        ))}
      </div>
    </div>
  );
}

const Tile = memo(function Tile({ chart, open }: { chart: ChartModel; open(id: string): void }) {
  const group = useRef<SVGGElement>(null);
  const { width, height } = chart.layout.size;
  const said = useStudio(({ state }) =>
    chart.kind === "monitor" ? verdict_text(state?.monitors[chart.name]?.verdict) : state?.charts[chart.id]?.running ? "▸ RUNNING" : "",
  );
  const word = said.includes("VIOLATED") ? "violated" : said.includes("SATISFIED") ? "satisfied" : said.includes("RUNNING") ? "running" : "";
  usePicture(`tile:${chart.id}`, () => {
    const box = { x: 0, y: 0, width, height };
    return group.current ? { name: chart.name, size: box, svg: svg_of_group(group.current, box, `${chart.kind} ${chart.name}`, color("surface")) } : null;
  });
  return (
    <figure className={`tile ${word}`} data-chart={chart.id}>
      <figcaption>
        <button className="tile-name ellipsis" onClick={() => open(chart.id)} title="Open this chart">
          {chart.name}
        </button>
        {said && <span className={`badge ${word}`}>{said}</span>}
        <MenuButton
          label={`Save the chart of ${chart.name}`}
          text="Save"
          data_view={`tile:${chart.id}`}
          entries={[
            { label: "Save as SVG", hint: "for documents", run: () => save_picture_of(`tile:${chart.id}`, "svg") },
            { label: "Save as PNG", hint: "2× pixels", run: () => save_picture_of(`tile:${chart.id}`, "png") },
          ]}
        />
      </figcaption>
      <svg className="tile-picture chart-picture picture" viewBox={`0 0 ${width} ${height}`} preserveAspectRatio="xMidYMid meet" role="img" aria-label={`Chart of ${chart.kind} ${chart.name}`} onDoubleClick={() => open(chart.id)}>
        <g ref={group}>
          <ChartDrawing chart={chart} />
        </g>
      </svg>
    </figure>
  );
});
