/** Indices of `TreeState.status` and `TreeState.last`. */
export const kStatuses = ["IDLE", "RUNNING", "SUCCESS", "FAILURE", "SKIPPED", "HALTING"] as const;

/** Of a node that is IDLE, the status to show for its last one: who was RUNNING was halted. */
export const last_shown = (last: number): number => (kStatuses[last] === "RUNNING" ? kStatuses.indexOf("HALTING") : last);
/** The same in words. */
export const last_word = (last: number): string => (kStatuses[last_shown(last)] === "HALTING" ? "halted" : (kStatuses[last] ?? "").toLowerCase());
