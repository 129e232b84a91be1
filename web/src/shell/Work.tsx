import { Fragment, useRef } from "react";

import { panels } from "../panels/registry";
import type { PanelId } from "../widgets/arrangement";
import { kTimelineMin_px, move_border } from "../widgets/arrangement";
import { useLayout } from "../widgets/layout";
import { PanelFrame } from "./PanelFrame";
import { Splitter } from "../widgets/Splitter";

const find = (id: PanelId) => panels.find((panel) => panel.id === id);

/** All panels: columns above, the timeline below, with borders that can be moved. */
export function Work() {
  const layout = useLayout();
  const place = useRef<HTMLDivElement>(null);
  const timeline = find("timeline");

  const move_columns = (index: number, pixels: number) => {
    const width = place.current?.clientWidth || 1;
    const weights = move_border(layout.columns.map((column) => column.weight), index, pixels / width);
    useLayout.setState({ columns: layout.columns.map((column, i) => ({ ...column, weight: weights[i] ?? column.weight })) });
  };
  const move_panels = (column_index: number, index: number, pixels: number) => {
    const height = place.current?.clientHeight || 1;
    useLayout.setState({
      columns: layout.columns.map((column, i) => {
        if (i !== column_index) return column;
        const weights = move_border(column.panels.map((panel) => panel.weight), index, pixels / height);
        return { ...column, panels: column.panels.map((panel, j) => ({ ...panel, weight: weights[j] ?? panel.weight })) };
      }),
    });
  };
  const move_timeline = (pixels: number) => {
    const available = (place.current?.clientHeight ?? 0) + layout.timeline_px - 160;
    useLayout.setState({ timeline_px: Math.max(kTimelineMin_px, Math.min(layout.timeline_px - pixels, available)) });
  };

  return (
    <main className="work">
      <div className="columns" ref={place}>
        {layout.columns.map((column, c) => (
          <Fragment key={column.panels.map((panel) => panel.id).join()}>
            {c > 0 && <Splitter direction="vertical" label="Width of the columns" move={(pixels) => move_columns(c - 1, pixels)} />}
            <div className="column" style={{ flex: `${column.weight} 1 0` }}>
              {column.panels.map(({ id, weight }, p) => {
                const panel = find(id);
                return panel ? (
                  <Fragment key={id}>
                    {p > 0 && <Splitter direction="horizontal" label={`Height of ${panel.title}`} move={(pixels) => move_panels(c, p - 1, pixels)} />}
                    <PanelFrame panel={panel} weight={weight} />
                  </Fragment>
                ) : null;
              })}
            </div>
          </Fragment>
        ))}
      </div>
      <Splitter direction="horizontal" label="Height of the timeline" move={move_timeline} />
      {timeline && <PanelFrame panel={timeline} height_px={layout.timeline_px} />}
    </main>
  );
}
