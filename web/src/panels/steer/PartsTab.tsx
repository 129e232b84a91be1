import { useState } from "react";

import { useStudio } from "../../store/store";
import { steer } from "./steering";

/** What can be killed and restarted. */
export function PartsTab() {
  const parts = useStudio((studio) => studio.index?.model.parts);
  const processes = useStudio((studio) => studio.state?.run.processes);
  // Killed from this page: a part in a thread has no process that would say so.
  const [killed, set_killed] = useState<ReadonlySet<string>>(new Set());
  if (!parts || parts.length === 0) return <p className="muted">Nothing of this run can be killed.</p>;
  const act = async (op: "kill" | "restart", part: string) => {
    if ((await steer(op, { part })) === null) return;
    set_killed((before) => {
      const next = new Set(before);
      if (op === "kill") next.add(part);
      else next.delete(part);
      return next;
    });
  };
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
          const dead = found ? !found.alive : killed.has(name);
          return (
            <tr key={`${kind}:${name}`}>
              <th scope="row">
                {name} <span className="muted">{kind}</span>
              </th>
              <td>
                <span className={`badge ${dead ? "failure" : ""}`}>{dead ? "✗ killed" : process ? `process ${found?.pid ?? ""}` : "thread"}</span>
              </td>
              <td className="actions">
                <button type="button" className="button small" disabled={dead} onClick={() => void act("kill", name)} aria-label={`Kill ${name}`}>
                  Kill
                </button>
                <button type="button" className="button small" onClick={() => void act("restart", name)} aria-label={`Restart ${name}`}>
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
