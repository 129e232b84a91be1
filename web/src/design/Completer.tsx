import { useEffect, useMemo, useRef, useState } from "react";

import type { PaletteNode } from "../protocol/types";
import { matches } from "../widgets/match";
import { by_name } from "../widgets/natural";
import { add_part, doc_of, useDesign } from "./design";

export interface Asked {
  title: string;
  x: number;
  y: number;
  /** Leaves and SubTrees may be picked too. */
  leaves: boolean;
  pick(id: string, subtree: boolean): void;
}

interface Entry {
  id: string;
  subtree: boolean;
  hint: string;
  /** A skill that is not there yet: its chart is made with it. */
  fresh?: boolean;
}

const kKinds: Record<PaletteNode["kind"], string> = { action: "action", condition: "condition", control: "control", decorator: "decorator", subtree: "SubTree" };

/** What a node is to be: the project's skills first; what has no such name yet becomes a new skill. */
export function Completer({ asked, close }: { asked: Asked; close(): void }) {
  const palette = useDesign((state) => state.palette);
  const doc = useDesign(doc_of);
  const [text, set_text] = useState("");
  const [at, set_at] = useState(0);
  const field = useRef<HTMLInputElement>(null);
  const place = useRef<HTMLDivElement>(null);
  useEffect(() => {
    const before = document.activeElement;
    field.current?.focus();
    return () => {
      if (before instanceof HTMLElement || before instanceof SVGElement) before.focus({ preventScroll: true });
    };
  }, []);

  const entries = useMemo<Entry[]>(() => {
    const nodes = palette.filter((node) => asked.leaves || node.children_max > 0);
    const sorted = [...nodes].sort((a, b) => Number(b.own) - Number(a.own) || by_name(a.id, b.id));
    const found: Entry[] = sorted.map((node) => ({ id: node.id, subtree: false, hint: node.own ? `skill, ${kKinds[node.kind]}` : kKinds[node.kind] }));
    if (asked.leaves) for (const tree of doc?.trees ?? []) found.push({ id: tree.id, subtree: true, hint: "SubTree" });
    const matching = found.filter((entry) => matches(text, entry.id));
    // What begins so comes first.
    const begins = (entry: Entry) => entry.id.toLowerCase().startsWith(text.toLowerCase());
    matching.sort((a, b) => Number(begins(b)) - Number(begins(a)));
    if (asked.leaves && /^[A-Za-z_]\w*$/.test(text) && !found.some(({ id }) => id === text)) matching.push({ id: text, subtree: false, hint: "new skill, with a chart", fresh: true });
    return matching;
  }, [palette, doc, text, asked]);

  const pick = (entry: Entry | undefined) => {
    if (!entry) return;
    close();
    if (!entry.fresh) asked.pick(entry.id, entry.subtree);
    else void add_part("skill", entry.id, false).then((made) => made && asked.pick(entry.id, false));
  };
  const key = (event: React.KeyboardEvent) => {
    event.stopPropagation();
    if (event.key === "Escape") close();
    else if (event.key === "ArrowDown") set_at((at + 1) % Math.max(entries.length, 1));
    else if (event.key === "ArrowUp") set_at((at + entries.length - 1) % Math.max(entries.length, 1));
    else if (event.key === "Enter") pick(entries[at]);
    else if (event.key === "Tab") close();
    else return;
    event.preventDefault();
  };
  const left = Math.max(4, Math.min(asked.x, window.innerWidth - 300));
  const top = Math.max(4, Math.min(asked.y, window.innerHeight - 320));
  useEffect(() => {
    place.current?.querySelector("[aria-selected=true]")?.scrollIntoView({ block: "nearest" });
  }, [at]);
  return (
    <>
      <div className="completer-ground" onPointerDown={close} />
      <div className="completer" style={{ left, top }} ref={place} onKeyDown={key} role="dialog" aria-label={asked.title} data-testid="completer">
        <label className="completer-title" htmlFor="completer-field">
          {asked.title}
        </label>
        <input
          id="completer-field"
          ref={field}
          className="field"
          role="combobox"
          aria-expanded="true"
          aria-controls="completer-list"
          aria-activedescendant={entries[at] ? `completer-${at}` : undefined}
          placeholder="Type a name"
          autoComplete="off"
          spellCheck={false}
          value={text}
          onChange={(event) => {
            set_text(event.target.value);
            set_at(0);
          }}
        />
        <ul id="completer-list" role="listbox" aria-label={asked.title}>
          {entries.slice(0, 60).map((entry, i) => (
            <li key={`${entry.hint} ${entry.id}`} id={`completer-${i}`} role="option" aria-selected={i === at} onPointerDown={(event) => event.preventDefault()} onClick={() => pick(entry)}>
              <span className={entry.fresh ? "fresh" : undefined}>{entry.fresh ? `+ ${entry.id}` : entry.id}</span>
              <span className="muted">{entry.hint}</span>
            </li>
          ))}
        </ul>
      </div>
    </>
  );
}
