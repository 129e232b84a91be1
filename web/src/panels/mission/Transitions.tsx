import { useEffect, useState } from "react";

import { clock_text, duration_text, kSecond_ns } from "../../draw/format";
import { download, file_name } from "../../picture/export";
import type { Time, TreeNode } from "../../protocol/types";
import { request, useStudio } from "../../store/store";
import { seek } from "../../store/time_travel";

type Row = readonly [Time, string];

/** Rows that are drawn; the file has all that the program gave. */
const kShownMax = 200;

/** What the table has, a line each; up to `end`, in run time. */
export function csv_of(rows: readonly Row[], end: Time): string {
  const seconds = (time: Time) => Number((time / kSecond_ns).toFixed(9));
  return ["time_s,status,duration_s", ...rows.map(([time, status], i) => `${seconds(time)},${status},${seconds(until(rows, i, end) - time)}`)].join("\n") + "\n";
}

const until = (rows: readonly Row[], i: number, end: Time): Time => rows[i + 1]?.[0] ?? Math.max(end, rows[i]![0]);

/** What a condition says anew each tick, once where it changes. */
export function answers_of(rows: readonly Row[]): Row[] {
  const said = rows.filter(([, status]) => status !== "IDLE");
  return said.filter(([, status], i) => status !== said[i - 1]?.[1]);
}

/** What became of a node when, up to the newest. */
export function Transitions({ node }: { node: TreeNode }) {
  const index = useStudio((studio) => studio.index);
  // Asked anew once a second while the run goes on, and when what is shown is another run.
  const second = useStudio((studio) => Math.floor((studio.state?.end ?? 0) / kSecond_ns));
  const time = useStudio((studio) => studio.state?.time ?? 0);
  const end = second * kSecond_ns;
  const [known, set_known] = useState<{ rows: readonly Row[]; left_out: number }>({ rows: [], left_out: 0 });
  useEffect(() => {
    let gone = false;
    void request("transitions", { node: node.id }).then((answer) => gone || set_known(answer), () => undefined);
    return () => {
      gone = true;
    };
  }, [node.id, index, second]);
  const { left_out } = known;
  const is_condition = node.kind === "condition";
  const rows = is_condition ? answers_of(known.rows) : known.rows;
  const now = rows.findLastIndex(([since]) => since <= time);
  const first = Math.max(0, Math.min(now - kShownMax / 2, rows.length - kShownMax));
  const shown = rows.slice(first, first + kShownMax);
  return (
    <section className="values transitions" aria-label="Transitions">
      <h3>
        {is_condition ? "Answers that changed" : "Transitions"} <span className="muted number">{rows.length + (is_condition ? 0 : left_out)}</span>
        {rows.length > 0 && (
          <button className="button small" title={`${left_out > 0 ? "The newest" : "All"} ${rows.length} rows`} onClick={() => download(csv_of(rows, end), file_name([node.name, "transitions"], "csv"), "text/csv")}>
            Save as CSV
          </button>
        )}
      </h3>
      {rows.length === 0 ? (
        <p className="muted">none yet</p>
      ) : (
        <table>
          <tbody>
            {shown.map(([since, status], i) => (
              <tr key={first + i} aria-current={first + i === now ? "step" : undefined}>
                <td>
                  <button className="mono" title="Go to this moment" onClick={() => seek(since)}>
                    {clock_text(since)}
                  </button>
                </td>
                <td>{status}</td>
                <td className="muted number">{duration_text(until(rows, first + i, end) - since)}</td>
              </tr>
            ))}
          </tbody>
        </table>
      )}
    </section>
  );
}
