import "../../styles/steer.css";

import { useEffect, useRef } from "react";

import { useStudio } from "../../store/store";
import { useCommand } from "../../widgets/commands";
import { useDrawers } from "../../widgets/layout";
import { CallTab } from "./CallTab";
import { FaultsTab } from "./FaultsTab";
import { PartsTab } from "./PartsTab";
import { Robots } from "./Robots";
import { SaveTab } from "./SaveTab";
import { StandingList } from "./StandingList";
import { refresh_standing, take_back, useSteering, useWhyNot } from "./steering";

const kDrawers = [
  { id: "faults", title: "Faults", Content: FaultsTab },
  { id: "parts", title: "Parts", Content: PartsTab },
  { id: "call", title: "Call", Content: CallTab },
  { id: "standing", title: "Standing", Content: StandingList },
  { id: "save", title: "Save", Content: SaveTab },
] as const;

/** Below the stage of a run that goes on: its robots, and drawers with everything else that can be done to it. */
export function SteerBar() {
  const open = useDrawers((drawers) => drawers.steer);
  const why_not = useWhyNot();
  const standing = useSteering((steering) => steering.standing.length);
  const undo = useSteering((steering) => steering.undo.at(-1)?.said ?? null);
  const stopped_at = useStudio((studio) => studio.state?.run.stopped_at?.what ?? null);
  const boot = useStudio((studio) => studio.hello?.boot);
  const toggle = (id: string) => useDrawers.setState({ steer: open === id ? null : id });

  // Another page may have set or cleared something while this one was away.
  useEffect(() => void refresh_standing(), [boot, why_not, stopped_at]);
  useCommand({ id: "steer.undo", title: "Take back what was done by hand last", group: "Steer", keys: ["Ctrl+Z"], run: () => void take_back() }, ...kDrawers.map(({ id, title }) => ({ id: `steer.${id}`, title: `Steer: ${title}`, group: "Steer", run: () => toggle(id) })));

  const drawer = kDrawers.find(({ id }) => id === open);
  const bar = useRef<HTMLDivElement>(null);
  const is_open = drawer !== undefined;
  useEffect(() => {
    if (!is_open) return;
    const close = () => useDrawers.setState({ steer: null });
    const outside = (event: PointerEvent) => {
      if (event.target instanceof Node && !bar.current?.contains(event.target)) close();
    };
    // Wherever the focus is, unless Escape means something there.
    const key = (event: KeyboardEvent) => {
      if (event.key === "Escape" && !event.defaultPrevented) close();
    };
    window.addEventListener("pointerdown", outside, true);
    window.addEventListener("keydown", key);
    return () => {
      window.removeEventListener("pointerdown", outside, true);
      window.removeEventListener("keydown", key);
    };
  }, [is_open]);
  return (
    <div
      ref={bar}
      className="steer"
      id="panel-steer"
      tabIndex={-1}
      role="group"
      aria-label="Steer"
      onKeyDown={(event) => {
        if (event.key !== "Escape" || !drawer) return;
        event.preventDefault();
        toggle(drawer.id);
        document.getElementById(`steer-tab-${drawer.id}`)?.focus();
      }}
    >
      {drawer && (
        <section
          className="steer-drawer"
          id="steer-content"
          role="tabpanel"
          aria-labelledby={`steer-tab-${drawer.id}`}
        >
          <fieldset disabled={why_not !== null} title={why_not ?? undefined}>
            <legend className="steer-title">{drawer.title}</legend>
            <drawer.Content />
          </fieldset>
        </section>
      )}
      {why_not ? (
        <p className="steer-reason ellipsis" role="status" data-testid="why-not">
          {why_not}.
        </p>
      ) : null}
      <fieldset className="steer-robots" disabled={why_not !== null} title={why_not ?? undefined}>
        <legend className="hidden-text">Robots</legend>
        <Robots />
      </fieldset>
      {undo !== null && why_not === null && (
        <button type="button" className="button small" title={`Take back: ${undo} (Ctrl+Z). What has come of it meanwhile stays`} data-testid="steer-undo" onClick={() => void take_back()}>
          Undo
        </button>
      )}
      <div className="steer-tabs" role="tablist" aria-label="Ways to steer" onKeyDown={walk}>
        {kDrawers.map(({ id, title }, i) => (
          <button
            key={id}
            id={`steer-tab-${id}`}
            className="tab"
            role="tab"
            aria-selected={open === id}
            aria-controls={open === id ? "steer-content" : undefined}
            tabIndex={open === id || (open === null && i === 0) ? 0 : -1}
            onClick={() => toggle(id)}
          >
            {title}
            {id === "standing" && standing > 0 && <span className="count number">{standing}</span>}
          </button>
        ))}
      </div>
    </div>
  );
}

/** Arrows go from tab to tab. */
function walk(event: React.KeyboardEvent): void {
  const step = event.key === "ArrowRight" ? 1 : event.key === "ArrowLeft" ? -1 : 0;
  if (step === 0) return;
  const tabs = [...event.currentTarget.querySelectorAll<HTMLElement>("[role=tab]")];
  tabs[(tabs.indexOf(document.activeElement as HTMLElement) + step + tabs.length) % tabs.length]?.focus();
  event.preventDefault();
  event.stopPropagation();
}
