/** True if every word of `wanted` is somewhere in `text`, whatever the case. */
export function matches(wanted: string, text: string): boolean {
  const lower = text.toLowerCase();
  return wanted
    .toLowerCase()
    .split(/\s+/)
    .every((word) => lower.includes(word));
}
