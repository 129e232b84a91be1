/** Indices of `TreeState.status` and `TreeState.last`. */
export const kStatuses = ["IDLE", "RUNNING", "SUCCESS", "FAILURE", "SKIPPED", "HALTING"] as const;
