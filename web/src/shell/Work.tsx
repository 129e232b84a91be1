import { useEffect, useRef, useState, type ReactNode } from "react";

import { panels } from "../panels/registry";
import { useChartsBack } from "../panels/charts/back";
import { SteerBar } from "../panels/steer/SteerBar";
import { Story } from "../panels/violation/Story";
import { useStudio } from "../store/store";
import { default_sizes, is_stacked, kSideMin_px, kTimelineMin_px, move_share, tabs_in, type PanelId, type SideId } from "../widgets/arrangement";
import { Icon } from "../widgets/Icon";
import { show_side, useDrawers, useLayout, useWindow } from "../widgets/layout";
import { Splitter } from "../widgets/Splitter";
import { PanelFrame } from "./PanelFrame";

const panel_of = (id: PanelId) => panels.find((panel) => panel.id === id)!;

/** The stage, the column at its side and the timeline, with borders that can be moved. */
export function Work() {
  const layout = useLayout();
  const { narrow, ...size } = useWindow();
  const at_side = tabs_in(layout, "side").tabs.length > 0;
  const below = tabs_in(layout, "below").tabs.length > 0;
  const auto = default_sizes(size, below);
  const side_px = Math.min(layout.side_px ?? auto.side_px, size.width / 2);
  const timeline_px = Math.min(layout.timeline_px ?? auto.timeline_px, size.height * 0.6);
  return (
    <main className="work">
      <div className="upper">
        <Stage />
        {!at_side ? null : narrow ? (
          <Rail />
        ) : (
          <>
            <Splitter direction="vertical" label="Width of the column" share={1 - side_px / size.width} move={(pixels) => useLayout.setState({ side_px: Math.max(side_px - pixels, kSideMin_px) })} />
            <Side width={side_px} />
          </>
        )}
      </div>
      <Splitter direction="horizontal" label="Height of the timeline" share={1 - timeline_px / size.height} move={(pixels) => useLayout.setState({ timeline_px: Math.max(timeline_px - pixels, kTimelineMin_px) })} />
      <div className="lower" style={{ flex: `0 0 ${timeline_px}px` }}>
        <PanelFrame panel={panel_of("timeline")} flex="1 1 0" />
        {below && (
          <div className="below-panels">
            <TabbedPanels place="below" />
          </div>
        )}
        <Story />
      </div>
    </main>
  );
}

const kStrip_px = 40;

/** Mission, map, and the chart of what is chosen. */
function Stage() {
  const place = useRef<HTMLDivElement>(null);
  const [size, set_size] = useState({ width: 1, height: 1 });
  const mission = useLayout((layout) => layout.mission);
  const chart = useLayout((layout) => layout.chart);
  const charts_open = useLayout((layout) => layout.charts_open);
  const picture = useStudio((studio) => studio.index?.model.tree.layout.size);
  const has_world = useStudio((studio) => (studio.index?.model.world ?? null) !== null);
  const has_charts = useStudio((studio) => (studio.index?.model.charts.length ?? 0) > 0);
  // The run beside a project that is edited is not steered.
  const live = useStudio(({ hello }) => hello?.mode === "live" && (hello.steerable || !hello.design));
  useEffect(() => {
    const element = place.current;
    if (!element) return;
    const observer = new ResizeObserver(() => set_size({ width: element.clientWidth, height: element.clientHeight }));
    observer.observe(element);
    return () => observer.disconnect();
  }, []);
  useChartsBack();
  const with_chart = charts_open && has_charts;
  const before = useRef<boolean | undefined>(undefined);
  // At first as if a violation's strip were above, so that nothing moves when it comes.
  const room = { width: size.width, height: size.height - (before.current === undefined ? kStrip_px : 0) };
  const stacked = is_stacked(room, picture ?? size, mission, before.current);
  // Before it is measured it is no way at all.
  if (size.width > 1) before.current = stacked;
  const rest = with_chart || has_world;
  return (
    <div className="stage" data-testid="stage">
      <div className={`stage-panels ${stacked ? "stacked" : "beside"}`} ref={place}>
        <PanelFrame panel={panel_of("mission")} flex={rest ? `${mission} 1 0` : "1 1 0"} />
        {rest && (
          <Splitter
            direction={stacked ? "horizontal" : "vertical"}
            label="Share of the mission"
            share={mission}
            move={(pixels) => useLayout.setState({ mission: move_share(mission, pixels, stacked ? size.height : size.width) })}
          />
        )}
        {rest && (
          <div className={`stage-rest ${stacked ? "beside" : "stacked"}`} style={{ flex: `${1 - mission} 1 0` }}>
            {with_chart && <PanelFrame panel={panel_of("charts")} flex={has_world ? `${chart} 1 0` : "1 1 0"} />}
            {with_chart && has_world && (
              <Splitter
                direction={stacked ? "vertical" : "horizontal"}
                label="Share of the chart"
                share={chart}
                move={(pixels) => useLayout.setState({ chart: move_share(chart, pixels, stacked ? size.width : size.height) })}
              />
            )}
            {has_world && <PanelFrame panel={panel_of("map")} flex={with_chart ? `${1 - chart} 1 0` : "1 1 0"} />}
          </div>
        )}
      </div>
      {live && <SteerBar />}
    </div>
  );
}

function Tabs({ tabs, shown }: { tabs: readonly SideId[]; shown: SideId | null }) {
  return (
    <div className="side-tabs" role="tablist" aria-label={tabs.map((id) => panel_of(id).title).join(", ")} onKeyDown={walk}>
      {tabs.map((id) => (
        <button key={id} className="tab" role="tab" aria-selected={shown === id} tabIndex={shown === id ? 0 : -1} onClick={() => show_side(id)}>
          {panel_of(id).title}
          {id === "monitors" && <Violated />}
        </button>
      ))}
    </div>
  );
}

/** Arrows go from tab to tab. */
function walk(event: React.KeyboardEvent): void {
  if (event.key !== "ArrowRight" && event.key !== "ArrowLeft") return;
  const group = event.currentTarget.closest(".side, .below-panels");
  const tabs = [...event.currentTarget.querySelectorAll<HTMLElement>("[role=tab]")];
  const at = tabs.findIndex((tab) => tab.getAttribute("aria-selected") === "true");
  tabs[(at + (event.key === "ArrowRight" ? 1 : tabs.length - 1)) % tabs.length]?.click();
  // The tab that was clicked is in the bar of another panel.
  requestAnimationFrame(() => group?.querySelector<HTMLElement>(".panel:not([hidden]) [role=tab][aria-selected=true]")?.focus());
  event.preventDefault();
}

function Violated() {
  const count = useStudio((studio) => Object.values(studio.state?.monitors ?? {}).filter(({ verdict }) => verdict === "violated").length);
  return count === 0 ? null : <span className="count alarm number" title={`${count} violated`}>✗ {count}</span>;
}

/** The panels of a place; all are there, one is shown. */
function TabbedPanels({ place }: { place: "side" | "below" }) {
  const layout = useLayout();
  const { tabs, shown } = tabs_in(layout, place);
  return tabs.map((id) => <PanelFrame key={id} panel={panel_of(id)} flex="1 1 0" hidden={shown !== id} head={<Tabs tabs={tabs} shown={shown} />} />);
}

function Side({ width, children }: { width: number; children?: ReactNode }) {
  return (
    <div className="side" style={{ flex: `0 0 ${width}px`, width }}>
      <TabbedPanels place="side" />
      {children}
    </div>
  );
}

/** In a narrow window: the column is opened over the stage. */
function Rail() {
  const open = useDrawers((drawers) => drawers.side);
  const layout = useLayout();
  return (
    <div className="rail">
      {tabs_in(layout, "side").tabs.map((id) => (
        <button key={id} className="rail-button" aria-expanded={open} onClick={() => show_side(id)}>
          {panel_of(id).title}
          {id === "monitors" && <Violated />}
        </button>
      ))}
      <div className="side-drawer" hidden={!open}>
        <Side width={300}>
          <button className="button small drawer-close" onClick={() => useDrawers.setState({ side: false })}>
            <Icon name="right" />
            Close
          </button>
        </Side>
      </div>
    </div>
  );
}
