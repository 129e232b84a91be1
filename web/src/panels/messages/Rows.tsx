import { useLayoutEffect, useRef, useState } from "react";

import { clock_text, duration_text } from "../../draw/format";
import { members, short_name, summary } from "./describe";
import { subject, type Row } from "./join";

export const kRow_px = 24;
/** Lines drawn above and below what can be seen. */
const kSpare = 6;
/** So near to an end, in pixels, the list counts as being there. */
const kNear_px = 4;

const kMarks: Record<Row["state"], { sign: string; says: string }> = {
  event: { sign: "•", says: "event" },
  open: { sign: "…", says: "no outcome yet" },
  done: { sign: "✓", says: "answered" },
  error: { sign: "✕", says: "error" },
  late: { sign: "◷", says: "too late" },
};

/** A change of a node's status: what matters is the node. */
const is_status = (row: Row) => row.first.name === "node.status";

function row_title(row: Row): string {
  if (is_status(row)) return row.first.source;
  return row.outcome === null ? short_name(row.first) : subject(row.first);
}

function Line({ row, top, chosen, later, pick }: { row: Row; top: number; chosen: boolean; later: boolean; pick(row: Row): void }) {
  const { first, outcome, state } = row;
  const mark = kMarks[state];
  const way = first.target ? `${first.source} → ${first.target}` : first.source;
  const data = summary(first) || (outcome === null ? "" : "()");
  const result = outcome ? ` → ${summary(outcome)}` : "";
  const notable = first.name === "monitor.violated" || first.name === "scenario.injection";
  return (
    <div
      role="option"
      aria-selected={chosen}
      id={`message-${row.sequence}`}
      className={`message ${state}${chosen ? " chosen" : ""}${later ? " later" : ""}${notable ? " notable" : ""}`}
      style={{ top, height: kRow_px }}
      onClick={() => pick(row)}
    >
      <time>{clock_text(first.time)}</time>
      <span className="message-mark" title={mark.says} aria-label={mark.says}>
        {mark.sign}
      </span>
      <span className="message-who ellipsis" title={way}>
        {is_status(row) ? "status" : first.source || "–"}
      </span>
      <span className="message-name ellipsis" title={[row_title(row), first.name, way].filter((line, i, all) => line !== "" && all.indexOf(line) === i).join("\n")}>
        {row_title(row)}
      </span>
      <span className="message-data ellipsis" title={data + result}>
        {data}
        {outcome && <span className="message-result">{result}</span>}
      </span>
      <span className="message-duration">{row.duration === null ? "" : duration_text(row.duration)}</span>
    </div>
  );
}

interface RowsProps {
  rows: readonly Row[];
  /** Stay at the newest. */
  follow: boolean;
  set_follow(follow: boolean): void;
  /** Sequence of the chosen row's observation. */
  chosen: number | null;
  /** What is later than this has not happened at the moment shown. */
  now: number;
  pick(row: Row): void;
  /** The person is at the first row and may want older ones. */
  at_top(): void;
  /** Brings the row of this sequence into view when it changes. */
  reveal: number | null;
}

/** Only the rows that can be seen are in the page. */
export function Rows({ rows, follow, set_follow, chosen, now, pick, at_top, reveal }: RowsProps) {
  const place = useRef<HTMLDivElement>(null);
  const [scroll, set_scroll] = useState({ top: 0, height: 400 });
  const first_sequence = useRef<number | null>(null);
  const own_scroll = useRef(false);

  const scroll_to = (top: number) => {
    const list = place.current;
    if (!list || Math.abs(list.scrollTop - top) < 1) return;
    own_scroll.current = true;
    list.scrollTop = top;
  };

  useLayoutEffect(() => {
    const list = place.current;
    if (!list) return;
    const observer = new ResizeObserver(() => set_scroll({ top: list.scrollTop, height: list.clientHeight }));
    observer.observe(list);
    return () => observer.disconnect();
  }, []);

  useLayoutEffect(() => {
    const list = place.current;
    if (!list) return;
    if (follow) {
      scroll_to(rows.length * kRow_px - list.clientHeight);
    } else if (first_sequence.current !== null) {
      // Older rows came in above: what the person reads stays where it is.
      const added = rows.findIndex((row) => row.sequence >= (first_sequence.current ?? 0));
      if (added > 0) scroll_to(list.scrollTop + added * kRow_px);
    }
    first_sequence.current = rows[0]?.sequence ?? null;
  }, [rows, follow, scroll.height]);

  useLayoutEffect(() => {
    const list = place.current;
    if (!list || reveal === null || follow) return;
    const index = rows.findLastIndex((row) => row.sequence <= reveal);
    if (index < 0) return;
    const top = index * kRow_px;
    if (top < list.scrollTop || top + kRow_px > list.scrollTop + list.clientHeight) scroll_to(top - list.clientHeight * 0.6);
  }, [reveal, rows, follow]);

  const from = Math.max(0, Math.floor(scroll.top / kRow_px) - kSpare);
  const to = Math.min(rows.length, Math.ceil((scroll.top + scroll.height) / kRow_px) + kSpare);
  const at = rows.findIndex((row) => row.sequence === chosen || row.outcome?.sequence === chosen);
  const move = (by: number) => {
    const next = rows[Math.min(Math.max(at < 0 ? rows.length - 1 : at + by, 0), rows.length - 1)];
    if (!next) return;
    pick(next);
    const top = rows.indexOf(next) * kRow_px;
    const list = place.current;
    if (list && (top < list.scrollTop || top + kRow_px > list.scrollTop + list.clientHeight)) scroll_to(top - list.clientHeight / 2);
  };

  return (
    <div
      ref={place}
      className="scroll messages"
      role="listbox"
      aria-label="Observations"
      aria-activedescendant={at >= from && at < to ? `message-${rows[at]?.sequence}` : undefined}
      tabIndex={0}
      onScroll={(event) => {
        const list = event.currentTarget;
        set_scroll({ top: list.scrollTop, height: list.clientHeight });
        if (own_scroll.current) {
          own_scroll.current = false;
          return;
        }
        const at_end = list.scrollTop + list.clientHeight >= rows.length * kRow_px - kNear_px;
        if (at_end !== follow) set_follow(at_end);
        if (list.scrollTop <= kNear_px) at_top();
      }}
      onKeyDown={(event) => {
        const page = Math.max(1, Math.floor(scroll.height / kRow_px) - 1);
        const steps: Record<string, number> = { ArrowDown: 1, ArrowUp: -1, PageDown: page, PageUp: -page };
        const by = steps[event.key];
        if (event.key === "End") set_follow(true);
        else if (by !== undefined) move(by);
        else return;
        event.preventDefault();
      }}
    >
      <div className="messages-all" style={{ height: rows.length * kRow_px }}>
        {rows.slice(from, to).map((row, i) => (
          <Line key={row.sequence} row={row} top={(from + i) * kRow_px} chosen={from + i === at} later={row.sequence > now} pick={pick} />
        ))}
      </div>
    </div>
  );
}

/** Everything about one row, values decoded. */
export function Details({ row }: { row: Row }) {
  const { first, outcome } = row;
  const asked = members(first.data);
  const answered = members(outcome?.data ?? null);
  const parts: [string, unknown][] = [];
  if (first.kind === "request") {
    parts.push(["arguments", asked["args"] ?? asked["inputs"] ?? {}]);
    if (outcome) parts.push(outcome.kind === "reply" ? ["result", answered["result"] ?? without(answered, "args")] : ["error", without(answered, "args")]);
  } else {
    parts.push(["data", first.data]);
  }
  return (
    <dl className="message-details">
      <div>
        <dt>way</dt>
        <dd className="mono">
          {first.source || "–"}
          {first.target ? ` → ${first.target}` : ""}
        </dd>
      </div>
      <div>
        <dt>order</dt>
        <dd className="mono">
          {first.sequence}
          {outcome ? ` … ${outcome.sequence}` : ""} · tick {first.tick}
          {row.duration === null ? "" : ` · ${duration_text(row.duration)}`}
          {first.call === 0 ? "" : ` · call ${first.call}`}
        </dd>
      </div>
      {parts.map(([name, value]) => (
        <div key={name}>
          <dt>{name}</dt>
          <dd>
            <pre className="mono">{JSON.stringify(value, null, 2)}</pre>
          </dd>
        </div>
      ))}
    </dl>
  );
}

function without(data: { [key: string]: unknown }, key: string): { [key: string]: unknown } {
  const { [key]: _, ...rest } = data;
  return rest;
}
