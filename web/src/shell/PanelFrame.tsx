import { useState, type ReactNode } from "react";

import type { Panel } from "../panels/registry";
import { useStudio } from "../store/store";
import { useLayout } from "../widgets/layout";
import { ToolsPlace } from "../widgets/PanelTools";
import { PanelGuard } from "./PanelGuard";

/** A panel with its bar. `flex` is how it shares the room with its neighbours; `head` stands in place of its title. */
export function PanelFrame({ panel, flex, head, hidden = false }: { panel: Panel; flex: string; head?: ReactNode; hidden?: boolean }) {
  const [place, set_place] = useState<HTMLElement | null>(null);
  const maximised = useLayout((layout) => layout.maximised === panel.id);
  const past = useStudio((studio) => studio.state !== null && !studio.state.live && studio.hello?.mode === "live");
  const classes = ["panel", maximised ? "maximised" : "", past ? "past" : ""].filter(Boolean);
  return (
    <section id={`panel-${panel.id}`} className={classes.join(" ")} style={{ flex }} tabIndex={-1} aria-label={panel.title} hidden={hidden}>
      <header className="panel-bar">
        {head ?? <h2 className="panel-title">{panel.title}</h2>}
        <div className="panel-tools" ref={set_place} />
      </header>
      <div className="panel-content">
        <ToolsPlace.Provider value={place}>
          <PanelGuard name={panel.title}>
            <panel.Content />
          </PanelGuard>
        </ToolsPlace.Provider>
      </div>
    </section>
  );
}
