import { useEffect } from "react";

import { useStudio } from "../../store/store";
import { go_to_panel, useLayout } from "../../widgets/layout";
import { asks_for_chart } from "./asked";
import { useCharts } from "./charts";

/** Brings the charts back, where they were closed: with what is chosen, and not with the leaf at work. */
export function useChartsBack(): void {
  useEffect(
    () =>
      useStudio.subscribe((now, before) => {
        if (useLayout.getState().charts_open) return;
        if (now.index !== before.index || !asks_for_chart(now.selection, before.selection, (node) => (now.index?.model.tree.nodes[node]?.leaf ?? null) !== null)) return;
        useCharts.setState({ grid: false, follow: false });
        useLayout.setState({ charts_open: true });
      }),
    [],
  );
  useEffect(() => {
    const open = () => {
      useCharts.setState({ grid: false, follow: false });
      go_to_panel("charts");
    };
    document.addEventListener("sentree:open-chart", open);
    return () => document.removeEventListener("sentree:open-chart", open);
  }, []);
}
