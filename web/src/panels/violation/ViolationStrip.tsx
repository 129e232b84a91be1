import { useEffect, useRef } from "react";

import { clock_text, duration_text } from "../../draw/format";
import { useStudio } from "../../store/store";
import { useCommand } from "../../widgets/commands";
import { Icon } from "../../widgets/Icon";
import { go_to_violation, useViolation, useViolations } from "./violations";

/** Appears with the first violation, and again with every further one, until it is put away. */
export function ViolationStrip() {
  const violations = useStudio((studio) => studio.violations);
  const monitors = useStudio((studio) => studio.index?.model.monitors);
  const time = useStudio((studio) => studio.state?.time ?? 0);
  const boot = useStudio((studio) => studio.hello?.boot);
  const { shown, story } = useViolations();
  const known = useRef(0);
  useEffect(() => {
    if (violations.length > known.current) useViolations.setState({ shown: true });
    known.current = violations.length;
  }, [violations]);
  useEffect(() => useViolations.setState({ chosen: null, story: false }), [boot]);
  useCommand(
    { id: "violation.story", title: "Violations: story and witness", group: "Page", keys: ["V"], run: () => useViolations.setState({ shown: true, story: !story }) },
    ...(story ? [{ id: "violation.hide", title: "Violations: hide the story", group: "Page", keys: ["Escape"], run: () => useViolations.setState({ story: false }) }] : []),
    { id: "violation.away", title: "Violations: put the strip away", group: "Page", run: () => useViolations.setState({ shown: false, story: false }) },
  );
  const violation = useViolation();
  if (!violation || !shown) return null;
  const monitor = monitors?.find((candidate) => candidate.name === violation.monitor);
  const sentence = monitor?.sentence || monitor?.requirement || "";
  const away = violation.time - time;
  return (
    <section className="violation" role="alert" aria-label="Violated requirement" data-testid="violation-banner">
      <Icon name="alarm" />
      <strong className="violation-title">Requirement violated</strong>
      {violations.length > 1 ? (
        <div className="violation-tabs" role="group" aria-label="Violations">
          {violations.map((other, i) => (
            <button key={`${other.monitor}.${other.sequence}`} className="violation-button" aria-pressed={other === violation} onClick={() => useViolations.setState({ chosen: i })}>
              {other.monitor}
            </button>
          ))}
        </div>
      ) : (
        <strong className="violation-name">{violation.monitor}</strong>
      )}
      <span className="ellipsis violation-sentence" title={sentence}>
        {sentence}
      </span>
      <span className="violation-time number">
        at {clock_text(violation.time)}
        {away > 0 ? ` · ${duration_text(away)} after the moment shown` : ""}
      </span>
      <button className="violation-button" onClick={() => go_to_violation(violation)} data-testid="violation-moment">
        Go to the moment
      </button>
      <button className="violation-button" aria-expanded={story} onClick={() => useViolations.setState({ story: !story })} title="Story and witness, over the timeline (V)" data-testid="violation-why">
        {story ? "Hide why" : "Why"}
      </button>
      <button className="violation-button" onClick={() => useViolations.setState({ shown: false, story: false })} title="The header keeps count">
        Put away
      </button>
    </section>
  );
}
