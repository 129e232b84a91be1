/** "pending: waits for …" in its first word and the rest; a standing without a colon has no first word. */
export function split_standing(standing: string): { word: string; rest: string } {
  const match = /^(pending|holds so far)(?::\s*(.*))?$/s.exec(standing);
  return match ? { word: match[1] ?? "", rest: match[2] ?? "" } : { word: "", rest: standing };
}
