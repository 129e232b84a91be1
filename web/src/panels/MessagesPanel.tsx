import { useCallback, useEffect, useMemo, useRef, useState } from "react";

import type { Observation } from "../protocol/types";
import { useCommand } from "../widgets/commands";
import { Icon } from "../widgets/Icon";
import { go_to_panel } from "../widgets/layout";
import { request, select, useStudio } from "../store/store";
import { seek, stop_replay } from "../store/time_travel";
import { choices, filter_rows, kNoFilter, kShows, server_filter, type MessageFilter, type Show } from "./messages/filter";
import { join, type Row } from "./messages/join";
import { Details, Rows } from "./messages/Rows";
import { covers, extend, kEmptyWindow, kPage, prepend, type Window } from "./messages/window";

const kShowTitles: Record<Show, string> = {
  default: "No ticks",
  all: "All",
  calls: "Calls",
  ticks: "Ticks",
  statuses: "Statuses",
  events: "Events",
  errors: "Errors",
};
/** With fewer rows than this there is nothing to scroll; then older ones are offered, or asked for. */
const kRowsFew = 30;
/** Pages asked for in one go while none of their observations passes the filter. */
const kPagesMax = 8;

/** The part of the stream around the moment shown, grown where the person reads. */
function usePast(active: boolean, filter: MessageFilter): { window: Window; grow(): void } {
  const [window, set_window] = useState<Window>(kEmptyWindow);
  const sequence = useStudio((studio) => studio.state?.sequence ?? 0);
  // Another run, or the same that a shadow run shows anew.
  const index = useStudio((studio) => studio.index);
  const busy = useRef(false);
  const latest = useRef({ window, filter, sequence, index });
  latest.current = { window, filter, sequence, index };
  const narrow = JSON.stringify(server_filter(filter) ?? null);

  useEffect(() => {
    latest.current.window = kEmptyWindow;
    set_window(kEmptyWindow);
  }, [index, narrow, active]);

  const work = useCallback(async function again(what: "cover" | "older"): Promise<void> {
    if (busy.current) return;
    busy.current = true;
    const begun = latest.current.index;
    const put = (next: Window) => {
      latest.current.window = next;
      set_window(next);
    };
    const ask = (where: { before?: number; after?: number }) => {
      const only = server_filter(latest.current.filter);
      return request("messages", { limit: kPage, ...where, ...(only ? { filter: only } : {}) });
    };
    try {
      if (what === "older") {
        for (let page = 0; page < kPagesMax; page++) {
          const { window: now, index: of } = latest.current;
          const first = now.observations[0];
          if (!first || !now.older) break;
          const answer = await ask({ before: first.sequence });
          if (of !== latest.current.index) break;
          put(prepend(latest.current.window, answer.messages, answer.more && answer.messages.length > 0));
          if (filter_rows(join(answer.messages), latest.current.filter).length > 0) break;
        }
        return;
      }
      // The moment may move on while an answer is on its way.
      for (let page = 0; page < kPagesMax && !covers(latest.current.window, latest.current.sequence); page++) {
        const { window: now, sequence: wanted, index: of } = latest.current;
        // What another run has said since is not joined with this.
        const put_of = (next: Window) => of === latest.current.index && put(next);
        const last = now.observations.at(-1);
        if (last && wanted > last.sequence && wanted - last.sequence < kPage) {
          const answer = await ask({ after: last.sequence });
          put_of(extend(latest.current.window, answer.messages, answer.more));
        } else {
          const before = await ask({ before: wanted + 1 });
          const after = await ask({ after: wanted });
          put_of({ observations: [...before.messages, ...after.messages], older: before.more, newer: after.more });
        }
      }
    } catch {
      // Without a connection the list stays as it is; the strip above says so.
    } finally {
      busy.current = false;
    }
    // Of the run that came meanwhile nothing has been asked for.
    if (begun !== latest.current.index) await again("cover");
  }, []);

  useEffect(() => {
    if (active) void work("cover");
  }, [active, sequence, index, narrow, work]);

  return { window, grow: useCallback(() => void work("older"), [work]) };
}

export function MessagesPanel() {
  const live = useStudio((studio) => studio.state?.live ?? true);
  const recording = useStudio((studio) => studio.hello?.mode === "recording");
  const newest = useStudio((studio) => studio.messages);
  const missed = useStudio((studio) => studio.missed);
  const now = useStudio((studio) => studio.state?.sequence ?? 0);
  const chosen = useStudio((studio) => studio.selection.sequence);
  const index = useStudio((studio) => studio.index);
  const [filter, set_filter] = useState<MessageFilter>(kNoFilter);
  const [follow, set_follow] = useState(true);
  const [reading, set_reading] = useState<Row | null>(null);
  const text_field = useRef<HTMLInputElement>(null);

  const following = live && follow && !recording;
  const past = usePast(!following, filter);
  useEffect(() => {
    if (live) set_follow(true);
  }, [live]);

  const observations: readonly Observation[] = following ? newest : past.window.observations;
  const rows = useMemo(() => filter_rows(join(observations), filter), [observations, filter]);
  const { older } = past.window;
  const { grow } = past;
  useEffect(() => {
    if (!following && older && rows.length < kRowsFew) grow();
  }, [following, older, rows.length, grow]);
  const lists = useMemo(() => (index ? choices(index.model) : { services: [], leaves: [] }), [index]);
  const open = reading === null ? null : (rows.find((row) => row.sequence === reading.sequence) ?? reading);

  const pick = useCallback((row: Row) => {
    stop_replay();
    set_follow(false);
    set_reading(row);
    select({ sequence: row.sequence });
    seek(row.first.time);
  }, []);

  useCommand({
    id: "messages.find",
    title: "Search in the messages",
    group: "Messages",
    keys: ["M"],
    run: () => {
      go_to_panel("messages");
      requestAnimationFrame(() => text_field.current?.focus());
    },
  });

  return (
    <div className="messages-panel">
      <div className="messages-filter" role="search" aria-label="Filter the messages">
        <input
          ref={text_field}
          className="field"
          type="search"
          placeholder="Search"
          aria-label="Text"
          value={filter.text}
          onChange={(event) => set_filter({ ...filter, text: event.target.value })}
        />
        <select className="field" aria-label="Kind" value={filter.show} onChange={(event) => set_filter({ ...filter, show: event.target.value as Show })}>
          {kShows.map((show) => (
            <option key={show} value={show}>
              {kShowTitles[show]}
            </option>
          ))}
        </select>
        <select className="field" aria-label="Service" value={filter.service} onChange={(event) => set_filter({ ...filter, service: event.target.value })}>
          <option value="">Services</option>
          {lists.services.map((service) => (
            <option key={service}>{service}</option>
          ))}
        </select>
        <select className="field" aria-label="Leaf" value={filter.leaf} onChange={(event) => set_filter({ ...filter, leaf: event.target.value })}>
          <option value="">Leaves</option>
          {lists.leaves.map((leaf) => (
            <option key={leaf}>{leaf}</option>
          ))}
        </select>
        <span className="muted number messages-count">
          {rows.length}
          {missed > 0 && following ? ` · ${missed} left out` : ""}
        </span>
        {live && !recording && (
          <button className="icon-button" aria-pressed={following} onClick={() => set_follow(!follow)} aria-label="Follow the newest" title="Follow the newest">
            <Icon name="follow" />
          </button>
        )}
      </div>
      <div className="messages-list">
        <Rows
          rows={rows}
          follow={following}
          set_follow={set_follow}
          chosen={chosen}
          now={live && !recording ? Infinity : now}
          pick={pick}
          at_top={past.grow}
          reveal={live && !recording ? null : now}
        />
        {following && rows.length < kRowsFew && (
          <button className="button small messages-back" onClick={() => set_follow(false)}>
            Look further back
          </button>
        )}
        {rows.length === 0 && <p className="empty messages-none">{observations.length === 0 ? "No observations yet." : "None of the observations loaded passes the filter."}</p>}
      </div>
      {open && (
        <section className="message-open" aria-label="Chosen message">
          <header>
            <strong className="mono ellipsis">{open.first.name}</strong>
            <button className="icon-button" onClick={() => set_reading(null)} aria-label="Close">
              <Icon name="close" />
            </button>
          </header>
          <Details row={open} />
        </section>
      )}
    </div>
  );
}
