import type { ComponentType } from "react";

import type { PanelId } from "../widgets/arrangement";
import { ChartsPanel } from "./ChartsPanel";
import { MapPanel } from "./MapPanel";
import { MessagesPanel } from "./MessagesPanel";
import { MissionPanel } from "./MissionPanel";
import { MonitorsPanel } from "./MonitorsPanel";
import { PlotPanel } from "./PlotPanel";
import { ReachedPanel } from "./ReachedPanel";
import { TimelinePanel } from "./TimelinePanel";

/** A panel draws its own tools into the bar with <PanelTools>; the shell draws title, bar and borders. */
export interface Panel {
  id: PanelId;
  title: string;
  /** Goes to the panel, from anywhere on the page. */
  key: string;
  Content: ComponentType;
}

export const panels: readonly Panel[] = [
  { id: "map", title: "Map", key: "1", Content: MapPanel },
  { id: "mission", title: "Mission", key: "2", Content: MissionPanel },
  { id: "charts", title: "Charts", key: "3", Content: ChartsPanel },
  { id: "monitors", title: "Monitors", key: "4", Content: MonitorsPanel },
  { id: "messages", title: "Messages", key: "5", Content: MessagesPanel },
  { id: "reached", title: "Reached", key: "7", Content: ReachedPanel },
  { id: "plot", title: "Plot", key: "8", Content: PlotPanel },
  { id: "timeline", title: "Timeline", key: "6", Content: TimelinePanel },
];
