import { useEffect, useRef } from "react";

import { clock_text } from "../draw/format";
import { usePastMarks, type PastMark } from "../panels/timeline/shown";
import type { DesignPast } from "../protocol/types";
import { doc_of, go_to, useDesign } from "./design";
import { look_at, useMode } from "./mode";
import { line_start, type Places } from "./places";

/** What the requirements of the open file would have said of the project's last runs. */
export function PastPanel() {
  const past = useDesign(({ file, past: known }) => (file === null ? undefined : known[file]));
  const doc = useDesign(doc_of);
  const on_show = useMode(({ runs }) => runs.on_show);
  const is_wrong = useDesign(({ summary }) => summary?.checked === true && summary.findings.some(({ severity }) => severity === "error"));
  useEffect(() => {
    usePastMarks.setState({ marks: past ? marks_of(past, on_show) : [] });
    return () => usePastMarks.setState({ marks: [] });
  }, [past, on_show]);
  // Of a project that cannot be loaded nothing is told.
  if (!past && (doc?.error || is_wrong))
    return (
      <p className="empty" role="status">
        What the last runs would have said is told once {doc?.error ? `the text can be read. Line ${doc.error.line}: ${doc.error.message}` : "the errors of the project are mended."}
      </p>
    );
  if (!past || !doc) return <p className="empty">Looking at the last runs …</p>;
  return (
    <div className="last-runs scroll" data-testid="past" tabIndex={0}>
      <h2>In the last runs</h2>
      {past.runs.length === 0 && (
        <p className="muted">
          There is no recording in <span className="mono">runs/</span>. <strong>Record</strong> above makes one, as <span className="mono">sentree run</span> does; what is written here is then tried on it.
        </p>
      )}
      {past.requirements.length === 0 && <p className="muted">No requirement can be read.</p>}
      {past.requirements.map((requirement) => (
        <Requirement key={requirement.name} requirement={requirement} runs={past.runs} places={doc.places} />
      ))}
    </div>
  );
}

/** On the timeline: of the recording that is on show, else of all. */
function marks_of({ runs, requirements }: DesignPast, on_show: string): PastMark[] {
  return requirements.flatMap(({ name, violated }) =>
    violated.flatMap((time, i) => {
      const run = runs[i]!.name;
      return time === null || (on_show !== "" && run !== on_show.replace(/\.mcap$/, "")) ? [] : [{ kind: "past" as const, time, text: `${name} is violated in runs/${run}` }];
    }),
  );
}

function Requirement({ requirement, runs, places }: { requirement: DesignPast["requirements"][number]; runs: DesignPast["runs"]; places: Places }) {
  const section = useRef<HTMLElement>(null);
  const is_current = useDesign(({ requirement: at_caret }) => at_caret === requirement.name);
  useEffect(() => {
    if (is_current) section.current?.scrollIntoView({ block: "nearest" });
  }, [is_current]);
  return (
    <section aria-label={requirement.name} ref={section} aria-current={is_current ? "true" : undefined}>
      <button className="past-name mono" title="Go to it" onClick={() => go_to(places.byte(line_start(places.shown, requirement.line)), true)}>
        {requirement.name}
      </button>
      <ul>
        {runs.map((run, i) => (
          <Run key={run.name} run={run} at={requirement.violated[i] ?? null} requirement={requirement.name} />
        ))}
      </ul>
    </section>
  );
}

const kBar_px = 200;

function Run({ run, at, requirement }: { run: DesignPast["runs"][number]; at: number | null; requirement: string }) {
  const said = run.problem || (at === null ? "not violated" : `violated at ${clock_text(at)}`);
  return (
    <li data-past-run={run.name} data-requirement={requirement} data-violated={at ?? ""} title={`${run.name}: ${said}`}>
      <span className="ellipsis mono">{run.name}</span>
      {run.problem === "" && (
        <svg viewBox={`0 0 ${kBar_px} 10`} preserveAspectRatio="none" aria-hidden="true">
          <rect className="past-bar" y={3} width={kBar_px} height={4} />
          {at !== null && <rect className="past-mark" x={Math.min((at / Math.max(run.ended, 1)) * kBar_px, kBar_px - 3)} width={3} height={10} />}
        </svg>
      )}
      {run.problem === "" && at !== null ? (
        <button type="button" className="past-moment alarm" title={`Show ${run.name} at that moment`} onClick={() => void look_at(`${run.name}.mcap`, at)}>
          ✗ {said}
        </button>
      ) : (
        <span className="muted">{said}</span>
      )}
    </li>
  );
}
