import "../styles/design.css";
import "../styles/design_chart.css";
import "../styles/mission.css";
import "../styles/picture.css";
import "../styles/charts.css";

import { lazy, Suspense, useEffect, useRef, useState } from "react";

import { TimelinePanel } from "../panels/TimelinePanel";
import type { OutlineTree, PaletteNode, Size } from "../protocol/types";
import { ask, request, useStudio } from "../store/store";
import { useCommand } from "../widgets/commands";
import { Icon } from "../widgets/Icon";
import { Splitter } from "../widgets/Splitter";
import { useWindow } from "../widgets/layout";
import { ChartForm } from "./ChartForm";
import { ChartView } from "./ChartView";
import { Completer, type Asked } from "./Completer";
import { begin_project, broken, doc_of, go_to, held, node_of, open_file, redo, resolve, save_all, set_look, show_below, start_design, toggle_autosave, tree_of, undo, useDesign, kNoFiles, type Doc, type Look } from "./design";
import { Inspector } from "./Inspector";
import { matches } from "../widgets/match";
import { PastPanel } from "./PastPanel";
import { ReachedBelow } from "./ReachedBelow";
import { useMode } from "./mode";
import { line_start } from "./places";
import { Picture, type PictureHandle } from "./Picture";
import { useProblems } from "./problems";
import { ProjectTree } from "./ProjectTree";
import { RequirementBlocks } from "./RequirementBlocks";
import { is_below, kPictureAbove } from "./stacking";
import { set_share, useShares } from "./shares";
import { simulate, useSimulation } from "./simulate";
import { SimulatePanel } from "./SimulatePanel";
import { Happened, Problems, ShadowStrip, useTimeline } from "./Strip";
import { useRoom } from "../widgets/use_room";

const CodeEditor = lazy(() => import("./CodeEditor"));
const WorldView = lazy(() => import("./WorldView"));
const ScenarioView = lazy(() => import("./ScenarioView"));
const ScenarioForm = lazy(() => import("./ScenarioView").then((module) => ({ default: module.ScenarioForm })));
const PlacesForm = lazy(() => import("./PlacesForm"));
const ProjectForm = lazy(() => import("./ProjectForm"));
const CompareView = lazy(() => import("../compare/CompareView"));

/** The project, its texts and their pictures. */
export default function DesignView() {
  const phase = useStudio((studio) => studio.phase);
  const boot = useStudio((studio) => studio.hello?.boot);
  const known = useDesign((state) => state.summary !== null);
  const may = useStudio((studio) => studio.may_steer);
  useEffect(() => {
    if (phase !== "open" || boot === undefined || !may) return;
    let stop: (() => void) | null = null;
    let gone = false;
    void start_design().then(
      (stopped) => {
        if (gone) stopped();
        else stop = stopped;
      },
      // The next connection begins anew, or may not.
      () => undefined,
    );
    return () => {
      gone = true;
      stop?.();
    };
  }, [phase, boot, may]);
  useCommand(
    { id: "design.undo", title: "Undo", group: "Design", keys: ["Ctrl+Z"], run: () => void undo() },
    { id: "design.redo", title: "Do again what was undone", group: "Design", keys: ["Ctrl+Shift+Z", "Ctrl+Y"], run: () => void redo() },
    { id: "design.save", title: "Save all files", group: "Design", keys: ["Ctrl+S"], run: () => void save_all() },
    { id: "design.autosave", title: "Save each edit by itself, or only with Ctrl+S", group: "Design", run: toggle_autosave },
    { id: "design.compare", title: "Compare with the last commit, or with what a recording ran", group: "Design", run: () => useDesign.setState({ comparing: kCommit.id }) },
    { id: "design.simulate", title: "Run what is open by hand, or end that", group: "Design", run: () => simulate(!useSimulation.getState().on) },
    { id: "design.problems", title: "Show the problems, or hide them", group: "Design", run: () => show_below("problems") },
    { id: "design.reached", title: "Show what is never reached, or hide it", group: "Design", run: () => show_below("reached") },
    ...(["both", "picture", "text"] as const).map((look) => ({ id: `design.look.${look}`, title: kLooks[look].title, group: "Design", run: () => set_look(look) })),
  );
  const files = useDesign((state) => state.summary?.files ?? kNoFiles);
  useCommand(...files.slice(0, kFilesOffered).map(({ file }) => ({ id: `design.file.${file}`, title: `Open ${file}`, group: "File", run: () => void open_file(file) })));
  const comparing = useDesign((state) => state.comparing);
  if (!may) return <OnlyLooks />;
  if (!known) return <p className="empty waiting">Opening the project …</p>;
  return comparing === null ? <Bench /> : <Comparing side={comparing} />;
}

/** Without the token of the printed address. */
function OnlyLooks() {
  return (
    <main className="empty nothing" data-testid="only-looks">
      <p role="status">This page may only look. The project is edited with the address that the program has printed, the one with #token=… at its end.</p>
      <button className="button primary" onClick={() => useMode.setState({ mode: "run" })}>
        Look at its run
      </button>
    </main>
  );
}

/** In the palette. */
const kFilesOffered = 500;
const kCommit = { id: "HEAD", title: "the last commit (HEAD)" };

/** The texts as they are edited, and what they were. */
function Comparing({ side }: { side: string }) {
  const file = useDesign((state) => state.file);
  const revision = useDesign((state) => state.summary?.files.reduce((sum, one) => sum + one.version, 0) ?? 0);
  const [sides, set_sides] = useState<readonly { id: string; title: string }[]>([kCommit]);
  useEffect(() => {
    void ask("compare_sides", {}).then((found) => found && set_sides(found.sides));
  }, []);
  return (
    <Suspense fallback={<p className="empty waiting">Comparing …</p>}>
      <CompareView with={side} sides={sides} choose_side={(id) => useDesign.setState({ comparing: id })} file={file} revision={revision} close={() => useDesign.setState({ comparing: null })} />
    </Suspense>
  );
}

const kLooks: Record<Look, { label: string; title: string }> = {
  picture: { label: "Picture", title: "Show the picture alone" },
  both: { label: "Both", title: "Show picture and text side by side" },
  text: { label: "Text", title: "Show the text alone" },
};

function Bench() {
  const { narrow } = useWindow();
  const [asked, set_asked] = useState<Asked | null>(null);
  const picture = useRef<PictureHandle>(null);
  const below = useDesign((state) => state.below);
  const is_tree = useDesign((state) => (doc_of(state)?.shown_trees ?? null) !== null);
  const is_chosen = useDesign((state) => node_of(state) !== null);
  const is_chart = useDesign((state) => (doc_of(state)?.shown_chart ?? null) !== null);
  const is_requirement = useDesign(({ file }) => file?.endsWith(".req") ?? false);
  const is_scenario = useDesign((state) => doc_of(state)?.kind === "scenario");
  const is_world = useDesign((state) => doc_of(state)?.kind === "world");
  const empty = useDesign((state) => state.summary?.files.length === 0);
  const simulating = useSimulation(({ on }) => on) && (is_tree || is_chart);
  const timeline = useTimeline();
  const side = is_tree ? "Node" : is_chart ? "State" : is_requirement ? "Last runs" : is_scenario ? "Scenario" : is_world ? "Places" : null;
  const form = simulating ? <SimulatePanel /> : is_tree ? <Inspector /> : is_chart ? <ChartForm /> : is_requirement ? <PastPanel /> : is_scenario ? <ScenarioForm /> : is_world ? <PlacesForm /> : null;
  return (
    <main className="design" data-narrow={narrow}>
      <div className="design-left">
        <ProjectTree />
        {is_tree && !(narrow && (is_chosen || simulating)) && <PaletteList picture={picture} />}
        {narrow && (!is_tree || is_chosen || simulating) && <Suspense>{form}</Suspense>}
      </div>
      <div className="design-middle">
        <DesignBar />
        <Refused />
        <Standing />
        <Happened />
        <Conflict />
        {empty ? <Nothing /> : <Views picture={picture} ask={set_asked} />}
        {below !== null && <div className={`below-frame ${below}`}>{below === "problems" ? <Problems /> : <ReachedBelow />}</div>}
      </div>
      {side && !narrow && (
        <aside className="design-right" aria-label={side}>
          <Suspense>{form}</Suspense>
        </aside>
      )}
      <div className="design-foot">
        <ShadowStrip />
        {timeline && (
          <div className="design-timeline" id="panel-timeline">
            <TimelinePanel />
          </div>
        )}
      </div>
      {asked && <Completer asked={asked} close={() => set_asked(null)} />}
    </main>
  );
}

/** What is offered in a folder without a project. */
function Nothing() {
  return (
    <div className="empty nothing">
      <p>This folder is empty.</p>
      <button className="button primary" onClick={() => void begin_project()}>
        Begin a project that runs
      </button>
      <p className="muted">A mission of three nodes, two skills, a requirement, two scenarios and a room: what sentree init writes. Then + at the left adds parts.</p>
    </div>
  );
}

function DesignBar() {
  const summary = useDesign((state) => state.summary);
  const { undo: to_undo, undo_count, redo: to_redo } = useDesign((state) => state.steps);
  const file = useDesign((state) => state.file);
  const look = useDesign((state) => state.look);
  const autosave = useDesign((state) => state.autosave);
  const below = useDesign((state) => state.below);
  const is_held = useDesign(held);
  const has_picture = useDesign((state) => {
    const doc = doc_of(state);
    return doc !== null && has_picture_of(doc);
  });
  const can_run = useDesign((state) => (doc_of(state)?.shown_trees ?? null) !== null || (doc_of(state)?.shown_chart ?? null) !== null);
  const simulating = useSimulation(({ on }) => on);
  const trees = useDesign((state) => doc_of(state)?.shown_trees ?? null);
  const shown = useDesign((state) => tree_of(state)?.id);
  // Not of the files: what is missing is none of them.
  const problems = useProblems();
  const found = (of: string) => problems.filter(({ severity }) => severity === of).length;
  const errors = found("error");
  const warnings = found("warning");
  const dirty = summary?.files.filter((each) => each.dirty).length ?? 0;
  return (
    <div className="design-bar" role="toolbar" aria-label="Design">
      <strong className="ellipsis" title={file ?? ""}>
        {file ?? "No file"}
      </strong>
      {trees && trees.length > 1 && (
        <select className="field" aria-label="Tree" value={shown} onChange={(event) => useDesign.setState({ tree: event.target.value, chosen: null, also: [] })}>
          {trees.map(({ id }) => (
            <option key={id} value={id}>
              {id}
            </option>
          ))}
        </select>
      )}
      <span className="header-space" />
      <button className={`button small problems-button${errors > 0 ? " error" : ""}`} aria-pressed={below === "problems"} data-testid="problems" onClick={() => show_below("problems")}>
        {errors > 0 ? `✗ ${errors} ${errors === 1 ? "error" : "errors"}` : warnings > 0 ? `! ${warnings} ${warnings === 1 ? "warning" : "warnings"}` : summary?.checked ? "✓ no problems" : "checking …"}
      </button>
      <button className="button small" aria-pressed={below === "reached"} title="What of the project no scenario reaches" data-testid="reached-button" onClick={() => show_below("reached")}>
        Reached
      </button>
      <button className="button small" disabled={to_undo === null || is_held !== null} title={is_held ?? (to_undo === null ? "Nothing to undo" : `Undo: ${to_undo} (Ctrl+Z)`)} data-testid="undo" data-name={to_undo ?? ""} onClick={() => void undo()}>
        Undo{undo_count > 0 ? ` ${undo_count}` : ""}
      </button>
      <button className="button small" disabled={to_redo === null || is_held !== null} title={is_held ?? (to_redo === null ? "Nothing to do again" : `Do again: ${to_redo} (Ctrl+Shift+Z)`)} data-testid="redo" onClick={() => void redo()}>
        Redo
      </button>
      <button className={`button small${dirty > 0 ? " primary" : ""}`} disabled={dirty === 0} title="Save all files (Ctrl+S)" data-testid="save" onClick={() => void save_all()}>
        {dirty > 0 ? `Save ${dirty}` : "Saved"}
      </button>
      <button className="button small" aria-pressed={autosave} title="Save each edit by itself" data-testid="autosave" onClick={toggle_autosave}>
        Autosave
      </button>
      {can_run && (
        <button className="button small" aria-pressed={simulating} title="Run what is open by hand" data-testid="simulate-button" onClick={() => simulate(!simulating)}>
          Simulate
        </button>
      )}
      <button className="button small" title="Compare with what is saved, the last commit, or what a recording ran" data-testid="compare-button" onClick={() => useDesign.setState({ comparing: kCommit.id })}>
        Compare
      </button>
      {has_picture && (
        <div className="tool-group" role="group" aria-label="View">
          {(["picture", "both", "text"] as const).map((which) => (
            <button key={which} className="button small" aria-pressed={look === which} title={kLooks[which].title} onClick={() => set_look(which)}>
              {kLooks[which].label}
            </button>
          ))}
        </div>
      )}
    </div>
  );
}

/** Why what was tried last is not done; over what is below, so that nothing moves. */
function Refused() {
  const refused = useDesign((state) => state.refused);
  return (
    <div className="refused-frame" role="status">
      {refused !== null && (
        <p className="refused">
          <Icon name="warning" />
          <span data-testid="refused">{refused}</span>
          <button className="icon-button small" aria-label="Put away why it was refused" title="Put away" onClick={() => useDesign.setState({ refused: null })}>
            <Icon name="close" />
          </button>
        </p>
      )}
    </div>
  );
}

const kAskedAgain_ms = 2000;

/** What stands in the way of all edits, or of keeping them. */
function Standing() {
  const held_by = useDesign((state) => state.summary?.held_by ?? "");
  const journal = useDesign((state) => state.summary?.journal ?? "");
  const is_held = held_by !== "";
  // Whoever asks for the project takes it over, if it is free.
  useEffect(() => {
    if (!is_held) return;
    const timer = window.setInterval(() => void request("design", {}).catch(() => undefined), kAskedAgain_ms);
    return () => window.clearInterval(timer);
  }, [is_held]);
  if (!is_held && journal === "") return null;
  return (
    <div className="conflict" role="alert" data-testid="standing">
      <p>
        <Icon name="warning" />
        {is_held ? `${held_by} edits this project: here it is only shown. Once that program has ended, it is edited here, with what it has left.` : `What is not saved would be lost if the program ended now: its journal in .sentree ${journal}. Save, or make room; the next edit tries again.`}
      </p>
    </div>
  );
}

/** Two changes of the same lines: one of them must be chosen. */
function Conflict() {
  const doc = useDesign(doc_of);
  if (doc && doc.unreadable !== "") return <Unreadable doc={doc} />;
  if (!doc || doc.theirs === null) return null;
  return (
    <div className="conflict" role="alert" data-testid="conflict">
      <p>
        <Icon name="warning" />
        <strong>{doc.file} was changed on disk where it is edited here.</strong> Neither is lost; choose one.
      </p>
      <div className="conflict-texts">
        <section aria-label="Edited here">
          <h3>
            Edited here
            <button className="button small" onClick={() => void resolve(doc.file, "mine")}>
              Keep this
            </button>
          </h3>
          <Differing text={doc.places.shown} other={doc.theirs.replace(/\r\n?/g, "\n")} />
        </section>
        <section aria-label="On disk">
          <h3>
            On disk
            <button className="button small" onClick={() => void resolve(doc.file, "theirs")}>
              Take this
            </button>
          </h3>
          <Differing text={doc.theirs.replace(/\r\n?/g, "\n")} other={doc.places.shown} />
        </section>
      </div>
    </div>
  );
}

/** What another has put in the file's place is no text; it stays until one says otherwise. */
function Unreadable({ doc: { file, unreadable } }: { doc: Doc }) {
  const can_be_replaced = !/^it (?:is a folder|is a link|cannot be looked at)/.test(unreadable);
  return (
    <div className="conflict" role="alert" data-testid="conflict">
      <p>
        <Icon name="warning" />
        <strong>{file} on disk cannot be read:</strong> {unreadable}. It stays as it is there, and the text stays here: mend it on disk{can_be_replaced ? ", or" : ""}
        {can_be_replaced && (
          <button className="button small" onClick={() => void resolve(file, "mine")}>
            Write this text over it
          </button>
        )}
      </p>
    </div>
  );
}

/** The lines that the other text does not have, with two around them. */
function Differing({ text, other }: { text: string; other: string }) {
  const lines = text.split("\n");
  const others = new Set(other.split("\n"));
  const differs = lines.map((line) => !others.has(line));
  const near = (i: number) => differs.slice(Math.max(0, i - 2), i + 3).some(Boolean);
  const indent = Math.min(...lines.flatMap((line, i) => (near(i) && line.trim() !== "" ? [line.search(/\S/)] : [])));
  return (
    <pre className="mono scroll" tabIndex={0}>
      {lines.map((line, i) => near(i) && <div key={i} className={differs[i] ? "differs" : undefined}>{`${i + 1}  ${line.slice(indent)}`}</div>)}
    </pre>
  );
}

function Views({ picture, ask }: { picture: React.RefObject<PictureHandle | null>; ask(asked: Asked): void }) {
  const look = useDesign((state) => state.look);
  const doc = useDesign(doc_of);
  const tree = useDesign(tree_of);
  const why_dim = useDesign(broken);
  const { narrow } = useWindow();
  const shares = useShares();
  const frame = useRef<HTMLDivElement>(null);
  const room = useRoom(frame, doc !== null);
  const size = tree?.layout.size ?? doc?.shown_chart?.layout.size ?? null;
  const was = useRef<{ file: string; room: Size; below: boolean } | null>(null);
  let below = false;
  if (doc && size && room) {
    // In another window, or of another file, it is decided anew.
    const kept = was.current?.file === doc.file && was.current.room.width === room.width && was.current.room.height === room.height ? was.current.below : null;
    below = is_below(size, room, kept);
    was.current = { file: doc.file, room, below };
  }
  const stacked = narrow || below;
  if (!doc) return <Gone />;
  // Not before it is known how much room there is: it is laid out once.
  const drawn = !has_picture_of(doc) || room === null ? null : tree ? (
    <Picture key={doc.file} tree={tree} handle={picture} ask={ask} />
  ) : doc.shown_chart ? (
    <ChartView key={doc.file} chart={doc.shown_chart} file={doc.file} />
  ) : doc.shown_requirements ? (
    <RequirementBlocks key={doc.file} doc={doc} requirements={doc.shown_requirements} />
  ) : (
    <Suspense fallback={<p className="empty">Loading the editor …</p>}>
      {doc.kind === "world" ? <WorldView key={doc.file} doc={doc} /> : doc.kind === "scenario" ? <ScenarioView key={doc.file} doc={doc} /> : <ProjectForm key={doc.file} doc={doc} />}
    </Suspense>
  );
  // Over a picture there is room; over a form it would lie over its first rows.
  const over = tree !== null || doc.shown_chart !== null || doc.kind === "world";
  const go_to_error = () => {
    if (look === "picture") set_look("both");
    go_to(doc.places.byte(line_start(doc.places.shown, doc.error?.line ?? 1)), true);
  };
  const with_picture = drawn !== null && look !== "text";
  const with_text = !has_picture_of(doc) || look !== "picture";
  const which = stacked ? "above" : "beside";
  const fitting = !stacked ? 0.5 : size && room ? Math.min(kPictureAbove, (size.height + kGround_px) / Math.max(room.height, 1)) : 0.5;
  const share = shares[which] ?? fitting;
  return (
    <div ref={frame} className={`design-views${stacked ? " stacked" : ""}`}>
      {with_picture && (
        <div className={`design-view${over ? "" : " form"}`} data-testid="picture-view" style={with_text ? { flex: `0 0 ${100 * share}%` } : undefined}>
          {why_dim && (
            <p className={`dim-why${over ? " over" : ""}`} role="status" data-testid="broken">
              {why_dim}
              {doc.error && (
                <button className="button small" onClick={go_to_error}>
                  Go there
                </button>
              )}
            </p>
          )}
          {over ? drawn : <div className="design-form">{drawn}</div>}
        </div>
      )}
      {with_picture && with_text && (
        <Splitter
          direction={stacked ? "horizontal" : "vertical"}
          label={stacked ? "Height of the picture" : "Width of the picture"}
          share={share}
          move={(pixels) => room && set_share(which, share + pixels / (stacked ? room.height : room.width))}
          reset={() => useShares.setState({ [which]: null })}
        />
      )}
      {with_text && (
        <div className="design-view text">
          <Suspense fallback={<p className="empty">Loading the editor …</p>}>
            <CodeEditor key={doc.file} file={doc.file} />
          </Suspense>
        </div>
      )}
    </div>
  );
}

function Gone() {
  const gone = useDesign((state) => state.gone);
  return (
    <p className="empty" role="status" data-testid="gone">
      {gone === null ? "Choose a file." : `${gone} is not there any more: it was deleted or moved. It is shown again when it is back; Undo brings it back.`}
    </p>
  );
}

/** Whether a file is shown as anything else than its text. */
function has_picture_of(doc: Doc): boolean {
  return doc.shown_trees !== null || doc.shown_chart !== null || doc.shown_requirements !== null || ["world", "scenario", "project"].includes(doc.kind);
}

/** Around a picture. */
const kGround_px = 20;

const kSections: readonly { title: string; of(node: PaletteNode): boolean }[] = [
  { title: "Skills", of: (node) => node.own },
  { title: "Control", of: (node) => !node.own && node.kind === "control" },
  { title: "Decorators", of: (node) => !node.own && node.kind === "decorator" },
  { title: "Leaves", of: (node) => !node.own && (node.kind === "action" || node.kind === "condition") },
];

/** Nodes to drag into the tree. */
function PaletteList({ picture }: { picture: React.RefObject<PictureHandle | null> }) {
  const palette = useDesign((state) => state.palette);
  const trees: readonly OutlineTree[] = useDesign((state) => doc_of(state)?.shown_trees) ?? kNoTrees;
  const [text, set_text] = useState("");
  const row = (id: string, subtree: boolean, title: string) => (
    <li
      key={id}
      className={`palette-row${subtree ? " subtree" : ""}`}
      title={title || `Drag ${id} into the tree; double click, or Enter, puts it below the chosen node`}
      data-palette={id}
      onDoubleClick={() => picture.current?.add(id, subtree)}
      onKeyDown={(event) => {
        if (event.key !== "Enter") return;
        event.preventDefault();
        event.stopPropagation();
        picture.current?.add(id, subtree);
      }}
      onPointerDown={(event) => {
        if (event.button !== 0) return;
        event.preventDefault();
        event.currentTarget.querySelector("span")?.focus({ preventScroll: true });
        picture.current?.drag({ id, subtree }, event);
      }}
    >
      <span className="ellipsis" role="button" tabIndex={-1}>
        {id}
      </span>
    </li>
  );
  const next_row = (event: React.KeyboardEvent<HTMLElement>) => {
    if (event.key !== "ArrowDown" && event.key !== "ArrowUp") return;
    const rows = [...event.currentTarget.querySelectorAll<HTMLElement>(".palette-row > span")];
    const at = rows.findIndex((one) => one === document.activeElement) + (event.key === "ArrowDown" ? 1 : -1);
    rows[Math.max(0, Math.min(at, rows.length - 1))]?.focus();
    event.preventDefault();
  };
  return (
    <section className="design-palette" aria-label="Palette">
      <input className="field" type="search" aria-label="Find in the palette" placeholder="Find a node" value={text} onChange={(event) => set_text(event.target.value)} />
      <div className="scroll" tabIndex={0} role="group" aria-label="Nodes; arrows choose one" onKeyDown={next_row}>
        {kSections.map(({ title, of }) => {
          const nodes = palette.filter((node) => of(node) && matches(text, node.id));
          if (nodes.length === 0) return null;
          return (
            <div key={title} role="group" aria-label={title}>
              <h3>{title}</h3>
              <ul>{nodes.map((node) => row(node.id, false, [node.description, ...node.ports.map((port) => `${port.name}: ${port.description || port.type}`)].filter(Boolean).join("\n")))}</ul>
            </div>
          );
        })}
        {trees.length > 0 && (
          <section aria-label="SubTrees">
            <h3>SubTrees</h3>
            <ul>{trees.filter(({ id }) => matches(text, id)).map(({ id }) => row(id, true, ""))}</ul>
          </section>
        )}
      </div>
    </section>
  );
}
const kNoTrees: readonly OutlineTree[] = [];
