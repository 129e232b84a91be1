import { useMemo } from "react";

import { clock_text, duration_text } from "../draw/format";
import type { MonitorModel, MonitorState, Verdict } from "../protocol/types";
import { Icon } from "../widgets/Icon";
import { open_monitor_chart, useViolations } from "./violation/violations";
import { select, useStudio } from "../store/store";
import { seek, stop_replay } from "../store/time_travel";
import { split_standing } from "./monitors/standing";

const kVerdictText: Record<Verdict, string> = { violated: "violated", satisfied: "satisfied", undecided: "undecided" };

/** Each verdict has a shape of its own: octagon with a cross, disc with a check, ring with a dash. */
export function VerdictSign({ verdict }: { verdict: Verdict }) {
  return (
    <svg className={`verdict-sign ${verdict}`} viewBox="0 0 20 20" role="img" aria-label={kVerdictText[verdict]}>
      {verdict === "violated" && (
        <>
          <path d="M6.300 1h7.400L19 6.300v7.400L13.700 19H6.300L1 13.700V6.300z" fill="currentColor" />
          <path d="M6.500 6.500l7 7M13.500 6.500l-7 7" stroke="var(--surface)" strokeWidth="2.200" strokeLinecap="round" />
        </>
      )}
      {verdict === "satisfied" && (
        <>
          <circle cx="10" cy="10" r="9" fill="currentColor" />
          <path d="M5.800 10.400l3 3 5.600-6.400" fill="none" stroke="var(--surface)" strokeWidth="2.200" strokeLinecap="round" strokeLinejoin="round" />
        </>
      )}
      {verdict === "undecided" && (
        <>
          <circle cx="10" cy="10" r="8" fill="none" stroke="currentColor" strokeWidth="2" strokeDasharray="3.200 2.300" />
          <path d="M6.500 10h7" stroke="currentColor" strokeWidth="2" strokeLinecap="round" />
        </>
      )}
    </svg>
  );
}

/** Time left until the monitor decides; counts down in run time. */
function Deadline({ deadline }: { deadline: number }) {
  const left = useStudio((studio) => Math.max(0, deadline - (studio.state?.time ?? 0)));
  return (
    <span className={`deadline number${left < 1e9 ? " near" : ""}`} title={`Decided at ${clock_text(deadline)}`}>
      <Icon name="wait" />
      {duration_text(Math.round(left / 1e8) * 1e8)} left
    </span>
  );
}

function Monitor({ model, state, chosen, times }: { model: MonitorModel; state: MonitorState | undefined; chosen: boolean; times: readonly number[] }) {
  const verdict = state?.verdict ?? "undecided";
  const count = state?.violations ?? 0;
  const { word, rest } = split_standing(state?.standing ?? "");
  const vacuity = useStudio((studio) => studio.state?.run.vacuous[model.name]);
  const next = () => {
    const now = useStudio.getState().state?.time ?? 0;
    const time = times.find((candidate) => candidate > now) ?? times[0];
    if (time === undefined) return;
    stop_replay();
    seek(time);
    useViolations.setState({ shown: true });
  };
  return (
    <li className={`monitor ${verdict}${chosen ? " chosen" : ""}`} data-monitor={model.name} data-verdict={verdict} onClick={() => select({ monitor: model.name, chart: model.chart })}>
      <VerdictSign verdict={verdict} />
      <div className="monitor-text">
        <div className="monitor-head">
          <strong className="ellipsis">{model.name}</strong>
          <span className={`verdict-word ${verdict}`}>{kVerdictText[verdict]}</span>
          {model.gate.length > 0 && (
            <span className="badge" title={`May veto: ${model.gate.join(", ")}`}>
              gate
            </span>
          )}
          {model.severity && model.severity !== "error" && <span className="badge">{model.severity}</span>}
          {state?.deadline != null && <Deadline deadline={state.deadline} />}
        </div>
        {model.sentence && <p className="monitor-sentence">{model.sentence}</p>}
        {model.requirement && model.requirement !== model.sentence && <p className="monitor-requirement mono">{model.requirement}</p>}
        {rest && (
          <p className="monitor-standing">
            <span className="muted">{word} </span>
            {rest}
          </p>
        )}
        {vacuity !== undefined && (
          <p className="monitor-vacuity" data-testid="vacuity">
            It {vacuity}.
          </p>
        )}
      </div>
      <div className="monitor-tools">
        {times.length > 0 && (
          <button className="button small" onClick={next} aria-label={`Next violation of ${model.name}, ${clock_text(times[0] ?? 0, 1)}`} title={`Go to the next violation (${count > 1 ? `${count} in all` : clock_text(times[0] ?? 0)})`}>
            <Icon name="next" />
            {clock_text(times[0] ?? 0, 1)}
          </button>
        )}
        <button className="button small" onClick={() => open_monitor_chart(model.name)} aria-label={`Chart of ${model.name}`} title="Show its chart">
          Chart
        </button>
      </div>
    </li>
  );
}

export function MonitorsPanel() {
  const models = useStudio((studio) => studio.index?.model.monitors);
  const states = useStudio((studio) => studio.state?.monitors);
  const violations = useStudio((studio) => studio.violations);
  const chosen = useStudio((studio) => studio.selection.monitor);
  const times = useMemo(() => {
    const by_monitor = new Map<string, number[]>();
    for (const violation of violations) by_monitor.set(violation.monitor, [...(by_monitor.get(violation.monitor) ?? []), violation.time]);
    return by_monitor;
  }, [violations]);
  if (!models) return null;
  if (models.length === 0) return <p className="empty">This project has no monitors; sentree.yaml lists them under “monitors”.</p>;
  return (
    <>
      <ul className="scroll monitors">
        {models.map((model) => (
          <Monitor key={model.name} model={model} state={states?.[model.name]} chosen={chosen === model.name} times={times.get(model.name) ?? kNoTimes} />
        ))}
      </ul>
    </>
  );
}

const kNoTimes: readonly number[] = [];
