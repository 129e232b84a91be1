import { autocompletion, closeBrackets, completionKeymap, type CompletionContext, type CompletionResult } from "@codemirror/autocomplete";
import { defaultKeymap } from "@codemirror/commands";
import { xml } from "@codemirror/lang-xml";
import { yaml } from "@codemirror/lang-yaml";
import { bracketMatching, HighlightStyle, indentOnInput, StreamLanguage, syntaxHighlighting } from "@codemirror/language";
import { lintGutter, setDiagnostics, type Diagnostic } from "@codemirror/lint";
import { highlightSelectionMatches, search, searchKeymap } from "@codemirror/search";
import { Annotation, Compartment, EditorState, type Extension } from "@codemirror/state";
import { drawSelection, EditorView, highlightActiveLine, highlightActiveLineGutter, hoverTooltip, keymap, lineNumbers } from "@codemirror/view";
import { tags } from "@lezer/highlight";
import { useEffect, useRef } from "react";

import { request } from "../store/store";
import { choose_at, choose_at_caret, chosen_byte, doc_of, findings_of, fix, redo, save_all, session_of, undo, useCaret, useDesign, type Doc } from "./design";
import { splices_between } from "./joining";
import { caret_place } from "./places";

/** A change that the program made: it is not told to it again. */
const kFromProgram = Annotation.define<boolean>();

const kRequirementWords =
  /^(?:always|never|globally|between|after|until|before|whenever|while|when|shall|within|at least|every|event|observation|request|reply|and|or|not|implies|since|if|then|is|holds|eventually|exactly|once)\b/;
const requirements = StreamLanguage.define({
  token(stream) {
    if (stream.eatSpace()) return null;
    if (stream.match(/^#.*/)) return "comment";
    if (stream.match(/^"[^"]*"?/)) return "string";
    if (stream.match(/^\d+(?:\.\d+)?(?:\s*(?:ms|s|min|h|%|m))?/)) return "number";
    if (stream.match(kRequirementWords)) return "keyword";
    if (stream.match(/^[\w.]+/)) return "variableName";
    stream.next();
    return "operator";
  },
});

function language_of(file: string): Extension {
  if (/\.(?:xml|scxml)$/.test(file)) return xml();
  if (/\.ya?ml$/.test(file)) return yaml();
  return requirements;
}

const highlight = HighlightStyle.define([
  { tag: [tags.tagName, tags.keyword, tags.propertyName], color: "var(--accent)" },
  { tag: [tags.attributeName, tags.definition(tags.propertyName)], color: "var(--past)" },
  { tag: [tags.string, tags.attributeValue], color: "var(--success)" },
  { tag: [tags.number, tags.bool], color: "var(--failure)" },
  { tag: tags.comment, color: "var(--muted)", fontStyle: "italic" },
  { tag: [tags.angleBracket, tags.punctuation, tags.operator], color: "var(--muted)" },
]);

const look = EditorView.theme({
  "&": { height: "100%", fontSize: "13px", backgroundColor: "var(--surface)", color: "var(--ink)" },
  ".cm-scroller": { fontFamily: "var(--mono)", lineHeight: "1.5" },
  ".cm-gutters": { backgroundColor: "var(--nested)", color: "var(--muted)", border: "none" },
  ".cm-activeLine": { backgroundColor: "color-mix(in srgb, var(--accent) 7%, transparent)" },
  ".cm-activeLineGutter": { backgroundColor: "var(--hover)", color: "var(--ink)" },
  ".cm-cursor": { borderLeftColor: "var(--ink)" },
  "&.cm-focused > .cm-scroller > .cm-selectionLayer .cm-selectionBackground, .cm-selectionBackground": { backgroundColor: "var(--accent-fill) !important" },
  ".cm-tooltip, .cm-panels": { backgroundColor: "var(--surface)", color: "var(--ink)", border: "1px solid var(--line-strong)" },
  ".cm-diagnostic": { fontFamily: "var(--font)" },
  ".cm-diagnosticAction": { backgroundColor: "var(--accent)", color: "var(--on-accent)" },
});

/** What the program knows, of the text that is shown; null: it is another one by now. */
async function with_text<T>(file: string, text: string, what: (doc: Doc) => Promise<T>): Promise<{ doc: Doc; found: T } | null> {
  await session_of(file).flush();
  const doc = useDesign.getState().docs[file];
  if (!doc || doc.places.shown !== text) return null;
  try {
    return { doc, found: await what(doc) };
  } catch {
    return null;
  }
}

/** What may stand at the caret: of the project's interfaces, nodes, ports, places, states; and the words of the grammar. */
async function complete(file: string, context: CompletionContext): Promise<CompletionResult | null> {
  if (!context.explicit && !context.matchBefore(/[\w.{<"'-]$/)) return null;
  const told = await with_text(file, context.state.doc.toString(), (doc) => request("design_complete", { file, byte: doc.places.byte(context.pos) }));
  // Somebody typed on meanwhile: an empty answer is asked again, where none would wait for another letter.
  if (!told) return { from: context.pos, options: [] };
  if (told.found.items.length === 0 || context.aborted) return null;
  const { doc, found } = told;
  return {
    from: doc.places.at(found.from),
    to: doc.places.at(found.to),
    options: found.items.map(({ label, detail, documentation, insert }) => ({ label, detail, apply: insert, ...(documentation === "" ? {} : { info: documentation }) })),
    validFor: /^[\w-]*$/,
  };
}

/** What is known of what the pointer is on. */
async function explain(file: string, view: EditorView, place: number) {
  const told = await with_text(file, view.state.doc.toString(), (doc) => request("design_explain", { file, byte: doc.places.byte(place) }));
  if (!told?.found) return null;
  const { from, to, text } = told.found;
  return {
    pos: told.doc.places.at(from),
    end: told.doc.places.at(to),
    above: true,
    create: () => {
      const dom = document.createElement("div");
      dom.className = "code-help";
      dom.textContent = text.replace(/```\w*\n?|\*\*|`/g, "").trim();
      return { dom };
    },
  };
}

function extensions(file: string): Extension {
  return [
    lineNumbers(),
    lintGutter(),
    highlightActiveLine(),
    highlightActiveLineGutter(),
    drawSelection(),
    EditorView.lineWrapping,
    bracketMatching(),
    closeBrackets(),
    indentOnInput(),
    autocompletion({ icons: false, override: [(context) => complete(file, context)] }),
    hoverTooltip((view, place) => explain(file, view, place)),
    highlightSelectionMatches(),
    search({ top: true }),
    syntaxHighlighting(highlight),
    look,
    language_of(file),
    EditorView.contentAttributes.of({ "aria-label": `Text of ${file}` }),
    keymap.of([
      { key: "Mod-z", run: () => (void undo(), true), preventDefault: true },
      { key: "Mod-Shift-z", run: () => (void redo(), true), preventDefault: true },
      { key: "Mod-y", run: () => (void redo(), true), preventDefault: true },
      { key: "Mod-s", run: () => (void save_all(), true), preventDefault: true },
      ...completionKeymap,
      ...searchKeymap,
      ...defaultKeymap,
    ]),
    EditorView.updateListener.of((update) => {
      const own = update.transactions.every((transaction) => !transaction.annotation(kFromProgram));
      if (update.docChanged && own) session_of(file).typed(update.state.doc.toString());
      if (own && (update.selectionSet || update.docChanged) && update.view.hasFocus) {
        const doc = doc_of(useDesign.getState());
        if (doc && doc.places.shown === update.state.doc.toString()) choose_at_caret(doc.places.byte(caret_place(doc.places.shown, update.state.selection.main.head)));
      }
    }),
  ];
}

/** The open file as text, with what is wrong in it. */
export default function CodeEditor({ file }: { file: string }) {
  const place = useRef<HTMLDivElement>(null);
  const view = useRef<EditorView | null>(null);
  const blocked = useRef(new Compartment());
  const conflict = useDesign((state) => (state.docs[file]?.theirs ?? null) !== null);

  useEffect(() => {
    if (!place.current) return;
    const session = session_of(file);
    const made = new EditorView({
      parent: place.current,
      state: EditorState.create({ doc: session.text, extensions: [extensions(file), blocked.current.of(EditorState.readOnly.of(false))] }),
    });
    view.current = made;
    made.scrollDOM.tabIndex = 0;
    session.show = (text) => {
      const changes = splices_between(made.state.doc.toString(), text).map(({ from, to, text: insert }) => ({ from, to, insert }));
      if (changes.length > 0) made.dispatch({ changes, annotations: kFromProgram.of(true) });
    };
    const marks = () => mark(made, file);
    const stop_marks = useDesign.subscribe((state, before) => {
      const doc = state.docs[file];
      if (state.summary !== before.summary || doc !== before.docs[file]) marks();
      // What was typed can be read now: the caret is in a requirement that was not there.
      if (doc !== before.docs[file] && doc?.requirements && made.hasFocus && doc.places.shown === made.state.doc.toString()) choose_at(doc.places.byte(made.state.selection.main.head));
    });
    // Who types sees where, also when the room gets less.
    const observer = new ResizeObserver(() => {
      if (made.hasFocus) made.dispatch({ effects: EditorView.scrollIntoView(made.state.selection.main.head), annotations: kFromProgram.of(true) });
    });
    observer.observe(place.current);
    // An editor that is opened shows what has been chosen without it.
    const begin = chosen_byte();
    if (useCaret.getState().wanted === null && begin !== null) useCaret.setState({ wanted: { byte: begin, to: begin, focus: false } });
    const show_caret = () => {
      const { wanted } = useCaret.getState();
      const doc = useDesign.getState().docs[file];
      if (!wanted || !doc || useDesign.getState().file !== file) return;
      const at = Math.min(doc.places.at(wanted.byte), made.state.doc.length);
      made.dispatch({ selection: { anchor: at }, effects: EditorView.scrollIntoView(at, { y: "center" }), annotations: kFromProgram.of(true) });
      if (wanted.focus) made.focus();
      useCaret.setState({ wanted: null });
    };
    const stop_caret = useCaret.subscribe(show_caret);
    marks();
    show_caret();
    return () => {
      stop_marks();
      stop_caret();
      observer.disconnect();
      session.show = null;
      made.destroy();
      view.current = null;
    };
  }, [file]);

  useEffect(() => {
    view.current?.dispatch({ effects: blocked.current.reconfigure(EditorState.readOnly.of(conflict)) });
  }, [conflict, file]);

  return <div className="code" ref={place} data-testid="code" data-file={file} />;
}

/** Shows the findings of the text that is shown; those of another version come again. */
function mark(view: EditorView, file: string): void {
  const { summary, docs } = useDesign.getState();
  const doc = docs[file];
  if (!doc || doc.places.shown !== view.state.doc.toString()) return;
  const marks: Diagnostic[] = findings_of(summary, file).map((finding) => {
    const from = Math.min(doc.places.at(finding.from), view.state.doc.length);
    return {
      from,
      to: Math.max(from, Math.min(doc.places.at(finding.to), view.state.doc.length)),
      severity: finding.severity === "note" ? "info" : finding.severity,
      message: finding.message,
      actions: finding.fixes.map((which) => ({ name: `Write “${which.title}”`, apply: () => void fix(finding, which) })),
    };
  });
  if (doc.error && !marks.some(({ severity, message }) => severity === "error" || message === doc.error?.message)) {
    const line = view.state.doc.line(Math.min(Math.max(doc.error.line, 1), view.state.doc.lines));
    marks.push({ from: line.from, to: line.to, severity: "error", message: doc.error.message });
  }
  view.dispatch(setDiagnostics(view.state, marks));
}
