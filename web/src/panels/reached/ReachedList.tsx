import "../../styles/reached.css";

import { useMemo, useState } from "react";

import type { NotReached, Reached, ReachedKind } from "../../protocol/types";
import { lines_of } from "./reached";

const kWords: Record<ReachedKind, { title: string; says: string }> = {
  nodes: { title: "Nodes", says: "SUCCESS and FAILURE of each node, RUNNING of each action" },
  states: { title: "States", says: "states of the skills’ charts" },
  transitions: { title: "Transitions", says: "transitions of the skills’ charts" },
  guards: { title: "Guards", says: "each condition of a transition, true and false" },
  methods: { title: "Methods", says: "of each method that is called a reply, an error and a late answer" },
  requirements: { title: "Requirements", says: "requirements and monitors, put to the test" },
};
/** Lines of one kind that are drawn. */
const kLinesMax = 300;

/** How much of a project was reached, and what never was; `go` shows it, `leads` says whether it can. */
export function ReachedList({ reached, go, leads, without = [] }: { reached: Reached; go(what: NotReached): void; leads(what: NotReached): boolean; without?: readonly ReachedKind[] }) {
  const kinds = reached.kinds.filter(({ kind, of }) => of > 0 && !without.includes(kind));
  const first = kinds.find((kind) => kind.reached < kind.of)?.kind ?? kinds[0]?.kind;
  const [wanted, set_wanted] = useState<ReachedKind | null>(null);
  const shown = kinds.find(({ kind }) => kind === wanted)?.kind ?? first;
  const lines = useMemo(() => (shown ? lines_of(reached.not_reached, shown) : []), [reached, shown]);
  if (!shown) return <p className="empty">There is nothing to reach.</p>;
  return (
    <div className="reached" data-testid="reached">
      <ul className="reached-kinds" aria-label="Kinds">
        {kinds.map(({ kind, reached: got, of }) => (
          <li key={kind}>
            <button className="reached-kind" aria-pressed={shown === kind} data-kind={kind} title={kWords[kind].says} onClick={() => set_wanted(kind)}>
              <span>{kWords[kind].title}</span>
              <span className="number">
                {got} of {of}
              </span>
              <span className="reached-bar" aria-hidden="true">
                <span style={{ width: `${(100 * got) / of}%` }} />
              </span>
            </button>
          </li>
        ))}
      </ul>
      {lines.length === 0 ? (
        <p className="muted reached-none">All reached.</p>
      ) : (
        <ul className="reached-lines scroll" aria-label={`${kWords[shown].title} never reached`} tabIndex={0}>
          {lines.slice(0, kLinesMax).map(({ first: one, what, lacks }) => (
            <li key={`${one.of}|${one.what}|${one.line}`} data-never={one.of}>
              <button className="reached-line" disabled={!leads(one)} title={leads(one) ? "Show it" : undefined} onClick={() => go(one)}>
                <span className="mono wrap">{what || one.of}</span>
                {lacks.map((lack) => (
                  <span key={lack} className="badge">
                    never {lack}
                  </span>
                ))}
                {one.line > 0 && (
                  <span className="muted mono reached-at">
                    {one.file}:{one.line}
                  </span>
                )}
              </button>
            </li>
          ))}
          {lines.length > kLinesMax && <li className="muted">… and {lines.length - kLinesMax} more: sentree test --coverage --json has all</li>}
        </ul>
      )}
    </div>
  );
}
