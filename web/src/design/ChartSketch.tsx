import { Edge, Label, StateShape } from "../panels/charts/ChartPicture";
import { composites } from "../panels/charts/folding";
import type { OutlineChart } from "../protocol/types";

const kMargin = 8;

/** A chart at a glance, as wide as there is room. */
export function ChartSketch({ chart, label }: { chart: OutlineChart; label: string }) {
  const { layout } = chart;
  const nests = composites(layout);
  const [width, height] = [layout.size.width + 2 * kMargin, layout.size.height + 2 * kMargin];
  return (
    <svg className="picture chart-picture chart-sketch" viewBox={`${-kMargin} ${-kMargin} ${width} ${height}`} style={{ maxWidth: width }} role="img" aria-label={label}>
      {layout.states.map((drawn, i) => (
        <StateShape key={i} drawn={drawn} nest={nests.has(i)} active={false} />
      ))}
      {layout.separators.map(([x1, y1, x2, y2], i) => (
        <line key={i} className="region" x1={x1} y1={y1} x2={x2} y2={y2} />
      ))}
      {layout.edges.map((edge, i) => (
        <g key={i}>
          <Edge edge={edge} last={false} />
          <Label edge={edge} last={false} whole={edge.lines.join(" ")} />
        </g>
      ))}
    </svg>
  );
}
