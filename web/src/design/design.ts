import { create } from "zustand";

import { BusyError, LostError } from "../protocol/client";
import type { Design, DesignDocument, DesignPast, DesignSteps, EditedState, EditedTransition, Finding, Gesture, Operations, OutlineNode, OutlineTree, PaletteNode, StateKind } from "../protocol/types";
import { useEdit } from "../store/edit";
import { by_name } from "../widgets/natural";
import { note, on_design, page_name, request, request_whole, type DesignMessage } from "../store/store";
import { part_lines } from "./chart_places";
import { is_in, joined } from "./joining";
import { take_summary, useMode } from "./mode";
import { line_start, Places, splice_between } from "./places";
import { under_way_with } from "./turns";

/** A file as the page has it. */
export interface Doc extends DesignDocument {
  places: Places;
  /** The last picture there was, while the text has none. */
  shown_trees: OutlineTree[] | null;
  shown_chart: DesignDocument["chart"];
  shown_requirements: DesignDocument["requirements"];
}

export interface Chosen {
  element: number;
  key: string;
}

export type Look = "both" | "picture" | "text";

export interface DesignState {
  summary: Design | null;
  /** What this page can undo, and do again. */
  steps: DesignSteps;
  docs: Readonly<Record<string, Doc>>;
  palette: readonly PaletteNode[];
  world_places: readonly string[];
  /** `FILE.thrift/SERVICE`. */
  interfaces: readonly string[];
  /** By ID or name of leaves: the chart that the chosen scenario runs. */
  charts: Readonly<Record<string, string>>;
  file: string | null;
  /** Of a file with several: which tree the picture shows. */
  tree: string | null;
  /** Element that is chosen, and what it is called, so that it is found again after an edit. */
  chosen: Chosen | null;
  /** What is chosen beside it: what is done to several is done to all of them. */
  also: readonly Chosen[];
  /** Of a chart: the chosen state's id. */
  state: string | null;
  /** Ids of the states that are chosen beside it. */
  also_states: readonly string[];
  /** Of a chart: the chosen transition, by its place in the document, and its state, so that another is not taken for it. `at_caret`: the text shows it already. */
  transition: { index: number; source: string; at_caret?: boolean } | null;
  /** Of a file of requirements: that in which the caret is. */
  requirement: string | null;
  /** State to which a transition was drawn from the chosen one, "": one that is made for it; its event and condition are still to be said. */
  drawn_to: string | null;
  /** The state that was just made, with the version that it left of its file, until its field is left. */
  made: { file: string; state: string; version: number } | null;
  look: Look;
  /** Each edit is saved once it is checked. */
  autosave: boolean;
  /** What requirements would have said of the last runs, by file. */
  past: Readonly<Record<string, DesignPast>>;
  /** Says why something was refused, beside the picture. */
  refused: string | null;
  /** What was refused because the program could not be reached. */
  refused_lost: string | null;
  /** What is open below the texts. */
  below: "problems" | "reached" | null;
  /** Whether the shadow run's timeline is shown; null: where there is room. */
  timeline: boolean | null;
  /** What the project's texts are compared with, while they are. */
  comparing: string | null;
  /** The file that was open, while it is not there. */
  gone: string | null;
}

const kLookStored = "sentree.design.look";
const kAutosaveStored = "sentree.design.autosave";

export const useDesign = create<DesignState>()(() => ({
  summary: null,
  steps: { undo: null, undo_count: 0, redo: null, redo_count: 0 },
  docs: {},
  palette: [],
  world_places: [],
  interfaces: [],
  charts: {},
  file: null,
  tree: null,
  chosen: null,
  also: [],
  state: null,
  also_states: [],
  transition: null,
  requirement: null,
  drawn_to: null,
  made: null,
  look: (localStorage.getItem(kLookStored) as Look | null) ?? "both",
  autosave: localStorage.getItem(kAutosaveStored) === "true",
  past: {},
  refused: null,
  refused_lost: null,
  below: null,
  timeline: null,
  comparing: null,
  gone: null,
}));

useDesign.subscribe(({ file }, before) => {
  if (file !== before.file) useMode.setState({ file });
});

/** Opens it, or closes it again. */
export function show_below(what: NonNullable<DesignState["below"]>): void {
  useDesign.setState(({ below }) => ({ below: below === what ? null : what }));
}

export function set_look(look: Look): void {
  localStorage.setItem(kLookStored, look);
  useDesign.setState({ look });
}

export function toggle_autosave(): void {
  const autosave = !useDesign.getState().autosave;
  localStorage.setItem(kAutosaveStored, String(autosave));
  useDesign.setState({ autosave });
  note("info", autosave ? "each edit is saved from now on" : "edits are saved by Ctrl+S from now on");
  if (autosave) void save_all();
}

// ---- looking things up ----

/** Of one identity, so that nothing is drawn anew. */
export const kNoFiles: Design["files"] = [];
export const kNoNames: readonly string[] = [];
export const kNoFindings: readonly Finding[] = [];
const kNoneChosen: readonly Chosen[] = [];

export const key_of = (node: OutlineNode) => `${node.id}|${node.name}`;
const chosen_of = (node: OutlineNode): Chosen => ({ element: node.element, key: key_of(node) });

export function doc_of({ file, docs }: DesignState): Doc | null {
  return file === null ? null : (docs[file] ?? null);
}

/** The tree that is shown. */
export function tree_of(state: DesignState): OutlineTree | null {
  const doc = doc_of(state);
  const trees = doc?.shown_trees;
  if (!doc || !trees) return null;
  return trees.find(({ id }) => id === state.tree) ?? trees.find(({ id }) => id === doc.main) ?? trees[0] ?? null;
}

export function node_of(state: DesignState): OutlineNode | null {
  return tree_of(state)?.nodes.find(({ element }) => element === state.chosen?.element) ?? null;
}

/** All that are chosen, in the order of the text. */
export function nodes_of({ chosen, also }: Pick<DesignState, "chosen" | "also">, tree: OutlineTree | null): OutlineNode[] {
  const elements = new Set([chosen, ...also].map((one) => one?.element));
  return tree?.nodes.filter(({ element }) => elements.has(element)) ?? [];
}

export function findings_of(summary: Design | null, file: string | null): Finding[] {
  return summary?.findings.filter((finding) => finding.file === file) ?? [];
}

/** What is wrong in the start tag of a node. */
export function findings_at(findings: readonly Finding[], node: OutlineNode): Finding[] {
  return findings.filter(({ from }) => from >= node.from && from < node.open_end);
}

// ---- what the program says ----

function receive(message: DesignMessage): void {
  switch (message.type) {
    case "design": {
      const { type: _, ...summary } = message;
      const before = useDesign.getState().summary;
      take_design(summary);
      const { gone } = useDesign.getState();
      if (gone !== null && summary.files.some(({ file }) => file === gone)) void open_file(gone);
      if (summary.checked && before?.checked !== true) void load_palette();
      if (summary.checked && useDesign.getState().autosave && summary.files.some(({ dirty, conflict }) => dirty && !conflict)) void request("design_save", {}).catch(() => undefined);
      break;
    }
    case "design_document": {
      const { type: _, ...document } = message;
      take(document);
      break;
    }
    case "design_past": {
      const { type: _, ...past } = message;
      useDesign.setState((state) => ({ past: { ...state.past, [past.file]: past } }));
      break;
    }
    case "design_gone": {
      const { [message.file]: _gone, ...docs } = useDesign.getState().docs;
      useDesign.setState((state) => ({ docs, ...(state.file === message.file ? { file: null, chosen: null, also: kNoneChosen, gone: message.file } : {}) }));
      break;
    }
  }
}

const stem = (file: string) => file.replace(/\.\w+$/, "");
function take_design(told: Design): void {
  const summary: Design = { ...told, files: [...told.files].sort((a, b) => by_name(stem(a.file), stem(b.file)) || by_name(a.file, b.file)), scenarios: [...told.scenarios].sort(by_name) };
  useDesign.setState({ summary, steps: summary.pages[page_name()] ?? summary.steps });
}

function take(document: DesignDocument): void {
  useDesign.setState((state) => {
    const before = state.docs[document.file];
    const doc: Doc = {
      ...document,
      places: before?.text === document.text ? before.places : new Places(document.text),
      shown_trees: document.trees ?? before?.shown_trees ?? null,
      shown_chart: document.chart ?? before?.shown_chart ?? null,
      shown_requirements: document.requirements ?? before?.shown_requirements ?? null,
    };
    const docs = { ...state.docs, [document.file]: doc };
    return { docs, ...(state.file === document.file && document.trees ? kept(state, document.trees) : {}) };
  });
  sessions.get(document.file)?.came();
}

/** What is chosen in another version of its file: at its place, or by what it is called. */
function kept({ chosen, also }: DesignState, trees: readonly OutlineTree[]): Pick<DesignState, "chosen" | "also"> {
  if (!chosen) return { chosen, also };
  const nodes = trees.flatMap((tree) => tree.nodes);
  const now = ({ element, key }: Chosen) => nodes.find((node) => node.element === element && key_of(node) === key) ?? nodes.find((node) => key_of(node) === key);
  const called = now(chosen) ?? nodes.find((node) => node.element === chosen.element);
  const others = new Set(also.flatMap((one) => now(one) ?? []));
  if (called) others.delete(called);
  return { chosen: called ? chosen_of(called) : null, also: called && others.size > 0 ? [...others].map(chosen_of) : kNoneChosen };
}

async function load_palette(): Promise<void> {
  try {
    const { nodes, places, interfaces, charts } = await request("design_palette", {});
    useDesign.setState({ palette: [...nodes].sort((a, b) => by_name(a.id, b.id)), world_places: places, interfaces, charts });
  } catch {
    // The next summary asks again.
  }
}

/** Of an operation's refusal. */
const text_of = (error: unknown) => (error instanceof Error ? error.message : String(error));

/** Begins to follow the project, and opens what it is about. */
export async function start_design(): Promise<() => void> {
  // A listener of its own: another view may begin before the one before it has ended.
  const stop = on_design((message) => receive(message));
  const summary = await request("design", {});
  // The program is there.
  useDesign.setState(({ refused, refused_lost }) => ({ refused: refused === refused_lost ? null : refused, refused_lost: null }));
  take_design(summary);
  take_summary(summary);
  if (summary.checked) void load_palette();
  const { file } = useDesign.getState();
  const wanted = useMode.getState().file;
  const first = summary.files.find((one) => one.file === wanted) ?? summary.files.find(({ kind }) => kind === "mission") ?? summary.files[0];
  if (file === null && first) await open_file(first.file);
  else for (const open of Object.keys(useDesign.getState().docs)) await read(open);
  // A program that begins anew runs none; who was here before had chosen one.
  const before = localStorage.getItem(scenario_stored(summary.project)) ?? "";
  if (summary.scenario === "" && summary.scenarios.includes(before)) void choose_scenario(before);
  await edit_wanted();
  return stop;
}

/** Opens what somebody has asked to edit elsewhere in the page. */
async function edit_wanted(): Promise<void> {
  const { wanted } = useEdit.getState();
  const { summary } = useDesign.getState();
  if (!wanted || !summary) return;
  useEdit.setState({ wanted: null });
  if ("file" in wanted) {
    // The run has the path on disk.
    const found = summary.files.filter(({ file }) => `/${wanted.file}`.endsWith(`/${file}`)).sort((a, b) => b.file.length - a.file.length)[0];
    if (!found) return note("error", `${wanted.file} is not among the files of this project`);
    await open_file(found.file);
    choose_state(wanted.state || null);
    return;
  }
  if (!(await show_node(wanted.node.id, wanted.node.name))) note("error", `${wanted.node.name} is in no file of this project`);
}

/** Opens the file in which a node of that kind and name is, and chooses it. False: none is. */
export async function show_node(id: string, name: string): Promise<boolean> {
  for (const { file } of useDesign.getState().summary?.files.filter(({ kind }) => kind === "mission") ?? []) {
    if (useDesign.getState().docs[file] === undefined && !(await read(file))) continue;
    for (const { nodes } of useDesign.getState().docs[file]?.trees ?? []) {
      const node = nodes.find((one) => one.id === id && (one.name || one.id) === (name || id));
      if (!node) continue;
      await open_file(file, node.from);
      return true;
    }
  }
  return false;
}
useEdit.subscribe(() => void edit_wanted());

/** The chart that a leaf runs in the chosen scenario; null: the project has none. */
export function chart_of({ charts, summary }: DesignState, { name, id }: OutlineNode): string | null {
  const found = charts[name] ?? charts[id] ?? default_chart(id);
  return summary?.files.some(({ file }) => file === found) ? found : null;
}
export const default_chart = (id: string) => `skills/${id}.scxml`;

/** Opens the file in which a tree is, and chooses its root. False: none is. */
export async function show_tree(id: string): Promise<boolean> {
  const { file: open, summary } = useDesign.getState();
  const files = summary?.files.filter(({ kind }) => kind === "mission").map(({ file }) => file) ?? [];
  for (const file of files.sort((a, b) => Number(b === open) - Number(a === open))) {
    if (useDesign.getState().docs[file] === undefined && !(await read(file))) continue;
    const tree = useDesign.getState().docs[file]?.trees?.find((one) => one.id === id);
    if (!tree) continue;
    await open_file(file);
    useDesign.setState({ tree: id });
    choose(tree.nodes[0] ?? null);
    return true;
  }
  useDesign.setState({ refused: `the tree ${id} is in no file of this project` });
  return false;
}

/** What a double click on a node is for: its chart, its tree, else its name. */
export async function open_node(node: OutlineNode): Promise<void> {
  const chart = chart_of(useDesign.getState(), node);
  if (node.kind === "subtree") await show_tree(node.id);
  else if (chart !== null && (node.kind === "action" || node.kind === "condition")) await open_file(chart);
  else focus_field("design-name");
}

async function read(file: string): Promise<boolean> {
  try {
    take(await request("design_read", { file }));
    return true;
  } catch (error) {
    note("error", text_of(error), error instanceof LostError);
    return false;
  }
}

export async function open_file(file: string, byte?: number): Promise<void> {
  const known = useDesign.getState().docs[file] !== undefined || (await read(file));
  if (!known) return;
  if (useDesign.getState().file !== file) {
    choices += 1;
    useDesign.setState({ file, gone: null, tree: null, chosen: null, also: kNoneChosen, state: null, also_states: kNoNames, transition: null, refused: null });
  }
  if (byte !== undefined) go_to(byte);
}

// ---- choosing ----

/** Grows with each choice. To choose nothing is none: so ends a drag. */
let choices = 0;

/** Where the caret of the text goes when something is chosen elsewhere. */
export const useCaret = create<{ wanted: { byte: number; to: number; focus: boolean } | null }>()(() => ({ wanted: null }));

export function choose(node: OutlineNode | null, show_text = true): void {
  if (node) choices += 1;
  useDesign.setState({ chosen: node && chosen_of(node), also: kNoneChosen, refused: null });
  if (node && show_text) useCaret.setState({ wanted: { byte: node.from, to: node.open_end, focus: false } });
}

/** Several nodes of the tree on show; `first` is the one of them that is shown. */
export function choose_nodes(nodes: readonly OutlineNode[], first = nodes[0] ?? null): void {
  choose(first);
  const also = nodes.filter((node) => node !== first).map(chosen_of);
  if (also.length > 0) useDesign.setState({ also });
}

/** Chooses it beside what is chosen, or no more. */
export function toggle_chosen(node: OutlineNode): void {
  const state = useDesign.getState();
  const nodes = nodes_of(state, tree_of(state));
  if (nodes.includes(node)) choose_nodes(nodes.filter((one) => one !== node));
  else choose_nodes([...nodes, node], node);
}

/** Shows a place of the open file in its text, and the node that is there. */
export function go_to(byte: number, focus = false): void {
  useCaret.setState({ wanted: { byte, to: byte, focus } });
  choose_at(byte);
}

/** Where what is chosen of the open file stands in its text; null: nothing is. */
export function chosen_byte(): number | null {
  const state = useDesign.getState();
  const doc = doc_of(state);
  if (!doc) return null;
  const line = chosen_transition(state)?.line ?? chosen_state(state)?.line ?? null;
  if (line !== null && line > 0) return doc.places.byte(line_start(doc.places.shown, line, true));
  return node_of(state)?.from ?? doc.requirements?.find(({ name }) => name === state.requirement)?.from ?? null;
}

/** The innermost node at a byte of the open file, or the requirement. */
export function choose_at(byte: number): void {
  const state = useDesign.getState();
  const doc = doc_of(state);
  if (doc?.requirements) {
    const { name } = doc.requirements.find(({ from, to }) => byte >= from && byte <= to + 1) ?? { name: null };
    if (name !== state.requirement) useDesign.setState({ requirement: name });
  }
  if (!doc?.trees) return;
  for (const tree of doc.trees) {
    if (byte < tree.from || byte >= tree.to) continue;
    const node = tree.nodes.findLast(({ from, to }) => byte >= from && byte < to);
    if (tree.id !== tree_of(state)?.id) useDesign.setState({ tree: tree.id });
    if (node?.element !== state.chosen?.element) useDesign.setState({ chosen: node ? chosen_of(node) : null, also: kNoneChosen });
    return;
  }
}

/** Of a chart that is open: what is drawn around a byte, where the caret is now. */
export function choose_at_caret(byte: number): void {
  choose_at(byte);
  const state = useDesign.getState();
  const doc = doc_of(state);
  if (!doc?.chart) return;
  const { chart } = doc;
  const [line] = part_lines(chart, doc.places.shown, [doc.places.at(byte)]);
  const transition = chart.transitions.find((one) => one.line === line);
  const id = transition ? null : chart.states.find((one) => one.line === line)?.id || null;
  if (id === state.state && transition?.transition === state.transition?.index) return;
  useDesign.setState({ state: id, also_states: kNoNames, transition: transition ? { index: transition.transition, source: transition.source, at_caret: true } : null });
}

/** Of a chart that is open: the transition or state that is drawn around a byte. */
export function choose_part_at(byte: number): void {
  const doc = doc_of(useDesign.getState());
  const chart = doc?.shown_chart;
  if (!doc || !chart) return;
  const [line] = part_lines(chart, doc.places.shown, [doc.places.at(byte)]);
  const transition = chart.transitions.find((one) => one.line === line);
  if (transition) choose_transition(transition);
  else choose_state(chart.states.find((one) => one.line === line)?.id || null);
  useCaret.setState({ wanted: { byte, to: byte, focus: false } });
}

// ---- editing ----

/** Writes of one who types come together, and are told so often at most. */
const kTyping_ms = 60;
/** What is typed after such a pause is another step; so is what is typed on for so long, and the next line. */
const kPause_ms = 1000;
const kStep_ms = 5000;

/** Times that an edit is refused because of others' before one is told so. */
const kTriesMax = 20;
/** The version of a step whose edit is not answered yet. */
const kOnItsWay = -1;
/** What was refused for a while only is tried again after so long. */
const kLater_ms = 1000;
const kHalfCharacter = /\p{Surrogate}/gu;

/**
 * One file while it is typed in. Its text is what the program has (`base`) and what was typed since (`local`); one edit
 * is on its way at a time. What others change meanwhile is joined with what is typed: nothing of both is lost. While
 * the program cannot be reached, or a conflict with the disk is to be resolved, what is typed waits here.
 */
export class Session {
  private base: { version: number; places: Places };
  private local: string;
  private busy: Promise<void> | null = null;
  private timer = 0;
  private last_ms = -Infinity;
  /** When what is typed began to be one step. */
  private step_ms = -Infinity;
  private line_ended = false;
  /** What waits belongs to the step that left this version: nobody paused between, however long the program took. */
  private joins: number | null = null;
  /** Until the program has told the file again. */
  private waits = false;
  /** The text that was on its way when the connection was lost. */
  private unsure: string | null = null;
  private refused = 0;
  /** That what is typed waits until it is not refused any more has been said. */
  private told_later = false;
  /** Gives the editor another text. */
  show: ((text: string) => void) | null = null;

  constructor(readonly file: string) {
    const doc = useDesign.getState().docs[file]!;
    this.base = { version: doc.version, places: doc.places };
    this.local = doc.places.shown;
  }

  get text(): string {
    return this.local;
  }

  private get is_ahead(): boolean {
    return this.local !== this.base.places.shown;
  }

  typed(text: string): void {
    const now = performance.now();
    if (this.line_ended || now - this.last_ms >= kPause_ms || now - this.step_ms >= kStep_ms) {
      this.joins = null;
      this.step_ms = now;
    }
    this.last_ms = now;
    this.line_ended = splice_between(this.local, text)?.text.includes("\n") ?? false;
    this.local = text;
    this.soon();
  }

  private soon(): void {
    if (this.timer === 0) this.timer = window.setTimeout(() => void this.flush(), kTyping_ms);
  }

  /** The program has another version. */
  came(): void {
    if (this.busy) return;
    this.waits = false;
    const { shown } = this.base.places;
    const now = useDesign.getState().docs[this.file]?.places.shown ?? shown;
    this.rebase(this.unsure !== null && is_in(shown, this.unsure, now) ? this.unsure : shown);
    this.unsure = null;
    if (this.is_ahead) this.soon();
  }

  /** What the program has is the base; what was typed since `from` is joined with it. */
  private rebase(from: string): void {
    const doc = useDesign.getState().docs[this.file];
    if (!doc) return;
    this.base = { version: doc.version, places: doc.places };
    const before = this.local;
    this.local = before === from ? doc.places.shown : joined(from, before, doc.places.shown);
    if (this.local !== before) this.show?.(this.local);
  }

  /** Everything that was typed is with the program, if it can be reached. */
  async flush(): Promise<void> {
    window.clearTimeout(this.timer);
    this.timer = 0;
    while (this.busy) await this.busy;
    while (this.is_ahead && !this.waits && (useDesign.getState().docs[this.file]?.theirs ?? null) === null) {
      this.busy = this.send();
      await this.busy;
    }
  }

  private async send(): Promise<void> {
    // Half a character cannot be told to anybody.
    const whole = this.local.replace(kHalfCharacter, "\uFFFD");
    if (whole !== this.local) this.show?.((this.local = whole));
    const sent = this.local;
    const { places, version } = this.base;
    const splice = splice_between(places.shown, sent)!;
    // Another page may have typed in between.
    const join = this.joins === version;
    this.joins = kOnItsWay;
    const text = places.end_of_line === "\n" ? splice.text : splice.text.replace(/\n/g, places.end_of_line);
    try {
      const left = await request("design_edit", { file: this.file, base: version, edits: [{ from: places.byte(splice.from), to: places.byte(splice.to), text }], cause: `type in ${this.file}`, join });
      this.busy = null;
      // Unless one has paused since.
      if (this.joins === kOnItsWay) this.joins = left.version;
      this.refused = 0;
      this.told_later = false;
      this.rebase(sent);
    } catch (error) {
      this.busy = null;
      this.again(error, places.text, sent);
    }
  }

  /** What becomes of what was typed when the text `of` could not be edited. */
  private again(error: unknown, of: string, sent: string): void {
    const doc = useDesign.getState().docs[this.file];
    if (error instanceof LostError) {
      this.waits = true;
      this.unsure = sent;
      note("info", "the program cannot be reached; what is typed is kept here until it is back", true);
    } else if (is_for_now(error)) {
      this.waits = true;
      if (!this.told_later) note("info", `what is typed is kept here, and told later: ${text_of(error)}`);
      this.told_later = true;
      // Not where the connection was lost since: then the file must have been told again.
      window.setTimeout(() => {
        if (this.unsure === null) this.came();
      }, kLater_ms);
    } else if (!doc || doc.theirs !== null) {
      this.waits = true;
      note("error", text_of(error));
    } else if (doc.places.text !== of && this.refused++ < kTriesMax) {
      // The same lines were changed meanwhile.
      this.rebase(this.base.places.shown);
    } else {
      this.refused = 0;
      note("error", text_of(error));
      this.local = this.base.places.shown;
      this.rebase(this.local);
      this.show?.(this.local);
    }
  }
}

/** Refused for a while: the same may be done later. */
function is_for_now(error: unknown): boolean {
  return error instanceof BusyError || text_of(error).startsWith("not yet: ") || (useDesign.getState().summary?.held_by ?? "") !== "";
}

const sessions = new Map<string, Session>();

export function session_of(file: string): Session {
  let session = sessions.get(file);
  if (!session) sessions.set(file, (session = new Session(file)));
  return session;
}

async function flush_all(): Promise<void> {
  for (const session of sessions.values()) await session.flush();
}

/** Does something that may be refused; then the reason is shown and the value is null. Else what was refused before is forgotten, if `forgets`. */
async function attempt<T>(what: () => Promise<T>, forgets = true): Promise<T | null> {
  try {
    const value = await under_way_with(async () => {
      await flush_all();
      return what();
    });
    if (forgets) useDesign.setState({ refused: null });
    return value;
  } catch (error) {
    useDesign.setState({ refused: text_of(error), ...(error instanceof LostError ? { refused_lost: text_of(error) } : {}) });
    return null;
  }
}

/** The open file's text cannot be read: why its picture is of before. */
export function broken(state: DesignState): string | null {
  const doc = doc_of(state);
  return doc && unreadable(doc);
}
/** Why nothing of the open file can be edited by gestures. */
export function obstacle(state: DesignState): string | null {
  return held(state) ?? broken(state);
}
/** Why nothing of the project can be edited here now. */
export function held({ summary }: DesignState): string | null {
  return summary && summary.held_by !== "" ? `${summary.held_by} edits this project; here it is only shown` : null;
}
const unreadable = ({ error }: Doc) => (error ? `line ${error.line}: ${error.message}; mend the text first` : null);

/** The node in the text as it is now: where it was, or the only one that is called so. Null: there is none. */
export function node_now(node: OutlineNode): OutlineNode | null {
  const same = (doc_of(useDesign.getState())?.trees ?? []).flatMap(({ nodes }) => nodes).filter((one) => key_of(one) === key_of(node));
  return same.find(({ element }) => element === node.element) ?? (same.length === 1 ? same[0]! : null);
}

/** What a gesture names by number, to tell whether it means the same in a newer text. */
function named_by_number(wanted: Gesture, doc: Doc): string {
  if ("path" in wanted || "transition" in wanted || "index" in wanted && !("parent" in wanted)) return String(doc.version);
  const trees = doc.trees ?? [];
  const name = (element: number) => {
    const node = trees.flatMap(({ nodes }) => nodes).find((one) => one.element === element);
    return node ? key_of(node) : (trees.find((tree) => tree.element === element)?.id ?? "");
  };
  return [...("node" in wanted ? [name(wanted.node)] : []), ...("nodes" in wanted ? wanted.nodes.map(name) : []), ...("parent" in wanted ? [name(wanted.parent)] : [])].join("\n");
}

/** Of the open file: what a gesture is meant of that is begun now and done later. */
export const version_now = (): number => doc_of(useDesign.getState())?.version ?? 0;

function chosen_among(elements: readonly number[], tree: OutlineTree | null): Pick<DesignState, "chosen" | "also"> {
  const [chosen, ...also] = tree?.nodes.filter(({ element }) => elements.includes(element)).map(chosen_of) ?? [];
  return { chosen: chosen ?? null, also };
}

/** A gesture on the open file; chooses the node that it made or moved, or all of them. `meant_of`: the version that it was begun with. */
export async function gesture(wanted: Gesture, meant_of = version_now()): Promise<boolean> {
  const meant = doc_of(useDesign.getState());
  const before = choices;
  const done = await attempt(async () => {
    const doc = meant && useDesign.getState().docs[meant.file];
    if (!doc) throw new Error("no file is open");
    const why_not = unreadable(doc);
    if (why_not) throw new Error(why_not);
    // Numbers are those of the text that it is meant of; the program joins it with what happened since.
    const is_same = meant_of === meant.version && named_by_number(wanted, meant) === named_by_number(wanted, doc);
    return request_whole("design_gesture", { file: doc.file, base: is_same ? doc.version : meant_of, gesture: wanted });
  });
  const state = useDesign.getState();
  if (done?.at === undefined || choices !== before || state.file !== meant?.file || /^(?:delete.*|remove_.*|yaml_remove)$/.test(wanted.what)) return done !== null;
  go_to(done.at);
  const { nodes = [], states = [] } = done;
  if (states.length > 0) choose_states(states);
  if (nodes.length > 0 && doc_of(state)?.version === done.version) useDesign.setState(chosen_among(nodes, tree_of(useDesign.getState())));
  return true;
}

/** A gesture, and what is chosen then; who has chosen something else meanwhile keeps that. */
export async function gesture_then(wanted: Gesture, then: () => void): Promise<boolean> {
  const before = choices;
  const done = await gesture(wanted);
  if (done && choices === before) then();
  return done;
}

export interface FileUse {
  file: string;
  line: number;
  text: string;
}
/** The places that name a file of the project, or go with it; null: that cannot be told, as is said. */
export async function uses_of(file: string): Promise<readonly FileUse[] | null> {
  return (await attempt(() => request("design_uses", { file })))?.uses ?? null;
}
/** What has the name of a file that goes is saved with it. */
const with_saved = (saved: readonly string[]) => (saved.length === 0 ? "" : `; saved with it: ${saved.join(", ")}`);
/** Gives a file another place inside the project, wherever it is named. */
export async function rename_file(file: string, to: string): Promise<boolean> {
  const was_open = useDesign.getState().file === file;
  const done = await attempt(() => request("design_rename_file", { file, to }));
  if (!done) return false;
  if (done.files.length > 0 || done.saved.length > 0) note("info", `${file} is ${to} now${done.files.length > 0 ? `, in ${done.files.join(", ")} too` : ""}${with_saved(done.saved)}`);
  if (was_open) await open_file(to);
  return true;
}
/** Deletes a file of the project, on disk too. */
export async function remove_file(file: string): Promise<void> {
  const was_open = useDesign.getState().file === file;
  const done = await attempt(() => request("design_remove", { file }));
  if (done === null) return;
  note("info", `${file} is deleted${with_saved(done.saved)}; Undo brings it back`);
  if (!was_open) return;
  const files = useDesign.getState().summary?.files.filter((one) => one.file !== file) ?? [];
  const next = files.find(({ kind }) => kind === "mission") ?? files[0];
  if (next) await open_file(next.file);
}

type Renamed = Operations["design_rename"][1];
/** Gives something another name, wherever it is named. Null: refused, as is said. */
async function rename(what: { location: string } | { tree: string } | { node: string; file: string; base: number; gesture: Gesture } | { state: string; file: string }, to: string): Promise<Renamed | null> {
  const done = await attempt(() => request_whole("design_rename", { ...what, to }));
  if (done && done.places > 0) note("info", `${Object.values(what)[0]} is ${to} now: in ${done.places} ${done.places === 1 ? "place" : "places"} of ${done.files.join(", ")}`);
  return done;
}
const kLeftShown = 3;
/** What may have been meant as well stays said. */
function tell_left(name: string, { left }: Renamed): void {
  if (left.length === 0) return;
  const places = left.slice(0, kLeftShown).map(({ file, line, text }) => `${file}:${line} ${text}`);
  const more = left.length > kLeftShown ? ` and ${left.length - kLeftShown} more` : "";
  useDesign.setState({ refused: `look at what may mean ${name} and stays as it is, for that cannot be told: ${places.join(", ")}${more}` });
}
export const rename_place = async (location: string, to: string) => (await rename({ location }, to)) !== null;
/** Of the open chart; it stays chosen. */
export async function rename_state(state: string, to: string): Promise<boolean> {
  const { file } = useDesign.getState();
  const done = file === null ? null : await rename({ state, file }, to);
  if (!done) return false;
  if (useDesign.getState().file === file && useDesign.getState().state === state) choose_state(to);
  tell_left(state, done);
  return true;
}
/** With what else names it; an empty name takes it away. One request, so that what follows it finds it done. */
export async function rename_node(node: OutlineNode, to: string): Promise<void> {
  const wanted: Gesture = { what: "set", node: node.element, name: "name", value: to === "" ? null : to };
  const doc = doc_of(useDesign.getState());
  if (node.name === "" || to === "" || !doc) return void (await gesture(wanted));
  const done = await rename({ node: node.name, file: doc.file, base: doc.version, gesture: wanted }, to);
  if (done) tell_left(node.name, done);
}
/** Of the open file; the picture stays with it. */
export async function rename_tree(tree: string, to: string): Promise<boolean> {
  const shown = useDesign.getState().tree;
  const done = (await rename({ tree }, to)) !== null;
  if (done && shown === tree) useDesign.setState({ tree: to });
  return done;
}

/** The state of a chart that is chosen, or the transition. */
export function chosen_state(state: DesignState): EditedState | null {
  return (state.state !== null && doc_of(state)?.shown_chart?.states.find(({ id }) => id === state.state)) || null;
}
export function chosen_transition(state: DesignState): EditedTransition | null {
  const wanted = state.transition;
  return (wanted && doc_of(state)?.shown_chart?.transitions.find(({ transition, source }) => transition === wanted.index && source === wanted.source)) ?? null;
}
/** All states of the chart that are chosen, in the order of the text. */
export function chosen_states({ state, also_states }: Pick<DesignState, "state" | "also_states">, chart: DesignDocument["chart"]): EditedState[] {
  return chart?.states.filter(({ id }) => id !== "" && (id === state || also_states.includes(id))) ?? [];
}
export function choose_state(id: string | null, also: readonly string[] = kNoNames): void {
  choices += 1;
  useDesign.setState({ state: id, also_states: also, transition: null, refused: null });
}
/** Several; the last is the one that is shown. */
export function choose_states(ids: readonly string[]): void {
  choose_state(ids.at(-1) ?? null, ids.slice(0, -1));
}
/** Chooses it beside what is chosen, or no more. */
export function toggle_state(id: string): void {
  const { state, also_states } = useDesign.getState();
  const chosen = [...also_states, ...(state === null ? [] : [state])];
  choose_states(chosen.includes(id) ? chosen.filter((one) => one !== id) : [...chosen, id]);
}
export function choose_transition(chosen: Pick<EditedTransition, "transition" | "source"> | null): void {
  choices += 1;
  useDesign.setState({ state: null, also_states: kNoNames, transition: chosen && { index: chosen.transition, source: chosen.source }, refused: null });
}

/** An id that no state of the chart has. */
export function fresh_id(): string {
  const taken = new Set(doc_of(useDesign.getState())?.shown_chart?.states.map(({ id }) => id));
  let number = 1;
  while (taken.has(`state${number}`)) number++;
  return `state${number}`;
}

/** A state with such an id, which is to be said next. Its id; null: it was refused, or something else is chosen by now. */
export async function add_fresh_state(inside: string, kind: StateKind = "state"): Promise<string | null> {
  const id = fresh_id();
  let is_chosen = false;
  await gesture_then({ what: "add_state", inside, id, kind }, () => {
    is_chosen = true;
    choose_state(id);
    const { file } = useDesign.getState();
    if (file !== null) useDesign.setState({ made: { file, state: id, version: version_now() } });
    focus_field("design-state", id);
  });
  return is_chosen ? id : null;
}

/** A state that was just made goes again, unless something else was done to its file since. */
export async function take_back_made(id: string): Promise<void> {
  const { made, file } = useDesign.getState();
  if (made?.state !== id || made.file !== file || made.version !== version_now()) return;
  useDesign.setState({ made: null });
  await undo();
  if (chosen_state(useDesign.getState()) === null) choose_state(null);
  focus_picture();
}

/** Frames that a field is waited for. */
const kFramesMax = 120;

/** Once it is there, with what it says selected; `value`: once it says that. */
export function focus_field(id: string, value?: string): void {
  const look = (left: number) => {
    const field = document.getElementById(id);
    if ((field instanceof HTMLInputElement || field instanceof HTMLTextAreaElement) && (value === undefined || field.value === value)) {
      if (field.matches(":disabled")) return useDesign.setState({ refused: obstacle(useDesign.getState()) });
      field.focus();
      field.select();
    } else if (left > 0) requestAnimationFrame(() => look(left - 1));
  };
  look(kFramesMax);
}

/** What was done in a form is done: the next keys are of the picture. */
export function focus_picture(): void {
  requestAnimationFrame(() => document.querySelector<SVGElement>("svg.design-picture")?.focus({ preventScroll: true }));
}

/** Why a gesture would be refused; null: it would not. */
export async function refusal(wanted: Gesture): Promise<string | null> {
  const state = useDesign.getState();
  const doc = doc_of(state);
  if (!doc) return "no file is open";
  const why_not = obstacle(state);
  if (why_not) return why_not;
  try {
    await request("design_gesture", { file: doc.file, base: doc.version, gesture: wanted, try: true });
    return null;
  } catch (error) {
    return text_of(error);
  }
}

export async function fix(finding: Finding, which: Finding["fixes"][number]): Promise<void> {
  await attempt(async () => {
    if (useDesign.getState().docs[finding.file] === undefined) await read(finding.file);
    const doc = useDesign.getState().docs[finding.file];
    if (!doc) return;
    await request("design_edit", { file: finding.file, base: doc.version, edits: [{ from: which.from, to: which.to, text: which.text }], cause: `write ${which.title}` });
  });
}

/** Writes at places of a text as the editor has it; the program joins it with what happened since. */
export async function edit_text(file: string, text: string, edits: readonly { from: number; to: number; text: string }[], cause: string): Promise<void> {
  const meant = useDesign.getState().docs[file];
  await attempt(async () => {
    const now = useDesign.getState().docs[file];
    if (!now) throw new Error("no file is open");
    const doc = meant?.places.shown === text ? meant : now;
    if (doc.places.shown !== text) throw new Error("the text has changed meanwhile; try again");
    const bytes = edits.map((edit) => ({ from: doc.places.byte(edit.from), to: doc.places.byte(edit.to), text: edit.text }));
    await request("design_edit", { file, base: doc.version, edits: bytes, cause });
  });
}

/** Nothing is refused where there is nothing to be taken back. */
async function take_back(op: "design_undo" | "design_redo", none: string): Promise<void> {
  const done = await attempt(async () => {
    const { steps } = useDesign.getState();
    const there = op === "design_undo" ? steps.undo : steps.redo;
    return there === null ? null : request(op, {});
  });
  if (done) {
    show_one_of(done.files);
    if (done.saved.length > 0) note("info", `a file has gone on disk${with_saved(done.saved)}`);
  } else if (useDesign.getState().refused === null) note("info", none);
  if (done && done.left.length > 0) useDesign.setState({ refused: `${done.left.join(", ")} ${done.left.length === 1 ? "is" : "are"} not as in that step, somebody else has changed it; it stays as it is` });
}
export const undo = () => take_back("design_undo", "there is nothing to undo");
export const redo = () => take_back("design_redo", "there is nothing to do again");
/** What was undone is to be seen, also where it is of another file. */
function show_one_of(files: readonly string[] = []): void {
  const { file, summary } = useDesign.getState();
  if (files.length === 0 || (file !== null && files.includes(file))) return;
  const there = files.find((one) => summary?.files.some((known) => known.file === one));
  if (there) void open_file(there);
}
export async function save_all(): Promise<void> {
  // A field tells what was typed in it when one leaves it. If that is refused it stays said, whatever else is saved.
  useDesign.setState({ refused: null });
  const field = document.activeElement;
  if (field instanceof HTMLInputElement || field instanceof HTMLTextAreaElement) {
    field.blur();
    field.focus();
  }
  const done = await attempt(() => request("design_save", {}), false);
  const waiting = useDesign.getState().summary?.files.filter(({ conflict }) => conflict).map(({ file }) => file) ?? [];
  if (done && waiting.length > 0) useDesign.setState({ refused: `not saved: ${waiting.join(", ")}; it was changed on disk where it is edited here, or cannot be read there: choose one of both first` });
  if (done && done.saved > 0) note("info", done.saved === 1 ? "saved" : `saved ${done.saved} files`);
}
export async function resolve(file: string, keep: "mine" | "theirs"): Promise<void> {
  await attempt(() => request("design_resolve", { file, keep }));
}
const scenario_stored = (project: string) => `sentree.design.scenario.${project}`;
export async function choose_scenario(scenario: string): Promise<void> {
  localStorage.setItem(scenario_stored(useDesign.getState().summary?.project ?? ""), scenario);
  await attempt(() => request("design_scenario", { scenario }));
}
/** In a folder that is empty: a small project that runs. */
export async function begin_project(): Promise<void> {
  if ((await attempt(() => request("design_init", {}))) === null) return;
  const { files } = await request("design", {});
  const first = files.find(({ kind }) => kind === "mission") ?? files[0];
  if (first) await open_file(first.file);
}
export type PartKind = "skill" | "monitor" | "requirement" | "scenario" | "component";
export async function add_part(kind: PartKind, name: string, open = true): Promise<boolean> {
  const made = await attempt(() => request("design_add", { kind, name }));
  if (made && open) await open_file(made.file);
  return made !== null;
}
