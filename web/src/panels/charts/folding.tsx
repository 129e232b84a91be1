import { useEffect, useMemo, useState } from "react";

import type { ChartFold, ChartLayout } from "../../protocol/types";

const kNothingClosed: ReadonlySet<string> = new Set();
/** States that hide what is in them, by chart, for as long as the page is open. */
const closed_in = new Map<string, ReadonlySet<string>>();

export interface Folding {
  /** What is drawn, and which state and transition of the whole each is. */
  shown: ChartFold;
  /** The whole has been asked for with some states closed, and came. */
  folded: boolean;
  closed: ReadonlySet<string>;
  /** Closes a state, or opens it. */
  toggle(id: string): void;
  set_closed(ids: readonly string[]): void;
}

interface Whole {
  layout: ChartLayout;
  transitions: readonly unknown[];
}

/**
 * A chart in which states can be closed. `key` names it; `fold` lays it out with some closed, or gives null where that
 * is of an older version; whoever calls changes `version` with the chart.
 */
export function useFolding(key: string, whole: Whole, version: unknown, fold: (closed: string[]) => Promise<ChartFold | null>): Folding {
  const [closed, set_closed] = useState(() => closed_in.get(key) ?? kNothingClosed);
  const [found, set_found] = useState<{ version: unknown; fold: ChartFold } | null>(null);
  useEffect(() => {
    closed_in.set(key, closed);
    if (closed.size === 0) {
      set_found(null);
      return;
    }
    let gone = false;
    // While it cannot be laid out, the last picture stays.
    fold([...closed]).then(
      (came) => !gone && came && set_found({ version, fold: came }),
      () => undefined,
    );
    return () => {
      gone = true;
    };
    // `fold` is another function each time, and does the same for one key.
    // eslint-disable-next-line react-hooks/exhaustive-deps
  }, [key, closed, version]);
  const current = found !== null && found.version === version ? found.fold : null;
  const shown = useMemo(() => {
    if (current && current.states.every((at) => at < whole.layout.states.length)) return current;
    return { layout: whole.layout, states: whole.layout.states.map((_, i) => i), transitions: whole.transitions.map((_, i) => i), hidden: whole.layout.states.map(() => 0) };
  }, [current, whole]);
  const toggle = (id: string) =>
    set_closed((before) => {
      const next = new Set(before);
      if (!next.delete(id)) next.add(id);
      return next;
    });
  return { shown, folded: current !== null, closed, toggle, set_closed: (ids) => set_closed(new Set(ids)) };
}

/** States that hold others. */
export function composites(layout: ChartLayout): ReadonlySet<number> {
  return new Set(layout.states.map(({ parent }) => parent).filter((parent) => parent >= 0));
}

/** At the corner of what can be closed; a click on it is found by its class. */
export function FoldSign({ id, closed, hint, x, y }: { id: string; closed: boolean; hint: string; x: number; y: number }) {
  return (
    <g className="fold shown" data-export="no" data-fold={id} transform={`translate(${x} ${y})`}>
      <title>{`${closed ? "Show" : "Hide"} what is in ${id}${hint}`}</title>
      <circle r={8} />
      <path d={closed ? "M-4 0H4M0 -4V4" : "M-4 0H4"} />
    </g>
  );
}

/** How much is hidden in something that is closed. */
export function FoldCount({ hidden, x, y }: { hidden: number; x: number; y: number }) {
  return (
    <g className="fold-count" transform={`translate(${x} ${y})`}>
      <rect x={-19} y={-8} width={38} height={16} rx={8} />
      <text y={4} textAnchor="middle">{`+${hidden}`}</text>
    </g>
  );
}
