import { kInterventions } from "../../protocol/interventions";
import { Icon } from "../../widgets/Icon";
import { useStudio } from "../../store/store";
import { jump_to } from "../mission/mission";
import { intervene, useSteering, type Standing } from "./steering";

/** Breakpoints, faults and forced results that stand, each with a way to end it. */
export function StandingList() {
  const standing = useSteering((steering) => steering.standing);
  const stopped_at = useStudio((studio) => studio.state?.run.stopped_at ?? null);
  if (standing.length === 0) {
    return <p className="muted">No breakpoint, fault or forced result stands. Menus of nodes and states, and Faults, make them.</p>;
  }
  return (
    <>
      <ul className="standing">
        {standing.map((entry) => (
          <li key={entry.id} className={stopped_at?.breakpoint === entry.id ? "stopped" : ""}>
            <span className="standing-sign" aria-hidden="true">
              {kInterventions[entry.kind].sign ?? "•"}
            </span>
            <span className="standing-text">
              <Target entry={entry} />
              {entry.used > 0 && <span className="muted number"> · {entry.used}×</span>}
              {stopped_at?.breakpoint === entry.id && <span className="badge halting">stopped here</span>}
            </span>
            <button type="button" className="icon-button" aria-label={`Clear ${entry.kind} ${entry.text}`} title="Clear" onClick={() => void intervene({ clear: entry.id })}>
              <Icon name="close" />
            </button>
          </li>
        ))}
      </ul>
      <div className="row end">
        <button type="button" className="button small" onClick={() => void clear_all(standing)}>
          Clear all
        </button>
      </div>
    </>
  );
}

async function clear_all(standing: readonly Standing[]): Promise<void> {
  for (const { id } of standing) await intervene({ clear: id });
}

function Target({ entry }: { entry: Standing }) {
  const node = useStudio((studio) => studio.index?.model.tree.nodes.find(({ path }) => path === entry.node)?.id);
  if (node === undefined) return <span className="mono">{entry.text}</span>;
  return (
    <button type="button" className="link-button mono" onClick={() => jump_to(node)} title="Show it in the tree">
      {entry.text}
    </button>
  );
}
