import { useEffect, useRef, useState } from "react";
import { create } from "zustand";

import { clock_text, duration_text } from "../../draw/format";
import type { Observation, Violation } from "../../protocol/types";
import { select, useStudio } from "../../store/store";
import { seek, stop_replay } from "../../store/time_travel";
import { short_name, summary } from "../messages/describe";
import { said_first, witness_title } from "./violation";
import { useCommand } from "../../widgets/commands";
import { Icon } from "../../widgets/Icon";
import { go_to_panel } from "../../widgets/layout";

/** `shown`: the banner; otherwise a chip in the header remains. `details`: story and witness. */
export const useBanner = create<{ shown: boolean; details: boolean }>()(() => ({ shown: true, details: true }));

export function open_monitor_chart(monitor: string): void {
  const chart = useStudio.getState().index?.model.monitors.find((candidate) => candidate.name === monitor)?.chart;
  select({ monitor, ...(chart ? { chart } : {}) });
  go_to_panel(chart ? "charts" : "monitors");
}

function go_to(observation: { time: number; sequence: number }): void {
  stop_replay();
  select({ sequence: observation.sequence });
  seek(observation.time);
}

function Witness({ witness }: { witness: readonly Observation[] }) {
  const shown = useStudio((studio) => studio.state?.sequence ?? -1);
  const newest = witness.findLast((observation) => observation.sequence <= shown)?.sequence;
  return (
    <ol className="witness" aria-label="Witness">
      {witness.map((observation) => (
        <li key={observation.sequence}>
          <button className="witness-line" onClick={() => go_to(observation)} title="Go to this moment" aria-current={observation.sequence === newest ? "step" : undefined}>
            <time className="mono">{clock_text(observation.time)}</time>
            <span className="mono ellipsis">{short_name(observation)}</span>
            <span className="mono ellipsis witness-data">{summary(observation)}</span>
          </button>
        </li>
      ))}
    </ol>
  );
}

function Details({ violation }: { violation: Violation }) {
  return (
    <div className="banner-details">
      <section aria-label="Story">
        <h3>What happened</h3>
        <pre className="story">{violation.story.trim()}</pre>
      </section>
      <section aria-label="Witness">
        <h3>{witness_title(violation)}</h3>
        <Witness witness={violation.witness} />
      </section>
    </div>
  );
}

/** Appears with the first violation, and again with every further one, until it is put away. */
export function ViolationBanner() {
  const violations = useStudio((studio) => studio.violations);
  const monitors = useStudio((studio) => studio.index?.model.monitors);
  const time = useStudio((studio) => studio.state?.time ?? 0);
  const boot = useStudio((studio) => studio.hello?.boot);
  const { shown, details } = useBanner();
  const [chosen, set_chosen] = useState<number | null>(null);
  const known = useRef(0);
  useEffect(() => {
    if (violations.length > known.current) useBanner.setState({ shown: true });
    known.current = violations.length;
  }, [violations]);
  useEffect(() => set_chosen(null), [boot]);
  useCommand(
    { id: "banner.details", title: "Violations: story and witness", group: "Page", keys: ["V"], run: () => useBanner.setState(shown ? { details: !details } : { shown: true, details: true }) },
    { id: "banner.away", title: "Violations: put the banner away", group: "Page", run: () => useBanner.setState({ shown: false }) },
  );
  const violation = violations[Math.min(chosen ?? said_first(violations, monitors ?? []), violations.length - 1)];
  if (!violation || !shown) return null;
  const monitor = monitors?.find((candidate) => candidate.name === violation.monitor);
  const sentence = monitor?.sentence || monitor?.requirement || "";
  const away = violation.time - time;
  const later = away > 0 ? ` · ${duration_text(away)} after the moment shown` : "";
  return (
    <section className="banner" role="alert" aria-label="Violated requirement" data-testid="violation-banner">
      <div className="banner-head">
        <Icon name="alarm" />
        <strong className="banner-title">Requirement violated</strong>
        {violations.length > 1 ? (
          <div className="banner-tabs" role="group" aria-label="Violations">
            {violations.map((other, i) => (
              <button key={`${other.monitor}.${other.sequence}`} className="banner-tab" aria-pressed={other === violation} onClick={() => set_chosen(i)}>
                {other.monitor}
              </button>
            ))}
          </div>
        ) : (
          <strong className="banner-name">{violation.monitor}</strong>
        )}
        <span className="ellipsis banner-sentence">{sentence}</span>
        <span className="banner-time number">
          at {clock_text(violation.time)}
          {later}
        </span>
        <button className="banner-button" onClick={() => go_to(violation)} data-testid="violation-moment">
          Go to the moment
        </button>
        <button className="banner-button" onClick={() => open_monitor_chart(violation.monitor)}>
          Chart
        </button>
        <button className="banner-button" aria-expanded={details} onClick={() => useBanner.setState({ details: !details })} title="Story and witness (V)">
          {details ? "Less" : "Why"}
        </button>
        <button className="banner-button square" onClick={() => useBanner.setState({ shown: false })} aria-label="Put away" title="Put away; the header keeps count">
          <Icon name="close" />
        </button>
      </div>
      {details && <Details violation={violation} />}
    </section>
  );
}
