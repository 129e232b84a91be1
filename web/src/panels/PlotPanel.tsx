import { lazy, Suspense } from "react";

/** Comes when somebody plots something. */
const Plot = lazy(() => import("./plot/Plot"));

export function PlotPanel() {
  return (
    <Suspense fallback={<p className="empty">Loading the plot …</p>}>
      <Plot />
    </Suspense>
  );
}
