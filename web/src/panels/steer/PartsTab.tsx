import { useStudio } from "../../store/store";
import { intervene, useSteering } from "./steering";

/** What can be killed and restarted. */
export function PartsTab() {
  const parts = useStudio((studio) => studio.index?.model.parts);
  const processes = useStudio((studio) => studio.state?.run.processes);
  const ended = useStudio((studio) => studio.state?.run.state === "ended");
  // A part in a thread has no process whose absence would say so.
  const killed = useSteering((steering) => steering.killed);
  if (!parts || parts.length === 0) return <p className="muted">Nothing of this run can be killed.</p>;
  return (
    <table className="parts">
      <thead>
        <tr>
          <th scope="col">Part</th>
          <th scope="col">State</th>
          <th scope="col">
            <span className="hidden-text">Actions</span>
          </th>
        </tr>
      </thead>
      <tbody>
        {parts.map(({ name, kind, process }) => {
          const found = processes?.find((entry) => entry.name === name);
          const dead = process ? !found && !ended : killed.has(name);
          return (
            <tr key={`${kind}:${name}`}>
              <th scope="row">
                {name} <span className="muted">{kind}</span>
              </th>
              <td>
                <span className={`badge ${dead ? "failure" : ""}`}>{dead ? (process ? "✗ not running" : "✗ killed") : process ? `process ${found?.pid ?? ""}` : "thread"}</span>
              </td>
              <td className="actions">
                <button type="button" className="button small" disabled={dead} onClick={() => void intervene({ kill: name })} aria-label={`Kill ${name}`}>
                  Kill
                </button>
                <button type="button" className="button small" onClick={() => void intervene({ restart: name })} aria-label={`Restart ${name}`}>
                  Restart
                </button>
              </td>
            </tr>
          );
        })}
      </tbody>
    </table>
  );
}
