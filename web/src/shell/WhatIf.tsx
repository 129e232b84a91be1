import { useEffect, useState } from "react";
import { create } from "zustand";

import { clock_text, data_text } from "../draw/format";
import type { Data, Observation } from "../protocol/types";
import { request, useStudio } from "../store/store";
import { Dialog } from "../widgets/Dialog";
import { Icon } from "../widgets/Icon";
import { run_again } from "../widgets/run_commands";
import { choices_of, chosen_otherwise, others_of, type Choice } from "./choices";

const useWhatIf = create<{ open: boolean }>()(() => ({ open: false }));
export const open_what_if = () => useWhatIf.setState({ open: true });
const close = () => useWhatIf.setState({ open: false });

/** Choices that are listed at most, and observations that one request brings. */
const kListedMax = 1000;
const kPage = 500;

/** What models have chosen in this run up to the moment shown, in order. */
async function load(until: number): Promise<{ choices: Choice[]; more: boolean }> {
  const found: Observation[] = [];
  for (let before = until + 1; found.length < kListedMax; ) {
    const { messages, more } = await request("messages", { before, limit: kPage, filter: { name: "*.choice" } });
    found.unshift(...messages);
    const first = messages[0];
    if (!more || !first) return { choices: choices_of(found), more: false };
    before = first.sequence;
  }
  return { choices: [], more: true };
}

/** What models chose, each with its other alternatives: the run begins again, and is the same up to there. */
export function WhatIf() {
  const open = useWhatIf((state) => state.open);
  const boot = useStudio((studio) => studio.hello?.boot);
  useEffect(close, [boot]);
  return open ? <Choices /> : null;
}

function Choices() {
  const [found, set_found] = useState<{ choices: Choice[]; more: boolean } | null>(null);
  const sequence = useStudio((studio) => studio.state?.sequence ?? 0);
  const [until] = useState(sequence);
  useEffect(() => {
    let gone = false;
    load(until).then(
      (loaded) => !gone && set_found(loaded),
      () => !gone && set_found({ choices: [], more: false }),
    );
    return () => {
      gone = true;
    };
  }, [until]);
  const take = (i: number, value: Data) => {
    close();
    run_again({ choose: chosen_otherwise(found!.choices, i, value) });
  };
  return (
    <Dialog label="What if a model had chosen otherwise" className="what-if" close={close}>
      <header className="dialog-bar">
        <h2>What if a model had chosen otherwise?</h2>
        <button className="icon-button" onClick={close} aria-label="Close">
          <Icon name="close" />
        </button>
      </header>
      {found === null && <p className="empty">Looking for what models chose …</p>}
      {found?.more && <p className="empty">Models chose more than {kListedMax} times up to here. Go back in the run, and ask again.</p>}
      {found && !found.more && found.choices.length === 0 && <p className="empty">No model has chosen anything up to the moment shown. A model is a chart in place of a service that leaves open what may happen; <span className="mono">models:</span> in sentree.yaml names those of a project.</p>}
      {found && found.choices.length > 0 && (
        <>
          <p className="what-if-hint muted">The run begins again, chooses the same up to there and the other alternative then; behind it each model takes its first one.</p>
          <ol className="what-if-list scroll" tabIndex={0} aria-label="Choices">
            {found.choices.map((choice, i) => (
              <Row key={`${choice.model}#${choice.number}`} choice={choice} others={others_of(found.choices, choice)} take={(value) => take(i, value)} />
            ))}
          </ol>
        </>
      )}
    </Dialog>
  );
}

function Row({ choice, others, take }: { choice: Choice; others: readonly Data[]; take(value: Data): void }) {
  const [typed, set_typed] = useState("");
  const named = `${choice.model}#${choice.number}`;
  return (
    <li data-choice={named} data-value={data_text(choice.value)}>
      <span className="number muted">{clock_text(choice.time)}</span>
      <strong className="mono">{named}</strong>
      <span className="what-if-what">
        {choice.name || choice.function} = <span className="mono">{data_text(choice.value)}</span>
        {choice.place && <span className="muted"> {choice.place}</span>}
      </span>
      <span className="what-if-others">
        {others.map((value) => (
          <button key={data_text(value)} className="button small" onClick={() => take(value)}>
            {data_text(value)} instead
          </button>
        ))}
        {typeof choice.value !== "boolean" && (
          <form
            onSubmit={(event) => {
              event.preventDefault();
              if (typed.trim() !== "") take(typeof choice.value === "number" && Number.isFinite(Number(typed)) ? Number(typed) : typed.trim());
            }}
          >
            <input className="field small" aria-label={`Another value of ${named}`} placeholder="another value" spellCheck={false} value={typed} onChange={(event) => set_typed(event.target.value)} />
          </form>
        )}
      </span>
    </li>
  );
}
