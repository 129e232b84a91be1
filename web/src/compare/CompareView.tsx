import "../styles/mission.css";
import "../styles/picture.css";
import "../styles/charts.css";
import "../styles/compare.css";

import { useEffect, useMemo, useRef, useState } from "react";

import type { ComparedFile, Comparison } from "../protocol/types";
import { request, useStudio } from "../store/store";
import { useCommand } from "../widgets/commands";
import { JoinedPicture } from "./Joined";
import { compare_lines } from "./lines";
import { kKinds, kSigns, kWords } from "./marks";

export interface Chosen {
  /** Of a project that is edited: what its texts are compared with. */
  with?: string;
  sides?: readonly { id: string; title: string }[];
  choose_side?(id: string): void;
  /** Begins with this file, if it differs. */
  file?: string | null;
  /** Grows with each edit. */
  revision?: number;
  close?(): void;
}

/** The side that a project always has. */
const kSaved = "saved";
const text_of = (error: unknown) => (error instanceof Error ? error.message : String(error));

/** Two states of files: which files differ, and each of them as one picture with a list of what it shows. */
export default function CompareView({ with: side, sides, choose_side, file: first, revision = 0, close }: Chosen) {
  const phase = useStudio((studio) => studio.phase);
  const [files, set_files] = useState<readonly ComparedFile[] | null>(null);
  const [names, set_names] = useState({ before: "", after: "" });
  const [file, set_file] = useState<string | null>(first ?? null);
  const [comparison, set_comparison] = useState<Comparison | null>(null);
  const [current, set_current] = useState(0);
  const [tree, set_tree] = useState(0);
  const [look, set_look] = useState<"picture" | "text">("picture");
  const [problem, set_problem] = useState<string | null>(null);
  const list = useRef<HTMLOListElement>(null);
  const given = useMemo(() => (side === undefined ? {} : { with: side }), [side]);

  useEffect(() => {
    if (phase !== "open") return;
    let gone = false;
    request("compare_files", given).then(
      (found) => {
        if (gone) return;
        set_problem(null);
        set_files(found.files);
        set_names({ before: found.before, after: found.after });
        set_file((before) => (found.files.some((one) => one.file === before) ? before : (found.files[0]?.file ?? null)));
      },
      (error: unknown) => {
        if (gone) return;
        set_files([]);
        set_comparison(null);
        set_problem(text_of(error));
      },
    );
    return () => {
      gone = true;
    };
  }, [phase, given, revision]);

  useEffect(() => {
    if (phase !== "open" || file === null || !files?.some((one) => one.file === file)) {
      set_comparison(null);
      return;
    }
    let gone = false;
    request("compare", { ...given, file }).then(
      (found) => {
        if (gone) return;
        set_comparison(found);
        set_current(0);
        set_tree(Math.max(found.differences[0]?.tree ?? 0, 0));
      },
      (error: unknown) => !gone && set_problem(text_of(error)),
    );
    return () => {
      gone = true;
    };
  }, [phase, given, file, files]);

  const differences = comparison?.differences ?? [];
  const go = (to: number) => {
    if (differences.length === 0) return;
    const next = (to + differences.length) % differences.length;
    set_current(next);
    const of = differences[next]!.tree;
    if (of >= 0) set_tree(of);
  };
  useEffect(() => {
    list.current?.querySelector("[aria-current=true]")?.scrollIntoView({ block: "nearest" });
  }, [current]);
  const change_file = (by: number) => {
    if (!files || files.length === 0) return;
    const at = files.findIndex((one) => one.file === file);
    set_file(files[(at + by + files.length) % files.length]!.file);
  };
  useCommand(
    { id: "compare.next", title: "The next difference", group: "Compare", keys: ["J"], run: () => go(current + 1) },
    { id: "compare.previous", title: "The difference before", group: "Compare", keys: ["K"], run: () => go(current - 1) },
    { id: "compare.next_file", title: "The next file", group: "Compare", keys: ["Shift+J"], run: () => change_file(1) },
    { id: "compare.previous_file", title: "The file before", group: "Compare", keys: ["Shift+K"], run: () => change_file(-1) },
    ...(close ? [{ id: "compare.close", title: "Back to the design", group: "Compare", keys: ["Escape"], run: close }] : []),
  );

  const drawn = comparison !== null && (comparison.chart !== null || (comparison.trees?.length ?? 0) > 0);
  const shown = comparison?.trees?.[tree] ?? null;
  const counts = kKinds.map((kind) => [kind, differences.filter((one) => one.kind === kind).length] as const);
  return (
    <main className="compare" data-testid="compare" data-differences={comparison ? differences.length : undefined} data-file={comparison?.file}>
      <div className="compare-bar" role="toolbar" aria-label="Compare">
        {sides && choose_side ? (
          <label className="compare-sides">
            Compared with{" "}
            <select className="field" aria-label="Compare with" value={side} onChange={(event) => choose_side(event.target.value)}>
              {sides.map(({ id, title }) => (
                <option key={id} value={id}>
                  {title}
                </option>
              ))}
            </select>
          </label>
        ) : (
          <span className="compare-names ellipsis" title={`${names.before} → ${names.after}`}>
            <strong>{last(names.before)}</strong> → <strong>{last(names.after)}</strong>
          </span>
        )}
        {sides && files?.length === 1 && <strong className="ellipsis">{file}</strong>}
        {drawn && (
          <ul className="compare-counts" aria-label="Differences">
            {counts.map(([kind, count]) => (
              <li key={kind} className={`badge ${kind}`} data-count={kind} title={`${count} ${kWords[kind]}`}>
                <span aria-hidden="true">{kSigns[kind]}</span> {count} {kWords[kind]}
              </li>
            ))}
          </ul>
        )}
        <span className="header-space" />
        {comparison?.trees && comparison.trees.length > 1 && look === "picture" && (
          <select className="field" aria-label="Tree" value={tree} onChange={(event) => set_tree(Number(event.target.value))}>
            {comparison.trees.map(({ id }, i) => (
              <option key={id} value={i}>
                {id}
              </option>
            ))}
          </select>
        )}
        {drawn && (
          <div className="tool-group" role="group" aria-label="View">
            {(["picture", "text"] as const).map((which) => (
              <button key={which} className="button small" aria-pressed={look === which} onClick={() => set_look(which)}>
                {which === "picture" ? "Picture" : "Text"}
              </button>
            ))}
          </div>
        )}
        {close && (
          <button className="button small" onClick={close} title="Back to the design (Esc)">
            Back to the design
          </button>
        )}
      </div>
      <div className="compare-body">
        {files && files.length > 1 && (
          <nav className="compare-files scroll" aria-label="Files that differ">
            <ul>
              {files.map((one) => (
                <li key={one.file}>
                  <button className="file-row" aria-current={one.file === file ? "true" : undefined} data-compared={one.file} onClick={() => set_file(one.file)}>
                    <span className={`compare-letter ${one.change}`} aria-label={one.change}>
                      {kSigns[one.change]}
                    </span>
                    <span className="ellipsis" title={one.file}>
                      {one.file}
                    </span>
                  </button>
                </li>
              ))}
            </ul>
          </nav>
        )}
        <div className="compare-middle">
          {problem !== null ? (
            <p className="empty nothing" role="status">
              {problem}
              {choose_side && side !== kSaved && (
                <button className="button small" onClick={() => choose_side(kSaved)}>
                  Compare with what is saved
                </button>
              )}
            </p>
          ) : files === null ? (
            <p className="empty">Comparing …</p>
          ) : files.length === 0 ? (
            <p className="empty" role="status" data-testid="compare-same">
              Nothing differs.
            </p>
          ) : comparison === null ? (
            <p className="empty">Comparing {file} …</p>
          ) : drawn && look === "picture" ? (
            <JoinedPicture key={`${comparison.file} ${tree}`} comparison={comparison} tree={comparison.chart ? null : shown} chart={comparison.chart} current={current} choose={go} />
          ) : (
            <TextView comparison={comparison} />
          )}
        </div>
        {drawn && (
          <aside className="compare-right" aria-label="Differences">
            <h2>
              {differences.length} {differences.length === 1 ? "difference" : "differences"}
              <span className="muted">
                <kbd className="kbd">J</kbd> <kbd className="kbd">K</kbd>
              </span>
            </h2>
            {differences.length === 0 && <p className="empty">They mean the same: only white space, comments or the order of attributes differ.</p>}
            <ol ref={list} className="scroll">
              {differences.map((one, i) => (
                <li key={i}>
                  <button className="compare-row" aria-current={i === current ? "true" : undefined} data-difference={one.kind} onClick={() => go(i)}>
                    <span className={`compare-letter ${one.kind}`} aria-label={kWords[one.kind]}>
                      {kSigns[one.kind]}
                    </span>
                    <span className="compare-said">
                      <strong>{one.path.split("/").at(-1)}</strong>
                      <span>{one.what}</span>
                      <span className="muted mono">{one.path}</span>
                    </span>
                  </button>
                </li>
              ))}
            </ol>
          </aside>
        )}
      </div>
    </main>
  );
}

const last = (path: string) => path.split("/").filter(Boolean).slice(-2).join("/") || path;

/** Lines shown around each difference. */
const kAround = 3;

/** Both texts in one column, what is the same left out. */
function TextView({ comparison }: { comparison: Comparison }) {
  const lines = useMemo(() => compare_lines(comparison.before ?? "", comparison.after ?? ""), [comparison]);
  const shown = useMemo(() => {
    const near = new Set<number>();
    lines.forEach(({ before, after }, i) => {
      if (before !== null && after !== null) return;
      for (let n = i - kAround; n <= i + kAround; n += 1) near.add(n);
    });
    return near;
  }, [lines]);
  return (
    <>
      {comparison.problem !== "" && <p className="compare-why muted">{comparison.problem}</p>}
      <pre className="compare-text mono scroll" tabIndex={0} data-testid="compare-text">
        {lines.map((line, i) => {
          if (!shown.has(i)) return i > 0 && shown.has(i - 1) ? <div key={i} className="gap">⋯</div> : null;
          const kind = line.before === null ? "added" : line.after === null ? "removed" : "same";
          return (
            <div key={i} className={kind}>
              <span className="muted">{line.before ?? ""}</span>
              <span className="muted">{line.after ?? ""}</span>
              <span>{kind === "added" ? "+" : kind === "removed" ? "−" : " "}</span>
              <span>{line.text}</span>
            </div>
          );
        })}
      </pre>
    </>
  );
}
