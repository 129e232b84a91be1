import { clock_text } from "../../draw/format";
import type { Observation } from "../../protocol/types";
import { useStudio } from "../../store/store";
import { short_name, summary } from "../messages/describe";
import { witness_title } from "./violation";
import { go_to, open_monitor_chart, useViolation, useViolations } from "./violations";

/** What happened and the observations that prove it; over the timeline. */
export function Story() {
  const open = useViolations((state) => state.story);
  const violation = useViolation();
  if (!open || !violation) return null;
  return (
    <section className="violation-story" aria-label={`Why ${violation.monitor} is violated`} data-testid="violation-story">
      <section aria-label="Story">
        <h3>What happened</h3>
        <pre className="story">{violation.story.trim()}</pre>
      </section>
      <section aria-label="Witness">
        <h3>{witness_title(violation)}</h3>
        <Witness witness={violation.witness} />
      </section>
      <div className="story-actions">
        <button className="button small" onClick={() => useViolations.setState({ story: false })}>
          Close
        </button>
        <button className="button small" onClick={() => open_monitor_chart(violation.monitor)}>
          Chart of {violation.monitor}
        </button>
      </div>
    </section>
  );
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
