import { useState } from "react";

import type { Panel } from "../panels/registry";
import { useStudio } from "../store/store";
import { Icon } from "../widgets/Icon";
import { ToolsPlace } from "../widgets/PanelTools";
import { PanelGuard } from "./PanelGuard";
import { toggle_collapsed, toggle_maximised, useLayout } from "../widgets/layout";

export function PanelFrame({ panel, weight, height_px }: { panel: Panel; weight?: number; height_px?: number }) {
  const [place, set_place] = useState<HTMLElement | null>(null);
  const collapsed = useLayout((layout) => layout.collapsed.includes(panel.id));
  const maximised = useLayout((layout) => layout.maximised === panel.id);
  const past = useStudio((studio) => studio.state !== null && !studio.state.live && studio.hello?.mode === "live");
  const classes = ["panel", collapsed ? "collapsed" : "", maximised ? "maximised" : "", past ? "past" : ""].filter(Boolean);
  const flex = collapsed ? "0 0 auto" : height_px === undefined ? `${weight ?? 1} 1 0` : `0 0 ${height_px}px`;
  return (
    <section id={`panel-${panel.id}`} className={classes.join(" ")} style={{ flex }} tabIndex={-1} aria-labelledby={`title-${panel.id}`}>
      <header className="panel-bar" onDoubleClick={(event) => event.target === event.currentTarget && toggle_maximised(panel.id)}>
        <h2 className="panel-title" id={`title-${panel.id}`}>
          {panel.title}
        </h2>
        <div className="panel-tools" ref={set_place} />
        <button className="icon-button" onClick={() => toggle_maximised(panel.id)} aria-pressed={maximised} aria-label={`${panel.title}: fill the page`} title="Fill the page">
          <Icon name={maximised ? "shrink" : "expand"} />
        </button>
        <button className="icon-button" onClick={() => toggle_collapsed(panel.id)} aria-expanded={!collapsed} aria-label={`${panel.title}: collapse`} title={collapsed ? "Open" : "Collapse"}>
          <Icon name={collapsed ? "right" : "down"} />
        </button>
      </header>
      {collapsed ? null : (
        <div className="panel-content">
          <ToolsPlace.Provider value={place}>
            <PanelGuard name={panel.title}>
              <panel.Content />
            </PanelGuard>
          </ToolsPlace.Provider>
        </div>
      )}
    </section>
  );
}
