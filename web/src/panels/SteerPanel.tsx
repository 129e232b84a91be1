import "../styles/steer.css";

import { useEffect, useState } from "react";

import { useCommand } from "../widgets/commands";
import { go_to_panel } from "../widgets/layout";
import { useStudio } from "../store/store";
import { CallTab } from "./steer/CallTab";
import { FaultsTab } from "./steer/FaultsTab";
import { PartsTab } from "./steer/PartsTab";
import { RobotTab } from "./steer/RobotTab";
import { SaveTab } from "./steer/SaveTab";
import { StandingList } from "./steer/StandingList";
import { refresh_standing, useSteering, useWhyNot } from "./steer/steering";

const kTabs = [
  { id: "robot", title: "Robot", Content: RobotTab },
  { id: "faults", title: "Faults", Content: FaultsTab },
  { id: "parts", title: "Parts", Content: PartsTab },
  { id: "call", title: "Call", Content: CallTab },
  { id: "standing", title: "Standing", Content: StandingList },
  { id: "save", title: "Save", Content: SaveTab },
] as const;
type TabId = (typeof kTabs)[number]["id"];

export function SteerPanel() {
  const [tab, set_tab] = useState<TabId>("robot");
  const why_not = useWhyNot();
  const standing = useSteering((steering) => steering.standing.length);
  const known = useStudio((studio) => studio.index !== null);
  const stopped_at = useStudio((studio) => studio.state?.run.stopped_at?.what ?? null);
  const boot = useStudio((studio) => studio.hello?.boot);

  // Another page may have set or cleared something while this one was away.
  useEffect(() => void refresh_standing(), [boot, why_not, stopped_at]);
  useCommand(
    ...kTabs.map(({ id, title }) => ({
      id: `steer.${id}`,
      title: `Steer: ${title}`,
      group: "Steer",
      run: () => {
        set_tab(id);
        go_to_panel("steer");
      },
    })),
  );

  if (!known) return <div className="empty">Waiting for the run …</div>;
  const Content = kTabs.find(({ id }) => id === tab)?.Content ?? RobotTab;
  return (
    <div className="steer">
      <div className="tabs" role="tablist" aria-label="Ways to steer" onKeyDown={walk}>
        {kTabs.map(({ id, title }) => (
          <button
            key={id}
            id={`steer-tab-${id}`}
            className="tab"
            role="tab"
            aria-selected={tab === id}
            aria-controls="steer-content"
            tabIndex={tab === id ? 0 : -1}
            onClick={() => set_tab(id)}
          >
            {title}
            {id === "standing" && standing > 0 && <span className="count number">{standing}</span>}
          </button>
        ))}
      </div>
      {why_not && (
        <p className="steer-reason" role="status" data-testid="why-not">
          {why_not}.
        </p>
      )}
      <div className="steer-content scroll" id="steer-content" role="tabpanel" aria-labelledby={`steer-tab-${tab}`}>
        <fieldset disabled={why_not !== null} title={why_not ?? undefined}>
          <legend className="hidden-text">{kTabs.find(({ id }) => id === tab)?.title}</legend>
          <Content />
        </fieldset>
      </div>
    </div>
  );
}

/** Arrows go from tab to tab. */
function walk(event: React.KeyboardEvent): void {
  const step = event.key === "ArrowRight" ? 1 : event.key === "ArrowLeft" ? -1 : 0;
  if (step === 0) return;
  const tabs = [...event.currentTarget.querySelectorAll<HTMLElement>("[role=tab]")];
  const next = tabs[(tabs.indexOf(document.activeElement as HTMLElement) + step + tabs.length) % tabs.length];
  next?.focus();
  next?.click();
  event.preventDefault();
  event.stopPropagation();
}
