import { kStatuses, last_shown } from "../../protocol/statuses";

/** The badge of a status around the origin, as `sentree graph` draws it: signs are drawn, because fonts differ. */
export function StatusSign({ status, hollow = false }: { status: number; hollow?: boolean }) {
  if (status === 0) return null;
  return (
    <g className={hollow ? "sign hollow" : "sign"}>
      <circle className="badge-disc" r={8} />
      {kSigns[status]!.map(({ d, solid }) => (
        <path key={d} className={solid ? "badge-solid" : "badge-line"} d={d} />
      ))}
    </g>
  );
}

/** What a node that is idle was last. */
export function LastSign({ last, transform }: { last: number; transform: string }) {
  const status = last_shown(last);
  return (
    <g transform={transform} className={`last ${(kStatuses[status] ?? "").toLowerCase()}`}>
      <StatusSign status={status} hollow />
    </g>
  );
}

const kSigns: { d: string; solid?: boolean }[][] = [
  [],
  [{ d: "M-2.5 -4L4.2 0L-2.5 4Z", solid: true }],
  [{ d: "M-3.8 .3L-1.1 3.1L3.9 -2.9" }],
  [{ d: "M-3 -3L3 3" }, { d: "M3 -3L-3 3" }],
  [{ d: "M-3.5 -3L-.5 0L-3.5 3" }, { d: "M.8 -3L3.8 0L.8 3" }],
  [{ d: "M-3 -3L3 -3L3 3L-3 3Z", solid: true }],
];
