import "../styles/settings.css";

import { useEffect, useId, useState } from "react";

import type { OutlineChart, Sentence } from "../protocol/types";
import { ChartSketch } from "./ChartSketch";
import { broken, edit_text, gesture, go_to, obstacle, useDesign, type Doc } from "./design";
import { Definitions } from "./Definitions";
import { GrowingField } from "./GrowingField";
import { useTyped } from "./use_typed";

type PartName = Sentence["parts"][number]["part"];

const kScopes: Record<Sentence["scope"], { title: string; words: Partial<Record<PartName, string>> }> = {
  globally: { title: "always", words: {} },
  before: { title: "before …", words: { close: "before" } },
  after: { title: "after …", words: { open: "after" } },
  between: { title: "between … and …", words: { open: "between", close: "and" } },
  "after-until": { title: "after … until …", words: { open: "after", close: "until" } },
  while: { title: "while …", words: { open: "while" } },
};

/** By pattern: what a person chooses it by, and the words before each part. */
const kPatterns: Record<string, { title: string; words: Partial<Record<PartName, string>> }> = {
  always: { title: "P always holds", words: { p: "always" } },
  never: { title: "P never holds", words: { p: "never" } },
  eventually: { title: "P holds once", words: { p: "eventually" } },
  "eventually-within": { title: "P holds once, within D", words: { p: "eventually", bound: "within" } },
  respond: { title: "whenever P, Q within D", words: { p: "whenever", q: "then", bound: "within" } },
  "respond-eventually": { title: "whenever P, Q some time", words: { p: "whenever", q: "then eventually" } },
  immediately: { title: "whenever P, Q at once", words: { p: "whenever", q: "then immediately" } },
  "keep-for": { title: "whenever P, keep Q for D", words: { p: "whenever", q: "keep", bound: "for" } },
  "keep-until": { title: "whenever P, keep Q until R", words: { p: "whenever", q: "keep", r: "until" } },
  "not-for": { title: "whenever P, not Q for D", words: { p: "whenever", q: "not", bound: "for" } },
  precedes: { title: "P comes before Q", words: { p: "first", q: "then only" } },
  "precedes-within": { title: "P comes before Q, by at most D", words: { p: "first", q: "then only", bound: "by at most" } },
  "at-least-every": { title: "P at least every D", words: { p: "again and again", bound: "at least every" } },
  "at-most": { title: "P at most N times", words: { p: "seldom", times: "times at most" } },
  "at-most-per": { title: "P at most N times per D", words: { p: "seldom", times: "times at most", bound: "per" } },
  "holds-for": { title: "P holds for at least D", words: { p: "once it holds", bound: "for at least" } },
};
const kOrder: readonly PartName[] = ["p", "q", "times", "bound", "r"];
const kUnits = ["ms", "s", "min", "h", "us", "ns", "ticks", "events"];

/** The requirements of a file as blocks beside their text; each edits the other. */
export function RequirementBlocks({ doc, requirements }: { doc: Doc; requirements: readonly Sentence[] }) {
  const why_dim = useDesign(broken);
  const why_not = useDesign(obstacle);
  const watching = useDesign(({ past }) => past[doc.file]?.requirements);
  const [added, set_added] = useState<string | null>(null);
  const at_caret = useDesign(({ requirement }) => requirement);
  const is_there = requirements.some(({ name }) => name === (added ?? at_caret));
  useEffect(() => {
    if (!is_there) return;
    document.querySelector(`.sentence[data-requirement="${added ?? at_caret}"]`)?.scrollIntoView({ block: "nearest" });
    set_added(null);
  }, [added, at_caret, is_there]);
  return (
    <div className={`requirement-blocks scroll${why_dim ? " dim" : ""}`} tabIndex={0} role="group" aria-label={`Requirements of ${doc.file}`} data-testid="requirement-blocks">
      <fieldset disabled={why_not !== null} title={why_not ?? undefined}>
        <Definitions doc={doc} />
        {requirements.map((sentence) => (
          <SentenceBlocks key={sentence.name} sentence={sentence} chart={watching?.find(({ name }) => name === sentence.name)?.chart} />
        ))}
        <AddRequirement doc={doc} requirements={requirements} done={set_added} />
      </fieldset>
    </div>
  );
}

/** Another one at the end of the text. What it demands is `true` until its blocks say more. */
function AddRequirement({ doc, requirements, done }: { doc: Doc; requirements: readonly Sentence[]; done(name: string): void }) {
  const [name, set_name] = useState("");
  const fine = /^[A-Za-z_]\w*$/.test(name) && !requirements.some((one) => one.name === name);
  const add = () => {
    const text = doc.places.shown;
    const end = text.length;
    if (!fine) return;
    void edit_text(doc.file, text, [{ from: end, to: end, text: `${text === "" || text.endsWith("\n") ? "" : "\n"}\n${name}:\n  always true.\n` }], `add ${name}`).then(() => {
        done(name);
        set_name("");
      });
  };
  return (
    <div className="settings-row add">
      <input className="field" aria-label="Name of a new requirement" placeholder="new requirement" spellCheck={false} value={name} onChange={(event) => set_name(event.target.value)} onKeyDown={(event) => event.key === "Enter" && add()} />
      <button type="button" className="button small" disabled={!fine} onClick={add}>
        Add a requirement
      </button>
    </div>
  );
}

function SentenceBlocks({ sentence, chart }: { sentence: Sentence; chart: OutlineChart | undefined }) {
  const { name, scope, pattern, prose } = sentence;
  const scopes = kScopes[scope];
  const words = kPatterns[pattern]?.words ?? {};
  const part = (of: PartName) => sentence.parts.find((one) => one.part === of);
  const assuming = part("assuming");
  return (
    <section className="sentence" aria-label={name} data-requirement={name}>
      <h3>
        <button type="button" className="past-name mono" title="Go to it in the text" onClick={() => go_to(sentence.from, true)}>
          {name}
        </button>
        <span className="muted ellipsis" title={prose}>
          {prose}
        </span>
      </h3>
      <div className="blocks">
        <Choice label="Scope" value={scope} choices={kScopes} set={(to) => void gesture({ what: "set_scope", requirement: name, scope: to })} />
        {(["open", "close"] as const).map((of) => {
          const written = part(of);
          return written && <Block key={of} of={of} word={scopes.words[of] ?? ""} requirement={name} written={written.text} />;
        })}
        <Choice label="Pattern" value={pattern} choices={kPatterns} set={(to) => void gesture({ what: "set_pattern", requirement: name, pattern: to })} />
        {kOrder.map((of) => {
          const written = part(of);
          if (!written) return null;
          if (of === "bound") return <BoundBlock key={of} word={words[of] ?? "within"} requirement={name} written={written.text} />;
          return <Block key={of} of={of} word={words[of] ?? ""} requirement={name} written={written.text} />;
        })}
        <Block of="assuming" word="assuming" requirement={name} written={assuming?.text ?? ""} hint="nothing" />
      </div>
      {chart && (
        <details>
          <summary>The chart that watches for it</summary>
          <ChartSketch chart={chart} label={`Chart of ${name}`} />
        </details>
      )}
    </section>
  );
}

function Choice({ label, value, choices, set }: { label: string; value: string; choices: Record<string, { title: string }>; set(to: string): void }) {
  const id = useId();
  return (
    <div className={`block ${label.toLowerCase()}`}>
      <label htmlFor={id}>{label}</label>
      <select id={id} className="field" value={value} onChange={(event) => set(event.target.value)}>
        {Object.entries(choices).map(([key, { title }]) => (
          <option key={key} value={key}>
            {title}
          </option>
        ))}
      </select>
    </div>
  );
}

const set_part = (requirement: string, part: PartName, text: string) => gesture({ what: "set_part", requirement, part, text });

function Block({ of, word, requirement, written, hint }: { of: PartName; word: string; requirement: string; written: string; hint?: string }) {
  const id = useId();
  // Lines of the text are for the text.
  const shown = written.replace(/\s+/g, " ");
  const typed = useTyped(shown, (text) => set_part(requirement, of, text));
  return (
    <div className={`block part-${of}`} data-part={of}>
      <label htmlFor={id}>{word}</label>
      <GrowingField id={id} typed={typed} hint={hint} />
    </div>
  );
}

/** A number and its unit. */
function BoundBlock({ word, requirement, written }: { word: string; requirement: string; written: string }) {
  const id = useId();
  const [, number = "", unit = "s"] = /^(\S+?)\s*([a-z]+)$/.exec(written) ?? [];
  const set = (value: string, in_unit: string) => set_part(requirement, "bound", `${value} ${in_unit}`);
  const typed = useTyped(number, (value) => set(value, unit));
  const known = kUnits.includes(unit) ? kUnits : [...kUnits, unit];
  return (
    <div className="block part-bound" data-part="bound">
      <label htmlFor={id}>{word}</label>
      <span className="bound-fields">
        <input id={id} className="field mono number" inputMode="decimal" {...typed} />
        <select className="field" aria-label="Unit" value={unit} onChange={(event) => void set(typed.value.trim(), event.target.value)}>
          {known.map((one) => (
            <option key={one}>{one}</option>
          ))}
        </select>
      </span>
    </div>
  );
}
