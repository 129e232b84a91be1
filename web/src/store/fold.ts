import type { Delta, State } from "../protocol/types";

/**
 * The state after `delta`; what did not change is shared with `state`, so that panels can compare by identity.
 * Deltas stop while the page looks at the past, but for how far the recording goes by now and how the run stands.
 */
export function fold(state: State, delta: Delta): State {
  const { messages: _messages, missed: _missed, charts, monitors, robots, ...plain } = delta;
  const next: State = { ...state, ...plain };
  if (charts) next.charts = patch(state.charts, charts);
  if (monitors) next.monitors = patch(state.monitors, monitors);
  if (robots) next.robots = patch(state.robots, robots);
  return next;
}

function patch<Entry>(entries: Record<string, Entry>, changes: Record<string, Entry | null>): Record<string, Entry> {
  const next = { ...entries };
  for (const [key, entry] of Object.entries(changes)) {
    if (entry === null) delete next[key];
    else next[key] = entry;
  }
  return next;
}

/** The newest at the end; the oldest are dropped beyond `limit`. */
export function append<Entry>(list: readonly Entry[], more: readonly Entry[], limit: number): readonly Entry[] {
  if (more.length === 0) return list;
  const joined = list.concat(more);
  return joined.length > limit ? joined.slice(joined.length - limit) : joined;
}
